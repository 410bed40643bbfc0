#include "full_level.hpp"

#include <arkode/arkode_arkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>

#include "circuit.hpp"
#include "polynomials.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

constexpr Index kN = static_cast<Index>(kTcas);
constexpr double kLocalShare = 0.2;  // of the tolerance, for the error of one internal step
constexpr long kMostSteps = 100000;  // internal steps in one call
constexpr double kUnitRise = 1.0;    // rises below this are held to absolute accuracy [K]

Eigen::Map<VectorXd> view(N_Vector v) { return {N_VGetArrayPointer(v), static_cast<Index>(N_VGetLength(v))}; }

template <class Pointer>
Pointer check(Pointer pointer) {
  if (!pointer) throw std::bad_alloc();
  return pointer;
}

}  // namespace

struct FullLevel::Integrator {
  Circuit circuit;
  VectorXd root;  // mass^(1/2)
  SparseMatrix a;
  Eigen::MatrixXd load;  // B
  std::vector<int> probes;
  double surface_conductance;

  Eigen::SimplicialLDLT<SparseMatrix> factor;  // of a + 1/factored_gamma
  double factored_gamma = 0.0;
  VectorXd inverse_pivots, permuted;

  SUNContext context = nullptr;
  N_Vector x = nullptr, absolute = nullptr;
  SUNLinearSolver solver = nullptr;
  void* arkode = nullptr;
  const Drive* drive = nullptr;  // during advance only

  Integrator(const HeatMatrices& m, const Parameters& parameters)
      : circuit(parameters),
        root(m.mass.cwiseSqrt()),
        a((root.cwiseInverse().asDiagonal() * m.stiffness * root.cwiseInverse().asDiagonal()).eval()),
        load(root.cwiseInverse().asDiagonal() * m.loads),
        probes(m.probes),
        surface_conductance(m.surface_conductance),
        permuted(m.size()) {
    factor.analyzePattern(a);
#if SUNDIALS_VERSION_MAJOR < 7
    if (SUNContext_Create(nullptr, &context) != 0) throw std::bad_alloc();
#else
    if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) throw std::bad_alloc();
    SUNContext_ClearErrHandlers(context);
#endif
    x = check(N_VNew_Serial(m.size(), context));
    absolute = check(N_VNew_Serial(m.size(), context));
    N_VConst(0.0, x);
    solver = check(SUNLinSolNewEmpty(context));
    solver->content = this;
    solver->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_MATRIX_EMBEDDED; };
    solver->ops->solve = solve;
    arkode = check(ARKStepCreate(nullptr, slope, 0.0, x, context));
#if SUNDIALS_VERSION_MAJOR < 7
    ARKStepSetErrHandlerFn(
        arkode, [](int, const char*, const char*, char*, void*) {}, nullptr);
#endif
    ARKStepSetUserData(arkode, this);
    ARKStepSVtolerances(arkode, 1e-6, (N_VConst(1e-6, absolute), absolute));
    ARKStepSetLinearSolver(arkode, solver, nullptr);
    ARKStepSetTableName(arkode, "ARKODE_ESDIRK436L2SA_6_3_4", "ARKODE_ERK_NONE");
    ARKStepSetMaxNumSteps(arkode, kMostSteps);
    ARKStepSetDeduceImplicitRhs(arkode, 1);
    if (!circuit.has_feedback()) ARKStepSetLinear(arkode, 0);
  }
  ~Integrator() {
    if (arkode) ARKStepFree(&arkode);
    if (solver) SUNLinSolFreeEmpty(solver);
    if (absolute) N_VDestroy(absolute);
    if (x) N_VDestroy(x);
    if (context) SUNContext_Free(&context);
  }
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;

  /// out = -A x + B w(s)
  void slope_at(double s, const Eigen::Ref<const VectorXd>& at, Eigen::Ref<VectorXd> out) const {
    out.noalias() = a * at;
    out = load.col(kN) * taylor(drive->ambient_rise, s) - out;
    for (Index i = 0; i < kN; ++i) {
      const double rise = circuit.has_feedback() ? load.col(i).dot(at) : 0.0;
      out += load.col(i) * circuit.power(i, taylor(drive->V[i], s), rise, taylor(drive->delta[i], s));
    }
  }

  static int slope(sunrealtype s, N_Vector at, N_Vector out, void* user) {
    try {
      static_cast<const Integrator*>(user)->slope_at(s, view(at), view(out));
      return 0;
    } catch (const std::domain_error&) {
      return 1;  // recoverable: a shorter internal step may stay where resistances are positive
    }
  }

  /// (1 + gamma A) x = b
  static int solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
    Integrator& self = *static_cast<Integrator*>(solver->content);
    sunrealtype gamma = 0.0;
    ARKStepGetCurrentGamma(self.arkode, &gamma);
    if (gamma != self.factored_gamma) {
      self.factor.setShift(1.0 / gamma);
      self.factor.factorize(self.a);
      if (self.factor.info() != Eigen::Success) return -1;
      self.inverse_pivots = (gamma * self.factor.vectorD()).cwiseInverse();
      self.factored_gamma = gamma;
    }
    self.permuted.noalias() = self.factor.permutationP() * view(b);
    self.factor.matrixL().solveInPlace(self.permuted);
    self.permuted.array() *= self.inverse_pivots.array();
    self.factor.matrixU().solveInPlace(self.permuted);
    view(x).noalias() = self.factor.permutationPinv() * self.permuted;
    return 0;
  }

  /// Runs over [0, h]; `hint` is the step to try first (0: none known), on return the one to try next time.
  void run(const Drive& along, double h, double tolerance, double& hint) {
    drive = &along;
    ARKStepReInit(arkode, nullptr, slope, 0.0, x);
    view(absolute) = kLocalShare * tolerance * kUnitRise * root;
    ARKStepSVtolerances(arkode, kLocalShare * tolerance, absolute);
    ARKStepSetInitStep(arkode, std::min(hint, h));
    ARKStepSetStopTime(arkode, h);
    sunrealtype reached = 0.0, longest = 0.0;
    while (reached < h) {
      const int flag = ARKStepEvolve(arkode, h, x, &reached, ARK_ONE_STEP);
      if (flag < 0) fail(flag, reached);
      sunrealtype taken = 0.0;
      ARKStepGetLastStep(arkode, &taken);
      longest = std::max(longest, taken);
    }
    // The end of the interval cuts steps short: unless one had to be repeated, longer ones are worth a try.
    long int repeated = 0;
    ARKStepGetNumErrTestFails(arkode, &repeated);
    hint = repeated == 0 ? 2.0 * longest : longest;
  }

  [[noreturn]] void fail(int flag, double reached) {
    // Where the powers are at fault at the point reached, they say so themselves.
    for (Index i = 0; i < kN; ++i) {
      const double rise = load.col(i).dot(view(x));
      circuit.power(i, taylor(drive->V[i], reached), rise, taylor(drive->delta[i], reached));
    }
    char* name = ARKStepGetReturnFlagName(flag);
    const std::string text = "SUNDIALS ARKODE stopped " + std::to_string(reached) + " s into the step: " + name +
                             "; loosen tolerance or choose level = reduced";
    std::free(name);
    throw std::runtime_error(text);
  }
};

FullLevel::FullLevel(const HeatMatrices& matrices, const Parameters& parameters)
    : integrator_(std::make_unique<Integrator>(matrices, parameters)) {}
FullLevel::~FullLevel() = default;

std::size_t FullLevel::state_size() const { return static_cast<std::size_t>(integrator_->root.size()) + 1; }
int FullLevel::unknowns() const { return static_cast<int>(integrator_->root.size()); }

void FullLevel::advance(std::span<double> state, const Drive& drive, double h, double tolerance) {
  Eigen::Map<VectorXd> x(state.data(), integrator_->root.size());
  view(integrator_->x) = x;
  double hint = state.back();
  integrator_->run(drive, h, tolerance, hint);
  x = view(integrator_->x);
  state.back() = hint;
}

Observation FullLevel::observe(std::span<const double> state, const Drive& drive) {
  Integrator& in = *integrator_;
  const Eigen::Map<const VectorXd> x(state.data(), in.root.size());
  in.drive = &drive;
  Observation seen;
  in.slope_at(0.0, x, in.permuted);
  for (Index i = 0; i < kN; ++i) {
    seen.rise[i] = in.load.col(i).dot(x);
    seen.rate[i] = in.load.col(i).dot(in.permuted);
    seen.power[i] = in.circuit.power(i, drive.V[i][0], seen.rise[i], drive.delta[i][0]);
  }
  const double surface = in.load.col(kN).dot(x);
  seen.loss = surface - in.surface_conductance * drive.ambient_rise[0];
  seen.surface_rise = surface / in.surface_conductance;
  seen.stored = in.root.dot(x);
  seen.max_rise = -1e300;
  for (const int node : in.probes) seen.max_rise = std::max(seen.max_rise, x[node] / in.root[node]);
  return seen;
}

}  // namespace thermal
