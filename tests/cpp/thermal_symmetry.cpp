// A cyclic section in its harmonics is the section as a whole.
#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <numeric>

#include "mesh/heat_section.hpp"
#include "thermal_scene.hpp"

namespace thermal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Evenly spread TCAs in an order that is not theirs by azimuth, the first away from azimuth 0.
Parameters shuffled(std::size_t count) {
  Parameters p(count);
  for (std::size_t i = 0; i < count; ++i)
    p.tca.azimuth[i] = 0.4 + 2.0 * M_PI * static_cast<double>((i * (count - 1)) % count) / static_cast<double>(count);
  return p;
}

/// Largest difference of step responses of all channels in themselves and in each other, in the reference rise.
double largest_difference(const ModalModel& a, const ModalModel& b) {
  const auto response = [](const ModalModel& m, double t) -> MatrixXd {
    const VectorXd gain = -(-m.rate * t).array().expm1() / m.rate.array();
    return m.load.transpose() * gain.asDiagonal() * m.load;
  };
  double largest = 0.0;
  for (double t = 1e-3; t < 1e6; t *= 10.0) {
    const MatrixXd one = response(a, t), other = response(b, t);
    largest = std::max(largest, ((one - other).cwiseAbs().maxCoeff()) / one.cwiseAbs().maxCoeff());
  }
  return largest;
}

class Cyclic : public testing::TestWithParam<std::tuple<std::size_t, double>> {
 protected:
  const std::size_t count = std::get<0>(GetParam());
  const double h = std::get<1>(GetParam());
};

TEST_P(Cyclic, HarmonicsHaveTheResponsesOfTheWhole) {
  Parameters p = shuffled(count);
  p.h = h;
  const HeatSection section = must(heat_section(p, 3));
  const HeatMatrices whole = must(heat_matrices(p, 3));
  ASSERT_EQ(section.parts.size(), count / 2 + 1);
  Eigen::Index unknowns = 0;
  for (const HeatPart& part : section.parts)
    unknowns += part.system.size() * static_cast<Eigen::Index>(part.copies.size());
  // All of the whole's but those that are odd in every harmonic with one copy: no channel reaches them.
  EXPECT_LE(unknowns, whole.size());
  EXPECT_GE(unknowns, whole.size() / 2);
  EXPECT_NEAR(section.surface_conductance / whole.surface_conductance, 1.0, 1e-12);
  EXPECT_NEAR(heat_capacity(section) / whole.mass.sum(), 1.0, 1e-12);
  ASSERT_EQ(section.probes, static_cast<Eigen::Index>(whole.probes.size()));
  for (const double shift : {1e-3, 1.0, 1e3}) {
    const double s = shift * whole.surface_conductance / whole.mass.sum();
    MatrixXd response = MatrixXd::Zero(section.tcas + 1, section.tcas + 1);
    for (const HeatPart& part : section.parts) {
      Eigen::SparseMatrix<double> shifted = part.system.stiffness;
      shifted.diagonal() += s * part.system.mass;
      const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(shifted);
      add_response(part, part.system.loads.transpose() * factor.solve(part.system.loads), response);
    }
    Eigen::SparseMatrix<double> shifted = whole.stiffness;
    shifted.diagonal() += s * whole.mass;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(shifted);
    const MatrixXd expected = whole.loads.transpose() * factor.solve(whole.loads);
    // A direct solution loses 1e-14 / Bi to rounding, see insulated.hpp.
    const double rounding = h > 1.0 ? 1e-9 : 1e-6;
    EXPECT_LT((response - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff(), rounding) << shift;
  }
}

TEST_P(Cyclic, TheReducedModelIsThatOfTheWhole) {
  Parameters p = shuffled(count);
  p.h = h;
  HeatSection section = must(heat_section(p, 3));
  const HeatMatrices whole = must(heat_matrices(p, 3));
  const ModalModel parts = reduced(section, 1e-4), one = reduced(whole, 1e-4);
  EXPECT_EQ(parts.size(), one.size());
  EXPECT_TRUE(std::is_sorted(parts.rate.begin(), parts.rate.end()));
  EXPECT_LT(((parts.rate - one.rate).cwiseQuotient(one.rate)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NEAR(parts.bound / one.bound, 1.0, 1e-4);
  EXPECT_LT((parts.step_bound - one.step_bound).cwiseAbs().maxCoeff(), 1e-4 * one.step_bound.maxCoeff());
  EXPECT_LT(((parts.reference - one.reference).cwiseQuotient(one.reference)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(parts.surface_conductance / one.surface_conductance, 1.0, 1e-12);
  EXPECT_LT(largest_difference(parts, one), 1e-8);
  // Heat of the whole: that of a uniform rise of 1 K is its capacity.
  EXPECT_NEAR(parts.capacity.squaredNorm() / whole.mass.sum(), 1.0, 1e-9);
  // The field, at a time when it is far from uniform: hottest point, and the same nodes in another order.
  VectorXd w = VectorXd::LinSpaced(section.tcas + 1, 1.0, 2.0);
  const double t = 0.01 * whole.mass.sum() / whole.surface_conductance;
  const auto field = [&](const ModalModel& m) -> VectorXd {
    const VectorXd gain = -(-m.rate * t).array().expm1() / m.rate.array();
    return m.probe * gain.cwiseProduct(m.load * w);
  };
  VectorXd a = field(parts), b = field(one);
  EXPECT_NEAR(parts.peak.of(a) / one.peak.of(b), 1.0, 1e-8);
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-7 * b.maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(Sections, Cyclic,
                         testing::Combine(testing::Values<std::size_t>(1, 2, 3, 4, 5, 6), testing::Values(20.0, 1e-5)));

TEST(Cyclic, SectionsThatAreNotEvenStayWhole) {
  const std::vector<void (*)(Parameters&)> changes{
      [](Parameters& p) { p.tca.azimuth[1] += 1e-9; },     [](Parameters& p) { p.tca.k[2] *= 1.01; },
      [](Parameters& p) { p.tca.rho_c[0] *= 1.01; },       [](Parameters& p) { p.tca.inner_radius[1] *= 1.01; },
      [](Parameters& p) { p.tca.outer_radius[1] *= 0.9; }, [](Parameters& p) { p.tca.offset[0] *= 1.01; }};
  for (const auto& change : changes) {
    Parameters p;
    change(p);
    EXPECT_EQ(must(heat_section(p, 3)).parts.size(), 1u);
  }
  Parameters p;
  p.tca.R[1] *= 2.0;  // the circuit is no part of the section
  EXPECT_EQ(must(heat_section(p, 3)).parts.size(), 2u);
}

TEST(KeptMesh, GivesTheSectionsOfANewOne) {
  const auto same = [](const HeatSection& a, const HeatSection& b) {
    ASSERT_EQ(a.parts.size(), b.parts.size());
    EXPECT_EQ(a.surface_conductance, b.surface_conductance);
    EXPECT_EQ(a.probes, b.probes);
    for (std::size_t k = 0; k < a.parts.size(); ++k) {
      EXPECT_EQ(a.parts[k].system.mass, b.parts[k].system.mass);
      EXPECT_EQ(a.parts[k].system.loads, b.parts[k].system.loads);
      EXPECT_EQ(MatrixXd(a.parts[k].system.stiffness), MatrixXd(b.parts[k].system.stiffness));
      ASSERT_EQ(a.parts[k].copies.size(), b.parts[k].copies.size());
    }
  };
  for (const double offset : {2.5e-3, 2.6e-3}) {  // cyclic, and not
    Parameters p;
    p.tca.offset[1] = offset;
    must(heat_section(p, 3));
    p.h = 40.0, p.body.k = 0.3, p.body.length = 0.05, p.body.rho_c = 1e6;
    p.tca.k.fill(0.5), p.tca.rho_c.fill(2e6);
    const HeatSection kept = must(heat_section(p, 3));
    Parameters other = p;
    for (int k = 0; k < 40; ++k) {  // more shapes than are kept
      other.body.radius *= 1.001;
      must(heat_section(other, 3));
    }
    same(kept, must(heat_section(p, 3)));
  }
}

TEST(Cyclic, ABodyOfSlightlyUnevenTcasHasNearlyTheSameResponses) {
  Parameters even, uneven;
  uneven.tca.azimuth[1] += 1e-9;
  const ModalModel a = reduced(must(resolved_section(even)), 1e-5), b = reduced(must(resolved_section(uneven)), 1e-5);
  EXPECT_LT(largest_difference(a, b), 1e-7);
}

}  // namespace
}  // namespace thermal
