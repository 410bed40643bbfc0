#include "engine/run.hpp"

#include <algorithm>
#include <cstdio>

namespace engine {

Run::Run(const TcaPlan& plan) : plan_(plan) {
  for (size_t m = 0; m < plan.members; ++m) {
    members_.push_back(std::make_unique<Member>(plan.member[m]));
    first_.push_back(inputs_);
    inputs_ += plan.member[m].inputs;
    width_ += plan.member[m].recorded;
  }
  for (size_t p = 0; p < plan.parts; ++p)
    parts_.push_back({plan.part[p], plan.part[p].unknowns ? std::make_unique<RunLoop>(plan, plan.part[p]) : nullptr});
  own_.assign(inputs_, -1);
  for (size_t k = 0; k < plan.driven; ++k) own_[plan.driven_columns[k]] = static_cast<long>(k);
}

bool Run::report(const char* what, const Member& member) {
  if (!what) return true;
  failure_ = std::string(member.declared().name) + ": " + what;
  if (!member.messages().empty()) failure_ += ": " + member.messages();
  return false;
}

bool Run::report(const LoopResult& result, const Part& part) {
  if (result.good) return true;
  if (!failure_.empty()) return false;  // of a member in a sweep
  for (size_t m = 0; m < part.declared.count; ++m) {
    if (m) failure_ += ", ";
    failure_ += plan_.member[part.declared.first + m].name;
  }
  const bool is_over = static_cast<size_t>(result.sweeps) >= plan_.max_sweeps;
  char text[300];
  std::snprintf(text, sizeof text,
                ": the algebraic loop is not solved after %.0f sweeps, with a residual of %.2g nominals; %smake "
                "coupling.macro_step smaller, or run it by the master (tca.run), which tries more",
                result.sweeps, result.residual, is_over ? "raise coupling.max_sweeps, " : "");
  failure_ += text;
  return false;
}

std::string Run::warnings() const {
  std::string all;
  for (const auto& member : members_)
    if (!member->warning().empty())
      all += (all.empty() ? "" : "; ") + (member->declared().name + (": " + member->warning()));
  return all;
}

template <class Do>
bool Run::all_of(const Part& part, Do act) {
  for (size_t m = part.declared.first; m < part.declared.first + part.declared.count; ++m)
    if (!report(act(*members_[m]), *members_[m])) return false;
  return true;
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
  for (Part& part : parts_)
    if (part.loop) part.loop->begin();
  set_signals(0);
  for (auto& member : members_)
    for (int order = 1; order < orders; ++order)
      for (size_t k = 0; k < member->declared().inputs; ++k) member->input(order, k) = 0.0;
  if (!settle(plan_.start, true, [](Member& member) { return member.initialize(); })) return false;
  for (auto& member : members_)
    if (!report(member->exit_initialization(), *member)) return false;
  return arrive(0, plan_.start) && record(outputs);
}

bool Run::rehearse(size_t steps) {
  for (auto& member : members_)
    if (!report(member->keep(), *member)) return false;
  for (Part& part : parts_)
    if (part.loop) part.loop->remember();
  std::vector<double> row(width_);
  for (size_t k = 0; k < steps && step(k, row.data()); ++k) {
  }
  bool good = true;
  for (auto& member : members_) good = report(member->go_back(), *member) && good;
  for (Part& part : parts_)
    if (part.loop) part.loop->forget();
  if (good) failure_.clear();  // a step that fails now fails again when it is its turn
  return good;
}

// Consistent inputs and outputs of all members at one instant, part after part; evaluate(member) gives its outputs with
// the inputs that are set. initial: nothing is known of any output yet.
template <class Evaluate>
bool Run::settle(double time, bool initial, Evaluate evaluate) {
  for (Part& part : parts_) {
    const auto sweep = [&](bool guessed) {
      return all_of(part, [&](Member& member) {
        for (size_t k = 0; k < member.declared().links; ++k) {
          const TcaLink& link = member.declared().link[k];
          const Member& source = *members_[link.source];
          if (link.torn && guessed)
            member.receive_tangent(link, source, part.loop->guess(link.source));
          else if (!link.torn || !initial)
            member.receive_tangent(link, source, source.current());
        }
        return evaluate(member);
      });
    };
    if (!sweep(false)) return false;
    if (!part.loop) continue;
    if (!report(part.loop->settle(members_, time, !initial, [&] { return sweep(true); }), part)) return false;
    part.loop->arrive();
  }
  return true;
}

bool Run::arrive(size_t row, double time) {
  set_signals(row);
  return settle(time, false, [time](Member& member) { return member.sample_after_event(time); });
}

bool Run::record(double* outputs) {
  for (auto& member : members_) {
    if (!report(member->record(outputs), *member)) return false;
    outputs += member->declared().recorded;
  }
  return true;
}

void Run::set_polynomials(size_t m, size_t number) {
  const double* polynomials = plan_.polynomials + number * orders * inputs_;
  Member& member = *members_[m];
  for (size_t k = 0; k < member.declared().inputs; ++k) {
    const size_t column = first_[m] + k;
    member.input(0, k) = driven(number, column, polynomials[column]);
    for (int order = 1; order < orders; ++order)
      member.input(order, k) = own_[column] < 0 ? polynomials[order * inputs_ + column] : 0.0;
  }
}

// Steps the members of a part once, each with the newest samples of its sources, or what the loop guesses.
bool Run::sweep(const Part& part, size_t number) {
  const double time = plan_.times[number], length = plan_.lengths[number], end = plan_.ends[number];
  return all_of(part, [&](Member& member) {
    for (size_t k = 0; k < member.declared().links; ++k) {
      const TcaLink& link = member.declared().link[k];
      const Member& source = *members_[link.source];
      member.receive(link, source, link.torn ? part.loop->guess(link.source) : source.current(), time);
    }
    return member.step(time, length, end);
  });
}

bool Run::step(size_t number, double* outputs) {
  sweeps_ = 1;
  for (size_t m = 0; m < members_.size(); ++m) set_polynomials(m, number);
  for (Part& part : parts_) {
    if (!part.loop) {
      if (!sweep(part, number)) return false;
      continue;
    }
    if (!all_of(part, [](Member& member) { return member.save(); })) return false;
    const LoopResult result = part.loop->step(
        members_, plan_.times[number], plan_.lengths[number], plan_.ends[number], [&] { return sweep(part, number); },
        [&] { return all_of(part, [](Member& member) { return member.restore(); }); });
    if (!report(result, part)) return false;
    sweeps_ = std::max(sweeps_, static_cast<size_t>(result.sweeps));
  }
  for (auto& member : members_) member->accept();
  if (!record(outputs)) return false;
  return !plan_.events[number] || arrive(number + 1, plan_.ends[number]);
}

}  // namespace engine
