#include "rod_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace rod {

static_assert(std::is_same_v<Polynomial, fmu::Polynomial>);

namespace {

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw fmu::Error(text.str());
}

/// What no single row of the table can check.
void check(const Parameters& p) {
  if (p.tca_offset >= p.body_radius)
    refuse("tca.offset = ", p.tca_offset,
           " m lies outside the body: it must be less than body.radius = ", p.body_radius,
           " m; reduce tca.offset or enlarge body.radius");
  if (p.tca_chirality == 0) refuse("tca.chirality = 0: set +1 (extends when heated) or -1 (contracts)");
  if (p.tca_law == Law::wire && p.tca_wire_length <= p.body_length)
    refuse("tca.wire_length = ", p.tca_wire_length, " m cannot be coiled into body.length = ", p.body_length,
           " m; make the wire longer than the body");
}

}  // namespace

void RodModel::build() {
  check(data_.parameters);
  rod_ = Rod(data_.parameters);
  bdf_.reset();
  if (data_.parameters.method == Method::bdf) bdf_.emplace(rod_.unknowns());
  memory_.assign(State::size(rod_.unknowns()), 0.0);
}

void RodModel::initialise(double t) {
  std::fill(memory_.begin(), memory_.end(), 0.0);
  if (!data_.parameters.start_at_equilibrium && data_.parameters.dynamic) return;
  State start = state();
  if (!settle(rod_, loads_at(data_.inputs, 0.0), start, scratch_))
    refuse("no equilibrium found at t = ", t,
           " s for the inputs at the start; reduce the loads, or start straight (start_at_equilibrium = false)");
}

fmu::StepResult RodModel::step(double t, double h) {
  State now = state();
  const Parameters& p = data_.parameters;
  const Advance advance = [&] {
    if (!p.dynamic) return step_static(rod_, data_.inputs, h, now, scratch_);
    switch (p.method) {
      case Method::backward_euler:
        return step_backward_euler(rod_, data_.inputs, h, now, scratch_);
      case Method::midpoint:
        return step_midpoint(rod_, data_.inputs, h, now, scratch_);
      case Method::bdf:
        return bdf_->step(rod_, data_.inputs, h, p.tolerance, now, scratch_);
      case Method::rosenbrock:
        break;
    }
    return step_rosenbrock(rod_, data_.inputs, h, p.tolerance, now, scratch_);
  }();
  return {advance.reached == h ? t + h : t + advance.reached, advance.trouble};
}

void RodModel::evaluate(double) {
  const State now = state();
  const Loads loads = loads_at(data_.inputs, 0.0);
  rod_.residual(now.q.data(), now.v.data(), now.a.data(), loads, scratch_.newton.work, scratch_.r);
  rod_.outputs(now.q.data(), now.v.data(), loads, scratch_.newton.work, data_.outputs);
}

}  // namespace rod
