// Loops of the residual of one segment: forward, from the motion of its start to that of its end; back, from the wrench
// at its end to that at its start.
#include "mechanics/residual_terms.hpp"

namespace rod {

namespace {

/// Position and orientation of the end.
template <int packs>
ROD_INLINE void locate_end(const RodConstants& segment, Kinematics& w) {
  NodeArray<Triad<Pack>, packs> l;
  for (int p = 0; p < packs; ++p) l[p] = w.l[p];
  w.tip.p = w.base.p + segment.length * node_sum<packs>(*segment.grid, l);
  w.tip.quaternion = w.tip_quaternion;
  w.tip.R = rotation(w.tip_quaternion[0], w.tip_quaternion[1], w.tip_quaternion[2], w.tip_quaternion[3]);
}

template <int packs>
ROD_INLINE void forward(const RodConstants& segment, const double* q, const double* v, const double* a, bool moving,
                        Kinematics& w, const Gradients& b) {
  positions<Segmented, packs>(segment, q, w, b);
  locate_end<packs>(segment, w);
  w.moving = moving;
  if (!moving) return;
  velocities<Segmented, packs>(segment, v, w);
  if (!a) return;
  NodeArray<Triad<Pack>, packs> n{}, m{};
  inertia_forces<Segmented, packs>(segment, a, w, n, m);
  for (int p = 0; p < packs; ++p) w.n.set(p, n[p]);
}

template <int packs>
ROD_INLINE Wrench backward(const RodConstants& segment, const SegmentLoads& loads, const Kinematics& w,
                           Kinematics* keep, double* r) {
  const Quadrature& grid = *segment.grid;
  const SegmentInertia& inertia = *segment.inertia_along;
  const double L = segment.length;
  const bool moving = keep && w.moving;
  NodeArray<Triad<Pack>, packs> n{}, m{};
  Vec3 base = L * (loads.end.force + loads.along_total) + (L * L * inertia.mass_total) * loads.gravity;
  if (moving) {
    for (int p = 0; p < packs; ++p) n[p] = w.n[p];  // the inertia force, so far
    base = base + node_sum<packs>(grid, n);
    n = integral(grid.adjoint, n);
  }
  const auto end = broadcast(L * loads.end.force), gravity = broadcast((L * L) * loads.gravity);
  for (int p = 0; p < packs; ++p) {
    n[p] = n[p] + end + L * loads.along[p] + inertia.mass_beyond.pack[p] * gravity;
    m[p] = cross(w.l[p], n[p]);
    if (moving) m[p] = m[p] - w.hdot[p];
  }
  const Vec3 moment = loads.end.moment + node_sum<packs>(grid, m);
  m = integral(grid.adjoint, m);
  VectorField couple, force;
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    m[p] = m[p] + broadcast(loads.end.moment);
    if (keep) keep->n.set(p, n[p]), keep->m.set(p, m[p]);
    couple.set(p, transpose_times(R, m[p]));
    force.set(p, transpose_times(R, n[p]));
  }
  project<packs>(segment, couple, force, -1.0, r);
  return {(1.0 / L) * base, moment};
}

struct Loops {
  template <int packs>
  static SegmentLoops of() {
    return {.forward = dispatch<forward<packs>>, .backward = dispatch<backward<packs>>};
  }
};

}  // namespace

SegmentLoops segment_loops(const RodConstants& segment) { return select_segment_loop<Loops>(segment); }

}  // namespace rod
