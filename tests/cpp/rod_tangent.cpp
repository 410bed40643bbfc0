// The exact derivatives against differences of the residual, at random states, for every strain set and order.
#include <gtest/gtest.h>

#include "mechanics/uniform_rod.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::error;
using rod_test::RandomState;

namespace {

Inputs all_loads() {
  Inputs u;
  u.gravity[0] = {5.0, 1.0, 0, 0}, u.gravity[2] = {-3.0, 0, 0, 0};
  u.tip_force[1] = {0.01, 0.02, 0, 0}, u.tip_force[2] = {-0.02, 0, 0, 0};
  u.tip_moment[0] = {1e-4, 0, 0, 0}, u.tip_moment[2] = {2e-4, -1e-4, 0, 0};
  for (std::size_t i = 0; i < kTcas; ++i) u.T[i] = {330.0 + 10.0 * i, 3.0, 0, 0}, u.delta_guess[i] = {1e-3, 1e-3, 0, 0};
  return u;
}

constexpr double bound = 1e-10;

class RodTangent : public testing::TestWithParam<std::tuple<Strains, bool, int, Closure>> {
 protected:
  Parameters parameters() const {
    Parameters p;
    std::tie(p.segment[0].strains, p.planar, p.segment[0].order, p.closure) = GetParam();
    p.plane = 0.3;
    p.set(&Segment::retardation, 0.01);
    p.tca[0].helix = 40.0;
    return p;
  }
};

}  // namespace

TEST_P(RodTangent, IsTheDerivativeOfTheResidual) {
  const UniformRod rod(parameters());
  const int n = rod.unknowns();
  const Loads loads = loads_at(all_loads(), 0.0);
  Workspace work, other;
  Vector r, out;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const RandomState x(n, seed);
    rod.residual(x.q.data(), x.v.data(), x.a.data(), loads, work, r);
    const Weights weights{0.7, 30.0, 900.0};
    Matrix J;
    rod.tangent(work, weights, J);
    const RandomState d(n, seed + 100);
    const auto along = [&](double e) {
      const Vector q = x.q + e * weights.q * d.q, v = x.v + e * weights.v * d.q, a = x.a + e * weights.a * d.q;
      rod.residual(q.data(), v.data(), a.data(), loads, other, out);
      return out;
    };
    EXPECT_LT(error(along, J * d.q), bound * J.norm() * d.q.norm()) << "seed " << seed;

    Vector dr;
    rod.rate_derivative(work, d.v, d.a, dr);
    const auto rates = [&](double e) {
      const Vector v = x.v + e * d.v, a = x.a + e * d.a;
      rod.residual(x.q.data(), v.data(), a.data(), loads, other, out);
      return out;
    };
    EXPECT_LT(error(rates, dr), bound * dr.norm()) << "seed " << seed;
  }
}

TEST_P(RodTangent, StaticToo) {
  const UniformRod rod(parameters());
  const int n = rod.unknowns();
  const Loads loads = loads_at(all_loads(), 0.0);
  Workspace work, other;
  Vector r, out;
  const RandomState x(n, 7), d(n, 8);
  rod.static_residual(x.q.data(), loads, work, r);
  Matrix J;
  rod.tangent(work, {.q = 1.0}, J);
  const auto along = [&](double e) {
    const Vector q = x.q + e * d.q;
    rod.static_residual(q.data(), loads, other, out);
    return out;
  };
  EXPECT_LT(error(along, J * d.q), bound * J.norm() * d.q.norm());
}

TEST_P(RodTangent, KnowsHowLoadsChange) {
  const UniformRod rod(parameters());
  const Inputs u = all_loads();
  const RandomState x(rod.unknowns(), 5);
  Workspace work, other;
  Vector r, out, dr;
  rod.residual(x.q.data(), x.v.data(), x.a.data(), loads_at(u, 0.0), work, r);
  rod.load_derivative(work, loads_at(u, 0.0), load_rates_at(u, 0.0), dr);
  const auto along = [&](double t) {
    rod.residual(x.q.data(), x.v.data(), x.a.data(), loads_at(u, t), other, out);
    return out;
  };
  EXPECT_LT(error(along, dr, 1e-2), bound * dr.norm());
}

INSTANTIATE_TEST_SUITE_P(AllSets, RodTangent,
                         testing::Combine(testing::Values(Strains::bending, Strains::extensible, Strains::kirchhoff,
                                                          Strains::cosserat),
                                          testing::Bool(), testing::Range(0, kMaxOrder + 1),
                                          testing::Values(Closure::inside, Closure::exchanged)));
