// Vectors and fields along the rod. A Field holds one 3-vector per node, component by component, so that a loop over
// nodes compiles to vector instructions: write the vector algebra of one node, loop, and the compiler does all nodes at
// once.
#pragma once

#include <array>
#include <cmath>

namespace rod {

/// Gauss points along the rod. 16 resolve strains of degree 7 and rotations of several radians to rounding error.
inline constexpr int nodes = 16;

struct Vec3 {
  double x = 0.0, y = 0.0, z = 0.0;
  double& operator[](int c) { return c == 0 ? x : c == 1 ? y : z; }
  double operator[](int c) const { return c == 0 ? x : c == 1 ? y : z; }
};

[[gnu::always_inline]] inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
[[gnu::always_inline]] inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
[[gnu::always_inline]] inline Vec3 operator*(double s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
[[gnu::always_inline]] inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
[[gnu::always_inline]] inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
[[gnu::always_inline]] inline Vec3 scale(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

/// A rotation matrix by rows.
struct Mat3 {
  Vec3 row0, row1, row2;
};
[[gnu::always_inline]] inline Vec3 operator*(const Mat3& R, const Vec3& a) {
  return {dot(R.row0, a), dot(R.row1, a), dot(R.row2, a)};
}
/// R^T a
[[gnu::always_inline]] inline Vec3 back(const Mat3& R, const Vec3& a) {
  return a.x * R.row0 + a.y * R.row1 + a.z * R.row2;
}

using Lane = std::array<double, nodes>;

struct Field {
  alignas(64) Lane x{}, y{}, z{};
  [[gnu::always_inline]] Vec3 operator[](int k) const { return {x[k], y[k], z[k]}; }
  [[gnu::always_inline]] void set(int k, const Vec3& a) { x[k] = a.x, y[k] = a.y, z[k] = a.z; }
};

/// Component c of a field.
inline Lane& lane(Field& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }
inline const Lane& lane(const Field& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }

struct RotationField {
  Field row0, row1, row2;
  [[gnu::always_inline]] Mat3 operator[](int k) const { return {row0[k], row1[k], row2[k]}; }
  void set(int k, const Mat3& R) { row0.set(k, R.row0), row1.set(k, R.row1), row2.set(k, R.row2); }
};

}  // namespace rod
