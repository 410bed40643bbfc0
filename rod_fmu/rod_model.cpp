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
  if (p.dynamic && p.method == Method::pade_euler && p.strains != Strains::cosserat)
    refuse("method = pade_euler has all six strains, but strains = ", static_cast<int>(p.strains),
           "; set strains to cosserat (4), or choose another method");
}

}  // namespace

void RodModel::build() {
  const Parameters& p = data_.parameters;
  check(p);
  engine_ = p.dynamic && p.method == Method::pade_euler ? make_grid_engine(p) : make_strain_engine(p);
  memory_.assign(engine_->memory_size(), 0.0);
  engine_->rest(memory_);
}

void RodModel::initialise(double t) {
  engine_->rest(memory_);
  if (!data_.parameters.start_at_equilibrium && data_.parameters.dynamic) return;
  if (!engine_->settle(memory_, loads_at(data_.inputs, 0.0)))
    refuse("no equilibrium found at t = ", t,
           " s for the inputs at the start; reduce the loads, or start straight (start_at_equilibrium = false)");
}

fmu::StepResult RodModel::step(double t, double h) {
  const Advance advance = engine_->step(memory_, data_.inputs, h, data_.parameters.tolerance);
  return {advance.reached == h ? t + h : t + advance.reached, advance.trouble};
}

std::string RodModel::without_states() const {
  const Parameters& p = data_.parameters;
  if (!p.dynamic) return "with dynamic = false the shape is an equilibrium, not a state; set dynamic = true";
  if (p.method == Method::pade_euler)
    return "method = pade_euler is a scheme of time steps; choose another method, all others mean the same equations";
  return "";
}

void RodModel::get_states(std::span<double> x) {
  if (without_states().empty()) engine_->get_states(memory_, x);
}

void RodModel::set_states(std::span<const double> x) { engine_->set_states(memory_, x); }

std::string RodModel::rates(double, std::span<double> dx) {
  const bool found = engine_->rates(memory_, loads_at(data_.inputs, 0.0), dx);
  return found ? "" : "no finite acceleration; the strains or the loads may be too large";
}

bool RodModel::rates_along(double, std::span<const double> dx, std::span<double> ddx) {
  return engine_->rates_along(memory_, loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0), dx, ddx);
}

bool RodModel::drift(std::span<double> rate) {
  return !data_.parameters.dynamic &&
         engine_->drift(memory_, loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0), rate);
}

void RodModel::evaluate(double) { engine_->outputs(memory_, loads_at(data_.inputs, 0.0), data_.outputs); }

}  // namespace rod
