// Gauss-Legendre collocation on [0, 1]: nodes, weights, integrals from the clamp to each node, their discrete adjoint
// (integrals from each node to the tip), and the Legendre polynomials that carry the strains. All lengths in units of
// L.
#pragma once

#include <array>

#include "data.hpp"
#include "field.hpp"

namespace rod {

inline constexpr int max_terms = highest_order + 1;
inline constexpr int pieces = 2;  // intervals between neighbours among clamp, nodes and tip
inline constexpr int intervals = pieces * (nodes + 1);
inline constexpr int interval_packs = (intervals + pack_size - 1) / pack_size;
inline constexpr int points = 3;  // of the Magnus expansion in each interval

/// One number per interval, padded with zeros to whole packs.
struct IntervalLane {
  union {
    Pack pack[interval_packs] = {};
    double value[interval_packs * pack_size];
  };
  ROD_INLINE double& operator[](int e) { return value[e]; }
  ROD_INLINE double operator[](int e) const { return value[e]; }
};

struct Quadrature {
  Quadrature();

  Lane s, w;
  /// forward[j][k] = int_0^{s_k} l_j, so that (int_0^s f)(s_k) = sum_j forward[j][k] f_j.
  std::array<Lane, nodes> forward;
  /// adjoint[k][j] = w_k forward[j][k] / w_j, so that sum_k w_k g_k (int_0^s f)(s_k) = sum_j w_j f_j (int_s^1 g)(s_j).
  std::array<Lane, nodes> adjoint;
  /// stations[m][j] = int_0^{m/20} l_j: integrals at the evenly spaced stations.
  std::array<Lane, shape_stations> stations;
  /// legendre[a][k] = P_a(2 s_k - 1)
  std::array<Lane, max_terms> legendre;
  /// The same at the three Gauss points of every interval; length of these intervals.
  std::array<std::array<IntervalLane, points>, max_terms> legendre_between;
  IntervalLane length;
};

/// Computed once per process; immutable.
const Quadrature& quadrature();

/// Values P_0 ... P_{count-1} of the Legendre polynomials at x in [-1, 1].
void legendre_values(double x, int count, double* values);

}  // namespace rod
