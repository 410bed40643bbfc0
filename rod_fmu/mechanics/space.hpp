// Where a rod moves: in space, or in the plane x-z of its frame. The loops over nodes are written once for both and for
// every number of nodes; here are the kinds of vectors that each has, and how a rod gets its loop.
#pragma once

#include <stdexcept>

#include "mechanics/loops.hpp"
#include "numerics/field.hpp"

namespace rod {

struct Spatial {
  static constexpr bool planar = false;
  using Linear = Triad<Pack>;   // positions, forces
  using Angular = Triad<Pack>;  // rotations, couples
  ROD_INLINE static auto turn(const RotationField& R, int p) {
    return Rows<Linear>{take<Linear>(R.row0, p), take<Linear>(R.row1, p), take<Linear>(R.row2, p)};
  }
};

struct Planar {
  static constexpr bool planar = true;
  using Linear = Triad<Pack, Zero, Pack>;
  using Angular = Triad<Zero, Pack, Zero>;
  ROD_INLINE static auto turn(const RotationField& R, int p) {
    return Rows<Linear, Angular, Linear>{take<Linear>(R.row0, p), take<Angular>(R.row1, p), take<Linear>(R.row2, p)};
  }
};

/// Vectors in a section.
using InSection = Triad<Pack, Pack, Zero>;

/// Family::of<Space, packs>() for this build.
template <class Family>
auto choose(const Build& build) {
  switch (build.grid->packs) {
    case 3:
      return build.planar ? Family::template of<Planar, 3>() : Family::template of<Spatial, 3>();
    case 4:
      return build.planar ? Family::template of<Planar, 4>() : Family::template of<Spatial, 4>();
    case 5:
      return build.planar ? Family::template of<Planar, 5>() : Family::template of<Spatial, 5>();
  }
  throw std::logic_error("no loops for this number of nodes");
}

}  // namespace rod
