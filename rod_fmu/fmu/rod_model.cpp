// Checks of the parameters across rows of the table, and the calls of the FMI runtime passed on to the engine.
#include "fmu/rod_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "core/unwritten.hpp"
#include "fmu/energy_watch.hpp"

namespace rod {

namespace {

template <class... Parts>
fmu::Status refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return fmu::Status::error(text.str());
}

// Bits of Model::warn_once.
constexpr unsigned kPlaneWarning = 0, kSpatialErrorWarning = 1, kDoubtWarning = 2, kEnergyWarning = 3, kGridWarning = 4;
// Change of the energy of an undamped rod under constant loads over what its forms have exchanged, beyond which the
// host is warned [1]: a tolerance of 1e-4 stays below over hundreds of oscillations.
constexpr double kEnergyDrift = 0.05;
constexpr double kOutOfPlaneWarning = 1e-6;  // of Outputs::out_of_plane [1]: beyond, the host is warned
// Largest Outputs::spatial_error over the length [1] without a warning: of a rod at rest, and of a moving one, whose
// estimate is coarser, and whose waves after a sudden load no order resolves.
constexpr double kSpatialWarning = 1e-2, kSpatialWarningMoving = 5e-2;
constexpr double kAngleTolerance = 1e-9;  // of azimuths that count as equal [rad], and of other relative differences

/// Largest angle [rad] by which a TCA may wind about the axis: beyond, polynomials of this order miss its bending
/// moment altogether, and no estimate from them means anything.
double max_resolved_helix(int order) { return std::max(6.3, 1.5 * (order + 1)); }

/// Name of a parameter of segment j: that of the body where it is one segment.
std::string name_in(const Parameters& p, const std::string& name, std::size_t j) {
  return p.segments == 1 ? "body." + name : "segment." + name + "[" + std::to_string(j + 1) + "]";
}

/// Fails where the sections or the unloaded shape would drive a planar rod out of its plane.
fmu::Status check_plane_of_segments(const Parameters& p) {
  const double c = std::cos(p.plane), s = std::sin(p.plane);
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Segment& segment = p.segment[j];
    if (p.profile == Profile::given && std::abs(c * s) > kAngleTolerance)
      for (int first : {0, 3})
        if (segment.stiffness[first] != segment.stiffness[first + 1])
          return refuse("plane = ", p.plane, " rad is no principal plane of the section: ", name_in(p, "stiffness", j),
                        "[", first + 1, "] = ", segment.stiffness[first], " and ", name_in(p, "stiffness", j), "[",
                        first + 2, "] = ", segment.stiffness[first + 1],
                        " differ; set plane to a multiple of pi/2, or planar = false");
    const Triple& curvature = segment.curvature;
    const double across = c * curvature[0] + s * curvature[1], twist = curvature[2];
    const double size = std::hypot(curvature[0], curvature[1], curvature[2]);
    if (std::abs(across) > kAngleTolerance * size || std::abs(twist) > kAngleTolerance * size)
      return refuse(name_in(p, "curvature", j), " leaves the plane at azimuth plane = ", p.plane, " rad: ", across,
                    " 1/m across it, ", twist, " 1/m of twist; turn plane, or set planar = false");
  }
  return {};
}

bool is_without_force(const Tca& tca) { return tca.law == Law::measured && tca.stiffness == 0.0; }

/// Fails where section, unloaded shape or TCAs would drive a planar rod out of its plane.
fmu::Status check_plane(const Parameters& p) {
  if (p.dynamic && p.method == Method::pade_euler)
    return refuse(
        "planar = true has three strains at most, but method = pade_euler "
        "has all six; choose another method");
  if (fmu::Status status = check_plane_of_segments(p); !status.is_ok()) return status;
  for (std::size_t i = 0; i < p.tcas; ++i) {
    const Tca& tca = p.tca[i];
    if (is_without_force(tca) || (tca.offset == 0.0 && tca.offset_end == 0.0)) continue;
    const auto mirrors = [&](const Tca& other) {
      const double sum = tca.azimuth + other.azimuth - 2.0 * p.plane;
      return std::abs(std::sin(0.5 * sum)) < kAngleTolerance && std::abs(tca.helix + other.helix) < kAngleTolerance;
    };
    if (std::none_of(p.tca.begin(), p.tca.begin() + static_cast<std::ptrdiff_t>(p.tcas), mirrors))
      return refuse("TCA ", i + 1, " (tca.azimuth = ", tca.azimuth, " rad, tca.helix = ", tca.helix,
                    " rad/m) has no mirror image in the plane at azimuth plane = ", p.plane,
                    " rad; turn plane to a symmetry plane of the TCAs, or set planar "
                    "= false");
  }
  return {};
}

/// Fails where a TCA's law has no meaning at a temperature.
fmu::Status check_temperatures(const Parameters& p, const Loads& loads) {
  for (std::size_t i = 0; i < p.tcas; ++i) {
    const double T = loads.T[i];
    if (!(T > 0.0))
      return refuse("T[", i + 1, "] = ", T, " K; temperatures must be positive: set or connect T[", i + 1, "]");
    if (p.tca[i].law == Law::wire && !(1.0 + p.tca[i].rho_T * (T - p.T_0) > 0.0))
      return refuse("T[", i + 1, "] = ", T, " K with tca.rho_T = ", p.tca[i].rho_T, " 1/K and T_0 = ", p.T_0,
                    " K leaves the wire no diameter; 1 + tca.rho_T (T - T_0) must be positive");
  }
  return {};
}

/// Whether all that was written is finite; the runtime names an output that was not written.
bool is_finite(const Outputs& y) {
  static_assert(sizeof(Outputs) % sizeof(double) == 0);
  const auto* values = reinterpret_cast<const double*>(&y);
  return std::all_of(values, values + sizeof(Outputs) / sizeof(double),
                     [](double each) { return std::isfinite(each) || core::is_unwritten(each); });
}

/// Fails where the span of TCA i is none, or leaves the body sideways.
fmu::Status check_routing(const Parameters& p, std::size_t i) {
  const Tca& tca = p.tca[i];
  const int last = static_cast<int>(p.segments);
  if (tca.first_segment > tca.last_segment || tca.last_segment > last)
    return refuse("tca.first_segment[", i + 1, "] = ", tca.first_segment, " and tca.last_segment[", i + 1,
                  "] = ", tca.last_segment, " are no span of a body of ", last,
                  " segments; set 1 <= first <= last <= ", last);
  const double from = p.start_of(static_cast<std::size_t>(tca.first_segment - 1)), span = p.span_of(i);
  for (std::size_t j = static_cast<std::size_t>(tca.first_segment - 1); j < static_cast<std::size_t>(tca.last_segment);
       ++j)
    for (const bool at_end : {false, true}) {
      const double s = at_end ? p.start_of(j + 1) : p.start_of(j);
      const double offset = tca.offset + (tca.offset_end - tca.offset) * (s - from) / span;
      const double radius = at_end ? p.segment[j].radius_end : p.segment[j].radius;
      if (offset >= radius)
        return refuse("tca.offset", p.tcas > 1 || p.segments > 1 ? "[" + std::to_string(i + 1) + "]" : "", " = ",
                      offset, " m lies outside the body: it must be less than body.radius = ", radius, " m",
                      p.segments > 1 ? " of segment " + std::to_string(j + 1) : "",
                      "; reduce tca.offset or enlarge body.radius");
    }
  for (std::size_t j = 0; j < p.segments; ++j)
    if (const double angle = std::abs(tca.helix) * p.segment[j].length; angle > max_resolved_helix(p.segment[j].order))
      return refuse("tca.helix[", i + 1, "] = ", tca.helix, " rad/m is ", angle, " rad over ",
                    p.segments > 1 ? "segment " + std::to_string(j + 1) : "body.length",
                    "; order = ", p.segment[j].order, " resolves ", max_resolved_helix(p.segment[j].order),
                    " rad; raise order or reduce tca.helix");
  return {};
}

/// Fails where the law of TCA i contradicts itself or the way the TCA is held.
fmu::Status check_law(const Parameters& p, std::size_t i) {
  const Tca& tca = p.tca[i];
  if (tca.chirality == 0)
    return refuse("tca.chirality[", i + 1, "] = 0: set +1 (extends when heated) or -1 (contracts)");
  if (tca.handedness == 0) return refuse("tca.handedness[", i + 1, "] = 0: set +1 or -1");
  if (tca.law == Law::wire && tca.wire_length <= p.span_of(i))
    return refuse("tca.wire_length[", i + 1, "] = ", tca.wire_length,
                  " m cannot be coiled into body.length = ", p.span_of(i),
                  " m; make the wire longer than the body along the TCA");
  if (p.ends == Ends::tethered && (tca.law != Law::wire || tca.pitch != Pitch::frozen))
    return refuse("tca.ends = tethered needs the torque of the TCA, but tca.law[", i + 1, "] and tca.pitch[", i + 1,
                  "] are not wire and frozen; set them so, or tca.ends = free");
  return {};
}

/// Fails where ways to hold the TCAs exclude each other.
fmu::Status check_contact(const Parameters& p) {
  if (p.contact == Contact::bonded && p.ends == Ends::tethered)
    return refuse(
        "tca.contact = bonded and tca.ends = tethered: a bonded TCA has no ends that could turn; "
        "set tca.contact = sliding or tca.ends = free");
  const bool is_plain = p.contact == Contact::sliding && p.ends == Ends::free;
  if (!is_plain && p.closure == Closure::exchanged)
    return refuse(
        "closure = exchanged is for TCAs that slide and turn freely; set closure = inside, or "
        "tca.contact = sliding and tca.ends = free");
  return {};
}

/// Fails where a TCA creeps in a rod that the integration of creep does not cover.
fmu::Status check_creep(const Parameters& p) {
  for (std::size_t i = 0; i < p.tcas; ++i) {
    if (p.tca[i].creep_compliance == 0.0) continue;
    const std::string name = "tca.creep_compliance[" + std::to_string(i + 1) + "] > 0";
    if (p.tca[i].law != Law::measured)
      return refuse(name, " acts on the spring of a measured TCA, but tca.law[", i + 1,
                    "] is wire; set it to measured, or the compliance to 0");
    if (p.dynamic)
      return refuse(name,
                    " needs dynamic = false: creep takes seconds, in which the rod is at rest; set it so, or the "
                    "compliance to 0");
    if (p.closure == Closure::exchanged || p.contact == Contact::bonded)
      return refuse(name, " needs closure = inside and tca.contact = sliding; set them so, or the compliance to 0");
  }
  return {};
}

/// Fails where the paper's scheme cannot have this body.
fmu::Status check_grid(const Parameters& p) {
  if (!(p.dynamic && p.method == Method::pade_euler)) return {};
  if (p.segment[0].strains != Strains::cosserat)
    return refuse("method = pade_euler has all six strains, but strains = ", static_cast<int>(p.segment[0].strains),
                  "; set strains to cosserat (4), or choose another method");
  if (!is_uniform(p))
    return refuse(
        "method = pade_euler is for one segment of constant radius with TCAs that slide and turn freely, "
        "without tip body and forces along the body; choose another method");
  return {};
}

/// Fails where parameters contradict each other.
fmu::Status check(const Parameters& p) {
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Triple& each = p.segment[j].curvature;
    const double curvature = std::hypot(each[0], each[1], each[2]) * p.segment[j].length;
    if (curvature > max_resolved_curvature())
      return refuse(name_in(p, "curvature", j), " is ", curvature, " rad over ", name_in(p, "length", j), "; at most ",
                    max_resolved_curvature(), " rad are resolved; reduce ", name_in(p, "curvature", j), " or ",
                    name_in(p, "length", j));
  }
  for (std::size_t i = 0; i < p.tcas; ++i) {
    if (fmu::Status status = check_routing(p, i); !status.is_ok()) return status;
    if (fmu::Status status = check_law(p, i); !status.is_ok()) return status;
  }
  if (fmu::Status status = check_contact(p); !status.is_ok()) return status;
  if (fmu::Status status = check_creep(p); !status.is_ok()) return status;
  if (fmu::Status status = check_grid(p); !status.is_ok()) return status;
  return p.planar ? check_plane(p) : fmu::Status();
}

std::unique_ptr<Engine> make_engine(const Parameters& p) {
  return p.dynamic && p.method == Method::pade_euler ? make_grid_engine(p) : make_strain_engine(p);
}

}  // namespace

fmu::Status RodModel::build() {
  const Parameters& p = data_.parameters;
  if (fmu::Status status = check(p); !status.is_ok()) return status;
  engine_ = make_engine(p);
  memory_.assign(engine_->memory_size() + (EnergyWatch::applies_to(p) ? EnergyWatch::memory_size() : 0) + 1, 0.0);
  engine_->set_unloaded(engine_memory());
  return {};
}

std::span<double> RodModel::watch_memory() {
  return std::span(memory_).subspan(engine_->memory_size(), memory_.size() - engine_->memory_size() - 1);
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
  if (!watch_memory().empty()) EnergyWatch::restart(watch_memory());
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
  if (!watch_memory().empty()) EnergyWatch::restart(watch_memory());
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
    if (data_.parameters.dynamic)
      warn_of_step(t, h);
    else
      warn_of_doubt(t + h);
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
                                   rate.first(engine_->memory_size()));
}

fmu::Status RodModel::evaluate(double t) {
  const Loads loads = loads_at(data_.inputs, 0.0);
  if (fmu::Status status = check_temperatures(data_.parameters, loads); !status.is_ok()) return status;
  // Where the host integrates, states may be anything.
  if (is_silent)
    if (fmu::Status status = engine_->check_motion(engine_memory()); !status.is_ok()) return status;
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
  else if (y.spatial_error > limit * data_.parameters.length())
    warn_once(kSpatialErrorWarning, [&] {
      return line("strain polynomials of order = ", data_.parameters.segment[0].order, " leave an estimated error of ",
                  y.spatial_error, " m in shape and displacements (output spatial_error); raise order, up to ",
                  kMaxOrder, ", or reduce the loads or tca.helix");
    });
  return {};
}

fmu::Status RodModel::evaluate_on_demand(double) {
  return engine_->clamp_reaction(engine_memory(), loads_at(data_.inputs, 0.0), data_.outputs);
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

void RodModel::warn_of_step(double t, double h) {
  const auto at_end = [&](const auto&... parts) {
    std::ostringstream text;
    text << "t = " << t + h << " s: ";
    (text << ... << parts);
    return text.str();
  };
  if (const double least = engine_->least_resolved_step(); h < least)
    warn_once(kGridWarning, [&] {
      return at_end("steps of ", h, " s are shorter than the ", least,
                    " s in which a wave crosses one grid interval of this rod: after a sudden load the tip moves "
                    "at once, by the strain of that interval; take longer steps, raise grid_points, add "
                    "body.retardation, or choose another method");
    });
  if (watch_memory().empty()) return;
  const Loads loads = loads_at(data_.inputs, h);
  Outputs y;
  engine_->outputs(engine_memory(), loads, y);
  const double drift = EnergyWatch::drift(watch_memory(), data_.parameters, data_.inputs, loads, y);
  if (std::abs(drift) > kEnergyDrift)
    warn_once(kEnergyWarning, [&] {
      return at_end("the energy of this undamped rod has changed by ", drift,
                    " of what its forms exchanged, though its loads are constant; tighten tolerance, raise order, take "
                    "shorter steps, or add damping (body.retardation)");
    });
}

}  // namespace rod
