// Every node of the mesh as a state, in mass-orthonormal coordinates x = mass^(1/2) (T - T_0):
//     x' = -A x + B w,   A = mass^(-1/2) stiffness mass^(-1/2) sparse and symmetric,
// and what an implicit integrator needs of it: slopes, and sparse direct factors of 1 + gamma A, kept while gamma
// stays.
#pragma once

#include "levels/heat_level.hpp"
#include "mesh/heat_matrices.hpp"
#include "mesh/symmetric_factor.hpp"
#include "physics/circuit.hpp"
#include "physics/convection.hpp"

namespace thermal {

class FullSystem {
 public:
  using Vector = Eigen::VectorXd;

  FullSystem(const HeatMatrices& matrices, const Parameters& parameters);

  Eigen::Index size() const { return root.size(); }
  Eigen::Index tcas() const { return load.cols() - 1; }

  /// out = -A x + B w at s after the start of the drive. Fails as Circuit::power.
  Status slope(const Drive& drive, double s, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> out);

  /// (1 + gamma A) x = b. False: there are no factors.
  bool solve(double gamma, const Eigen::Ref<const Vector>& b, Eigen::Ref<Vector> x);

  Status observe(const Eigen::Ref<const Vector>& x, const Drive& drive, Observation& seen);
  /// Highest rise in TCAs and on the surface [K].
  double max_rise(const Eigen::Ref<const Vector>& x);
  /// Returns whether it exceeds `rise` [K].
  bool exceeds(const Eigen::Ref<const Vector>& x, double rise);

  Circuit circuit;
  Convection convection;
  Vector root;           // mass^(1/2)
  Eigen::MatrixXd load;  // B

  struct Counts {
    long steps = 0, slopes = 0, factorisations = 0, solves = 0;
  };
  Counts counts;  // of work done so far, for studies; steps and slopes are counted by the integrator

 private:
  /// h over that of the matrices, at the mean temperature of the surface.
  double convection_ratio(const Eigen::Ref<const Vector>& x, const Drive& drive, double s) const;

  using SparseMatrix = Eigen::SparseMatrix<double>;

  SparseMatrix a_;
  SymmetricFactor factor_;  // of a + 1/gamma
  std::vector<int> probes_;
  void observe_probes(const Eigen::Ref<const Vector>& x);

  Peak peak_;
  Vector peak_values_;  // scratch
  double surface_conductance_, T_0_;
  Vector surface_;  // convection of the matrices at every node, by its heat capacity [1/s]; empty where h is constant
  SymmetricFactor::Factors<1> factors_;
  double gamma_ = 0.0;
  Vector inverse_pivots_, permuted_;
  // Insulated sections: A conserves heat only to rounding of the conduction, which may exceed the convection. With the
  // uniform unit vector u, A u = loss is known exactly.
  bool is_insulated_;
  Vector uniform_, loss_;  // u; empty unless insulated
};

}  // namespace thermal
