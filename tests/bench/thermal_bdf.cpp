#include "thermal_bdf.hpp"

#include <cvode/cvode.h>

#include <stdexcept>

#include "thermal_scene.hpp"

namespace thermal {

Bdf::Bdf(const HeatMatrices& matrices, const Parameters& parameters, bool keeps_history)
    : system_(matrices, parameters), sundials_(matrices.size(), this, solve), keeps_history_(keeps_history) {
  cvode_ = check(CVodeCreate(CV_BDF, sundials_.context));
  CVodeInit(cvode_, slope, 0.0, sundials_.x);
  CVodeSetUserData(cvode_, this);
  CVodeSVtolerances(cvode_, 1e-6, sundials_.absolute);
  CVodeSetLinearSolver(cvode_, sundials_.solver, nullptr);
  CVodeSetMaxNumSteps(cvode_, 100000);
}

Bdf::~Bdf() { CVodeFree(&cvode_); }

int Bdf::slope(sunrealtype, N_Vector at, N_Vector out, void* user) {
  auto& self = *static_cast<Bdf*>(user);
  ++self.system_.counts.slopes;
  return self.system_.slope(*self.drive_, 0.0, view(at), view(out)).is_ok() ? 0 : -1;
}

int Bdf::solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
  auto& self = *static_cast<Bdf*>(solver->content);
  sunrealtype gamma = 0.0;
  CVodeGetCurrentGamma(self.cvode_, &gamma);
  return self.system_.solve(gamma, view(b), view(x)) ? 0 : -1;
}

void Bdf::advance(const Drive& drive, double h, double tolerance) {
  drive_ = &drive;
  if (!keeps_history_ || t_ == 0.0) {
    CVodeReInit(cvode_, t_, sundials_.x);
    view(sundials_.absolute) = tolerance * system_.root;
    CVodeSVtolerances(cvode_, tolerance, sundials_.absolute);
  }
  long before = 0, after = 0;
  if (keeps_history_) CVodeGetNumSteps(cvode_, &before);
  CVodeSetStopTime(cvode_, t_ + h);
  sunrealtype reached = t_;
  if (CVode(cvode_, t_ + h, sundials_.x, &reached, CV_NORMAL) < 0) throw std::runtime_error("CVODE stopped");
  CVodeGetNumSteps(cvode_, &after);
  system_.counts.steps += after - before;
  t_ += h;
}

Observation Bdf::observe(const Drive& drive) {
  Observation seen;
  must(system_.observe(view(sundials_.x), drive, seen));
  return seen;
}

}  // namespace thermal
