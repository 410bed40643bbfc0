// The exact derivatives against differences of the residual, at random states, for every strain set and order.
#include <gtest/gtest.h>

#include "rod_support.hpp"

using namespace rod;
using rod_test::RandomState;

namespace {

Inputs all_loads() {
  Inputs u;
  u.gravity[0] = {5.0, 1.0, 0, 0}, u.gravity[2] = {-3.0, 0, 0, 0};
  u.tip_force[1] = {0.01, 0.02, 0, 0}, u.tip_force[2] = {-0.02, 0, 0, 0};
  u.tip_moment[0] = {1e-4, 0, 0, 0}, u.tip_moment[2] = {2e-4, -1e-4, 0, 0};
  for (std::size_t i = 0; i < tca_count; ++i)
    u.T[i] = {330.0 + 10.0 * i, 3.0, 0, 0}, u.delta_guess[i] = {1e-3, 1e-3, 0, 0};
  return u;
}

using Residual = std::function<Vector(double)>;  // along one direction

/// Central difference of order 4.
Vector slope(const Residual& r, double e) { return (8.0 * (r(e) - r(-e)) - (r(2 * e) - r(-2 * e))) / (12.0 * e); }

class RodTangent : public testing::TestWithParam<std::tuple<Strains, int, Closure>> {
 protected:
  Parameters parameters() const {
    Parameters p;
    std::tie(p.strains, p.order, p.closure) = GetParam();
    p.body_retardation = 0.01;
    p.tca_helix[0] = 40.0;
    return p;
  }
  /// Random strains of degree 7 vary so fast that the orientation's expansion of order 6 shows: R(q) is not to rounding
  /// the R whose variation the tangent uses.
  double bound() const { return std::get<1>(GetParam()) > 4 ? 1e-9 : 1e-10; }
};

}  // namespace

TEST_P(RodTangent, IsTheDerivativeOfTheResidual) {
  const Rod rod(parameters());
  const int n = rod.unknowns();
  const Loads loads = loads_at(all_loads(), 0.0);
  Work work, other;
  Vector r, out;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const RandomState x(n, seed);
    rod.residual(x.q.data(), x.v.data(), x.a.data(), loads, work, r);
    const Weights weights{0.7, 30.0, 900.0};
    Matrix J;
    rod.tangent(work, weights, J);
    const RandomState d(n, seed + 100);
    const Vector along = slope(
        [&](double e) {
          const Vector q = x.q + e * weights.q * d.q, v = x.v + e * weights.v * d.q, a = x.a + e * weights.a * d.q;
          rod.residual(q.data(), v.data(), a.data(), loads, other, out);
          return out;
        },
        1e-3);
    EXPECT_LT((along - J * d.q).norm(), bound() * J.norm() * d.q.norm()) << "seed " << seed;

    Vector dr;
    rod.rate_derivative(work, d.v, d.a, dr);
    const Vector rates = slope(
        [&](double e) {
          const Vector v = x.v + e * d.v, a = x.a + e * d.a;
          rod.residual(x.q.data(), v.data(), a.data(), loads, other, out);
          return out;
        },
        1e-3);
    EXPECT_LT((rates - dr).norm(), bound() * rates.norm());
  }
}

TEST_P(RodTangent, StaticToo) {
  const Rod rod(parameters());
  const int n = rod.unknowns();
  const Loads loads = loads_at(all_loads(), 0.0);
  Work work, other;
  Vector r, out;
  const RandomState x(n, 7), d(n, 8);
  rod.residual(x.q.data(), nullptr, nullptr, loads, work, r);
  Matrix J;
  rod.tangent(work, {.q = 1.0}, J);
  const Vector along = slope(
      [&](double e) {
        const Vector q = x.q + e * d.q;
        rod.residual(q.data(), nullptr, nullptr, loads, other, out);
        return out;
      },
      1e-3);
  EXPECT_LT((along - J * d.q).norm(), bound() * J.norm() * d.q.norm());
}

TEST_P(RodTangent, KnowsHowLoadsChange) {
  const Rod rod(parameters());
  const Inputs u = all_loads();
  const RandomState x(rod.unknowns(), 5);
  Work work, other;
  Vector r, out, dr;
  rod.residual(x.q.data(), x.v.data(), x.a.data(), loads_at(u, 0.0), work, r);
  rod.load_derivative(work, loads_at(u, 0.0), load_rates_at(u, 0.0), dr);
  const Vector along = slope(
      [&](double t) {
        rod.residual(x.q.data(), x.v.data(), x.a.data(), loads_at(u, t), other, out);
        return out;
      },
      1e-2);
  EXPECT_LT((along - dr).norm(), bound() * dr.norm());
}

INSTANTIATE_TEST_SUITE_P(
    AllSets, RodTangent,
    testing::Combine(testing::Values(Strains::bending, Strains::extensible, Strains::kirchhoff, Strains::cosserat),
                     testing::Values(0, 1, 4, 7), testing::Values(Closure::inside, Closure::exchanged)));
