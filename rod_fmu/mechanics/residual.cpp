// Loops of the residual of a uniform rod.
#include "mechanics/residual_terms.hpp"

namespace rod {

namespace {

template <class Space, int packs>
ROD_INLINE void kinematics(const RodConstants& rod, const double* q, const double* v, Kinematics& w,
                           const Gradients& b) {
  positions<Space, packs>(rod, q, w, b);
  w.moving = true;
  velocities<Space, packs>(rod, v, w);
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
  kinematics<Space, packs>(rod, q, v, w, b);
  NodeArray<typename Space::Linear, packs> n{};
  NodeArray<typename Space::Angular, packs> m{};
  inertia_forces<Space, packs>(rod, a, w, n, m);
  n = integral(rod.grid->adjoint, n);
  balance<Space, packs>(rod, loads, n, m, w, r);
}

struct Residual {
  template <class Space, int packs>
  static ResidualLoops of() {
    return {.kinematics = dispatch<kinematics<Space, packs>>,
            .statics = dispatch<statics<Space, packs>>,
            .dynamics = dispatch<dynamics<Space, packs>>};
  }
};

}  // namespace

ResidualLoops residual_loops(const RodConstants& rod) { return select_loop<Residual>(rod); }

}  // namespace rod
