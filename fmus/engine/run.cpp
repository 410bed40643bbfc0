#include "engine/run.hpp"

#include <utility>

namespace engine {

Run::Run(const TcaPlan& plan) : plan_(plan) {
  for (size_t m = 0; m < plan.members; ++m) {
    members_.push_back(std::make_unique<Member>(plan.member[m]));
    first_.push_back(inputs_);
    inputs_ += plan.member[m].inputs;
    width_ += plan.member[m].recorded;
  }
  own_.assign(inputs_, -1);
  for (size_t k = 0; k < plan.driven; ++k) own_[plan.driven_columns[k]] = static_cast<long>(k);
}

bool Run::report(const char* what, const Member& member) {
  if (!what) return true;
  failure_ = std::string(member.declared().name) + ": " + what;
  if (!member.messages().empty()) failure_ += ": " + member.messages();
  return false;
}

double Run::driven(size_t k, size_t column, double otherwise) const {
  return own_[column] < 0 || !of_run_ ? otherwise : of_run_[k * plan_.driven + static_cast<size_t>(own_[column])];
}

// Sets what signals give after the event of that row; all other inputs are set by links.
void Run::set_signals(size_t row) {
  const double* values = plan_.starts + row * 2 * inputs_;
  const size_t next = row < plan_.steps ? row : plan_.steps - 1;  // the last event has no step behind it
  for (size_t m = 0; m < members_.size(); ++m)
    for (size_t k = 0; k < members_[m]->declared().inputs; ++k) {
      const size_t column = first_[m] + k;
      members_[m]->input(0, k) = driven(next, column, values[column]);
      members_[m]->input(1, k) = own_[column] < 0 ? values[inputs_ + column] : 0.0;
      members_[m]->input(2, k) = members_[m]->input(3, k) = 0.0;
    }
}

bool Run::begin(const double* parameters, const double* inputs, double* outputs) {
  failure_.clear();
  of_run_ = inputs;
  for (auto& member : members_)
    if (!report(member->begin(plan_, parameters, used_), *member)) return false;
  used_ = true;
  set_signals(0);
  for (auto& member : members_) {
    for (int order = 1; order < orders; ++order)
      for (size_t k = 0; k < member->declared().inputs; ++k) member->input(order, k) = 0.0;
    for (size_t k = 0; k < member->declared().links; ++k)
      member->receive_tangent(member->declared().link[k], *members_[member->declared().link[k].source]);
    if (!report(member->initialize(), *member)) return false;
  }
  for (auto& member : members_)
    if (!report(member->exit_initialization(), *member)) return false;
  return arrive(0, plan_.start) && record(outputs);
}

bool Run::rehearse(size_t steps) {
  for (auto& member : members_)
    if (!report(member->keep(), *member)) return false;
  std::vector<double> row(width_);
  for (size_t k = 0; k < steps && step(k, row.data()); ++k) {
  }
  bool good = true;
  for (auto& member : members_) good = report(member->go_back(), *member) && good;
  if (good) failure_.clear();  // a step that fails now fails again when it is its turn
  return good;
}

bool Run::arrive(size_t row, double time) {
  set_signals(row);
  for (auto& member : members_) {
    for (size_t k = 0; k < member->declared().links; ++k)
      member->receive_tangent(member->declared().link[k], *members_[member->declared().link[k].source]);
    if (!report(member->sample_after_event(time), *member)) return false;
  }
  return true;
}

bool Run::record(double* outputs) {
  for (auto& member : members_) {
    if (!report(member->record(outputs), *member)) return false;
    outputs += member->declared().recorded;
  }
  return true;
}

bool Run::step(size_t number, double* outputs) {
  const double time = plan_.times[number], length = plan_.lengths[number], end = plan_.ends[number];
  const double* polynomials = plan_.polynomials + number * orders * inputs_;
  for (size_t m = 0; m < members_.size(); ++m) {
    Member& member = *members_[m];
    for (size_t k = 0; k < member.declared().inputs; ++k) {
      const size_t column = first_[m] + k;
      member.input(0, k) = driven(number, column, polynomials[column]);
      for (int order = 1; order < orders; ++order)
        member.input(order, k) = own_[column] < 0 ? polynomials[order * inputs_ + column] : 0.0;
    }
    for (size_t k = 0; k < member.declared().links; ++k)
      member.receive(member.declared().link[k], *members_[member.declared().link[k].source], time);
    if (!report(member.step(time, length, end), member)) return false;
  }
  for (auto& member : members_) {
    std::swap(member->past_[0], member->past_[1]);
    std::swap(member->past_[1], member->past_[2]);
    member->past_[2].time = member->current_.time;
    member->past_[2].values = member->current_.values;  // of one size: nothing is allocated
    member->past_[2].rates = member->current_.rates;
    if (member->known_ < 3) ++member->known_;
  }
  if (!record(outputs)) return false;
  return !plan_.events[number] || arrive(number + 1, end);
}

}  // namespace engine
