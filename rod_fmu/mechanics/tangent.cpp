// Loops of the exact derivatives of the residual of a uniform rod.
#include "mechanics/tangent_terms.hpp"

namespace rod {

namespace {

/// Derivative of sum N_i [r_i x t_i; t_i] L in strain component c at constant tensions: dt = (1 - t t^T) du/|u|, the
/// force follows the direction of the TCA.
template <class Space, int packs>
ROD_INLINE void linearise_tca_direction(const RodConstants& rod, const Kinematics& w, int c, double weight,
                                        const PerTca<double>& tension, VectorField& couple, VectorField& force) {
  std::array<double, 6> unit{};
  unit[c] = 1.0;
  const Vec3 bend{unit[0], unit[1], unit[2]}, shift{unit[3], unit[4], unit[5]};
  for (std::size_t i = 0; i < rod.tcas; ++i) {
    if (tension[i] == 0.0) continue;
    for (int p = 0; p < packs; ++p) {
      const auto r = restrict_to<InSection>(rod.offset[i], p);
      const auto t = w.t[i][p];
      const auto du = broadcast(shift) + cross(broadcast(bend), r);
      const Pack factor = (weight * rod.length * tension[i]) * w.inverse_length[i].pack[p];
      const auto dt = factor * (du - dot(t, du) * t);
      couple.set(p, couple[p] + cross(r, dt));
      force.set(p, force[p] + dt);
    }
  }
}

template <class Space, int packs, bool moving>
ROD_INLINE void columns(const RodConstants& rod, const Kinematics& w, const std::array<double, 3>& weights,
                        const PerTca<double>& tension, double* J) {
  using Linear = typename Space::Linear;
  using Angular = typename Space::Angular;
  const Quadrature& grid = *rod.grid;
  const int unknowns = rod.unknowns();
  for (int i = 0; i < rod.count; ++i) {
    const int c = rod.components[i];
    const ScalarField &x = component(w.R.row0, c % 3), &y = component(w.R.row1, c % 3), &z = component(w.R.row2, c % 3);
    VectorField couple_per, force_per;
    linearise_tca_direction<Space, packs>(rod, w, c, weights[0], tension, couple_per, force_per);
    for (int a = 0; a < rod.terms; ++a) {
      const ScalarField& shape = grid.legendre[a];
      const auto carried = [&](int p) ROD_LAMBDA_INLINE {
        return shape.pack[p] * Triad<Pack>{x.pack[p], y.pack[p], z.pack[p]};
      };
      VectorField couple, force;
      if (c < 3)
        linearise<Space, packs, moving>(
            rod, w,
            Column<Angular, ZeroVector, packs>{
                weights,
                for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE { return restrict_to<Angular>(carried(p)); }),
                {}},
            couple, force);
      else
        linearise<Space, packs, moving>(
            rod, w, Column<ZeroVector, Linear, packs>{weights, {}, for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
                                                        return restrict_to<Linear>(carried(p));
                                                      })},
            couple, force);
      for (int p = 0; p < packs; ++p) {
        couple.set(p, couple[p] - shape.pack[p] * couple_per[p]);
        force.set(p, force[p] - shape.pack[p] * force_per[p]);
      }
      project<packs>(rod, couple, force, -1.0, J + (a * rod.count + i) * unknowns);
    }
  }
}

template <class Space, int packs>
ROD_INLINE void tangent(const RodConstants& rod, const Kinematics& w, const std::array<double, 3>& weights,
                        const PerTca<double>& tension, double* J) {
  if (w.moving)
    columns<Space, packs, true>(rod, w, weights, tension, J);
  else
    columns<Space, packs, false>(rod, w, weights, tension, J);
}

template <class Space, int packs>
ROD_INLINE void rates(const RodConstants& rod, const Kinematics& w, const double* dv, const double* da, double* dr) {
  using Linear = typename Space::Linear;
  using Angular = typename Space::Angular;
  VectorField kappa1, lambda1, kappa2, lambda2;
  add_expansion<packs>(rod, dv, kappa1, lambda1);
  add_expansion<packs>(rod, da, kappa2, lambda2);
  Rates<Angular, Linear, packs> d;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::rotation_at(w.R, p);
    d.angular1[p] = R * restrict_to<Angular>(kappa1, p);
    d.angular2[p] = R * restrict_to<Angular>(kappa2, p);
    d.linear1[p] = R * restrict_to<Linear>(lambda1, p);
    d.linear2[p] = R * restrict_to<Linear>(lambda2, p);
  }
  VectorField couple, force;
  linearise<Space, packs, true>(rod, w, d, couple, force);
  project<packs>(rod, couple, force, -1.0, dr);
}

struct Tangent {
  template <class Space, int packs>
  static TangentLoops of() {
    return {.tangent = dispatch<tangent<Space, packs>>, .rate = dispatch<rates<Space, packs>>};
  }
};

}  // namespace

TangentLoops tangent_loops(const RodConstants& rod) { return select_loop<Tangent>(rod); }

}  // namespace rod
