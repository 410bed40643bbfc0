#include "engine/run_loop.hpp"

#include <algorithm>
#include <utility>

namespace engine {

LoopMemory::LoopMemory(std::vector<double> nominals)
    : scale_(std::move(nominals)),
      columns_(2 * scale_.size() * scale_.size()),
      combined_(columns_.size()),
      times_(TCA_SOLUTIONS),
      solutions_(TCA_SOLUTIONS * scale_.size()),
      component_{} {
  component_.size = scale_.size();
  component_.scale = scale_.data();
  component_.columns = columns_.data();
  component_.combined = combined_.data();
  component_.times = times_.data();
  component_.solutions = solutions_.data();
}

std::vector<RunLoop::Group> RunLoop::groups_of(const TcaPart& part) {
  std::vector<Group> groups;
  for (size_t k = 0; k < part.unknowns; ++k)
    if (k && part.source[k] == part.source[k - 1])
      ++groups.back().count;
    else
      groups.push_back({part.source[k], k, 1});
  return groups;
}

RunLoop::Instant::Instant(const TcaPlan& plan, std::vector<double> nominals)
    : memory(std::move(nominals)),
      iteration(plan.blas, memory.component(), {plan.coupling_tolerance, HUGE_VAL, plan.max_sweeps}),
      start(memory.component().size),
      x(start.size()) {}

RunLoop::RunLoop(const TcaPlan& plan, const TcaPart& part)
    : plan_(plan),
      part_(part),
      blas_(plan.blas),
      groups_(groups_of(part)),
      memory_(std::vector<double>(part.nominals, part.nominals + part.unknowns)),
      iteration_(plan.blas, memory_.component(), {plan.coupling_tolerance, plan.reach, plan.max_sweeps}),
      past_(memory_.component()),
      first_(plan, instant_nominals(false)),
      later_(plan, instant_nominals(true)),
      start_(part.unknowns),
      x_(part.unknowns),
      columns_(orders * part.unknowns),
      guesses_(plan.members) {
  for (const Group& group : groups_) {
    const size_t outputs = plan.member[group.member].outputs;
    guesses_[group.member].values.resize(outputs);
    guesses_[group.member].rates.resize(outputs);
    polynomial_.resize(std::max(polynomial_.size(), orders * outputs));
  }
  shifted_.resize(polynomial_.size());
}

void RunLoop::begin() {
  memory_.component().kept = 0;
  arrive();
}

void RunLoop::arrive() { memory_.component().solved = 0; }

void RunLoop::begin_step(const Members& members, double time) {
  for (size_t k = 0; k < part_.unknowns; ++k) start_[k] = members[part_.source[k]]->past().values[part_.output[k]];
  const TcaComponent& known = memory_.component();
  if (known.solved && known.times[known.solved - 1] == time) return;
  arrive();
  past_.add(time, start_.data());
}

void RunLoop::set_first_guess(const Members& members, double time, double length, double end) {
  if (memory_.component().solved >= TCA_LEAST) return past_.guess(end, x_.data());
  for (const Group& group : groups_) predict(*members[group.member], group, time, length);
}

// Guesses in the first two steps after an event: the parabola of fit_parabola in cosim/extrapolation.py.
void RunLoop::predict(const Member& source, const Group& group, double time, double length) {
  const Sample &first = source.past(source.known() - 1), &newest = source.past();
  const size_t n = first.values.size();
  const bool rates = source.declared().needs_rates;
  const double h = newest.time - first.time;
  std::fill(polynomial_.begin(), polynomial_.end(), 0.0);
  double *value = polynomial_.data(), *slope = value + n, *bend = slope + n;
  for (size_t k = 0; k < n; ++k) {
    const double a = first.values[k], rise = newest.values[k] - a;
    value[k] = a;
    if (rates) slope[k] = first.rates[k];
    if (&first == &newest) continue;
    if (rates)
      bend[k] = (rise / h - slope[k]) * (2.0 / h);
    else
      slope[k] = rise / h, value[k] = a + slope[k] * (time - first.time);
  }
  const double* polynomial = polynomial_.data();
  if (rates && first.time != time) {
    const double s = time - first.time, square = s * s / 2.0, cube = s * s * s / 6.0;
    const double shift[] = {1.0, s, square, cube, 0.0, 1.0, s, square, 0.0, 0.0, 1.0, s, 0.0, 0.0, 0.0, 1.0};
    blas_.times_matrix(shift, polynomial_.data(), n, shifted_.data());
    polynomial = shifted_.data();
  }
  for (size_t k = 0; k < group.count; ++k)
    for (int order = 0; order < orders; ++order)
      columns_[k * orders + order] = polynomial[order * n + part_.output[group.first + k]];
  const double ahead[] = {1.0, length, length * length / 2.0, length * length * length / 6.0};
  blas_.vector_times_columns(orders, group.count, columns_.data(), ahead, x_.data() + group.first);
}

// Writes the unknowns in the newest samples: of each source the values, then the rates where these are unknown.
void RunLoop::pack(const Members& members, bool rates, double* x) const {
  for (const Group& group : groups_) {
    const Sample& sample = members[group.member]->current();
    const size_t* output = part_.output + group.first;
    for (size_t k = 0; k < group.count; ++k) *x++ = sample.values[output[k]];
    for (size_t k = 0; k < group.count && rates && plan_.member[group.member].needs_rates; ++k)
      *x++ = sample.rates[output[k]];
  }
}

void RunLoop::set_guess(double time, const std::vector<double>& x, bool rates) {
  const double* value = x.data();
  for (const Group& group : groups_) {
    Sample& guess = guesses_[group.member];
    const size_t* output = part_.output + group.first;
    guess.time = time;
    for (size_t k = 0; k < group.count; ++k) guess.values[output[k]] = *value++;
    for (size_t k = 0; k < group.count && rates && plan_.member[group.member].needs_rates; ++k)
      guess.rates[output[k]] = *value++;
  }
}

std::vector<double> RunLoop::instant_nominals(bool rates) const {
  std::vector<double> nominals;
  for (const Group& group : groups_)
    for (int each = 0; each < (rates && plan_.member[group.member].needs_rates ? 2 : 1); ++each)
      nominals.insert(nominals.end(), part_.nominals + group.first, part_.nominals + group.first + group.count);
  return nominals;
}

void RunLoop::remember() {
  iteration_.remember();
  past_.remember();
}

void RunLoop::forget() {
  iteration_.forget();
  past_.forget();
}

}  // namespace engine
