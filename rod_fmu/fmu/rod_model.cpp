// Checks of the parameters across rows of the table, and the calls of the FMI runtime passed on to the engine.
#include "fmu/rod_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

namespace rod {

namespace {

template <class... Parts>
fmu::Status refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return fmu::Status::error(text.str());
}

constexpr unsigned kPlaneWarning = 0, kSpatialErrorWarning = 1, kDoubtWarning = 2;  // bits of Model::warn_once
constexpr double kOutOfPlaneWarning = 1e-6;  // of Outputs::out_of_plane [1]: beyond, the host is warned
// Largest Outputs::spatial_error over the length [1] without a warning: of a rod at rest, and of a moving one, whose
// estimate is coarser, and whose waves after a sudden load no order resolves.
constexpr double kSpatialWarning = 1e-2, kSpatialWarningMoving = 5e-2;
constexpr double kAngleTolerance = 1e-9;  // of azimuths that count as equal [rad], and of other relative differences

/// Largest angle [rad] by which a TCA may wind about the axis: beyond, polynomials of this order miss its bending
/// moment altogether, and no estimate from them means anything.
double max_resolved_helix(int order) { return std::max(6.3, 1.5 * (order + 1)); }

/// Fails where section, unloaded shape or TCAs would drive a planar rod out of its plane.
fmu::Status check_plane(const Parameters& p) {
  const double c = std::cos(p.plane), s = std::sin(p.plane);
  if (p.dynamic && p.method == Method::pade_euler)
    return refuse(
        "planar = true has three strains at most, but method = pade_euler "
        "has all six; choose another method");
  if (p.body_profile == Profile::given && std::abs(c * s) > kAngleTolerance)
    for (int first : {0, 3})
      if (p.body_stiffness[first] != p.body_stiffness[first + 1])
        return refuse("plane = ", p.plane, " rad is no principal plane of the section: body.stiffness[", first + 1,
                      "] = ", p.body_stiffness[first], " and body.stiffness[", first + 2,
                      "] = ", p.body_stiffness[first + 1],
                      " differ; set plane to a multiple of pi/2, or planar = false");
  const double across = c * p.body_curvature[0] + s * p.body_curvature[1], twist = p.body_curvature[2];
  const double size = std::hypot(p.body_curvature[0], p.body_curvature[1], p.body_curvature[2]);
  if (std::abs(across) > kAngleTolerance * size || std::abs(twist) > kAngleTolerance * size)
    return refuse("body.curvature leaves the plane at azimuth plane = ", p.plane, " rad: ", across, " 1/m across it, ",
                  twist, " 1/m of twist; turn plane, or set planar = false");
  if (p.tca_law == Law::measured && p.tca_stiffness == 0.0) return {};  // TCAs without force
  for (std::size_t i = 0; i < kTcas; ++i) {
    const auto mirrors = [&](std::size_t j) {
      const double sum = p.tca_azimuth[i] + p.tca_azimuth[j] - 2.0 * p.plane;
      return std::abs(std::sin(0.5 * sum)) < kAngleTolerance &&
             std::abs(p.tca_helix[i] + p.tca_helix[j]) < kAngleTolerance;
    };
    bool mirrored = false;
    for (std::size_t j = 0; j < kTcas; ++j) mirrored = mirrored || mirrors(j);
    if (!mirrored)
      return refuse("TCA ", i + 1, " (tca.azimuth = ", p.tca_azimuth[i], " rad, tca.helix = ", p.tca_helix[i],
                    " rad/m) has no mirror image in the plane at azimuth plane = ", p.plane,
                    " rad; turn plane to a symmetry plane of the TCAs, or set planar "
                    "= false");
  }
  return {};
}

/// Fails where a TCA's law has no meaning at a temperature.
fmu::Status check_temperatures(const Parameters& p, const Loads& loads) {
  for (std::size_t i = 0; i < kTcas; ++i) {
    const double T = loads.T[i];
    if (!(T > 0.0))
      return refuse("T[", i + 1, "] = ", T, " K; temperatures must be positive: set or connect T[", i + 1, "]");
    if (p.tca_law == Law::wire && !(1.0 + p.tca_rho_T * (T - p.T_0) > 0.0))
      return refuse("T[", i + 1, "] = ", T, " K with tca.rho_T = ", p.tca_rho_T, " 1/K and T_0 = ", p.T_0,
                    " K leaves the wire no diameter; 1 + tca.rho_T (T - T_0) must be positive");
  }
  return {};
}

bool is_finite(const Outputs& y) {
  static_assert(sizeof(Outputs) % sizeof(double) == 0);
  const auto* values = reinterpret_cast<const double*>(&y);
  return std::all_of(values, values + sizeof(Outputs) / sizeof(double),
                     [](double each) { return std::isfinite(each); });
}

/// Fails where parameters contradict each other.
fmu::Status check(const Parameters& p) {
  if (p.tca_offset >= p.body_radius)
    return refuse("tca.offset = ", p.tca_offset,
                  " m lies outside the body: it must be less than body.radius = ", p.body_radius,
                  " m; reduce tca.offset or enlarge body.radius");
  if (p.tca_chirality == 0) return refuse("tca.chirality = 0: set +1 (extends when heated) or -1 (contracts)");
  if (p.tca_law == Law::wire && p.tca_wire_length <= p.body_length)
    return refuse("tca.wire_length = ", p.tca_wire_length, " m cannot be coiled into body.length = ", p.body_length,
                  " m; make the wire longer than the body");
  const double curvature = std::hypot(p.body_curvature[0], p.body_curvature[1], p.body_curvature[2]) * p.body_length;
  if (curvature > max_resolved_curvature())
    return refuse("body.curvature is ", curvature, " rad over body.length; at most ", max_resolved_curvature(),
                  " rad are resolved; reduce body.curvature or body.length");
  for (std::size_t i = 0; i < kTcas; ++i)
    if (const double angle = std::abs(p.tca_helix[i]) * p.body_length; angle > max_resolved_helix(p.order))
      return refuse("tca.helix[", i + 1, "] = ", p.tca_helix[i], " rad/m is ", angle,
                    " rad over body.length; order = ", p.order, " resolves ", max_resolved_helix(p.order),
                    " rad; raise order or reduce tca.helix");
  if (p.dynamic && p.method == Method::pade_euler && p.strains != Strains::cosserat)
    return refuse("method = pade_euler has all six strains, but strains = ", static_cast<int>(p.strains),
                  "; set strains to cosserat (4), or choose another method");
  return p.planar ? check_plane(p) : fmu::Status();
}

}  // namespace

namespace {
std::unique_ptr<Engine> make_engine(const Parameters& p) {
  return p.dynamic && p.method == Method::pade_euler ? make_grid_engine(p) : make_strain_engine(p);
}
}  // namespace

fmu::Status RodModel::build() {
  const Parameters& p = data_.parameters;
  if (fmu::Status status = check(p); !status.is_ok()) return status;
  engine_ = make_engine(p);
  memory_.assign(engine_->memory_size() + 1, 0.0);
  engine_->set_unloaded(engine_memory());
  return {};
}

/// Returns call() and adds its evaluations of the residual to the count in the memory.
template <class Call>
auto RodModel::counted(Call call) {
  const long before = engine_->evaluations();
  auto result = call();
  memory_.back() += static_cast<double>(engine_->evaluations() - before);
  return result;
}

/// The strains stay, so the state of motion does; a shape at rest becomes the equilibrium of the new rod.
fmu::Status RodModel::retune(double t) {
  const Parameters& p = data_.parameters;
  if (fmu::Status status = check(p); !status.is_ok()) return status;
  std::unique_ptr<Engine> before = std::exchange(engine_, make_engine(p));
  engine_->discard_look_ahead(engine_memory());
  if (p.dynamic) return {};
  fmu::Status status =
      counted([&] { return engine_->solve_equilibrium(engine_memory(), loads_at(data_.inputs, 0.0)); });
  if (status.is_ok()) {
    warn_of_doubt(t);
    return status;
  }
  engine_ = std::move(before);
  return refuse("t = ", t, " s, after a change of parameters: ", status.failure().what, "; change them less");
}

fmu::Status RodModel::initialise(double t) {
  engine_->set_unloaded(engine_memory());
  memory_.back() = 0.0;
  if (!data_.parameters.start_at_equilibrium && data_.parameters.dynamic) return {};
  fmu::Status status =
      counted([&] { return engine_->solve_equilibrium(engine_memory(), loads_at(data_.inputs, 0.0)); });
  if (status.is_ok()) {
    warn_of_doubt(t);
    return status;
  }
  return refuse("t = ", t, " s, at the start: ", status.failure().what,
                "; reduce the loads, or start unloaded (start_at_equilibrium = false)");
}

fmu::StepResult RodModel::step(double t, double h) {
  if (fmu::Status status = check_temperatures(data_.parameters, loads_at(data_.inputs, h)); !status.is_ok())
    return {t, std::move(status)};
  StepOutcome outcome =
      counted([&] { return engine_->step(engine_memory(), data_.inputs, h, data_.parameters.tolerance); });
  if (outcome.reached == h) {
    if (!data_.parameters.dynamic) warn_of_doubt(t + h);
    return {t + h, {}};
  }
  return {t + outcome.reached, std::move(outcome.status)};
}

fmu::Status RodModel::check_memory(std::span<const double> memory) const {
  // Infinity is legitimate: the integrator marks loads that did not stand still with it (look_ahead.cpp).
  for (const double number : memory)
    if (std::isnan(number)) return refuse("the state holds a number that is not a number");
  return {};
}

fmu::Status RodModel::check_states() const {
  const Parameters& p = data_.parameters;
  if (!p.dynamic) return refuse("with dynamic = false the shape is an equilibrium, not a state; set dynamic = true");
  if (p.method == Method::pade_euler)
    return refuse(
        "method = pade_euler is a scheme of time steps; choose another method, all others mean the same equations");
  return {};
}

void RodModel::get_states(std::span<double> x) {
  // With dynamic = false they cannot be set, but can be read: the strains of the equilibrium reached.
  if (!data_.parameters.dynamic || check_states().is_ok()) engine_->get_states(engine_memory(), x);
}

void RodModel::set_states(std::span<const double> x) { engine_->set_states(engine_memory(), x); }

fmu::Status RodModel::rates(double, std::span<double> dx) {
  return engine_->rates(engine_memory(), loads_at(data_.inputs, 0.0), dx);
}

bool RodModel::rates_along(double, std::span<const double> dx, std::span<double> ddx) {
  return engine_->rates_along(engine_memory(), loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0), dx, ddx);
}

bool RodModel::drift(std::span<double> rate) {
  return !data_.parameters.dynamic &&
         engine_->equilibrium_rate(engine_memory(), loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0),
                                   rate.first(rate.size() - 1));
}

fmu::Status RodModel::evaluate(double t) {
  const Loads loads = loads_at(data_.inputs, 0.0);
  if (fmu::Status status = check_temperatures(data_.parameters, loads); !status.is_ok()) return status;
  Outputs& y = data_.outputs;
  engine_->outputs(engine_memory(), loads, y);
  y.evaluations = memory_.back();
  if (!is_finite(y))
    return fmu::Status::discard("the outputs are not finite",
                                "the states or the inputs are beyond what the rod or its TCAs can have");
  const double limit = data_.parameters.dynamic ? kSpatialWarningMoving : kSpatialWarning;
  const auto line = [t](const auto&... parts) {
    std::ostringstream text;
    text << "t = " << t << " s: ";
    (text << ... << parts);
    return text.str();
  };
  if (y.out_of_plane > kOutOfPlaneWarning)
    warn_once(kPlaneWarning, [&] {
      return line("forces across the plane of this planar rod are left out; alone they would cause strains of ",
                  y.out_of_plane, " (output out_of_plane); set planar = false, or turn plane");
    });
  else if (y.spatial_error > limit * data_.parameters.body_length)
    warn_once(kSpatialErrorWarning, [&] {
      return line("strain polynomials of order = ", data_.parameters.order, " leave an estimated error of ",
                  y.spatial_error, " m in shape and displacements (output spatial_error); raise order, up to ",
                  kMaxOrder, ", or reduce the loads or tca.helix");
    });
  return {};
}

void RodModel::warn_of_doubt(double t) {
  const std::string doubt = engine_->doubt();
  if (doubt.empty()) return;
  warn_once(kDoubtWarning, [&] {
    std::ostringstream text;
    text << "t = " << t << " s: " << doubt;
    return text.str();
  });
}

}  // namespace rod
