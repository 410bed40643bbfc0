// State of a rod on grid points, as views into one array of plain doubles.
#pragma once

#include <Eigen/Core>
#include <span>
#include <type_traits>

#include "pade/node.hpp"

namespace rod {

/// Views of the quantities at the points and of those of the whole rod, SI units. Body frame but for the pose. Number
/// is double, or const double for a state that is only read.
template <class Number>
class GridView {
  template <class Matrix>
  using Map = Eigen::Map<std::conditional_t<std::is_const_v<Number>, const Matrix, Matrix>>;

 public:
  static std::size_t size(int points, int tcas) {
    return static_cast<std::size_t>(points) * static_cast<std::size_t>(19 + tcas) +
           static_cast<std::size_t>(2 * tcas + 7);
  }
  GridView(Number* memory, int points, int tcas)
      : memory_(memory), tail_(memory + points * (19 + tcas)), points_(points), tcas_(tcas) {}
  operator GridView<const double>() const { return {memory_, points_, tcas_}; }

  Map<Eigen::Vector4d> quaternion(int k) const { return Map<Eigen::Vector4d>(at(k)); }  // scalar part first
  Map<pade::Vector3> position(int k) const { return Map<pade::Vector3>(at(k) + 4); }    // m
  Map<pade::Vector6> strain(int k) const { return Map<pade::Vector6>(at(k) + 7); }      // xi [1/m, 1]
  Map<pade::Vector6> velocity(int k) const { return Map<pade::Vector6>(at(k) + 13); }   // eta [1/s, m/s]
  Map<pade::TcaVector> stretch(int k) const {
    return Map<pade::TcaVector>(at(k) + 19, tcas_);
  }                                                                                       // eps' = |u| of every TCA
  Map<pade::TcaVector> delta_rate() const { return Map<pade::TcaVector>(tail_, tcas_); }  // of the last step [m/s]
  Map<pade::TcaVector> tension() const { return Map<pade::TcaVector>(tail_ + tcas_, tcas_); }  // at its end [N]
  Map<pade::Vector6> tip_load() const { return Map<pade::Vector6>(tail_ + 2 * tcas_); }        // at its end [N m, N]
  Number& dissipated() const { return tail_[2 * tcas_ + 6]; }                                  // J
  int points() const { return points_; }
  std::span<Number> memory() const { return {memory_, size(points_, tcas_)}; }

 private:
  Number* at(int k) const { return memory_ + k * (19 + tcas_); }
  Number *memory_, *tail_;
  int points_, tcas_;
};

using GridState = GridView<double>;
using ConstGridState = GridView<const double>;

}  // namespace rod
