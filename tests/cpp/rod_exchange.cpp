// The rod as model exchange: rates and directional derivatives against the exact tangents of the residual,
//   M a = -r(q, v, 0),  da = -M^-1 (r_q dq + r_v dv + r_u du).
#include <gtest/gtest.h>

#include <algorithm>

#include "description/blueprint.hpp"
#include "fmi2Functions.h"
#include "mechanics/uniform_rod.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::RandomState;

namespace {

fmi2ValueReference reference(const std::string& name) {
  const auto& rows = fmu::Blueprint::get().rows;
  return static_cast<fmi2ValueReference>(std::ranges::find(rows, name, &fmu::Variable::name) - rows.begin());
}

/// Index of each unknown among the states of the largest rod.
std::vector<int> state_indices(const Rod& rod) {
  std::vector<int> where;
  for (int k = 0; k < rod.unknowns(); ++k) {
    std::vector<double> states(kStrainStates);
    const Vector unit = Vector::Unit(rod.unknowns(), k);
    rod.to_states(unit.data(), states.data());
    where.push_back(static_cast<int>(std::ranges::max_element(states) - states.begin()));
  }
  return where;
}

struct Instance {
  explicit Instance(const Parameters& p)
      : fmu(fmi2Instantiate("rod", fmi2ModelExchange, fmu::Blueprint::get().guid.c_str(), "", nullptr, 0, 0)) {
    const fmi2ValueReference retardation = reference("body.retardation"), order = reference("order"),
                             strains = reference("strains"), planar = reference("planar");
    const fmi2Boolean flat = p.planar;
    const int kind = static_cast<int>(p.segment[0].strains);
    fmi2SetReal(fmu, &retardation, 1, &p.segment[0].retardation);
    fmi2SetInteger(fmu, &order, 1, &p.segment[0].order);
    fmi2SetInteger(fmu, &strains, 1, &kind);
    fmi2SetBoolean(fmu, &planar, 1, &flat);
    fmi2EnterInitializationMode(fmu);
    EXPECT_EQ(fmi2ExitInitializationMode(fmu), fmi2OK);
    fmi2EnterContinuousTimeMode(fmu);
  }
  ~Instance() { fmi2FreeInstance(fmu); }
  fmi2Component fmu;
};

class RodExchange : public testing::TestWithParam<std::tuple<Strains, int, bool>> {
 protected:
  RodExchange() {
    std::tie(p.segment[0].strains, p.segment[0].order, p.planar) = GetParam();
    p.set(&Segment::retardation, 0.01);
  }
  Parameters p;
};

}  // namespace

TEST_P(RodExchange, RatesAndTheirDerivativesAreExact) {
  const UniformRod rod(p);
  const int n = rod.unknowns();
  const std::vector<int> index = state_indices(rod);
  const RandomState at(n, 5);
  Instance instance(p);
  std::vector<double> x(2 * kStrainStates + 1), dx(x.size());
  for (int k = 0; k < n; ++k) x[index[k]] = at.q[k], x[kStrainStates + index[k]] = at.v[k];
  ASSERT_EQ(fmi2SetContinuousStates(instance.fmu, x.data(), x.size()), fmi2OK);
  const double T = 320.0;
  const fmi2ValueReference heated = reference("T[1]");
  ASSERT_EQ(fmi2SetReal(instance.fmu, &heated, 1, &T), fmi2OK);
  ASSERT_EQ(fmi2GetDerivatives(instance.fmu, dx.data(), dx.size()), fmi2OK);

  Inputs u;
  u.T[0] = {T, 1.0, 0, 0};
  const Loads loads = loads_at(u, 0.0);
  Workspace work;
  Vector r, a(n), zero = Vector::Zero(n);
  rod.residual(at.q.data(), at.v.data(), zero.data(), loads, work, r);
  Matrix M, K, D;
  rod.tangent(work, {.a = 1.0}, M);
  const Eigen::PartialPivLU<Eigen::MatrixXd> mass{Eigen::MatrixXd(M)};
  a = -mass.solve(r);
  for (int k = 0; k < n; ++k) {
    EXPECT_EQ(dx[index[k]], at.v[k]);
    EXPECT_NEAR(dx[kStrainStates + index[k]], a[k], 1e-9 * a.cwiseAbs().maxCoeff());
  }
  EXPECT_NEAR(dx.back(), rod.damping_power(at.v), 1e-12 * dx.back());

  // All derivatives of the accelerations: columns q, v, T[1].
  rod.residual(at.q.data(), at.v.data(), a.data(), loads, work, r);
  rod.tangent(work, {.q = 1.0}, K);
  rod.tangent(work, {.v = 1.0}, D);
  Vector r_T;
  rod.load_derivative(work, loads, load_rates_at(u, 0.0), r_T);
  Eigen::MatrixXd exact(n, 2 * n + 1), computed(n, 2 * n + 1);
  exact << -mass.solve(Eigen::MatrixXd(K)), -mass.solve(Eigen::MatrixXd(D)), -mass.solve(Eigen::VectorXd(r_T));
  const auto first = reference("strain[1,1]"), first_rate = reference("der(strain[1,1])");
  std::vector<fmi2ValueReference> unknowns;
  for (int k = 0; k < n; ++k) unknowns.push_back(first_rate + kStrainStates + index[k]);
  for (int j = 0; j <= 2 * n; ++j) {
    const fmi2ValueReference known = j == 2 * n ? heated : first + (j < n ? 0 : kStrainStates) + index[j % n];
    const double seed = 1.0;
    ASSERT_EQ(fmi2GetDirectionalDerivative(instance.fmu, unknowns.data(), n, &known, 1, &seed, &computed(0, j)),
              fmi2OK);
  }
  for (int j = 0; j <= 2 * n; ++j)
    EXPECT_LT((computed.col(j) - exact.col(j)).norm(), 1e-9 * exact.col(j).norm()) << "column " << j;
}

INSTANTIATE_TEST_SUITE_P(All, RodExchange,
                         testing::Values(std::tuple{Strains::bending, 4, false},
                                         std::tuple{Strains::extensible, 2, false},
                                         std::tuple{Strains::kirchhoff, 3, false},
                                         std::tuple{Strains::cosserat, 0, false},
                                         std::tuple{Strains::cosserat, 7, false}, std::tuple{Strains::bending, 3, true},
                                         std::tuple{Strains::cosserat, 5, true}));
