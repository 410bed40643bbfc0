// The rod for the number of TCAs this file is compiled for: closed form, exact tangent, planar against spatial.
#include <gtest/gtest.h>

#include <cmath>

#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;

TEST(Count, EvenHeatStretchesAndBendsByTheSmallStrainForms) {
  const Parameters p;
  const TcaLaw law(p);
  const Section section = Section::of(p);
  const double EI = section.stiffness[0], EA = section.stiffness[5], k = law.stiffness(), L = p.body_length;
  Bench bench(p);
  for (Polynomial& T : bench.inputs.T) T[0] = p.T_0 + 1e-4;
  ASSERT_TRUE(bench.solve_equilibrium());
  const double push = k * law.free_stroke(p.T_0 + 1e-4);
  const double N = kTcas, r = p.tca_offset;
  if (kTcas > 1) {  // even azimuths: no bending
    EXPECT_NEAR(bench.state.q[5], N * push / (EA + N * k * L), 1e-6 * bench.state.q[5]);
    EXPECT_NEAR(bench.state.q[1], 0.0, 1e-6 * bench.state.q[5]);
  } else {  // EA e = F, EI kappa = -r F, F = push - k L (e - r kappa)
    const double F = push / (1.0 + k * L * (1.0 / EA + r * r / EI));
    EXPECT_NEAR(bench.state.q[5], F / EA, 1e-5 * F / EA);
    EXPECT_NEAR(bench.state.q[1], -L * r * F / EI, 1e-5 * L * r * F / EI);
  }
}

TEST(Count, TangentIsExact) {
  Parameters p;
  p.order = 2, p.body_retardation = 0.01;
  const Rod rod(p);
  const rod_test::RandomState x(rod.unknowns(), 1), d(rod.unknowns(), 2);
  Inputs u;
  for (std::size_t i = 0; i < kTcas; ++i) u.T[i][0] += 10.0 * (i + 1);
  const Loads loads = loads_at(u, 0.0);
  Workspace work, other;
  Vector r, out;
  Matrix J;
  rod.residual(x.q.data(), x.v.data(), x.a.data(), loads, work, r);
  rod.tangent(work, {.q = 1.0}, J);
  const auto along = [&](double e) {
    const Vector q = x.q + e * d.q;
    rod.residual(q.data(), x.v.data(), x.a.data(), loads, other, out);
    return out;
  };
  EXPECT_LT(rod_test::error(along, J * d.q), 1e-10 * J.norm() * d.q.norm());
}

TEST(Count, PlanarIsSpatialWhereHeatIsSymmetric) {
  Parameters p;  // the first TCA lies in the plane, the others mirror each other
  Bench spatial(p);
  p.planar = true;
  Bench planar(p);
  for (Bench* bench : {&spatial, &planar}) {
    bench->inputs.gravity[0][0] = 3.0;
    bench->inputs.T[0][0] += 20.0;
    ASSERT_TRUE(bench->solve_equilibrium());
  }
  const Outputs a = spatial.outputs(), b = planar.outputs();
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a.tip_p[c], b.tip_p[c], 1e-12);
  for (std::size_t i = 0; i < kTcas; ++i) EXPECT_NEAR(a.delta[i], b.delta[i], 1e-12);
  EXPECT_LT(b.out_of_plane, 1e-12);
}
