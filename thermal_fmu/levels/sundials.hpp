// RAII for SUNDIALS objects, and its vectors as Eigen maps.
#pragma once

#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_linearsolver.h>

#include <Eigen/Core>
#include <new>

namespace thermal {

inline Eigen::Map<Eigen::VectorXd> view(N_Vector v) {
  return {N_VGetArrayPointer(v), static_cast<Eigen::Index>(N_VGetLength(v))};
}

template <class Pointer>
Pointer check(Pointer pointer) {
  if (!pointer) throw std::bad_alloc();
  return pointer;
}

/// Objects that an integrator of n unknowns needs: state, absolute tolerances, a linear solver that is a function.
struct Sundials {
  using Solve = int (*)(SUNLinearSolver, SUNMatrix, N_Vector, N_Vector, sunrealtype);

  Sundials(Eigen::Index n, void* user, Solve solve) {
#if SUNDIALS_VERSION_MAJOR < 7
    if (SUNContext_Create(nullptr, &context) != 0) throw std::bad_alloc();
#else
    if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) throw std::bad_alloc();
    SUNContext_ClearErrHandlers(context);
#endif
    x = check(N_VNew_Serial(n, context));
    absolute = check(N_VNew_Serial(n, context));
    N_VConst(0.0, x);
    N_VConst(1e-6, absolute);
    solver = check(SUNLinSolNewEmpty(context));
    solver->content = user;
    solver->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_MATRIX_EMBEDDED; };
    solver->ops->solve = solve;
  }
  ~Sundials() {
    if (solver) SUNLinSolFreeEmpty(solver);
    if (absolute) N_VDestroy(absolute);
    if (x) N_VDestroy(x);
    if (context) SUNContext_Free(&context);
  }
  Sundials(const Sundials&) = delete;
  Sundials& operator=(const Sundials&) = delete;

  SUNContext context = nullptr;
  N_Vector x = nullptr, absolute = nullptr;
  SUNLinearSolver solver = nullptr;
};

}  // namespace thermal
