// Fields along the rod: a number or a 3-vector at every node, component by component, in packs of four nodes, so that a
// loop over packs does four sections at once whatever the compiler makes of it.
#pragma once

#include <cmath>

#include "numerics/vectors.hpp"

namespace rod {

/// Room for the Gauss points of the largest rod; how many count is the quadrature's affair, the rest stays 0.
inline constexpr int most_packs = 5;
inline constexpr int most_nodes = most_packs * pack_size;

/// One number at every node, read four at a time or each by itself (GCC and Clang define both views of the union).
struct Lane {
  union {
    Pack pack[most_packs] = {};
    double value[most_nodes];
  };
  ROD_INLINE double& operator[](int k) { return value[k]; }
  ROD_INLINE double operator[](int k) const { return value[k]; }
};

/// One vector at every node.
struct Field {
  Lane x, y, z;
  ROD_INLINE Triad<Pack> operator[](int p) const { return {x.pack[p], y.pack[p], z.pack[p]}; }
  ROD_INLINE Vec3 at(int k) const { return {x[k], y[k], z[k]}; }
  ROD_INLINE void put(int k, const Vec3& a) { x[k] = a.x, y[k] = a.y, z[k] = a.z; }
  /// Writes pack p, leaving alone what a lacks.
  template <class X, class Y, class Z>
  ROD_INLINE void set(int p, const Triad<X, Y, Z>& a) {
    if constexpr (Number<X>) x.pack[p] = a.x;
    if constexpr (Number<Y>) y.pack[p] = a.y;
    if constexpr (Number<Z>) z.pack[p] = a.z;
  }
};

/// Component c of a field.
inline Lane& lane(Field& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }
inline const Lane& lane(const Field& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }

struct RotationField {
  Field row0, row1, row2;
  ROD_INLINE Rotation<Pack> operator[](int p) const { return {row0[p], row1[p], row2[p]}; }
  template <class A, class B, class C>
  ROD_INLINE void set(int p, const Rows<A, B, C>& R) {
    row0.set(p, R.row0), row1.set(p, R.row1), row2.set(p, R.row2);
  }
};

/// A as one of the components that V says.
template <Scalar T, Number A>
ROD_INLINE auto keep(const A& a) {
  if constexpr (std::same_as<T, Zero>)
    return Zero{};
  else
    return a;
}
/// Those components of a vector that V has: of Vec3, at pack p of a field.
template <class V, Number A>
ROD_INLINE auto take(const Triad<A>& a) {
  return Triad{keep<decltype(V::x)>(a.x), keep<decltype(V::y)>(a.y), keep<decltype(V::z)>(a.z)};
}
template <class V>
ROD_INLINE V take(const Field& f, int p) {
  return take<V>(f[p]);
}
}  // namespace rod
