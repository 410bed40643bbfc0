// Gauss-Legendre collocation on [0, 1]: nodes, weights, integrals from the clamp to each node, their discrete adjoint
// (integrals from each node to the tip), and the Legendre polynomials of the strains. All lengths in units of L.
#pragma once

#include <array>

#include "numerics/field.hpp"
#include "numerics/sizes.hpp"

namespace rod {

inline constexpr int kMaxTerms = kMaxOrder + 1;
/// Number of intervals per gap between neighbours among clamp, nodes and tip, and of packs of all intervals.
constexpr int pieces_of(int packs) { return packs > 4 ? 3 : 2; }
constexpr int interval_packs_of(int packs) {
  return (pieces_of(packs) * (packs * kPackSize + 1) + kPackSize - 1) / kPackSize;
}
inline constexpr int kMaxIntervalPacks = interval_packs_of(kMaxPacks);
inline constexpr int kGaussPoints = 3;  // Gauss points of the Magnus expansion in each interval

/// One number per interval, padded with zeros to whole packs.
struct alignas(kPackSize * sizeof(double)) IntervalField {
  union {
    Pack pack[kMaxIntervalPacks] = {};
    double value[kMaxIntervalPacks * kPackSize];
  };
  ROD_INLINE double& operator[](int e) { return value[e]; }
  ROD_INLINE double operator[](int e) const { return value[e]; }
};

inline constexpr int kStationPacks = (static_cast<int>(kShapeStations) + kPackSize - 1) / kPackSize;

/// One number per station, padded with zeros to whole packs.
struct alignas(kPackSize * sizeof(double)) StationField {
  union {
    Pack pack[kStationPacks] = {};
    double value[kStationPacks * kPackSize];
  };
  ROD_INLINE double& operator[](int m) { return value[m]; }
  ROD_INLINE double operator[](int m) const { return value[m]; }
};

struct Quadrature {
  explicit Quadrature(int packs);

  int packs, nodes, pieces, intervals, interval_packs;
  /// Largest curvature times L [rad] for which the position of the tip is integrated to 1e-8 L.
  double max_curvature;
  ScalarField s, w;
  /// forward[j][k] = int_0^{s_k} l_j, so that (int_0^s f)(s_k) = sum_j forward[j][k] f_j.
  std::array<ScalarField, kMaxNodes> forward;
  /// adjoint[k][j] = w_k forward[j][k] / w_j, so that sum_k w_k g_k (int_0^s f)(s_k) = sum_j w_j f_j (int_s^1 g)(s_j).
  std::array<ScalarField, kMaxNodes> adjoint;
  /// stations[j][m] = int_0^{m/20} l_j: integrals at the evenly spaced stations.
  std::array<StationField, kMaxNodes> stations;
  /// legendre[a][k] = P_a(2 s_k - 1), and their integrals from the clamp, which end at 0 but for a = 0.
  std::array<ScalarField, kMaxTerms> legendre, legendre_integral;
  /// moment[a][k] = w_k P_a(2 s_k - 1)
  std::array<ScalarField, kMaxTerms> moment;
  /// The same at the three Gauss points of every interval; length of these intervals.
  std::array<std::array<IntervalField, kGaussPoints>, kMaxTerms> legendre_at_gauss_points;
  IntervalField length;
};

/// The rule for strains of this degree: 12, 16 or 20 nodes, enough to integrate their products and rotations of several
/// radians to rounding error. Computed once per process; immutable.
/// A rod whose unloaded curvature or helical routing turns by more than these resolve gets more nodes.
const Quadrature& quadrature(int order, double turns = 0.0);

/// Largest curvature times L [rad] that the finest rule resolves.
double max_resolved_curvature();

/// Writes the weights of int_0^x f ds for x in [0, 1], in units of L.
void integral_weights(const Quadrature& grid, double x, ScalarField& weights);

/// Values P_0 ... P_{count-1} of the Legendre polynomials at x in [-1, 1].
void legendre_values(double x, int count, double* values);

}  // namespace rod
