#include "mesh/heat_matrices.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mesh/spectral.hpp"
#include "physics/convection.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

/// Local node (i, j): s at the rule's node i, t at its node j, counted i + (p + 1) j.
struct Element {
  std::vector<Vector2d> points;
  Eigen::VectorXd area;  // quadrature weights [m2]
  MatrixXd diffusion;    // for conductivity 1 [1]
  Eigen::VectorXd edge;  // quadrature weights along the side at t_to, nodes (i, p) [m]
};

core::Result<Element> element(const Patch& patch, const LobattoRule& rule) {
  const Index n = rule.nodes.size();
  Element e{std::vector<Vector2d>(n * n), Eigen::VectorXd(n * n), MatrixXd::Zero(n * n, n * n), Eigen::VectorXd(n)};
  const double half = 0.5 * (patch.t_to - patch.t_from);
  MatrixXd g_ss(n, n), g_st(n, n), g_tt(n, n);  // weighted metric at the nodes
  for (Index i = 0; i < n; ++i) {
    const Vector2d inner = patch.inner.at(rule.nodes[i]), outer = patch.outer.at(rule.nodes[i]);
    const Vector2d inner_slope = patch.inner.slope(rule.nodes[i]), outer_slope = patch.outer.slope(rule.nodes[i]);
    for (Index j = 0; j < n; ++j) {
      const double t = patch.t_from + half * (1.0 + rule.nodes[j]);
      const Vector2d s_slope = (1.0 - t) * inner_slope + t * outer_slope;
      const Vector2d t_slope = half * (outer - inner);
      const double jacobian = t_slope.x() * s_slope.y() - t_slope.y() * s_slope.x();
      if (!(jacobian > 0.0)) {
        return core::Status::error("the mesh of the cross-section folds: the TCAs leave too thin a wall",
                                   "change tca.offset, tca.outer_radius or tca.azimuth");
      }
      const double weight = rule.weights[i] * rule.weights[j];
      e.points[i + n * j] = (1.0 - t) * inner + t * outer;
      e.area[i + n * j] = weight * jacobian;
      g_ss(i, j) = weight * t_slope.squaredNorm() / jacobian;
      g_st(i, j) = -weight * t_slope.dot(s_slope) / jacobian;
      g_tt(i, j) = weight * s_slope.squaredNorm() / jacobian;
      if (j == n - 1) e.edge[i] = rule.weights[i] * s_slope.norm();
    }
  }
  // Integral of grad u . grad v = sum over nodes of g_ss u_s v_s + g_st (u_s v_t + u_t v_s) + g_tt u_t v_t, where
  // slopes along s couple nodes of one row j, slopes along t nodes of one column i.
  const MatrixXd& d = rule.derivative;
  for (Index j = 0; j < n; ++j) {
    const MatrixXd row = d.transpose() * g_ss.col(j).asDiagonal() * d;
    for (Index a = 0; a < n; ++a)
      for (Index b = 0; b < n; ++b) e.diffusion(a + n * j, b + n * j) += row(a, b);
  }
  for (Index i = 0; i < n; ++i) {
    const MatrixXd column = d.transpose() * g_tt.row(i).asDiagonal() * d;
    for (Index a = 0; a < n; ++a)
      for (Index b = 0; b < n; ++b) e.diffusion(i + n * a, i + n * b) += column(a, b);
  }
  for (Index a = 0; a < n; ++a)
    for (Index j = 0; j < n; ++j)
      for (Index i = 0; i < n; ++i)
        for (Index b = 0; b < n; ++b) {
          // u_s at node (i, j) sees node (a, j); v_t there sees node (i, b).
          const double mixed = g_st(i, j) * d(i, a) * d(j, b);
          e.diffusion(a + n * j, i + n * b) += mixed;
          e.diffusion(i + n * b, a + n * j) += mixed;
        }
  return e;
}

/// Numbers nodes so that points of different elements closer than `closeness` are one node.
std::vector<int> merged(const std::vector<Vector2d>& points, double closeness, int& count) {
  std::vector<int> by_x(points.size()), number(points.size(), -1);
  std::iota(by_x.begin(), by_x.end(), 0);
  std::sort(by_x.begin(), by_x.end(), [&](int a, int b) { return points[a].x() < points[b].x(); });
  count = 0;
  for (std::size_t a = 0; a < by_x.size(); ++a) {
    if (number[by_x[a]] >= 0) continue;
    number[by_x[a]] = count;
    for (std::size_t b = a + 1; b < by_x.size() && points[by_x[b]].x() - points[by_x[a]].x() < closeness; ++b) {
      if ((points[by_x[b]] - points[by_x[a]]).norm() < closeness) number[by_x[b]] = count;
    }
    ++count;
  }
  return number;
}

}  // namespace

core::Result<HeatMatrices> heat_matrices(const Parameters& parameters, int order) {
  if (core::Status status = check(parameters.body, parameters.tca); !status.is_ok()) return status;
  return heat_matrices(cross_section(parameters.body, parameters.tca), parameters, parameters.tca.count, order);
}

core::Result<HeatMatrices> heat_matrices(const std::vector<Patch>& patches, const Parameters& parameters,
                                         std::size_t tcas, int order) {
  const Body& body = parameters.body;
  const Tca& tca = parameters.tca;
  const LobattoRule rule = lobatto_rule(order);
  const Index n = rule.nodes.size(), locals = n * n;

  std::vector<Element> elements;
  std::vector<Vector2d> points;
  for (const Patch& patch : patches) {
    core::Result<Element> next = element(patch, rule);
    if (!next.status.is_ok()) return std::move(next.status);
    elements.push_back(std::move(next.value));
    points.insert(points.end(), elements.back().points.begin(), elements.back().points.end());
  }
  int count = 0;
  const std::vector<int> number = merged(points, 1e-10 * body.radius, count);

  HeatMatrices m;
  m.points.resize(count);
  for (std::size_t k = 0; k < points.size(); ++k) m.points[number[k]] = points[k];
  m.mass = Eigen::VectorXd::Zero(count);
  const auto surface = static_cast<Index>(tcas);  // column of the loads, behind the TCAs
  m.loads = MatrixXd::Zero(count, surface + 1);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(patches.size() * (locals * locals + n));
  std::vector<bool> is_probe(count, false);
  const double h = Convection(parameters).reference();
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const Patch& patch = patches[k];
    const Element& e = elements[k];
    const int* node = number.data() + k * locals;
    const bool is_tca = patch.tca >= 0;
    const double rho_c = body.length * (is_tca ? tca.rho_c[patch.tca] : body.rho_c);
    const double conductivity = body.length * (is_tca ? tca.k[patch.tca] : body.k);
    for (Index b = 0; b < locals; ++b) {
      m.mass[node[b]] += rho_c * e.area[b];
      if (is_tca) m.loads(node[b], patch.tca) += e.area[b], is_probe[node[b]] = true;
      for (Index a = 0; a < locals; ++a) {
        if (e.diffusion(a, b) != 0.0) entries.emplace_back(node[a], node[b], conductivity * e.diffusion(a, b));
      }
    }
    if (!patch.is_at_surface) continue;
    for (Index i = 0; i < n; ++i) {
      const int at = node[i + n * (n - 1)];
      const double convection = h * body.length * e.edge[i];
      m.loads(at, surface) += convection;
      entries.emplace_back(at, at, convection);
      is_probe[at] = true;
    }
  }
  for (Index i = 0; i < surface; ++i) m.loads.col(i) /= m.loads.col(i).sum();  // annulus area -> mean
  m.surface_conductance = m.loads.col(surface).sum();
  m.stiffness.resize(count, count);
  m.stiffness.setFromTriplets(entries.begin(), entries.end());
  std::vector<int> probe_of(count, -1);
  for (int i = 0; i < count; ++i)
    if (is_probe[i]) {
      probe_of[i] = static_cast<int>(m.probes.size());
      m.probes.push_back(i);
    }
  m.order = order;
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const int* node = number.data() + k * locals;
    const bool is_tca = patches[k].tca >= 0;
    if (!is_tca && !patches[k].is_at_surface) continue;
    ProbePatch& patch = m.probe_patches.emplace_back();
    patch.rows = static_cast<int>(n);
    patch.columns = is_tca ? static_cast<int>(n) : 1;
    for (Index i = is_tca ? 0 : n * (n - 1); i < locals; ++i) patch.probes.push_back(probe_of[node[i]]);
  }
  return m;
}

}  // namespace thermal
