#include "mesh/resolution.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/insulated.hpp"
#include "mesh/symmetric_factor.hpp"

namespace thermal {
namespace {

using Eigen::MatrixXd;

constexpr std::array<double, 3> kFrequencies{1e2, 1e4, 1e5};  // of dynamic responses, in units of the slowest rate

/// What responses of all orders are measured in. One order's own response as its unit would hide that response's error.
struct Units {
  double rise = 0.0;     // reference rise of the TCA that heats most [K/W]
  double slowest = 0.0;  // rate [1/s]
  bool is_insulated = false;
};

Units units_of(const HeatMatrices& m) {
  Units units;
  SymmetricFactor factor(m.stiffness);
  factor.factor();
  const Eigen::Index tcas = m.tcas();
  const MatrixXd steady = m.loads.transpose() * factor.solve(m.loads.leftCols(tcas));
  Eigen::Index hottest = 0;
  const double rise = steady.topRows(tcas).diagonal().maxCoeff(&hottest);
  const double above = rise - steady(tcas, hottest) / m.surface_conductance;
  units.is_insulated = is_insulated(rise, above);
  units.rise = units.is_insulated
                   ? kSurfaceShare * (m.loads.leftCols(tcas).transpose() * rises_above_surface(m)).diagonal().maxCoeff()
                   : reference_rise(rise, above);
  units.slowest = 1.0 / (units.rise * m.mass.sum());
  return units;
}

/// The TCAs' part of loads' (stiffness + s mass)^-1 loads, (TCAs) x (TCAs, surroundings), in the reference rise.
class Response {
 public:
  Response(const HeatMatrices& matrices, const Units& units)
      : m_(matrices), units_(units), loads_(matrices.loads), factor_(matrices.stiffness) {
    loads_.col(m_.tcas()) *= std::sqrt(units.rise / m_.surface_conductance);  // so that it counts like a TCA's
  }

  /// An insulated section's is not compared: 1/(h S) whatever the mesh.
  MatrixXd steady() { return units_.is_insulated ? MatrixXd::Zero(m_.tcas(), loads_.cols()).eval() : at(0.0); }

  /// Those of all frequencies, side by side.
  MatrixXd dynamic() {
    const Eigen::Index channels = loads_.cols();
    MatrixXd all(m_.tcas(), channels * static_cast<Eigen::Index>(kFrequencies.size()));
    for (std::size_t k = 0; k < kFrequencies.size(); ++k)
      all.middleCols(static_cast<Eigen::Index>(k) * channels, channels) = at(kFrequencies[k] * units_.slowest);
    return all;
  }

 private:
  MatrixXd at(double s) {
    factor_.factor(s * m_.mass);
    return m_.loads.leftCols(m_.tcas()).transpose() * factor_.solve(loads_) / units_.rise;
  }

  const HeatMatrices& m_;
  const Units& units_;
  MatrixXd loads_;
  SymmetricFactor factor_;
};

/// Changes of a response from order to order, taken for a geometric series.
class Changes {
 public:
  void add(MatrixXd response) {
    const double change = last_.size() > 0 ? (response - last_).cwiseAbs().maxCoeff() : 0.0;
    ratio_ = change_ > 0.0 ? std::min(kSlowest, change / change_) : kFirst;
    least_ = change_ > 0.0 ? kLeast : kFirst;
    change_ = change;
    last_ = std::move(response);
  }
  double error_before() const { return change_ / (1.0 - ratio_); }
  double error() const { return error(ratio_); }
  double cautious_error() const { return error(std::max(ratio_, least_)); }

 private:
  // Ratio of a change to the one before it: of the first change; the least that later ones are expected to be, since
  // where walls are thin it is 0.1 at order 4 and 0.4 at order 5; the largest that is taken.
  static constexpr double kFirst = 0.3, kLeast = 0.4, kSlowest = 0.95;

  double error(double ratio) const { return change_ * ratio / (1.0 - ratio); }

  MatrixXd last_;
  double change_ = 0.0, ratio_ = kFirst, least_ = kFirst;
};

}  // namespace

core::Result<HeatMatrices> resolved_matrices(const Parameters& parameters) {
  core::Result<HeatMatrices> coarser;
  Units units;
  Changes steady, dynamic;
  for (int order = kLeastOrder - 1;; ++order) {
    core::Result<HeatMatrices> here = heat_matrices(parameters, order);
    if (!here.status.is_ok()) return here;
    if (order < kLeastOrder) units = units_of(here.value);
    here.value.is_insulated = units.is_insulated;
    Response response(here.value, units);
    steady.add(response.steady());
    if (order > kLeastOrder) {
      coarser.value.error = std::max(steady.error_before(), dynamic.error());
      if (coarser.value.error <= parameters.tolerance) return coarser;
    }
    dynamic.add(response.dynamic());
    here.value.error = std::max(steady.cautious_error(), dynamic.error());
    if (order >= kLeastOrder && (here.value.error <= parameters.tolerance || order == kHighestOrder)) return here;
    coarser = std::move(here);
  }
}

}  // namespace thermal
