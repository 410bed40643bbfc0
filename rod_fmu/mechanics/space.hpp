// Types of the vectors of a rod that moves in space, or in the plane x-z of its frame. The loops over nodes are written
// once for both and for every number of nodes; select_loop() finds the ones of a rod.
#pragma once

#include <stdexcept>

#include "mechanics/loops.hpp"
#include "numerics/field.hpp"

namespace rod {

struct Spatial {
  static constexpr bool planar = false;
  static constexpr bool segment = false;
  using Linear = Triad<Pack>;   // positions, forces
  using Angular = Triad<Pack>;  // rotations, couples
  ROD_INLINE static auto rotation_at(const RotationField& R, int p) {
    return Rows<Linear>{restrict_to<Linear>(R.row0, p), restrict_to<Linear>(R.row1, p), restrict_to<Linear>(R.row2, p)};
  }
};

/// A segment of a body: motion in space of a rod whose start moves and whose section changes.
struct Segmented : Spatial {
  static constexpr bool segment = true;
};

struct Planar {
  static constexpr bool planar = true;
  static constexpr bool segment = false;
  using Linear = Triad<Pack, Zero, Pack>;
  using Angular = Triad<Zero, Pack, Zero>;
  ROD_INLINE static auto rotation_at(const RotationField& R, int p) {
    return Rows<Linear, Angular, Linear>{restrict_to<Linear>(R.row0, p), restrict_to<Angular>(R.row1, p),
                                         restrict_to<Linear>(R.row2, p)};
  }
};

/// Vectors in the plane of a section, such as the offset of a TCA.
using InSection = Triad<Pack, Pack, Zero>;

/// Family::of<Space, packs>() for this rod.
template <class Family>
auto select_loop(const RodConstants& rod) {
  switch (rod.grid->packs) {
    case 3:
      return rod.planar ? Family::template of<Planar, 3>() : Family::template of<Spatial, 3>();
    case 4:
      return rod.planar ? Family::template of<Planar, 4>() : Family::template of<Spatial, 4>();
    case 5:
      return rod.planar ? Family::template of<Planar, 5>() : Family::template of<Spatial, 5>();
  }
  throw std::logic_error("no loops for this number of nodes");
}

/// Family::of<packs>() for the loops of this segment.
template <class Family>
auto select_segment_loop(const RodConstants& segment) {
  switch (segment.grid->packs) {
    case 3:
      return Family::template of<3>();
    case 4:
      return Family::template of<4>();
    case 5:
      return Family::template of<5>();
  }
  throw std::logic_error("no loops for this number of nodes");
}

}  // namespace rod
