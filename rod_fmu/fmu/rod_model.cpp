#include "fmu/rod_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace rod {

static_assert(std::is_same_v<Polynomial, fmu::Polynomial>);

namespace {

template <class... Parts>
fmu::Status refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return fmu::Status::error(text.str());
}

constexpr double noticed = 1e-6;     // of Outputs::out_of_plane, what a host is warned of
constexpr double coincident = 1e-9;  // rad, azimuths

/// What keeps a planar rod from staying in its plane whatever the loads.
fmu::Status check_plane(const Parameters& p) {
  const double c = std::cos(p.plane), s = std::sin(p.plane);
  if (p.dynamic && p.method == Method::pade_euler)
    return refuse(
        "planar = true has three strains at most, but method = pade_euler "
        "has all six; choose another method");
  if (p.body_profile == Profile::given && std::abs(c * s) > coincident)
    for (int first : {0, 3})
      if (p.body_stiffness[first] != p.body_stiffness[first + 1])
        return refuse("plane = ", p.plane, " rad is no principal plane of the section: body.stiffness[", first + 1,
                      "] = ", p.body_stiffness[first], " and body.stiffness[", first + 2,
                      "] = ", p.body_stiffness[first + 1],
                      " differ; set plane to a multiple of pi/2, or planar = false");
  const double across = c * p.body_curvature[0] + s * p.body_curvature[1], twist = p.body_curvature[2];
  const double size = std::hypot(p.body_curvature[0], p.body_curvature[1], p.body_curvature[2]);
  if (std::abs(across) > coincident * size || std::abs(twist) > coincident * size)
    return refuse("body.curvature leaves the plane at azimuth plane = ", p.plane, " rad: ", across, " 1/m across it, ",
                  twist, " 1/m of twist; turn plane, or set planar = false");
  if (p.tca_law == Law::measured && p.tca_stiffness == 0.0) return {};  // TCAs that do nothing
  for (std::size_t i = 0; i < tca_count; ++i) {
    const auto mirrors = [&](std::size_t j) {
      const double sum = p.tca_azimuth[i] + p.tca_azimuth[j] - 2.0 * p.plane;
      return std::abs(std::sin(0.5 * sum)) < coincident && std::abs(p.tca_helix[i] + p.tca_helix[j]) < coincident;
    };
    bool mirrored = false;
    for (std::size_t j = 0; j < tca_count; ++j) mirrored = mirrored || mirrors(j);
    if (!mirrored)
      return refuse("TCA ", i + 1, " (tca.azimuth = ", p.tca_azimuth[i], " rad, tca.helix = ", p.tca_helix[i],
                    " rad/m) has no mirror image in the plane at azimuth plane = ", p.plane,
                    " rad; turn plane to a symmetry plane of the TCAs, or set planar "
                    "= false");
  }
  return {};
}

/// What no single row of the table can check.
fmu::Status check(const Parameters& p) {
  if (p.tca_offset >= p.body_radius)
    return refuse("tca.offset = ", p.tca_offset,
                  " m lies outside the body: it must be less than body.radius = ", p.body_radius,
                  " m; reduce tca.offset or enlarge body.radius");
  if (p.tca_chirality == 0) return refuse("tca.chirality = 0: set +1 (extends when heated) or -1 (contracts)");
  if (p.tca_law == Law::wire && p.tca_wire_length <= p.body_length)
    return refuse("tca.wire_length = ", p.tca_wire_length, " m cannot be coiled into body.length = ", p.body_length,
                  " m; make the wire longer than the body");
  if (p.dynamic && p.method == Method::pade_euler && p.strains != Strains::cosserat)
    return refuse("method = pade_euler has all six strains, but strains = ", static_cast<int>(p.strains),
                  "; set strains to cosserat (4), or choose another method");
  return p.planar ? check_plane(p) : fmu::Status();
}

}  // namespace

fmu::Status RodModel::build() {
  const Parameters& p = data_.parameters;
  if (fmu::Status status = check(p); !status.is_ok()) return status;
  warned_ = false;
  engine_ = p.dynamic && p.method == Method::pade_euler ? make_grid_engine(p) : make_strain_engine(p);
  memory_.assign(engine_->memory_size() + 1, 0.0);
  engine_->rest(engine_memory());
  return {};
}

/// call() with its evaluations added to those in the memory.
template <class Call>
auto RodModel::counted(Call call) {
  const long before = engine_->evaluations();
  const auto result = call();
  memory_.back() += static_cast<double>(engine_->evaluations() - before);
  return result;
}

fmu::Status RodModel::initialise(double t) {
  engine_->rest(engine_memory());
  memory_.back() = 0.0;
  if (!data_.parameters.start_at_equilibrium && data_.parameters.dynamic) return {};
  if (!counted([&] { return engine_->settle(engine_memory(), loads_at(data_.inputs, 0.0)); }))
    return refuse("no equilibrium found at t = ", t,
                  " s for the inputs at the start; reduce the loads, or start straight (start_at_equilibrium = false)");
  return {};
}

fmu::StepResult RodModel::step(double t, double h) {
  const Advance advance =
      counted([&] { return engine_->step(engine_memory(), data_.inputs, h, data_.parameters.tolerance); });
  if (advance.reached == h) return {t + h, {}};
  return {t + advance.reached, fmu::Status::discard(advance.trouble)};
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
  if (check_states().is_ok()) engine_->get_states(engine_memory(), x);
}

void RodModel::set_states(std::span<const double> x) { engine_->set_states(engine_memory(), x); }

fmu::Status RodModel::rates(double, std::span<double> dx) {
  const bool found = engine_->rates(engine_memory(), loads_at(data_.inputs, 0.0), dx);
  return found ? fmu::Status()
               : fmu::Status::discard("no finite acceleration", "the strains or the loads may be too large");
}

bool RodModel::rates_along(double, std::span<const double> dx, std::span<double> ddx) {
  return engine_->rates_along(engine_memory(), loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0), dx, ddx);
}

bool RodModel::drift(std::span<double> rate) {
  return !data_.parameters.dynamic && engine_->drift(engine_memory(), loads_at(data_.inputs, 0.0),
                                                     load_rates_at(data_.inputs, 0.0), rate.first(rate.size() - 1));
}

fmu::Status RodModel::evaluate(double t) {
  engine_->outputs(engine_memory(), loads_at(data_.inputs, 0.0), data_.outputs);
  data_.outputs.evaluations = memory_.back();
  if (warned_ || !(data_.outputs.out_of_plane > noticed)) return {};
  warned_ = true;
  std::ostringstream text;
  text << "t = " << t
       << " s: forces across the plane of this planar rod are left out; alone "
          "they would cause strains of "
       << data_.outputs.out_of_plane << " (output out_of_plane); set planar = false, or turn plane";
  warn(text.str());
  return {};
}

}  // namespace rod
