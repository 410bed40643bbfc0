// Model reduction of the symmetric system x' = -A x + B w, y = B' x (mass-orthonormal coordinates, A = A' > 0).
//
// 1. A space V of block rational Krylov type, (A + s)^-1 B at s = 0 and at shifts that are added until its own error
// bound is
//    well below the tolerance. s = 0 makes steady states exact, and contains the uniform temperature, so heat is
//    balanced exactly too.
// 2. In it, balanced truncation of the map from jumps of w to the way still to go to the steady state,
//    A^-1 B - A^-1 e^(-A t) B. In coordinates A^(1/2) x this is again symmetric, so one Gramian gives its balanced
//    directions. The leading ones together with A^-1 B make the final space: a Galerkin projection of a symmetric
//    system, so stable.
// 3. Bound. Let F = A V - V L, L = V' A V: F' V = 0. The error of the reduced transfer function is R' (s + A)^-1 R with
// the
//    residual R = B - (s + A) V (s + L)^-1 V' B, and R = s F L^-1 (s + L)^-1 V' B because steady states are exact. So a
//    unit step of channel j moves the error of T_i by the inverse transform of rho_i' s (s + A)^-1 rho_j, where
//    rho_j(t) = F L^-1 e^(-L t) V' b_j. As |s (s + A)^-1| <= 1 on the imaginary axis, Plancherel's theorem bounds it at
//    all times by |rho_i| |rho_j| in L2, a closed form in the eigenvalues of L. It is quadratic in the residual and
//    holds against the unreduced mesh, whatever the shifts were.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "mesh/insulated.hpp"
#include "mesh/symmetric_factor.hpp"
#include "reduction/graded_eigen.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

/// Orthonormal basis, grown by blocks; directions that add nothing beyond rounding are dropped.
class Basis {
 public:
  explicit Basis(Index rows) : memory_(rows, kFirstColumns) {}

  void add(const MatrixXd& block) {
    for (Index j = 0; j < block.cols(); ++j) {
      VectorXd v = block.col(j).normalized();
      for (int pass = 0; pass < 2; ++pass) v -= columns() * (columns().transpose() * v);
      const double rest = v.norm();
      if (rest < kDropped) continue;
      v /= rest;
      v -= columns() * (columns().transpose() * v);
      if (count_ == memory_.cols()) memory_.conservativeResize(Eigen::NoChange, 2 * count_);
      memory_.col(count_++) = v.normalized();
    }
  }
  MatrixXd::ConstColsBlockXpr columns() const { return memory_.leftCols(count_); }

 private:
  static constexpr double kDropped = 1e-10;
  static constexpr Index kFirstColumns = 64;  // room for those of the first shifts
  MatrixXd memory_;
  Index count_ = 0;
};

/// A projected system in its eigenvectors, with the Gram matrix F' F of its residual.
struct Projection {
  VectorXd rate;
  MatrixXd load;
  MatrixXd vectors;  // of the projected matrix
  MatrixXd residual_gram;

  /// |rho_j| in L2 for every channel.
  VectorXd residual_norms() const {
    VectorXd norms(load.cols());
    for (Index c = 0; c < load.cols(); ++c) {
      const VectorXd weight = load.col(c).cwiseQuotient(rate);
      double sum = 0.0;
      for (Index k = 0; k < rate.size(); ++k)
        for (Index l = 0; l < rate.size(); ++l)
          sum += weight[k] * weight[l] * residual_gram(k, l) / (rate[k] + rate[l]);
      norms[c] = std::sqrt(std::max(sum, 0.0));
    }
    return norms;
  }
};

Projection project(const SparseMatrix& a, const MatrixXd& b, const MatrixXd& basis) {
  const MatrixXd image = a * basis;
  const MatrixXd small = basis.transpose() * image;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(small);
  Projection p{
      eigen.eigenvalues(), eigen.eigenvectors().transpose() * (basis.transpose() * b), eigen.eigenvectors(), {}};
  const MatrixXd residual = (image - basis * small) * p.vectors;
  p.residual_gram = residual.transpose() * residual;
  return p;
}

/// The same for an insulated section, where the first basis vector is the uniform temperature and its image is known.
Projection project(const SparseMatrix& a, const MatrixXd& b, const MatrixXd& basis, const VectorXd& first_image) {
  MatrixXd image = a * basis;
  image.col(0) = first_image;
  MatrixXd small = basis.transpose() * image;
  small.row(0) = small.col(0).transpose();
  const Eigenpairs eigen = graded_eigenpairs(small);
  Projection p{eigen.values, eigen.vectors.transpose() * (basis.transpose() * b), eigen.vectors, {}};
  const MatrixXd residual = (image - basis * small) * p.vectors;
  p.residual_gram = residual.transpose() * residual;
  return p;
}

/// The subspace W (orthonormal columns) of an already projected system. `is_graded`: W is the first mode and others.
Projection project(const Projection& from, const MatrixXd& w, bool is_graded) {
  const MatrixXd small = w.transpose() * from.rate.asDiagonal() * w;
  Projection p;
  if (is_graded) {
    const Eigenpairs eigen = graded_eigenpairs(small);
    p = {eigen.values, {}, w * eigen.vectors, {}};
  } else {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(small);
    p = {eigen.eigenvalues(), {}, w * eigen.eigenvectors(), {}};
  }
  p.load = p.vectors.transpose() * from.load;
  const MatrixXd inner = from.rate.asDiagonal() * p.vectors - p.vectors * p.rate.asDiagonal();
  p.residual_gram = p.vectors.transpose() * from.residual_gram * p.vectors + inner.transpose() * inner;
  return p;
}

/// Largest bound of the heated TCAs' own step errors, relative to their reference rises.
double relative_bound(const Projection& p, const VectorXd& reference) {
  const VectorXd norms = p.residual_norms();
  double largest = 0.0;
  for (Index i = 0; i < reference.size(); ++i) largest = std::max(largest, norms[i] * norms[i] / reference[i]);
  return largest;
}

/// Points of (0, 1), each in the widest gap of those before: van der Corput's sequence.
double spread(int index) {
  double x = 0.0, digit = 0.5;
  for (int rest = index + 1; rest > 0; rest /= 2, digit /= 2) x += digit * (rest % 2);
  return x;
}

class Krylov {
 public:
  explicit Krylov(const HeatMatrices& m)
      : root_(m.mass.cwiseSqrt()),
        a_(root_.cwiseInverse().asDiagonal() * m.stiffness * root_.cwiseInverse().asDiagonal()),
        b_(root_.cwiseInverse().asDiagonal() * m.loads),
        factor_(a_) {}

  const SparseMatrix& a() const { return a_; }
  const MatrixXd& b() const { return b_; }
  const VectorXd& root() const { return root_; }

  MatrixXd solve(double shift) {
    factor_.factor(shift);
    return factor_.solve(b_);
  }

 private:
  VectorXd root_;
  SparseMatrix a_;
  MatrixXd b_;
  SymmetricFactor factor_;
};

/// Steady responses A^-1 B and the scales that follow from them.
struct Start {
  MatrixXd steady;       // columns that span A^-1 B; the uniform temperature first where the section is insulated
  VectorXd rise;         // steady rise of each channel in itself
  VectorXd reference;    // of each TCA, see mesh/insulated.hpp
  double slowest = 0.0;  // slowest rate that is not that of the section as a whole against the surroundings
  bool is_insulated = false;
};

Start start(const HeatMatrices& matrices, Krylov& krylov) {
  const Index tcas = matrices.tcas();
  Start s;
  s.steady = krylov.solve(0.0);
  s.rise = (krylov.b().transpose() * s.steady).diagonal();
  const VectorXd surface = (krylov.b().col(tcas).transpose() * s.steady).transpose() / matrices.surface_conductance;
  s.reference.resize(tcas);
  for (Index i = 0; i < tcas; ++i) {
    const double above = s.rise[i] - surface[i];
    s.is_insulated = s.is_insulated || is_insulated(s.rise[i], above);
    s.reference[i] = reference_rise(s.rise[i], above);
  }
  s.slowest = s.rise[0] / s.steady.col(0).squaredNorm() * (s.rise[0] / s.reference[0]);
  if (!s.is_insulated) return s;
  const VectorXd uniform = krylov.root().normalized();
  s.steady.resize(krylov.root().size(), tcas + 1);
  s.steady.col(0) = uniform;
  const MatrixXd above = rises_above_surface(matrices);
  for (Index i = 0; i < tcas; ++i) {
    const VectorXd y = krylov.root().cwiseProduct(above.col(i));
    const double internal = matrices.loads.col(i).dot(above.col(i));
    s.steady.col(1 + i) = y - uniform * uniform.dot(y);
    s.rise[i] = internal + 1.0 / matrices.surface_conductance;
    s.reference[i] = kSurfaceShare * internal;
  }
  s.rise[tcas] = matrices.surface_conductance;
  s.slowest = 1.0 / (matrices.mass.sum() * s.reference[0]);
  return s;
}

/// 1. A Krylov space whose bound is a tenth of the tolerance. Shifts span from the slowest rates to those of heat that
/// crosses the thinnest length that still matters; where that is not enough, to faster ones.
Projection krylov_space(Krylov& krylov, const Start& start, double tolerance, Basis& basis) {
  constexpr int kFirst = 7, kMost = 40;  // shifts
  constexpr int kRounds = 2;             // the second with faster shifts
  constexpr double kFaster = 1e3;
  const double lowest = 0.3 * start.slowest, highest = 3e4 * start.slowest;
  const VectorXd uniform_image = krylov.b().rightCols(1) / krylov.root().norm();
  basis.add(start.steady);
  Projection whole;
  for (int round = 0; round < kRounds; ++round) {
    const double low = round == 0 ? lowest : highest, high = round == 0 ? highest : kFaster * highest;
    for (int shifts = 0; shifts < (round == 0 ? kMost : kMost / 2);) {
      const int until = shifts == 0 && round == 0 ? kFirst : shifts + 2;
      for (; shifts < until; ++shifts) basis.add(krylov.solve(low * std::pow(high / low, spread(shifts))));
      whole = start.is_insulated ? project(krylov.a(), krylov.b(), basis.columns(), uniform_image)
                                 : project(krylov.a(), krylov.b(), basis.columns());
      if (relative_bound(whole, start.reference) < 0.1 * tolerance) return whole;
    }
  }
  return whole;
}

}  // namespace

ModalModel reduced(const HeatMatrices& matrices, double tolerance) {
  Krylov krylov(matrices);
  const Start origin = start(matrices, krylov);
  Basis basis(matrices.size());
  const Projection whole = krylov_space(krylov, origin, tolerance, basis);

  // 2. Balanced directions. The surroundings' channel, slow and smooth, counts a tenth of a TCA's. The mode of an
  // insulated section as a whole is kept as it is: it would hide all others.
  const Index tcas = matrices.tcas();
  const Index n = whole.rate.size(), kept_modes = origin.is_insulated ? 1 : 0, m = n - kept_modes;
  const VectorXd rate = whole.rate.tail(m);
  const MatrixXd load = whole.load.bottomRows(m);
  MatrixXd scaled = load;
  scaled.rightCols(1) *= 0.1 * std::sqrt(origin.rise.head(tcas).maxCoeff() / origin.rise[tcas]);
  MatrixXd gramian(m, m);
  for (Index k = 0; k < m; ++k)
    for (Index l = 0; l < m; ++l)
      gramian(k, l) = scaled.row(k).dot(scaled.row(l)) / (std::sqrt(rate[k] * rate[l]) * (rate[k] + rate[l]));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> balanced(gramian);
  const VectorXd strength = balanced.eigenvalues().reverse();
  const MatrixXd directions =
      rate.cwiseSqrt().cwiseInverse().asDiagonal() * balanced.eigenvectors().rowwise().reverse();
  const MatrixXd steady_small = rate.cwiseInverse().asDiagonal() * load;

  // 3. The fewest directions that keep the bound; directions of equal strength (symmetry) stay together.
  std::vector<Index> cuts;
  for (Index r = 1; r < m; ++r)
    if (strength[r] < (1.0 - 1e-5) * strength[r - 1]) cuts.push_back(r);
  cuts.push_back(m);
  const auto with_kept = [&](const MatrixXd& columns) {
    MatrixXd result = MatrixXd::Zero(n, columns.cols());
    result.bottomRows(m) = columns;
    return result;
  };
  const auto truncated = [&](Index r) {
    Basis small(n);
    if (origin.is_insulated) small.add(MatrixXd::Identity(n, 1));
    small.add(with_kept(steady_small));
    small.add(with_kept(directions.leftCols(r)));
    return project(whole, small.columns(), origin.is_insulated);
  };
  std::size_t low = 0, high = cuts.size() - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (relative_bound(truncated(cuts[middle]), origin.reference) <= tolerance) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  const Projection kept = truncated(cuts[low]);

  const MatrixXd lifted = basis.columns() * (whole.vectors * kept.vectors);
  ModalModel model;
  model.rate = kept.rate;
  model.load = kept.load;
  model.capacity = lifted.transpose() * krylov.root();
  model.probe.resize(static_cast<Index>(matrices.probes.size()), model.size());
  for (Index i = 0; i < model.probe.rows(); ++i) {
    model.probe.row(i) = lifted.row(matrices.probes[i]) / krylov.root()[matrices.probes[i]];
  }
  model.peak = Peak(matrices.probe_patches, static_cast<int>(matrices.probes.size()), matrices.order);
  const VectorXd norms = kept.residual_norms();
  model.step_bound = norms.head(tcas) * norms.transpose();
  model.reference = origin.reference;
  model.bound = relative_bound(kept, origin.reference);
  model.surface_conductance = matrices.surface_conductance;
  return model;
}

}  // namespace thermal
