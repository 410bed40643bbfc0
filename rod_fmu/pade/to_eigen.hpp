// A vector of the other rooms as Eigen's.
#pragma once

#include "numerics/vectors.hpp"
#include "pade/node.hpp"

namespace rod::pade {

inline Vector3 to_eigen(const Vec3& a) { return {a.x, a.y, a.z}; }

}  // namespace rod::pade
