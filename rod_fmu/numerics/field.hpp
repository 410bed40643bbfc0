// Fields along the rod: a number or a 3-vector at every node, stored by component in packs of four nodes, so that a
// loop over packs treats four sections at once.
#pragma once

#include <cmath>

#include "numerics/vectors.hpp"

namespace rod {

/// Packs of the finest quadrature. A coarser one uses the first of them; the others stay 0.
inline constexpr int kMaxPacks = 5;
inline constexpr int kMaxNodes = kMaxPacks * kPackSize;

/// One number at every node, by packs or by nodes (GCC and Clang define both views of the union). The alignment is that
/// which functions compiled for AVX rely on; without AVX the compiler takes less, and objects on the heap would lie
/// wrong.
struct alignas(kPackSize * sizeof(double)) ScalarField {
  union {
    Pack pack[kMaxPacks] = {};
    double value[kMaxNodes];
  };
  ROD_INLINE double& operator[](int k) { return value[k]; }
  ROD_INLINE double operator[](int k) const { return value[k]; }
};

/// One vector at every node.
struct VectorField {
  ScalarField x, y, z;
  ROD_INLINE Triad<Pack> operator[](int p) const { return {x.pack[p], y.pack[p], z.pack[p]}; }
  ROD_INLINE Vec3 at(int k) const { return {x[k], y[k], z[k]}; }
  ROD_INLINE void put(int k, const Vec3& a) { x[k] = a.x, y[k] = a.y, z[k] = a.z; }
  /// Writes pack p. Components of type Zero are not written.
  template <class X, class Y, class Z>
  ROD_INLINE void set(int p, const Triad<X, Y, Z>& a) {
    if constexpr (Number<X>) x.pack[p] = a.x;
    if constexpr (Number<Y>) y.pack[p] = a.y;
    if constexpr (Number<Z>) z.pack[p] = a.z;
  }
};

/// Component c of a field.
inline ScalarField& component(VectorField& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }
inline const ScalarField& component(const VectorField& f, int c) { return c == 0 ? f.x : c == 1 ? f.y : f.z; }

struct RotationField {
  VectorField row0, row1, row2;
  ROD_INLINE Rotation<Pack> operator[](int p) const { return {row0[p], row1[p], row2[p]}; }
  template <class A, class B, class C>
  ROD_INLINE void set(int p, const Rows<A, B, C>& R) {
    row0.set(p, R.row0), row1.set(p, R.row1), row2.set(p, R.row2);
  }
};

/// The number a as a component of type T: itself, or Zero.
template <Scalar T, Number A>
ROD_INLINE auto restrict_component(const A& a) {
  if constexpr (std::same_as<T, Zero>)
    return Zero{};
  else
    return a;
}
/// The components of a vector that the type V has; of a field at pack p.
template <class V, Number A>
ROD_INLINE auto restrict_to(const Triad<A>& a) {
  return Triad{restrict_component<decltype(V::x)>(a.x), restrict_component<decltype(V::y)>(a.y),
               restrict_component<decltype(V::z)>(a.z)};
}
template <class V>
ROD_INLINE V restrict_to(const VectorField& f, int p) {
  return restrict_to<V>(f[p]);
}
}  // namespace rod
