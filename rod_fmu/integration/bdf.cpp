// Binding of IDA to the rod: residual, Newton matrix and linear solver.
#include "integration/bdf.hpp"

#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <cstdlib>
#include <new>

namespace rod {

namespace {

constexpr double kMaxSteps = 2e5;     // of IDA in one call, which bounds its work to seconds
constexpr double kStrainScale = 0.1;  // strain [1] below which the error is absolute

template <class T>
T* check(T* made) {
  if (!made) throw std::bad_alloc();
  return made;
}

std::string flag_name(int flag) {
  const std::unique_ptr<char, decltype(&std::free)> name(IDAGetReturnFlagName(flag), &std::free);
  return name.get();
}

}  // namespace

/// y = (q, v, e) with the dissipated energy e, F = (dq/dt - v, r(q, v, dv/dt), de/dt - v^T D v). Elimination of the
/// first and last rows reduces the Newton matrix dF/dy + c dF/d(dy/dt) to r_q + c r_v + c^2 r_a, as in the other
/// methods.
struct Bdf::Problem {
  explicit Problem(int unknowns) : n(unknowns) {
    if (SUNContext_Create(0, &context) != 0) throw std::bad_alloc();
    y = check(N_VNew_Serial(2 * n + 1, context));
    yp = check(N_VNew_Serial(2 * n + 1, context));
    absolute = check(N_VNew_Serial(2 * n + 1, context));
    matrix = check(SUNMatNewEmpty(context));
    matrix->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
    matrix->ops->zero = [](SUNMatrix) { return 0; };
    matrix->content = this;
    solver = check(SUNLinSolNewEmpty(context));
    solver->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
    solver->ops->solve = [](SUNLinearSolver s, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
      return static_cast<Problem*>(s->content)->solve(N_VGetArrayPointer(x), N_VGetArrayPointer(b));
    };
    solver->content = this;
    ida = check(IDACreate(context));
    IDAInit(ida, residual, 0.0, y, yp);
    IDASetUserData(ida, this);
    IDASetLinearSolver(ida, solver, matrix);
    IDASetJacFn(ida, jacobian);
#if SUNDIALS_VERSION_MAJOR < 7
    IDASetErrFile(ida, nullptr);  // a failure is reported by step(), nothing is printed
#else
    SUNContext_ClearErrHandlers(context);
#endif
  }
  ~Problem() {
    if (ida) IDAFree(&ida);
    if (solver) SUNLinSolFreeEmpty(solver);
    if (matrix) SUNMatFreeEmpty(matrix);
    for (N_Vector each : {y, yp, absolute})
      if (each) N_VDestroy(each);
    if (context) SUNContext_Free(&context);
  }

  static int residual(sunrealtype t, N_Vector yy, N_Vector yyp, N_Vector f, void* user) {
    auto& self = *static_cast<Problem*>(user);
    const int n = self.n;
    const double *q = N_VGetArrayPointer(yy), *v = q + n, *qp = N_VGetArrayPointer(yyp), *a = qp + n;
    double* out = N_VGetArrayPointer(f);
    self.rod->residual(q, v, a, loads_at(*self.u, t), self.scratch->work, self.r);
    const Eigen::Map<const Vector> rates(v, n);
    Eigen::Map<Vector>(out, n) = Eigen::Map<const Vector>(qp, n) - rates;
    Eigen::Map<Vector>(out + n, n) = self.r;
    out[2 * n] = qp[2 * n] - self.rod->damping_power(rates);
    return self.r.allFinite() ? 0 : 1;  // 1: try a smaller step
  }

  static int jacobian(sunrealtype t, sunrealtype c, N_Vector yy, N_Vector yyp, N_Vector, SUNMatrix, void* user,
                      N_Vector, N_Vector, N_Vector) {
    auto& self = *static_cast<Problem*>(user);
    const double *q = N_VGetArrayPointer(yy), *v = q + self.n, *a = N_VGetArrayPointer(yyp) + self.n;
    self.c = c;
    self.rod->residual(q, v, a, loads_at(*self.u, t), self.scratch->newton.work, self.r);
    self.rod->tangent(self.scratch->newton.work, {1.0, c, c * c}, self.J);
    self.lu.compute(self.J);
    self.rod->damping_force(Eigen::Map<const Vector>(v, self.n), self.heat_slope);
    self.heat_slope *= 2.0;
    return 0;
  }

  int solve(double* x, const double* b) {
    b1 = Eigen::Map<const Vector>(b, n);
    b2 = c * b1;
    rod->rate_derivative(scratch->newton.work, b1, b2, r);
    r += Eigen::Map<const Vector>(b + n, n);
    Eigen::Map<Vector> xq(x, n), xv(x + n, n);
    const double heat = b[2 * n];
    xq = lu.solve(r);
    xv = c * xq - b1;
    x[2 * n] = (heat + heat_slope.dot(xv)) / c;
    return 0;
  }

  int n;
  SUNContext context = nullptr;
  N_Vector y = nullptr, yp = nullptr, absolute = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver solver = nullptr;
  void* ida = nullptr;

  const Rod* rod = nullptr;
  const Inputs* u = nullptr;
  Scratch* scratch = nullptr;  // newton.work is at the point of the Newton matrix, work at that of the residual
  double c = 0.0;
  Vector r, b1, b2, heat_slope;
  Matrix J;
  Eigen::PartialPivLU<Matrix> lu;
};

Bdf::Bdf(int unknowns) : problem_(std::make_unique<Problem>(unknowns)) {}
Bdf::~Bdf() = default;
Bdf::Bdf(Bdf&&) noexcept = default;
Bdf& Bdf::operator=(Bdf&&) noexcept = default;

StepOutcome Bdf::step(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch) {
  Problem& p = *problem_;
  const int n = p.n;
  if (core::Status status = solve_acceleration(rod, loads_at(u, 0.0), state, scratch); !status.is_ok())
    return {0.0, std::move(status)};
  p.rod = &rod;
  p.u = &u;
  p.scratch = &scratch;
  double *y = N_VGetArrayPointer(p.y), *yp = N_VGetArrayPointer(p.yp), *absolute = N_VGetArrayPointer(p.absolute);
  Eigen::Map<Vector> q(y, n), v(y + n, n), qp(yp, n), a(yp + n, n);
  q = state.q, v = state.v, qp = state.v, a = state.a;
  y[2 * n] = 0.0;
  yp[2 * n] = rod.damping_power(state.v);
  Eigen::Map<Vector>(absolute, n).setConstant(tolerance * kStrainScale);
  Eigen::Map<Vector>(absolute + n, n).setConstant(tolerance * kStrainScale * rod.first_frequency());
  absolute[2 * n] = tolerance * rod.stiffness().mean();
  IDAReInit(p.ida, 0.0, p.y, p.yp);
  IDASVtolerances(p.ida, tolerance, p.absolute);
  IDASetStopTime(p.ida, h);
  IDASetMaxNumSteps(p.ida, static_cast<long>(std::min(max_internal_steps(rod, h), kMaxSteps)));

  sunrealtype reached = 0.0;
  const int status = IDASolve(p.ida, h, &reached, p.y, p.yp, IDA_NORMAL);
  if (status < 0 || !q.allFinite() || !v.allFinite())
    return {0.0,
            core::Status::discard("SUNDIALS IDA stopped: " + flag_name(status), "reduce the step or the tolerance")};
  if (core::Status inadmissible = rod.check_strains(y); !inadmissible.is_ok()) return {0.0, std::move(inadmissible)};
  state.q = q, state.v = v, state.a = a;
  state.dissipated += y[2 * n];
  return {h, {}};
}

}  // namespace rod
