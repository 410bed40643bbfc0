// A vector as parameters, inputs and outputs keep it.
#pragma once

#include "numerics/vectors.hpp"
#include "physics/data.hpp"

namespace rod {

inline Triple triple(const Vec3& a) { return {a.x, a.y, a.z}; }

}  // namespace rod
