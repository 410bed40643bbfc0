#include "mesh/resolution.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/insulated.hpp"

namespace thermal {
namespace {

using Eigen::MatrixXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

constexpr std::array<double, 4> kFrequencies{0.0, 1e2, 1e4, 1e5};  // in units of the slowest rate
using Responses = std::array<MatrixXd, kFrequencies.size()>;

/// loads' (stiffness + s mass)^-1 loads, in units of the reference rise of the TCA that heats most. An insulated
/// section is not compared at s = 0, where the response is 1/(h S) whatever the mesh.
Responses responses(HeatMatrices& m) {
  MatrixXd loads = m.loads;
  Responses result;
  double steady_rise = 0.0, slowest = 0.0;
  Eigen::SimplicialLDLT<SparseMatrix> factor;
  factor.analyzePattern(m.stiffness);
  SparseMatrix shifted = m.stiffness;
  for (std::size_t k = 0; k < kFrequencies.size(); ++k) {
    shifted = m.stiffness;
    shifted.diagonal() += kFrequencies[k] * slowest * m.mass;
    factor.factorize(shifted);
    result[k] = loads.transpose() * factor.solve(loads);
    if (k == 0) {
      Eigen::Index hottest = 0;
      steady_rise = result[0].diagonal().head(kTcas).maxCoeff(&hottest);
      const double above = steady_rise - result[0](kChannels - 1, hottest) / m.surface_conductance;
      if (is_insulated(steady_rise, above)) {
        result[0].setZero();
        m.is_insulated = true;
        steady_rise =
            kSurfaceShare * (m.loads.leftCols(kTcas).transpose() * rises_above_surface(m)).diagonal().maxCoeff();
      } else {
        steady_rise = reference_rise(steady_rise, above);
      }
      slowest = 1.0 / (steady_rise * m.mass.sum());
      // The surroundings' channel so that its own response counts like a TCA's.
      result[0].row(kChannels - 1) *= std::sqrt(steady_rise / m.surface_conductance);
      result[0].col(kChannels - 1) *= std::sqrt(steady_rise / m.surface_conductance);
      loads.col(kChannels - 1) *= std::sqrt(steady_rise / m.surface_conductance);
    }
  }
  for (MatrixXd& each : result) each /= steady_rise;
  return result;
}

double change(const Responses& a, const Responses& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    largest = std::max(largest, (a[k] - b[k]).topRows(kTcas).cwiseAbs().maxCoeff());
  }
  return largest;
}

}  // namespace

core::Result<HeatMatrices> resolved_matrices(const Parameters& parameters) {
  core::Result<HeatMatrices> coarsest = heat_matrices(parameters, kLeastOrder - 1);
  if (!coarsest.status.is_ok()) return coarsest;
  Responses before = responses(coarsest.value);
  double ratio = 0.1;  // of changes from order to order, until two are known; typical
  double change_before = 0.0;
  for (int order = kLeastOrder;; ++order) {
    core::Result<HeatMatrices> matrices = heat_matrices(parameters, order);
    if (!matrices.status.is_ok()) return matrices;
    Responses here = responses(matrices.value);
    const double change_here = change(here, before);
    if (change_before > 0.0) ratio = std::min(0.95, change_here / change_before);
    const double changes_to_come = change_here * ratio / (1.0 - ratio);  // geometric series
    if (changes_to_come <= parameters.tolerance || order == kHighestOrder) {
      matrices.value.error = changes_to_come;
      return matrices;
    }
    before = std::move(here);
    change_before = change_here;
  }
}

}  // namespace thermal
