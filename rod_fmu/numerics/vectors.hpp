// Vector algebra of a section, written once for numbers and for packs of numbers. A component that is known to vanish,
// such as the one across the plane of a planar rod, has the type Zero and costs nothing.
#pragma once

#include <concepts>

namespace rod {

inline constexpr int kPackSize = 4;
using Pack = double __attribute__((vector_size(kPackSize * sizeof(double))));

#define ROD_INLINE [[gnu::always_inline]] inline

template <class T>
concept Number = std::same_as<T, double> || std::same_as<T, Pack>;

struct Zero {
  ROD_INLINE Zero operator+(Zero) const { return {}; }
  ROD_INLINE Zero operator-(Zero) const { return {}; }
  ROD_INLINE Zero operator*(Zero) const { return {}; }
  ROD_INLINE Zero operator-() const { return {}; }
  ROD_INLINE Zero& operator+=(Zero) { return *this; }
};
template <Number T>
ROD_INLINE T operator+(const T& a, Zero) {
  return a;
}
template <Number T>
ROD_INLINE T operator+(Zero, const T& a) {
  return a;
}
template <Number T>
ROD_INLINE T operator-(const T& a, Zero) {
  return a;
}
template <Number T>
ROD_INLINE T operator-(Zero, const T& a) {
  return -a;
}
template <Number T>
ROD_INLINE Zero operator*(const T&, Zero) {
  return {};
}
template <Number T>
ROD_INLINE Zero operator*(Zero, const T&) {
  return {};
}

template <class T>
concept Scalar = Number<T> || std::same_as<T, Zero>;

template <class X, class Y = X, class Z = X>
struct Triad {
  X x{};
  Y y{};
  Z z{};
};
template <class X, class Y, class Z>
Triad(X, Y, Z) -> Triad<X, Y, Z>;
using Vec3 = Triad<double>;

template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto operator+(const Triad<A, B, C>& a, const Triad<X, Y, Z>& b) {
  return Triad{a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto operator-(const Triad<A, B, C>& a, const Triad<X, Y, Z>& b) {
  return Triad{a.x - b.x, a.y - b.y, a.z - b.z};
}
template <Scalar S, class X, class Y, class Z>
ROD_INLINE auto operator*(const S& s, const Triad<X, Y, Z>& a) {
  return Triad{s * a.x, s * a.y, s * a.z};
}
template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto dot(const Triad<A, B, C>& a, const Triad<X, Y, Z>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto cross(const Triad<A, B, C>& a, const Triad<X, Y, Z>& b) {
  return Triad{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Componentwise product.
template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto scale(const Triad<A, B, C>& a, const Triad<X, Y, Z>& b) {
  return Triad{a.x * b.x, a.y * b.y, a.z * b.z};
}
/// The same vector at the nodes of one pack.
ROD_INLINE Triad<Pack> broadcast(const Vec3& a) { return {a.x - Pack{}, a.y - Pack{}, a.z - Pack{}}; }

/// A matrix by its rows.
template <class A, class B = A, class C = A>
struct Rows {
  A row0;
  B row1;
  C row2;
};
template <class T>
using Rotation = Rows<Triad<T>>;

template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto operator*(const Rows<A, B, C>& R, const Triad<X, Y, Z>& a) {
  return Triad{dot(R.row0, a), dot(R.row1, a), dot(R.row2, a)};
}
/// R^T a
template <class A, class B, class C, class X, class Y, class Z>
ROD_INLINE auto transpose_times(const Rows<A, B, C>& R, const Triad<X, Y, Z>& a) {
  return a.x * R.row0 + a.y * R.row1 + a.z * R.row2;
}

/// Rotation matrix of a unit quaternion, scalar part w.
template <class T>
ROD_INLINE Rotation<T> rotation(const T& w, const T& x, const T& y, const T& z) {
  return {{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
          {2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)},
          {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)}};
}

}  // namespace rod
