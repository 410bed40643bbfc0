// LU factors of a small dense matrix that many right-hand sides follow one by one, as the stages of a Rosenbrock step:
// the triangles are stored by columns in packs, so that a solve takes a quarter of the instructions of a general one.
#pragma once

#include <Eigen/LU>
#include <vector>

#include "numerics/vectors.hpp"

namespace rod {

class PackedLu {
 public:
  /// Factors A with partial pivoting. Allocates where A is larger than all before.
  void compute(const Eigen::MatrixXd& A);
  /// Writes A^-1 b; b and x may be the same.
  void solve(const Eigen::VectorXd& b, Eigen::VectorXd& x);

 private:
  /// Aligned as functions compiled for AVX rely on; see field.hpp.
  struct alignas(kPackSize * sizeof(double)) Aligned {
    double value[kPackSize] = {};
  };

  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  int packs_ = 0;                       // of a column
  std::vector<Aligned> lower_, upper_;  // column after column, without the diagonal, padded with zeros
  std::vector<double> inverse_;         // of the diagonal
  std::vector<Aligned> x_;
};

}  // namespace rod
