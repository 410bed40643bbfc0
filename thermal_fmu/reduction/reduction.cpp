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
//
// A section in parts (mesh/heat_section.hpp) has a space for each part: A, and so F, is block diagonal. Directions of
// all parts are ranked together.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "mesh/insulated.hpp"
#include "mesh/symmetric_factor.hpp"
#include "reduction/modal_model.hpp"
#include "reduction/projection.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

/// |rho_j| in L2 for every channel of the section.
VectorXd residual_norms(const HeatSection& section, std::span<const Projection> projections) {
  VectorXd squares = VectorXd::Zero(section.tcas + 1);
  for (std::size_t k = 0; k < projections.size(); ++k) {
    const VectorXd of_loads = projections[k].residual_squares();
    for (const HeatPart::Copy& copy : section.parts[k].copies)
      squares += copy.channels.cwiseAbs2().transpose() * of_loads;
  }
  return squares.cwiseSqrt();
}

/// Largest bound of the heated TCAs' own step errors, relative to their reference rises.
double relative_bound(const HeatSection& section, std::span<const Projection> projections, const VectorXd& reference) {
  const VectorXd norms = residual_norms(section, projections);
  return norms.head(section.tcas).cwiseAbs2().cwiseQuotient(reference).maxCoeff();
}

/// Points of (0, 1), each in the widest gap of those before: van der Corput's sequence.
double spread(int index) {
  double x = 0.0, digit = 0.5;
  for (int rest = index + 1; rest > 0; rest /= 2, digit /= 2) x += digit * (rest % 2);
  return x;
}

/// D matrix D with the diagonal D, in the matrix's own pattern.
SparseMatrix scaled_both_sides(SparseMatrix matrix, const VectorXd& diagonal) {
  for (Index column = 0; column < matrix.outerSize(); ++column)
    for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry)
      entry.valueRef() = diagonal[entry.row()] * entry.value() * diagonal[column];
  return matrix;
}

/// One part of the section in mass-orthonormal coordinates, and its growing space.
class Krylov {
 public:
  explicit Krylov(const HeatPart& part)
      : part_(part),
        root_(part.system.mass.cwiseSqrt()),
        a_(scaled_both_sides(part.system.stiffness, root_.cwiseInverse())),
        b_(root_.cwiseInverse().asDiagonal() * part.system.loads),
        factor_(a_, VectorXd::Ones(a_.rows())),
        basis_(part.system.size()) {}

  const MatrixXd& b() const { return b_; }
  const VectorXd& root() const { return root_; }
  Basis& basis() { return basis_; }

  std::vector<MatrixXd> solve(std::span<const double> shifts) const { return factor_.solve(shifts, b_); }

  /// Holds the uniform temperature as its first basis vector, whose image is known.
  bool is_graded(bool is_insulated) const { return is_insulated && part_.has_surface; }

  Projection projection(bool is_insulated) const {
    return is_graded(is_insulated) ? project(a_, b_, basis_.columns(), b_.rightCols(1) / root_.norm())
                                   : project(a_, b_, basis_.columns());
  }

 private:
  const HeatPart& part_;
  VectorXd root_;
  SparseMatrix a_;
  MatrixXd b_;
  SymmetricFactor factor_;
  Basis basis_;
};

/// Steady responses A^-1 B and the scales that follow from them.
struct Start {
  std::vector<MatrixXd> steady;  // of each part: columns that span A^-1 B; the uniform temperature first where graded
  VectorXd rise;                 // steady rise of each channel in itself
  VectorXd reference;            // of each TCA, see mesh/insulated.hpp
  double slowest = 0.0;          // slowest rate that is not that of the section as a whole against the surroundings
  bool is_insulated = false;
};

/// The same of an insulated section. `steady`: A^-1 B, of use in the parts without surface only.
void split_uniform(const HeatSection& section, std::span<Krylov> krylov, Start& s) {
  MatrixXd internal = MatrixXd::Zero(section.tcas + 1, section.tcas + 1);
  for (std::size_t k = 0; k < krylov.size(); ++k) {
    const HeatSystem& system = section.parts[k].system;
    const Index loads = system.loads.cols();
    MatrixXd of_loads = MatrixXd::Zero(loads, loads);
    if (section.parts[k].has_surface) {
      const VectorXd uniform = krylov[k].root().normalized();
      const MatrixXd above = rises_above_surface(system);
      of_loads.leftCols(loads - 1) = system.loads.transpose() * above;
      s.steady[k].col(0) = uniform;
      for (Index i = 0; i + 1 < loads; ++i) {
        const VectorXd y = krylov[k].root().cwiseProduct(above.col(i));
        s.steady[k].col(1 + i) = y - uniform * uniform.dot(y);
      }
    } else {
      of_loads = krylov[k].b().transpose() * s.steady[k];
    }
    add_response(section.parts[k], of_loads, internal);
  }
  const VectorXd of_tcas = internal.diagonal().head(section.tcas);
  s.rise.head(section.tcas) = of_tcas.array() + 1.0 / section.surface_conductance;
  s.rise[section.tcas] = section.surface_conductance;
  s.reference = kSurfaceShare * of_tcas;
  s.slowest = 1.0 / (heat_capacity(section) * s.reference[0]);
}

Start start(const HeatSection& section, std::span<Krylov> krylov) {
  const Index tcas = section.tcas;
  Start s;
  MatrixXd response = MatrixXd::Zero(tcas + 1, tcas + 1), square = response;  // of the channels' steady temperatures
  for (std::size_t k = 0; k < krylov.size(); ++k) {
    const MatrixXd& steady = s.steady.emplace_back(krylov[k].solve(std::array{0.0})[0]);
    add_response(section.parts[k], krylov[k].b().transpose() * steady, response);
    add_response(section.parts[k], steady.transpose() * steady, square);
  }
  s.rise = response.diagonal();
  s.reference.resize(tcas);
  for (Index i = 0; i < tcas; ++i) {
    const double above = s.rise[i] - response(tcas, i) / section.surface_conductance;
    s.is_insulated = s.is_insulated || is_insulated(s.rise[i], above);
    s.reference[i] = reference_rise(s.rise[i], above);
  }
  s.slowest = s.rise[0] / square(0, 0) * (s.rise[0] / s.reference[0]);
  if (s.is_insulated) split_uniform(section, krylov, s);
  return s;
}

/// 1. Krylov spaces whose bound is a tenth of the tolerance. Shifts span from the slowest rates to those of heat that
/// crosses the thinnest length that still matters; where that is not enough, to faster ones.
std::vector<Projection> krylov_spaces(const HeatSection& section, std::span<Krylov> krylov, const Start& start,
                                      double tolerance) {
  constexpr int kFirst = 7, kMost = 40;  // shifts
  constexpr int kRounds = 2;             // the second with faster shifts
  constexpr double kFaster = 1e3;
  const double lowest = 0.3 * start.slowest, highest = 3e4 * start.slowest;
  for (std::size_t k = 0; k < krylov.size(); ++k) krylov[k].basis().add(start.steady[k]);
  std::vector<Projection> whole(krylov.size());
  for (int round = 0; round < kRounds; ++round) {
    const double low = round == 0 ? lowest : highest, high = round == 0 ? highest : kFaster * highest;
    for (int shifts = 0; shifts < (round == 0 ? kMost : kMost / 2);) {
      const int until = shifts == 0 && round == 0 ? kFirst : shifts + 2;
      std::vector<double> next;
      for (; shifts < until; ++shifts) next.push_back(low * std::pow(high / low, spread(shifts)));
      for (Krylov& part : krylov)
        for (const MatrixXd& responses : part.solve(next)) part.basis().add(responses);
      for (std::size_t k = 0; k < krylov.size(); ++k) whole[k] = krylov[k].projection(start.is_insulated);
      if (relative_bound(section, whole, start.reference) < 0.1 * tolerance) return whole;
    }
  }
  return whole;
}

/// 2. Balanced directions of one part, the strongest first. The surroundings' channel, slow and smooth, counts a tenth
/// of a TCA's. The mode of an insulated section as a whole is kept as it is: it would hide all others.
class Balanced {
 public:
  Balanced(const HeatPart& part, const Projection& whole, const Start& start, bool is_graded)
      : whole_(whole), is_graded_(is_graded) {
    const Index n = whole.rate.size(), m = n - (is_graded ? 1 : 0);
    const VectorXd rate = whole.rate.tail(m);
    const MatrixXd load = whole.load.bottomRows(m);
    MatrixXd scaled = load * part.copies[0].channels;
    const Index tcas = scaled.cols() - 1;
    scaled.rightCols(1) *= 0.1 * std::sqrt(start.rise.head(tcas).maxCoeff() / start.rise[tcas]);
    MatrixXd gramian = scaled * scaled.transpose();
    for (Index l = 0; l < m; ++l)
      for (Index k = 0; k < m; ++k) gramian(k, l) /= std::sqrt(rate[k] * rate[l]) * (rate[k] + rate[l]);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> balanced(gramian);
    strength = balanced.eigenvalues().reverse();
    directions_ = rate.cwiseSqrt().cwiseInverse().asDiagonal() * balanced.eigenvectors().rowwise().reverse();
    steady_ = rate.cwiseInverse().asDiagonal() * load;
  }

  /// The projection on the steady responses and the first `count` directions.
  Projection truncated(Index count) const {
    const Index n = whole_.rate.size();
    Basis small(n);
    if (is_graded_) small.add(MatrixXd::Identity(n, 1));
    small.add(with_kept(steady_));
    small.add(with_kept(directions_.leftCols(count)));
    return project(whole_, small.columns(), is_graded_);
  }

  VectorXd strength;

 private:
  MatrixXd with_kept(const MatrixXd& columns) const {
    MatrixXd result = MatrixXd::Zero(whole_.rate.size(), columns.cols());
    result.bottomRows(columns.rows()) = columns;
    return result;
  }

  const Projection& whole_;
  bool is_graded_;
  MatrixXd directions_, steady_;
};

/// 3. The fewest directions that keep the bound; directions of equal strength (symmetry) stay together.
std::vector<Projection> fewest(const HeatSection& section, std::span<const Balanced> balanced,
                               const VectorXd& reference, double tolerance) {
  struct Direction {
    double strength;
    std::size_t part;
  };
  std::vector<Direction> ranked;
  for (std::size_t k = 0; k < balanced.size(); ++k)
    for (const double strength : balanced[k].strength) ranked.push_back({strength, k});
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Direction& a, const Direction& b) { return a.strength > b.strength; });
  std::vector<std::size_t> cuts;
  for (std::size_t r = 1; r < ranked.size(); ++r)
    if (ranked[r].strength < (1.0 - 1e-5) * ranked[r - 1].strength) cuts.push_back(r);
  cuts.push_back(ranked.size());
  const auto truncated = [&](std::size_t cut) {
    std::vector<Index> counts(balanced.size(), 0);
    for (std::size_t r = 0; r < cut; ++r) ++counts[ranked[r].part];
    std::vector<Projection> result;
    for (std::size_t k = 0; k < balanced.size(); ++k) result.push_back(balanced[k].truncated(counts[k]));
    return result;
  };
  std::size_t low = 0, high = cuts.size() - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (relative_bound(section, truncated(cuts[middle]), reference) <= tolerance) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return truncated(cuts[low]);
}

/// Modes of all copies of all parts, the slowest first. `lifted`: mass-orthonormal modes of each part.
void collect_modes(const HeatSection& section, std::span<const Krylov> krylov, std::span<const Projection> kept,
                   std::span<const MatrixXd> lifted, ModalModel& model) {
  struct Mode {
    double rate;
    std::size_t part, copy;
    Index index;
  };
  std::vector<Mode> modes;
  for (std::size_t k = 0; k < kept.size(); ++k)
    for (Index index = 0; index < kept[k].rate.size(); ++index)
      for (std::size_t copy = 0; copy < section.parts[k].copies.size(); ++copy)
        modes.push_back({kept[k].rate[index], k, copy, index});
  std::stable_sort(modes.begin(), modes.end(), [](const Mode& a, const Mode& b) { return a.rate < b.rate; });
  const auto size = static_cast<Index>(modes.size());
  model.rate.resize(size);
  model.load.resize(size, section.tcas + 1);
  model.capacity = VectorXd::Zero(size);
  model.probe.resize(section.probes, size);
  for (Index i = 0; i < size; ++i) {
    const Mode& mode = modes[static_cast<std::size_t>(i)];
    const HeatPart& part = section.parts[mode.part];
    const HeatPart::Copy& copy = part.copies[mode.copy];
    const VectorXd& root = krylov[mode.part].root();
    const auto shape = lifted[mode.part].col(mode.index);
    model.rate[i] = mode.rate;
    model.load.row(i) = kept[mode.part].load.row(mode.index) * copy.channels;
    if (part.has_surface) model.capacity[i] = copy.channels(copy.channels.rows() - 1, section.tcas) * shape.dot(root);
    model.probe.col(i) = copy.probes * shape.cwiseQuotient(root);
  }
}

}  // namespace

ModalModel reduced(const HeatSection& section, double tolerance) {
  std::vector<Krylov> krylov;
  krylov.reserve(section.parts.size());
  for (const HeatPart& part : section.parts) krylov.emplace_back(part);
  const Start origin = start(section, krylov);
  const std::vector<Projection> whole = krylov_spaces(section, krylov, origin, tolerance);
  std::vector<Balanced> balanced;
  balanced.reserve(whole.size());
  for (std::size_t k = 0; k < whole.size(); ++k)
    balanced.emplace_back(section.parts[k], whole[k], origin, krylov[k].is_graded(origin.is_insulated));
  const std::vector<Projection> kept = fewest(section, balanced, origin.reference, tolerance);

  ModalModel model;
  std::vector<MatrixXd> lifted;
  for (std::size_t k = 0; k < kept.size(); ++k)
    lifted.push_back(krylov[k].basis().columns() * (whole[k].vectors * kept[k].vectors));
  collect_modes(section, krylov, kept, lifted, model);
  model.peak = Peak(section.probe_patches, static_cast<int>(section.probes), section.order);
  const VectorXd norms = residual_norms(section, kept);
  model.step_bound = norms.head(section.tcas) * norms.transpose();
  model.reference = origin.reference;
  model.bound = relative_bound(section, kept, origin.reference);
  model.surface_conductance = section.surface_conductance;
  return model;
}

ModalModel reduced(const HeatMatrices& matrices, double tolerance) { return reduced(undivided(matrices), tolerance); }

}  // namespace thermal
