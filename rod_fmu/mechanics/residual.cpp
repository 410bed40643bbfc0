// Loops of the residual of a uniform rod.
#include "mechanics/residual_terms.hpp"

namespace rod {

namespace {

template <class Space, int packs>
ROD_INLINE void shape(const RodConstants& rod, const double* q, Kinematics& w) {
  VectorField kappa, lambda;
  strains<packs>(rod, q, kappa, lambda);
  orientation<Space, packs>(rod, q, w);
  for (int p = 0; p < packs; ++p)
    w.l.set(p, Space::rotation_at(w.R, p) * restrict_to<typename Space::Linear>(lambda, p));
}

template <class Space, int packs>
ROD_INLINE void paths(const RodConstants& rod, const double* q, Kinematics& w, const Gradients& b) {
  VectorField kappa, lambda;
  strains<packs>(rod, q, kappa, lambda);
  tca_geometry<Space, packs>(rod, kappa, lambda, w, b);
}

template <class Space, int packs>
ROD_INLINE void statics(const RodConstants& rod, const double* q, const BodyLoads& loads, Kinematics& w, double* r,
                        const Gradients& b) {
  positions<Space, packs>(rod, q, w, b);
  w.moving = false;
  NodeArray<typename Space::Linear, packs> n{};
  NodeArray<typename Space::Angular, packs> m{};
  balance<Space, packs>(rod, loads, n, m, w, r);
}

template <class Space, int packs>
ROD_INLINE void dynamics(const RodConstants& rod, const double* q, const double* v, const double* a,
                         const BodyLoads& loads, Kinematics& w, double* r, const Gradients& b) {
  positions<Space, packs>(rod, q, w, b);
  w.moving = true;
  velocities<Space, packs>(rod, v, w);
  NodeArray<typename Space::Linear, packs> n{};
  NodeArray<typename Space::Angular, packs> m{};
  inertia_forces<Space, packs>(rod, a, w, n, m);
  n = integral(rod.grid->adjoint, n);
  balance<Space, packs>(rod, loads, n, m, w, r);
}

struct Residual {
  template <class Space, int packs>
  static ResidualLoops of() {
    return {.positions = dispatch<shape<Space, packs>>,
            .paths = dispatch<paths<Space, packs>>,
            .positions_and_paths = dispatch<positions<Space, packs>>,
            .velocities = dispatch<velocities<Space, packs>>,
            .statics = dispatch<statics<Space, packs>>,
            .dynamics = dispatch<dynamics<Space, packs>>};
  }
};

}  // namespace

ResidualLoops residual_loops(const RodConstants& rod) { return select_loop<Residual>(rod); }

}  // namespace rod
