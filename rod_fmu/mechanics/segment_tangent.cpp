// Columns of the exact derivatives of one segment: in its strains, in the motion of its start, in the wrench at its
// end.
#include "mechanics/tangent_terms.hpp"

namespace rod {

namespace {

/// A variation that leaves the strains as they are.
struct NoStrain {
  ROD_INLINE ZeroVector k(int) const { return {}; }
  ROD_INLINE ZeroVector k1(int) const { return {}; }
  ROD_INLINE ZeroVector k2(int) const { return {}; }
  ROD_INLINE ZeroVector l(int) const { return {}; }
  ROD_INLINE ZeroVector l1(int) const { return {}; }
  ROD_INLINE ZeroVector l2(int) const { return {}; }
};

template <int packs, class Variation>
ROD_INLINE void write_column(const RodConstants& segment, const Kinematics& w, const Variation& d,
                             const SectionVariation& start, SegmentColumn& column) {
  VectorField couple, force;
  EndVariations ends{.start = start, .end = {}, .base = {}};
  if (w.moving)
    linearise<Segmented, packs, true>(segment, w, d, couple, force, &ends);
  else
    linearise<Segmented, packs, false>(segment, w, d, couple, force, &ends);
  project<packs>(segment, couple, force, -1.0, column.r);
  column.tip = ends.end;
  column.base = ends.base;
}

template <int packs>
ROD_INLINE void strain_column(const RodConstants& segment, const Kinematics& w, const std::array<double, 3>& weights,
                              int component_index, int degree, SegmentColumn& column) {
  const int c = segment.components[component_index];
  const ScalarField &x = component(w.R.row0, c % 3), &y = component(w.R.row1, c % 3), &z = component(w.R.row2, c % 3);
  const ScalarField& shape = segment.grid->legendre[degree];
  const auto carried = for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
    return shape.pack[p] * Triad<Pack>{x.pack[p], y.pack[p], z.pack[p]};
  });
  if (c < 3)
    write_column<packs>(segment, w, Column<Triad<Pack>, ZeroVector, packs>{weights, carried, {}}, {}, column);
  else
    write_column<packs>(segment, w, Column<ZeroVector, Triad<Pack>, packs>{weights, {}, carried}, {}, column);
}

template <int packs>
ROD_INLINE void base_column(const RodConstants& segment, const Kinematics& w, const SectionVariation& start,
                            SegmentColumn& column) {
  write_column<packs>(segment, w, NoStrain{}, start, column);
}

template <int packs>
ROD_INLINE void wrench_column(const RodConstants& segment, const Kinematics& w, const Wrench& end,
                              SegmentColumn& column) {
  const Quadrature& grid = *segment.grid;
  const auto n = broadcast(segment.length * end.force);
  NodeArray<Triad<Pack>, packs> m;
  for (int p = 0; p < packs; ++p) m[p] = cross(w.l[p], n);
  column.tip = {};
  column.base = {end.force, end.moment + node_sum<packs>(grid, m)};
  m = integral(grid.adjoint, m);
  VectorField couple, force;
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    couple.set(p, transpose_times(R, m[p] + broadcast(end.moment)));
    force.set(p, transpose_times(R, n));
  }
  project<packs>(segment, couple, force, -1.0, column.r);
}

template <int packs>
ROD_INLINE void rate_column(const RodConstants& segment, const Kinematics& w, const double* dv, const double* da,
                            const SectionVariation& start, SegmentColumn& column) {
  VectorField kappa1, lambda1, kappa2, lambda2;
  add_expansion<packs>(segment, dv, kappa1, lambda1);
  add_expansion<packs>(segment, da, kappa2, lambda2);
  Rates<Triad<Pack>, Triad<Pack>, packs> d;
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    d.angular1[p] = R * kappa1[p];
    d.angular2[p] = R * kappa2[p];
    d.linear1[p] = R * lambda1[p];
    d.linear2[p] = R * lambda2[p];
  }
  write_column<packs>(segment, w, d, start, column);
}

struct Loops {
  template <int packs>
  static SegmentTangentLoops of() {
    return {.strain = dispatch<strain_column<packs>>,
            .base = dispatch<base_column<packs>>,
            .wrench = dispatch<wrench_column<packs>>,
            .rate = dispatch<rate_column<packs>>};
  }
};

}  // namespace

SegmentTangentLoops segment_tangent_loops(const RodConstants& segment) { return select_segment_loop<Loops>(segment); }

}  // namespace rod
