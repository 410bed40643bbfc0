// Levels `reduced` and `lumped`: a modal model stepped exactly in time, at any step length.
//
// Voltages and T_ambient are cubics over a step, so powers are polynomials of degree 6 and phi functions carry every
// mode over it exactly. With electrical feedback the powers depend on the temperatures they make; they are then the
// polynomial of degree 6 through the powers at seven Lobatto points of the step, found by fixed-point iteration
// (collocation with an exact linear part), or by Newton's method where that does not contract. Where the polynomial
// does not resolve the conductances, the step is halved. A coefficient of convection that follows the surface is
// treated likewise, as surroundings that depend on the surface's mean.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <memory>
#include <vector>

#include "levels/heat_level.hpp"
#include "levels/polynomials.hpp"
#include "physics/circuit.hpp"
#include "physics/convection.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {

/// The level, with the number of TCAs known when compiling (the default one: its loops unrolled), or Eigen::Dynamic.
template <int tcas>
class ModalLevel final : public HeatLevel {
 public:
  ModalLevel(ModalModel model, const Parameters& parameters);

  std::size_t state_size() const override { return static_cast<std::size_t>(model_.size() + 2 * channels()); }
  int unknowns() const override { return static_cast<int>(model_.size()); }
  Status advance(std::span<double> state, const Drive& drive, double h, double tolerance) override;
  void retune(const Parameters& parameters) override;
  Status observe(std::span<const double> state, const Drive& drive, Observation& seen) override;
  double max_rise(std::span<const double> memory) override;
  bool exceeds(std::span<const double> memory, double rise) override;
  std::size_t amplitudes() const override { return static_cast<std::size_t>(model_.size()); }
  void get_amplitudes(std::span<const double> state, std::span<double> x) const override;
  void set_amplitudes(std::span<double> state, std::span<const double> x) const override;
  Status check_amplitudes(std::span<const double> memory) const override;
  Status rates(std::span<const double> state, const Drive& drive, std::span<double> dx) override;
  Status note_powers(std::span<double> state, const Drive& drive) override;

 private:
  static constexpr int kPoints = kPowerTerms;
  static constexpr int kMostHalvings = 32;  // of a step with feedback
  // Inputs of the linear problem: the power of each TCA [W], then the rise of the surroundings [K].
  static constexpr bool kIsFixed = tcas != Eigen::Dynamic;
  static constexpr int kMostTcas = kIsFixed ? tcas : static_cast<int>(kMaxTcas), kMostChannels = kMostTcas + 1;
  static constexpr int kChannels = kIsFixed ? tcas + 1 : Eigen::Dynamic;
  // Rows of what feeds back on itself: the power of each TCA, and the surroundings where h varies.
  static constexpr int kMostRows = kIsFixed ? tcas : kMostChannels;
  static constexpr int kValues = kIsFixed ? tcas * kPoints : Eigen::Dynamic;
  using Loads = Eigen::Matrix<double, Eigen::Dynamic, kChannels, Eigen::ColMajor, Eigen::Dynamic, kMostChannels>;
  using Weights = Eigen::Matrix<double, Eigen::Dynamic, kPowerTerms>;
  using Channels = Eigen::Matrix<double, kChannels, 1, Eigen::ColMajor, kMostChannels, 1>;
  // Derivatives of the channels.
  using Forcing = Eigen::Matrix<double, kChannels, kPowerTerms, Eigen::ColMajor, kMostChannels, kPowerTerms>;
  using AtPoints = Eigen::Matrix<double, tcas, kPoints, Eigen::ColMajor, kMostRows, kPoints>;
  using Values = Eigen::Matrix<double, kValues, 1, Eigen::ColMajor, kMostRows * kPoints, 1>;  // AtPoints in one column

  /// The caller's doubles: amplitudes, the channels' last values, and how far each has travelled (for the bound).
  struct State {
    Eigen::Map<Eigen::VectorXd> z;
    Eigen::Map<Channels> last;
    Eigen::Map<Channels> travel;
  };

  /// Propagator of the modes over a time h; depends on h alone.
  struct Carrier {
    double h = -1.0;
    Eigen::VectorXd decay;
    Weights weight;
    void prepare(const Eigen::VectorXd& rate, double h);
  };

  /// Responses between the points of a step of length h: the rise at point m, TCA i (row i + N m) from the power
  /// at point n of TCA j (column j + N n).
  struct Collocation {
    double h = -1.0;
    std::array<Carrier, kPoints> carriers;
    Eigen::MatrixXd response;
  };

  Carrier make_carrier() const;
  Eigen::Index count() const { return kIsFixed ? tcas : load_.cols() - 1; }
  Eigen::Index channels() const { return count() + 1; }
  bool has_varying_convection() const { return !kIsFixed && !convection_.is_constant(); }
  Eigen::Index rows() const { return count() + (has_varying_convection() ? 1 : 0); }
  bool has_feedback() const { return circuit_.has_feedback() || has_varying_convection(); }
  /// The rise of surroundings [K] that would, with the coefficient of the matrices, draw the same heat from a surface
  /// at this mean rise as the true ones do with the true coefficient.
  double effective_ambient(double surface_rise, double ambient_rise, double speed) const;
  State state_of(std::span<double> memory) const;
  void carry(State& state, const Carrier& carrier, const Forcing& forcing);
  Status advance_with_feedback(State& state, const Drive& drive, double from, double h, double tolerance, int depth);
  /// Powers at the points of a step. False: they do not settle, or are not resolved; a shorter step may do.
  bool solve_powers(const State& state, const Drive& drive, double from, const Forcing& ambient,
                    const Collocation& collocation, double tolerance);
  /// How far powers moved in an iteration.
  struct Settling {
    double change = 0.0, largest = 0.0;  // W
    bool has_same_surroundings = false;
    bool is_within(double share) const { return change <= share * largest && has_same_surroundings; }
  };
  void hold_rises();
  bool update_powers(const Drive& drive, double from, double h, Settling& settling);
  bool settle_by_iteration(const Drive& drive, double from, const Collocation& collocation);
  bool settle_by_newton(const Drive& drive, double from, const Collocation& collocation);
  bool update_surroundings(const Drive& drive, double from, double h);
  Collocation& collocation(double h, int depth);
  void observe_probes(const Eigen::Ref<const Eigen::VectorXd>& z);
  /// Powers and ambient rise at the start of the drive.
  Status inputs(const Eigen::Ref<const Eigen::VectorXd>& z, const Drive& drive, Channels& input) const;

  ModalModel model_;
  Loads load_;
  double unit_;                         // amplitudes of a uniform rise of 1 K, together [sqrt(J/K)]
  Eigen::VectorXd most_per_amplitude_;  // largest rise at a probe by each amplitude of 1
  Circuit circuit_;
  Convection convection_;
  double T_0_;
  int parts_ = 0;  // of the present step with feedback

  // Scratch: follows from the arguments of advance and observe alone.
  Carrier carrier_;
  std::vector<Collocation> collocations_;  // by depth of halving
  AtPoints powers_, rises_, conductances_, v2_, delta_;
  Values base_rises_, residual_;
  Eigen::MatrixXd slopes_;
  Eigen::PartialPivLU<Eigen::MatrixXd> newton_;
  Eigen::VectorXd z_, probed_, probes_;  // probed_: the amplitudes that probes_ belong to
  double node_rise_ = 0.0;               // highest of probes_ [K]
};

extern template class ModalLevel<static_cast<int>(core::kDefaultTcas)>;
extern template class ModalLevel<Eigen::Dynamic>;

std::unique_ptr<HeatLevel> make_modal_level(ModalModel model, const Parameters& parameters);

}  // namespace thermal
