// The level's calls and its steps without feedback; with feedback: modal_feedback.cpp.
#include "levels/modal_level.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levels/phi.hpp"

namespace thermal {
namespace {

using core::value;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double kHottest = 1e6;  // rise [K] beyond which a host's integration is taken to have diverged

}  // namespace

template <int tcas>
ModalLevel<tcas>::ModalLevel(ModalModel model, const Parameters& parameters)
    : model_(std::move(model)),
      load_(model_.load),
      unit_(model_.capacity.norm()),
      most_per_amplitude_(model_.probe.cwiseAbs().colwise().maxCoeff()),
      circuit_(parameters),
      convection_(parameters),
      T_0_(parameters.T_0),
      powers_(rows(), kPoints),
      rises_(rows(), kPoints),
      conductances_(count(), kPoints),
      v2_(count(), kPoints),
      delta_(count(), kPoints),
      base_rises_(rows() * kPoints),
      residual_(rows() * kPoints),
      z_(model_.size()),
      probed_(VectorXd::Zero(model_.size())),
      probes_(VectorXd::Zero(model_.probe.rows())) {
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
  collocations_.resize(kMostHalvings + 1);
  slopes_.setIdentity(rows() * kPoints, rows() * kPoints);
  newton_.compute(slopes_);
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
double ModalLevel<tcas>::effective_ambient(double surface_rise, double ambient_rise, double speed) const {
  if (!has_varying_convection()) return ambient_rise;
  const double h = convection_.coefficient(T_0_ + surface_rise, T_0_ + ambient_rise, speed);
  return ambient_rise + (h / convection_.reference() - 1.0) * (ambient_rise - surface_rise);
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
  seen.bound = 0.0;
  for (Index i = 0; i < n_tcas; ++i) seen.bound = std::max(seen.bound, model_.step_bound.row(i).dot(travel));
  return {};
}

template <int tcas>
void ModalLevel<tcas>::observe_probes(const Eigen::Ref<const VectorXd>& z) {
  probes_.noalias() = model_.probe * z;
  probed_ = z;
  node_rise_ = probes_.maxCoeff();
}

template <int tcas>
double ModalLevel<tcas>::max_rise(std::span<const double> memory) {
  const Eigen::Map<const VectorXd> z(memory.data(), model_.size());
  if (z != probed_) observe_probes(z);
  return model_.peak.of(probes_);
}

template <int tcas>
bool ModalLevel<tcas>::exceeds(std::span<const double> memory, double rise) {
  const Eigen::Map<const VectorXd> z(memory.data(), model_.size());
  // Since the probes were last calculated none of them has moved by more than all amplitudes together.
  if (node_rise_ + most_per_amplitude_.dot((z - probed_).cwiseAbs()) <= rise - kBetweenNodes) return false;
  if (z != probed_) observe_probes(z);
  return node_rise_ > rise - kBetweenNodes && model_.peak.of(probes_) > rise;
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
