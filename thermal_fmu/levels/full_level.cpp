#include "levels/full_level.hpp"

#include <arkode/arkode_arkstep.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "levels/sundials.hpp"

#if SUNDIALS_VERSION_MAJOR >= 7
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // 6.4 knows these functions by ARKStep's names only
#endif

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLocalShare = 0.2;  // of the tolerance, for the error of one internal step
constexpr long kMostSteps = 5000;    // internal steps in one call: bounds its work to a few seconds
constexpr long kManySteps = 500;     // so many are worth a look at the resistances in each further one
constexpr double kUnitRise = 1.0;    // rises below this are held to absolute accuracy [K]

}  // namespace

struct FullLevel::Integrator {
  FullSystem system;
  Sundials sundials;
  void* arkode = nullptr;
  const Drive* drive = nullptr;  // during advance only

  Integrator(const HeatMatrices& m, const Parameters& parameters)
      : system(m, parameters), sundials(m.size(), this, solve) {
    arkode = check(ARKStepCreate(nullptr, slope, 0.0, sundials.x, sundials.context));
#if SUNDIALS_VERSION_MAJOR < 7
    ARKStepSetErrHandlerFn(
        arkode, [](int, const char*, const char*, char*, void*) {}, nullptr);
#endif
    ARKStepSetUserData(arkode, this);
    ARKStepSVtolerances(arkode, 1e-6, sundials.absolute);
    ARKStepSetLinearSolver(arkode, sundials.solver, nullptr);
    ARKStepSetTableName(arkode, "ARKODE_ESDIRK436L2SA_6_3_4", "ARKODE_ERK_NONE");
    ARKStepSetDeduceImplicitRhs(arkode, 1);
    retune();
  }

  /// Tells the integrator whether the slope is linear in the temperatures.
  void retune() {
    if (system.circuit.has_feedback() || !system.convection.is_constant())
      ARKStepSetNonlinear(arkode);
    else
      ARKStepSetLinear(arkode, 0);
  }

  ~Integrator() {
    if (arkode) ARKStepFree(&arkode);
  }

  static int slope(sunrealtype s, N_Vector at, N_Vector out, void* user) {
    auto& self = *static_cast<Integrator*>(user);
    ++self.system.counts.slopes;
    // 1: recoverable, a shorter internal step may stay where resistances are positive.
    return self.system.slope(*self.drive, s, view(at), view(out)).is_ok() ? 0 : 1;
  }

  static int solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
    auto& self = *static_cast<Integrator*>(solver->content);
    sunrealtype gamma = 0.0;
    ARKStepGetCurrentGamma(self.arkode, &gamma);
    return self.system.solve(gamma, view(b), view(x)) ? 0 : -1;
  }

  /// Runs over [0, h]; `hint` is the step to try first (0: none known), on return the one to try next time.
  Status run(const Drive& along, double h, double tolerance, double& hint) {
    drive = &along;
    ARKStepReInit(arkode, nullptr, slope, 0.0, sundials.x);
    view(sundials.absolute) = kLocalShare * tolerance * kUnitRise * system.root;
    ARKStepSVtolerances(arkode, kLocalShare * tolerance, sundials.absolute);
    ARKStepSetInitStep(arkode, std::min(hint, h));
    ARKStepSetStopTime(arkode, h);
    sunrealtype reached = 0.0, longest = 0.0;
    for (long steps = 0; reached < h; ++steps) {
      if (steps > kManySteps)
        if (Status status = explain(reached); !status.is_ok()) return status;
      if (steps == kMostSteps) return too_much_work(reached);
      const int flag = ARKStepEvolve(arkode, h, sundials.x, &reached, ARK_ONE_STEP);
      if (flag < 0) return failure(flag, reached);
      ++system.counts.steps;
      sunrealtype taken = 0.0;
      ARKStepGetLastStep(arkode, &taken);
      longest = std::max(longest, taken);
    }
    // The end of the interval cuts steps short: unless one had to be repeated, longer ones are worth a try.
    long int repeated = 0;
    ARKStepGetNumErrTestFails(arkode, &repeated);
    hint = repeated == 0 ? 2.0 * longest : longest;
    return {};
  }

  Status too_much_work(double reached) const {
    return Status::discard(
        std::to_string(kMostSteps) + " internal steps reached only " + std::to_string(reached) + " s into the step",
        "take shorter steps, loosen tolerance or choose level = reduced");
  }

  /// The resistance or power that is at fault at the point reached; success where none is.
  Status explain(double reached) {
    PerTca rise{}, delta{};
    for (Index i = 0; i < system.tcas(); ++i) {
      rise[i] = system.load.col(i).dot(view(sundials.x));
      delta[i] = core::value(drive->delta[i], reached);
      double power = 0.0;
      Status status = system.circuit.power(i, core::value(drive->V[i], reached), rise[i], delta[i], power);
      if (!status.is_ok()) return std::move(status).as_error();
    }
    return system.circuit.explain(rise, delta).as_error();
  }

  Status failure(int flag, double reached) {
    if (Status status = explain(reached); !status.is_ok()) return status;
    char* name = ARKStepGetReturnFlagName(flag);
    const std::string what = "SUNDIALS ARKODE stopped " + std::to_string(reached) + " s into the step: " + name;
    std::free(name);
    return Status::discard(what, "loosen tolerance or choose level = reduced");
  }
};

FullLevel::FullLevel(const HeatMatrices& matrices, const Parameters& parameters)
    : integrator_(std::make_unique<Integrator>(matrices, parameters)) {}
FullLevel::~FullLevel() = default;

std::size_t FullLevel::state_size() const { return static_cast<std::size_t>(integrator_->system.size()) + 1; }
int FullLevel::unknowns() const { return static_cast<int>(integrator_->system.size()); }
const FullSystem::Counts& FullLevel::counts() const { return integrator_->system.counts; }

Status FullLevel::advance(std::span<double> state, const Drive& drive, double h, double tolerance) {
  Eigen::Map<VectorXd> x(state.data(), integrator_->system.size());
  view(integrator_->sundials.x) = x;
  double hint = state.back();
  Status status = integrator_->run(drive, h, tolerance, hint);
  x = view(integrator_->sundials.x);
  state.back() = hint;
  return status;
}

void FullLevel::retune(const Parameters& parameters) {
  integrator_->system.circuit = Circuit(parameters);
  integrator_->retune();
}

Status FullLevel::observe(std::span<const double> state, const Drive& drive, Observation& seen) {
  FullSystem& system = integrator_->system;
  return system.observe(Eigen::Map<const VectorXd>(state.data(), system.size()), drive, seen);
}

double FullLevel::max_rise(std::span<const double> state) {
  FullSystem& system = integrator_->system;
  return system.max_rise(Eigen::Map<const VectorXd>(state.data(), system.size()));
}

bool FullLevel::exceeds(std::span<const double> state, double rise) {
  FullSystem& system = integrator_->system;
  return system.exceeds(Eigen::Map<const VectorXd>(state.data(), system.size()), rise);
}

}  // namespace thermal
