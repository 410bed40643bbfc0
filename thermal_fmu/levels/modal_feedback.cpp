// A step of ModalLevel with feedback: powers that depend on the temperatures they make, found at the points of a
// collocation; the step is halved where they do not settle or are not resolved.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "levels/modal_level.hpp"
#include "mesh/spectral.hpp"

namespace thermal {
namespace {

using core::value;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kMostParts = 20000;        // parts of a step with feedback: bounds the work of a call to about a second
constexpr int kIterations = 60;          // of the powers, at most
constexpr int kNewtonIterations = 20;    // the same
constexpr double kSame = 1e-14;          // relative change at which the powers are settled
constexpr double kSameByNewton = 1e-12;  // the same where rounding is amplified by steep powers
constexpr double kSameRise = 1e-12;  // change [K] at which the effective surroundings are settled, of 1 K and theirs

/// The points of a step with feedback, in units of its length, and what is read off the values there.
struct Points {
  std::array<double, kPowerTerms> at{};
  Eigen::Matrix<double, kPowerTerms, kPowerTerms> derivatives;  // (q, n): q-th derivative at the start by value at n
  Eigen::Matrix<double, kPowerTerms, 1> finest;                 // the interpolant's highest Legendre coefficient

  Points() {
    const LobattoRule rule = lobatto_rule(kPowerTerms - 1);
    MatrixXd power = MatrixXd::Identity(kPowerTerms, kPowerTerms);
    for (int q = 0; q < kPowerTerms; ++q) {
      derivatives.row(q) = power.row(0);
      power = power * (2.0 * rule.derivative);
      at[q] = 0.5 * (1.0 + rule.nodes[q]);
    }
    // At Lobatto points P_p(x_n)^2 = 2 / (p (p + 1) w_n); signs alternate; the discrete norm of P_p is 2/p.
    constexpr int p = kPowerTerms - 1;
    for (int n = 0; n <= p; ++n) {
      const double legendre = ((p - n) % 2 == 0 ? 1.0 : -1.0) * std::sqrt(2.0 / (p * (p + 1) * rule.weights[n]));
      finest[n] = 0.5 * p * rule.weights[n] * legendre;
    }
  }
};
const Points& points() {
  static const Points instance;
  return instance;
}

}  // namespace

template <int tcas>
auto ModalLevel<tcas>::collocation(double h, int depth) -> Collocation& {
  const Index n_rows = rows();
  Collocation& c = collocations_[depth];
  if (c.h == h) return c;
  c.h = h;
  c.response.setZero();
  for (int m = 1; m < kPoints; ++m) {
    Carrier& carrier = c.carriers[m];
    carrier.prepare(model_.rate, points().at[m] * h);
    for (Index k = 0; k < model_.size(); ++k) {
      for (int n = 0; n < kPoints; ++n) {
        double weight = 0.0, scale = 1.0;
        for (int q = 0; q < kPowerTerms; ++q, scale /= h) {
          weight += carrier.weight(k, q) * points().derivatives(q, n) * scale;
        }
        for (Index i = 0; i < n_rows; ++i)
          for (Index j = 0; j < n_rows; ++j)
            c.response(i + n_rows * m, j + n_rows * n) += load_(k, i) * load_(k, j) * weight;
      }
    }
  }
  return c;
}

template <int tcas>
bool ModalLevel<tcas>::solve_powers(const State& state, const Drive& drive, double from, const Forcing& ambient,
                                    const Collocation& c, double tolerance) {
  const Index n_tcas = count(), n_rows = rows();
  // Rises without the TCAs' power, at every point.
  for (int m = 0; m < kPoints; ++m) {
    z_ = state.z;
    if (m > 0) {
      z_.array() *= c.carriers[m].decay.array();
      for (int q = 0; q < 4; ++q) {
        z_.array() += ambient(n_tcas, q) * c.carriers[m].weight.col(q).array() * load_.col(n_tcas).array();
      }
    }
    for (Index i = 0; i < n_rows; ++i) base_rises_[i + n_rows * m] = load_.col(i).dot(z_);
  }
  for (int m = 0; m < kPoints; ++m) {
    const double s = from + points().at[m] * c.h;
    for (Index i = 0; i < n_tcas; ++i) {
      v2_(i, m) = std::pow(value(drive.V[i], s), 2);
      delta_(i, m) = value(drive.delta[i], s);
    }
  }
  if (!settle_by_iteration(drive, from, c) && !settle_by_newton(drive, from, c)) return false;
  // Does degree 6 resolve the conductances? What its last term may do to a temperature by the end of the step.
  for (Index i = 0; i < n_tcas; ++i) {
    const double rough = std::abs(conductances_.row(i).dot(points().finest)) * v2_.row(i).maxCoeff();
    const double gain = c.response.row(i + n_rows * (kPoints - 1)).cwiseAbs().sum();
    if (!(rough * gain <= 0.1 * tolerance * (1.0 + std::abs(rises_(i, kPoints - 1))))) return false;
  }
  if (!has_varying_convection()) return true;
  // A kelvin of the surroundings, held, is at most a kelvin of any temperature.
  const double rough = std::abs(powers_.row(n_tcas).dot(points().finest));
  return rough <= 0.1 * tolerance * (1.0 + rises_.topRows(n_tcas).cwiseAbs().maxCoeff());
}

/// Takes the rises at all points as they are at the first.
template <int tcas>
void ModalLevel<tcas>::hold_rises() {
  for (Index i = 0; i < rows(); ++i) rises_.row(i).setConstant(base_rises_[i]);
}

/// Writes powers and conductances that belong to the rises, and how far the powers moved. False where a resistance is
/// not positive.
template <int tcas>
bool ModalLevel<tcas>::update_powers(const Drive& drive, double from, double h, Settling& settling) {
  settling = {};
  for (int m = 0; m < kPoints; ++m)
    for (Index i = 0; i < count(); ++i) {
      const double resistance = circuit_.resistance(i, rises_(i, m), delta_(i, m));
      if (!(resistance > 0.0)) return false;
      conductances_(i, m) = 1.0 / resistance;
      const double power = v2_(i, m) / resistance;
      settling.change = std::max(settling.change, std::abs(power - powers_(i, m)));
      settling.largest = std::max(settling.largest, power);
      powers_(i, m) = power;
    }
  settling.has_same_surroundings = !has_varying_convection() || update_surroundings(drive, from, h);
  return true;
}

template <int tcas>
bool ModalLevel<tcas>::settle_by_iteration(const Drive& drive, double from, const Collocation& c) {
  hold_rises();
  Eigen::Map<Values> flat_rises(rises_.data(), rows() * kPoints);
  const Eigen::Map<const Values> flat_powers(powers_.data(), rows() * kPoints);
  Settling settling;
  bool has_settled = false;
  for (int iteration = 0; iteration < kIterations && !has_settled; ++iteration) {
    if (!update_powers(drive, from, c.h, settling)) return false;
    has_settled = iteration > 0 && settling.is_within(kSame);
    flat_rises = base_rises_;
    flat_rises.noalias() += c.response * flat_powers;
  }
  return has_settled;
}

/// Newton's method for the rises, where powers that fall steeply with the temperature make the iteration diverge. The
/// surroundings, whose feedback is weak, are iterated along.
template <int tcas>
bool ModalLevel<tcas>::settle_by_newton(const Drive& drive, double from, const Collocation& c) {
  hold_rises();
  Eigen::Map<Values> flat_rises(rises_.data(), rows() * kPoints);
  const Eigen::Map<const Values> flat_powers(powers_.data(), rows() * kPoints);
  Settling settling;
  for (int iteration = 0; iteration < kNewtonIterations; ++iteration) {
    if (!update_powers(drive, from, c.h, settling)) return false;
    if (iteration > 0 && settling.is_within(kSameByNewton)) return true;
    slopes_ = c.response;
    for (int m = 0; m < kPoints; ++m)
      for (Index i = 0; i < rows(); ++i)
        slopes_.col(i + rows() * m) *=
            i < count() ? powers_(i, m) * conductances_(i, m) * circuit_.resistance_per_kelvin(i) : 0.0;
    slopes_.diagonal().array() += 1.0;
    residual_ = base_rises_ - flat_rises;
    residual_.noalias() += c.response * flat_powers;
    newton_.compute(slopes_);
    flat_rises += newton_.solve(residual_);
  }
  return false;
}

/// Writes what the effective surroundings have more than the true ones, at every point. True where that has settled.
template <int tcas>
bool ModalLevel<tcas>::update_surroundings(const Drive& drive, double from, double h) {
  const Index row = count();
  double change = 0.0, largest = 0.0;
  for (int m = 0; m < kPoints; ++m) {
    const double s = from + points().at[m] * h, ambient = value(drive.ambient_rise, s);
    const double surface = rises_(row, m) / model_.surface_conductance;
    const double more = effective_ambient(surface, ambient, value(drive.air_speed, s)) - ambient;
    change = std::max(change, std::abs(more - powers_(row, m)));
    largest = std::max(largest, std::abs(more));
    powers_(row, m) = more;
  }
  return change <= kSameRise * (1.0 + largest);
}

template <int tcas>
Status ModalLevel<tcas>::advance_with_feedback(State& state, const Drive& drive, double from, double h,
                                               double tolerance, int depth) {
  const Index n_tcas = count();
  const Collocation& c = collocation(h, depth);
  Forcing forcing = Forcing::Zero(channels(), kPowerTerms);
  const Cubic ambient = core::shifted(drive.ambient_rise, from);
  for (int q = 0; q < 4; ++q) forcing(n_tcas, q) = ambient[q];
  if (solve_powers(state, drive, from, forcing, c, tolerance)) {
    double scale = 1.0;
    for (int q = 0; q < kPowerTerms; ++q, scale /= h) {
      if constexpr (kIsFixed)
        forcing.col(q).template head<tcas>(n_tcas) = scale * (powers_ * points().derivatives.row(q).transpose());
      else
        forcing.col(q).head(rows()) += scale * (powers_ * points().derivatives.row(q).transpose());
    }
    carry(state, c.carriers[kPoints - 1], forcing);
    return {};
  }
  if (depth == kMostHalvings || ++parts_ > kMostParts) {
    PerTca rise{}, delta{};
    for (Index i = 0; i < n_tcas; ++i) {
      rise[i] = load_.col(i).dot(state.z);
      delta[i] = value(drive.delta[i], from + h);
    }
    if (Status status = circuit_.explain(rise, delta); !status.is_ok()) return std::move(status).as_error();
    if (depth < kMostHalvings)
      return Status::discard("the step needs more than " + std::to_string(kMostParts) + " parts",
                             "take shorter steps, or loosen tolerance");
    return Status::discard("parts of 2^-" + std::to_string(kMostHalvings) +
                               " of the step do not resolve how fast powers and temperatures change",
                           "take shorter steps, or reduce tca.alpha_T, tca.beta or the voltages");
  }
  Status status = advance_with_feedback(state, drive, from, 0.5 * h, tolerance, depth + 1);
  if (!status.is_ok()) return status;
  return advance_with_feedback(state, drive, from + 0.5 * h, 0.5 * h, tolerance, depth + 1);
}

// The class is instantiated in modal_level.cpp, which does not see the members of this file.
constexpr int kDefault = static_cast<int>(core::kDefaultTcas);
template auto ModalLevel<kDefault>::collocation(double, int) -> Collocation&;
template bool ModalLevel<kDefault>::solve_powers(const State&, const Drive&, double, const Forcing&, const Collocation&,
                                                 double);
template void ModalLevel<kDefault>::hold_rises();
template bool ModalLevel<kDefault>::update_powers(const Drive&, double, double, Settling&);
template bool ModalLevel<kDefault>::settle_by_iteration(const Drive&, double, const Collocation&);
template bool ModalLevel<kDefault>::settle_by_newton(const Drive&, double, const Collocation&);
template bool ModalLevel<kDefault>::update_surroundings(const Drive&, double, double);
template Status ModalLevel<kDefault>::advance_with_feedback(State&, const Drive&, double, double, double, int);

template auto ModalLevel<Eigen::Dynamic>::collocation(double, int) -> Collocation&;
template bool ModalLevel<Eigen::Dynamic>::solve_powers(const State&, const Drive&, double, const Forcing&,
                                                       const Collocation&, double);
template void ModalLevel<Eigen::Dynamic>::hold_rises();
template bool ModalLevel<Eigen::Dynamic>::update_powers(const Drive&, double, double, Settling&);
template bool ModalLevel<Eigen::Dynamic>::settle_by_iteration(const Drive&, double, const Collocation&);
template bool ModalLevel<Eigen::Dynamic>::settle_by_newton(const Drive&, double, const Collocation&);
template bool ModalLevel<Eigen::Dynamic>::update_surroundings(const Drive&, double, double);
template Status ModalLevel<Eigen::Dynamic>::advance_with_feedback(State&, const Drive&, double, double, double, int);

}  // namespace thermal
