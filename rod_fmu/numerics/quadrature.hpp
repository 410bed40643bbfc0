// Gauss-Legendre collocation on [0, 1]: nodes, weights, integrals from the clamp to each node, their discrete adjoint
// (integrals from each node to the tip), and the Legendre polynomials that carry the strains. All lengths in units of
// L. The more degrees the strains have, the more nodes they get.
#pragma once

#include <array>

#include "numerics/field.hpp"
#include "numerics/sizes.hpp"

namespace rod {

inline constexpr int max_terms = highest_order + 1;
/// Intervals between neighbours among clamp, nodes and tip; packs of them all.
constexpr int pieces_of(int packs) { return packs > 4 ? 3 : 2; }
constexpr int interval_packs_of(int packs) {
  return (pieces_of(packs) * (packs * pack_size + 1) + pack_size - 1) / pack_size;
}
inline constexpr int most_interval_packs = interval_packs_of(most_packs);
inline constexpr int points = 3;  // of the Magnus expansion in each interval

/// One number per interval, padded with zeros to whole packs.
struct IntervalLane {
  union {
    Pack pack[most_interval_packs] = {};
    double value[most_interval_packs * pack_size];
  };
  ROD_INLINE double& operator[](int e) { return value[e]; }
  ROD_INLINE double operator[](int e) const { return value[e]; }
};

struct Quadrature {
  explicit Quadrature(int packs);

  int packs, nodes, pieces, intervals, interval_packs;
  Lane s, w;
  /// forward[j][k] = int_0^{s_k} l_j, so that (int_0^s f)(s_k) = sum_j forward[j][k] f_j.
  std::array<Lane, most_nodes> forward;
  /// adjoint[k][j] = w_k forward[j][k] / w_j, so that sum_k w_k g_k (int_0^s f)(s_k) = sum_j w_j f_j (int_s^1 g)(s_j).
  std::array<Lane, most_nodes> adjoint;
  /// stations[m][j] = int_0^{m/20} l_j: integrals at the evenly spaced stations.
  std::array<Lane, shape_stations> stations;
  /// legendre[a][k] = P_a(2 s_k - 1), and their integrals from the clamp, which end at 0 but for a = 0.
  std::array<Lane, max_terms> legendre, turned;
  /// moment[a][k] = w_k P_a(2 s_k - 1)
  std::array<Lane, max_terms> moment;
  /// The same at the three Gauss points of every interval; length of these intervals.
  std::array<std::array<IntervalLane, points>, max_terms> legendre_between;
  IntervalLane length;
};

/// With as many nodes as strains of this degree need: their products and turns of several radians to rounding error.
/// Computed once per process; immutable.
const Quadrature& quadrature(int order);

/// Values P_0 ... P_{count-1} of the Legendre polynomials at x in [-1, 1].
void legendre_values(double x, int count, double* values);

}  // namespace rod
