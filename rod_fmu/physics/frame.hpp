// A frame rotated about the axis of the straight rod; its x axis lies in the plane of a planar rod.
#pragma once

#include "numerics/vectors.hpp"

namespace rod {

struct Frame {
  double cosine = 1.0, sine = 0.0;  // of the azimuth of the x axis
  /// Components in this frame of a vector in the fixed frame.
  Vec3 to_frame(const Vec3& a) const { return {cosine * a.x + sine * a.y, cosine * a.y - sine * a.x, a.z}; }
  /// Components in the fixed frame of a vector in this frame.
  Vec3 from_frame(const Vec3& a) const { return {cosine * a.x - sine * a.y, cosine * a.y + sine * a.x, a.z}; }
};

}  // namespace rod
