// Vectors and fields along the rod. A field holds a 3-vector at every node, component by component, in packs of four
// nodes: the vector algebra of a section is written once, for scalars and packs alike, and a loop over packs does four
// sections at once whatever the compiler makes of it.
#pragma once

#include <cmath>

namespace rod {

/// Gauss points along the rod. 16 resolve strains of degree 7 and rotations of several radians to rounding error.
inline constexpr int nodes = 16;
inline constexpr int pack_size = 4;
inline constexpr int packs = nodes / pack_size;

using Pack = double __attribute__((vector_size(pack_size * sizeof(double))));

#define ROD_INLINE [[gnu::always_inline]] inline

template <class T>
struct Triad {
  T x{}, y{}, z{};
};
using Vec3 = Triad<double>;

template <class T>
ROD_INLINE Triad<T> operator+(const Triad<T>& a, const Triad<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
ROD_INLINE Triad<T> operator-(const Triad<T>& a, const Triad<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class S, class T>
ROD_INLINE auto operator*(const S& s, const Triad<T>& a) -> Triad<decltype(s * a.x)> {
  return {s * a.x, s * a.y, s * a.z};
}
template <class S, class T>
ROD_INLINE auto dot(const Triad<S>& a, const Triad<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S, class T>
ROD_INLINE auto cross(const Triad<S>& a, const Triad<T>& b) -> Triad<decltype(a.x * b.x)> {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Componentwise product.
template <class S, class T>
ROD_INLINE auto scale(const Triad<S>& a, const Triad<T>& b) -> Triad<decltype(a.x * b.x)> {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
/// The same vector at four nodes.
ROD_INLINE Triad<Pack> spread(const Vec3& a) { return {a.x - Pack{}, a.y - Pack{}, a.z - Pack{}}; }

/// A rotation matrix by rows.
template <class T>
struct Rotation {
  Triad<T> row0, row1, row2;
};
template <class S, class T>
ROD_INLINE auto operator*(const Rotation<S>& R, const Triad<T>& a) -> Triad<decltype(R.row0.x * a.x)> {
  return {dot(R.row0, a), dot(R.row1, a), dot(R.row2, a)};
}
/// R^T a
template <class T>
ROD_INLINE Triad<T> back(const Rotation<T>& R, const Triad<T>& a) {
  return a.x * R.row0 + a.y * R.row1 + a.z * R.row2;
}

/// The rotation of a unit quaternion, scalar part w.
template <class T>
ROD_INLINE Rotation<T> rotation(const T& w, const T& x, const T& y, const T& z) {
  return {{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
          {2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)},
          {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)}};
}

/// One number at every node, read four at a time or each by itself (GCC and Clang define both views of the union).
struct Lane {
  union {
    Pack pack[packs] = {};
    double value[nodes];
  };
  ROD_INLINE double& operator[](int k) { return value[k]; }
  ROD_INLINE double operator[](int k) const { return value[k]; }
};

/// One vector at every node.
struct Field {
  Lane x, y, z;
  ROD_INLINE Triad<Pack> operator[](int p) const { return {x.pack[p], y.pack[p], z.pack[p]}; }
  ROD_INLINE void set(int p, const Triad<Pack>& a) { x.pack[p] = a.x, y.pack[p] = a.y, z.pack[p] = a.z; }
  ROD_INLINE Vec3 at(int k) const { return {x[k], y[k], z[k]}; }
  ROD_INLINE void put(int k, const Vec3& a) { x[k] = a.x, y[k] = a.y, z[k] = a.z; }
};

/// Component c of a field.
inline Lane& lane(Field& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }
inline const Lane& lane(const Field& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }

struct RotationField {
  Field row0, row1, row2;
  ROD_INLINE Rotation<Pack> operator[](int p) const { return {row0[p], row1[p], row2[p]}; }
  ROD_INLINE void set(int p, const Rotation<Pack>& R) { row0.set(p, R.row0), row1.set(p, R.row1), row2.set(p, R.row2); }
};

}  // namespace rod
