// A frame turned about the rod's axis.
#pragma once

#include "numerics/vectors.hpp"

namespace rod {

struct Frame {
  double cosine = 1.0, sine = 0.0;
  Vec3 in(const Vec3& a) const { return {cosine * a.x + sine * a.y, cosine * a.y - sine * a.x, a.z}; }
  Vec3 out(const Vec3& a) const { return {cosine * a.x - sine * a.y, cosine * a.y + sine * a.x, a.z}; }
};

}  // namespace rod
