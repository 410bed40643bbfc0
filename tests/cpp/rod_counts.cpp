// Rods of any number of TCAs: closed form, exact tangent, planar against spatial.
#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/uniform_rod.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;

namespace {

class RodCounts : public testing::TestWithParam<std::size_t> {};

}  // namespace

TEST_P(RodCounts, EvenHeatStretchesAndBendsByTheSmallStrainForms) {
  const std::size_t tcas = GetParam();
  const Parameters p(tcas);
  const TcaLaw law(p, 0);
  const Section section = Section::of(p);
  const double EI = section.stiffness[0], EA = section.stiffness[5], k = law.stiffness(), L = p.length();
  Bench bench(p);
  for (Polynomial& T : bench.inputs.T) T[0] = p.T_0 + 1e-4;
  ASSERT_TRUE(bench.solve_equilibrium());
  const double push = k * law.free_stroke(p.T_0 + 1e-4);
  const double N = static_cast<double>(tcas), r = p.tca[0].offset;
  if (tcas > 1) {  // even azimuths: no bending
    EXPECT_NEAR(bench.state.q[5], N * push / (EA + N * k * L), 1e-6 * bench.state.q[5]);
    EXPECT_NEAR(bench.state.q[1], 0.0, 1e-6 * bench.state.q[5]);
  } else {  // EA e = F, EI kappa = -r F, F = push - k L (e - r kappa)
    const double F = push / (1.0 + k * L * (1.0 / EA + r * r / EI));
    EXPECT_NEAR(bench.state.q[5], F / EA, 1e-5 * F / EA);
    EXPECT_NEAR(bench.state.q[1], -L * r * F / EI, 1e-5 * L * r * F / EI);
  }
}

TEST_P(RodCounts, TangentIsExact) {
  const std::size_t tcas = GetParam();
  Parameters p(tcas);
  p.set(&Segment::order, 2), p.set(&Segment::retardation, 0.01);
  const UniformRod rod(p);
  const rod_test::RandomState x(rod.unknowns(), 1), d(rod.unknowns(), 2);
  Inputs u = Bench::inputs_of(p);
  for (std::size_t i = 0; i < tcas; ++i) u.T[i][0] += 10.0 * static_cast<double>(i + 1);
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

TEST_P(RodCounts, PlanarIsSpatialWhereHeatIsSymmetric) {
  const std::size_t tcas = GetParam();
  Parameters p(tcas);  // the first TCA lies in the plane, the others mirror each other
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
  for (std::size_t i = 0; i < tcas; ++i) EXPECT_NEAR(a.delta[i], b.delta[i], 1e-12);
  EXPECT_LT(b.out_of_plane, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Tcas, RodCounts, testing::Values(1, 2, 4, 6, 12));
