#include "levels/modal_level.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "levels/phi.hpp"
#include "mesh/spectral.hpp"

namespace thermal {
namespace {

using core::value;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kDeepest = 24;         // halvings of a step with feedback
constexpr int kMostParts = 20000;    // parts of a step with feedback: bounds the work of a call to about a second
constexpr double kHottest = 1e6;     // rise [K] beyond which a host's integration is taken to have diverged
constexpr int kIterations = 60;      // of the powers, at most
constexpr double kSame = 1e-14;      // relative change at which the powers are settled
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
ModalLevel<tcas>::ModalLevel(ModalModel model, const Parameters& parameters)
    : model_(std::move(model)),
      load_(model_.load),
      unit_(model_.capacity.norm()),
      circuit_(parameters),
      convection_(parameters),
      T_0_(parameters.T_0),
      powers_(rows(), kPoints),
      rises_(rows(), kPoints),
      conductances_(count(), kPoints),
      base_rises_(rows() * kPoints),
      z_(model_.size()),
      probed_(VectorXd::Constant(model_.size(), std::numeric_limits<double>::quiet_NaN())),
      probes_(model_.probe.rows()) {
  carrier_ = make_carrier();
  retune(parameters);
}

template <int tcas>
auto ModalLevel<tcas>::make_carrier() const -> Carrier {
  return {-1.0, VectorXd(model_.size()), Weights(model_.size(), kPowerTerms)};
}

template <int tcas>
void ModalLevel<tcas>::retune(const Parameters& parameters) {
  circuit_ = Circuit(parameters);
  if (!has_feedback() || !collocations_.empty()) return;
  collocations_.resize(kDeepest + 1);
  for (Collocation& c : collocations_) {
    for (Carrier& carrier : c.carriers) carrier = make_carrier();
    c.response.resize(rows() * kPoints, rows() * kPoints);
  }
}

template <int tcas>
void ModalLevel<tcas>::Carrier::prepare(const VectorXd& rate, double step) {
  if (h == step) return;
  h = step;
  for (Index k = 0; k < rate.size(); ++k) {
    const auto f = phi<kPowerTerms>(rate[k] * h);
    decay[k] = f[0];
    double scale = h;
    for (int q = 0; q < kPowerTerms; ++q, scale *= h) weight(k, q) = scale * f[q + 1];
  }
}

template <int tcas>
auto ModalLevel<tcas>::state_of(std::span<double> memory) const -> State {
  const Index n = model_.size();
  return {Eigen::Map<VectorXd>(memory.data(), n), Eigen::Map<Channels>(memory.data() + n, channels()),
          Eigen::Map<Channels>(memory.data() + n + channels(), channels())};
}

template <int tcas>
void ModalLevel<tcas>::carry(State& state, const Carrier& carrier, const Forcing& forcing) {
  state.z.array() *= carrier.decay.array();
  for (int q = 0; q < kPowerTerms; ++q) {
    if ((forcing.col(q).array() == 0.0).all()) continue;
    z_.noalias() = load_ * forcing.col(q);
    state.z.array() += carrier.weight.col(q).array() * z_.array();
  }
  for (Index c = 0; c < channels(); ++c) {
    std::array<double, kPowerTerms> derivatives;
    for (int q = 0; q < kPowerTerms; ++q) derivatives[q] = forcing(c, q);
    state.travel[c] += std::abs(forcing(c, 0) - state.last[c]) + variation(derivatives, carrier.h);
    state.last[c] = value(derivatives, carrier.h);
  }
}

template <int tcas>
Status ModalLevel<tcas>::advance(std::span<double> memory, const Drive& drive, double h, double tolerance) {
  const Index n_tcas = count();
  State state = state_of(memory);
  if (has_feedback()) {
    parts_ = 0;
    return advance_with_feedback(state, drive, 0.0, h, tolerance, 0);
  }
  Forcing forcing = Forcing::Zero(channels(), kPowerTerms);
  for (Index i = 0; i < n_tcas; ++i) {
    double power_of_1_volt = 0.0;
    if (Status status = circuit_.power(i, 1.0, 0.0, 0.0, power_of_1_volt); !status.is_ok())
      return std::move(status).as_error();
    const Sextic v2 = square(drive.V[i]);
    for (int q = 0; q < kPowerTerms; ++q) forcing(i, q) = v2[q] * power_of_1_volt;
  }
  for (int q = 0; q < 4; ++q) forcing(n_tcas, q) = drive.ambient_rise[q];
  carrier_.prepare(model_.rate, h);
  carry(state, carrier_, forcing);
  return {};
}

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
  AtPoints v2(n_tcas, kPoints), delta(n_tcas, kPoints);
  for (int m = 0; m < kPoints; ++m) {
    const double s = from + points().at[m] * c.h;
    for (Index i = 0; i < n_tcas; ++i) {
      v2(i, m) = std::pow(value(drive.V[i], s), 2);
      delta(i, m) = value(drive.delta[i], s);
      rises_(i, m) = base_rises_[i];
    }
    if (has_varying_convection()) rises_(n_tcas, m) = base_rises_[n_tcas];
  }
  bool has_settled = false;
  for (int iteration = 0; iteration < kIterations && !has_settled; ++iteration) {
    double change = 0.0, largest = 0.0;
    for (int m = 0; m < kPoints; ++m)
      for (Index i = 0; i < n_tcas; ++i) {
        const double resistance = circuit_.resistance(i, rises_(i, m), delta(i, m));
        if (!(resistance > 0.0)) return false;
        conductances_(i, m) = 1.0 / resistance;
        const double power = v2(i, m) / resistance;
        if (iteration > 0) change = std::max(change, std::abs(power - powers_(i, m)));
        largest = std::max(largest, power);
        powers_(i, m) = power;
      }
    has_settled = iteration > 0 && change <= kSame * largest;
    if (has_varying_convection()) has_settled = update_surroundings(drive, from, c.h) && has_settled && iteration > 0;
    Eigen::Map<Values> flat_rises(rises_.data(), n_rows * kPoints);
    Eigen::Map<const Values> flat_powers(powers_.data(), n_rows * kPoints);
    flat_rises = base_rises_;
    flat_rises.noalias() += c.response * flat_powers;
  }
  if (!has_settled) return false;
  // Does degree 6 resolve the conductances? What its last term may do to a temperature by the end of the step.
  for (Index i = 0; i < n_tcas; ++i) {
    const double rough = std::abs(conductances_.row(i).dot(points().finest)) * v2.row(i).maxCoeff();
    const double gain = c.response.row(i + n_rows * (kPoints - 1)).cwiseAbs().sum();
    if (!(rough * gain <= 0.1 * tolerance * (1.0 + std::abs(rises_(i, kPoints - 1))))) return false;
  }
  if (!has_varying_convection()) return true;
  // A kelvin of the surroundings, held, is at most a kelvin of any temperature.
  const double rough = std::abs(powers_.row(n_tcas).dot(points().finest));
  return rough <= 0.1 * tolerance * (1.0 + rises_.topRows(n_tcas).cwiseAbs().maxCoeff());
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
double ModalLevel<tcas>::effective_ambient(double surface_rise, double ambient_rise, double speed) const {
  if (!has_varying_convection()) return ambient_rise;
  const double h = convection_.coefficient(T_0_ + surface_rise, T_0_ + ambient_rise, speed);
  return ambient_rise + (h / convection_.reference() - 1.0) * (ambient_rise - surface_rise);
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
  if (depth == kDeepest || ++parts_ > kMostParts) {
    PerTca rise{}, delta{};
    for (Index i = 0; i < n_tcas; ++i) {
      rise[i] = load_.col(i).dot(state.z);
      delta[i] = value(drive.delta[i], from + h);
    }
    if (Status status = circuit_.explain(rise, delta); !status.is_ok()) return std::move(status).as_error();
    if (depth < kDeepest)
      return Status::discard("the step needs more than " + std::to_string(kMostParts) + " parts",
                             "take shorter steps, or loosen tolerance");
    return Status::discard("powers and temperatures do not settle however short the step",
                           "take shorter steps, or reduce tca.alpha_T, tca.beta or the voltages");
  }
  Status status = advance_with_feedback(state, drive, from, 0.5 * h, tolerance, depth + 1);
  if (!status.is_ok()) return status;
  return advance_with_feedback(state, drive, from + 0.5 * h, 0.5 * h, tolerance, depth + 1);
}

template <int tcas>
Status ModalLevel<tcas>::inputs(const Eigen::Ref<const VectorXd>& z, const Drive& drive, Channels& input) const {
  const Index n_tcas = count();
  for (Index i = 0; i < n_tcas; ++i) {
    Status status = circuit_.power(i, drive.V[i][0], load_.col(i).dot(z), drive.delta[i][0], input[i]);
    if (!status.is_ok()) return status;
  }
  const double surface = has_varying_convection() ? load_.col(n_tcas).dot(z) / model_.surface_conductance : 0.0;
  input[n_tcas] = effective_ambient(surface, drive.ambient_rise[0], drive.air_speed[0]);
  return {};
}

template <int tcas>
void ModalLevel<tcas>::get_amplitudes(std::span<const double> memory, std::span<double> x) const {
  for (Index k = 0; k < model_.size(); ++k) x[k] = memory[k] / unit_;
}

template <int tcas>
void ModalLevel<tcas>::set_amplitudes(std::span<double> memory, std::span<const double> x) const {
  for (Index k = 0; k < model_.size(); ++k) memory[k] = x[k] * unit_;
}

/// A host's explicit method with too long a step oscillates below absolute zero and beyond kHottest.
template <int tcas>
Status ModalLevel<tcas>::check_amplitudes(std::span<const double> memory) const {
  const Index n_tcas = count();
  const Eigen::Map<const VectorXd> z(memory.data(), model_.size());
  for (Index i = 0; i < n_tcas; ++i) {
    const double rise = load_.col(i).dot(z);
    if (rise >= -T_0_ && rise <= kHottest) continue;
    return Status::discard("T[" + std::to_string(i + 1) + "] = " + std::to_string(T_0_ + rise) +
                               " K, allowed is 0 to " + std::to_string(T_0_ + kHottest) + " K",
                           "the host's integration has diverged: take shorter steps or a method for stiff equations");
  }
  return {};
}

template <int tcas>
Status ModalLevel<tcas>::rates(std::span<const double> memory, const Drive& drive, std::span<double> dx) {
  const Index n = model_.size();
  const Eigen::Map<const VectorXd> z(memory.data(), n);
  Channels input(channels());
  if (Status status = inputs(z, drive, input); !status.is_ok()) return status;
  if (Status status = check_amplitudes(memory); !status.is_ok()) return status;
  Eigen::Map<VectorXd>(dx.data(), n) = (load_ * input - model_.rate.cwiseProduct(z)) / unit_;
  return {};
}

template <int tcas>
Status ModalLevel<tcas>::note_powers(std::span<double> memory, const Drive& drive) {
  const Index n = model_.size();
  Channels now(channels());
  if (Status status = inputs(Eigen::Map<const VectorXd>(memory.data(), n), drive, now); !status.is_ok()) return status;
  Eigen::Map<Channels> last(memory.data() + n, channels()), travel(memory.data() + n + channels(), channels());
  travel += (now - last).cwiseAbs();
  last = now;
  return {};
}

template <int tcas>
Status ModalLevel<tcas>::observe(std::span<const double> memory, const Drive& drive, Observation& seen) {
  const Index n_tcas = count();
  const Index n = model_.size();
  const Eigen::Map<const VectorXd> z(memory.data(), n);
  const Eigen::Map<const Channels> travel(memory.data() + n + channels(), channels());
  Channels input(channels());
  if (Status status = inputs(z, drive, input); !status.is_ok()) return status;
  for (Index i = 0; i < n_tcas; ++i) {
    seen.rise[i] = load_.col(i).dot(z);
    seen.power[i] = input[i];
  }
  z_.noalias() = load_ * input;
  z_ -= model_.rate.cwiseProduct(z);
  for (Index i = 0; i < n_tcas; ++i) seen.rate[i] = load_.col(i).dot(z_);
  const double surface = load_.col(n_tcas).dot(z);
  seen.loss = surface - model_.surface_conductance * input[n_tcas];
  seen.coefficient = convection_.coefficient(T_0_ + surface / model_.surface_conductance, T_0_ + drive.ambient_rise[0],
                                             drive.air_speed[0]);
  seen.surface_rise = surface / model_.surface_conductance;
  seen.stored = model_.capacity.dot(z);
  observe_probes(z);
  seen.node_rise = probes_.maxCoeff();
  seen.bound = 0.0;
  for (Index i = 0; i < n_tcas; ++i) seen.bound = std::max(seen.bound, model_.step_bound.row(i).dot(travel));
  return {};
}

template <int tcas>
void ModalLevel<tcas>::observe_probes(const Eigen::Ref<const VectorXd>& z) {
  probes_.noalias() = model_.probe * z;
  probed_ = z;
}

template <int tcas>
double ModalLevel<tcas>::max_rise(std::span<const double> memory) {
  const Eigen::Map<const VectorXd> z(memory.data(), model_.size());
  if (z != probed_) observe_probes(z);
  return model_.peak.of(probes_);
}

template class ModalLevel<static_cast<int>(core::kDefaultTcas)>;
template class ModalLevel<Eigen::Dynamic>;

std::unique_ptr<HeatLevel> make_modal_level(ModalModel model, const Parameters& parameters) {
  constexpr int kDefault = static_cast<int>(core::kDefaultTcas);
  if (parameters.tca.count == core::kDefaultTcas && parameters.convection == ConvectionKind::constant)
    return std::make_unique<ModalLevel<kDefault>>(std::move(model), parameters);
  return std::make_unique<ModalLevel<Eigen::Dynamic>>(std::move(model), parameters);
}

}  // namespace thermal
