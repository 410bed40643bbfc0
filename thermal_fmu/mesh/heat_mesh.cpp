#include "mesh/heat_mesh.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "mesh/spectral.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

struct Element {
  std::vector<Vector2d> points;
  Eigen::VectorXd area;  // as in HeatElement
  MatrixXd diffusion;    // for conductivity 1 [1]
  Eigen::VectorXd edge;
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

/// Fills the probes and their patches.
void find_probes(HeatMesh& mesh) {
  const auto n = static_cast<std::size_t>(mesh.order + 1);
  const auto first_of = [&](const HeatElement& e) { return e.tca >= 0 ? 0 : n * (n - 1); };
  std::vector<int> probe_of(mesh.points.size(), -1);
  for (const HeatElement& e : mesh.elements)
    if (e.tca >= 0 || e.is_at_surface)
      for (std::size_t i = first_of(e); i < n * n; ++i) probe_of[static_cast<std::size_t>(e.node[i])] = 0;
  for (std::size_t k = 0; k < probe_of.size(); ++k)
    if (probe_of[k] == 0) {
      probe_of[k] = static_cast<int>(mesh.probes.size());
      mesh.probes.push_back(static_cast<int>(k));
    }
  for (const HeatElement& e : mesh.elements) {
    if (e.tca < 0 && !e.is_at_surface) continue;
    ProbePatch& patch = mesh.probe_patches.emplace_back();
    patch.rows = static_cast<int>(n);
    patch.columns = e.tca >= 0 ? static_cast<int>(n) : 1;
    for (std::size_t i = first_of(e); i < n * n; ++i)
      patch.probes.push_back(probe_of[static_cast<std::size_t>(e.node[i])]);
  }
}

}  // namespace

Eigen::SparseMatrix<double> EntryPlaces::zeros() const {
  const auto size = static_cast<Index>(begins.size()) - 1;
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.resizeNonZeros(static_cast<Index>(rows.size()));
  std::copy(begins.begin(), begins.end(), matrix.outerIndexPtr());
  std::copy(rows.begin(), rows.end(), matrix.innerIndexPtr());
  matrix.coeffs().setZero();
  return matrix;
}

EntryPlaces find_places(Index size, const std::vector<Place>& addends) {
  const auto columns = static_cast<std::size_t>(size);
  std::vector<int> begins(columns + 1, 0);
  for (const Place& each : addends) ++begins[static_cast<std::size_t>(each.column) + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  struct Addend {
    int row, number;
  };
  std::vector<Addend> by_column(addends.size());
  std::vector<int> next = begins;
  for (std::size_t k = 0; k < addends.size(); ++k)
    by_column[next[addends[k].column]++] = {addends[k].row, static_cast<int>(k)};

  EntryPlaces result;
  result.places.resize(addends.size());
  result.begins.push_back(0);
  result.rows.reserve(addends.size());
  std::vector<int>& rows = result.rows;
  std::vector<int> entry_of(columns, -1);  // of each row, in the column that it was met last
  for (std::size_t column = 0; column < columns; ++column) {
    const auto first = static_cast<int>(rows.size());
    for (int k = begins[column]; k < begins[column + 1]; ++k) {
      const int row = by_column[k].row;
      if (entry_of[row] < first) {
        entry_of[row] = first;
        rows.push_back(row);
      }
    }
    std::sort(rows.begin() + first, rows.end());
    for (std::size_t entry = first; entry < rows.size(); ++entry) entry_of[rows[entry]] = static_cast<int>(entry);
    for (int k = begins[column]; k < begins[column + 1]; ++k)
      result.places[by_column[k].number] = entry_of[by_column[k].row];
    result.begins.push_back(static_cast<int>(rows.size()));
  }
  return result;
}

core::Result<HeatMesh> heat_mesh(const std::vector<Patch>& patches, double closeness, int order) {
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
  const std::vector<int> number = merged(points, closeness, count);

  HeatMesh mesh;
  mesh.order = order;
  mesh.points.resize(count);
  for (std::size_t k = 0; k < points.size(); ++k) mesh.points[number[k]] = points[k];
  std::vector<Place> addends;
  addends.reserve(patches.size() * (locals * locals + n));
  mesh.elements.reserve(patches.size());
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const int* const node = number.data() + k * locals;
    HeatElement& e = mesh.elements.emplace_back();
    e.tca = patches[k].tca;
    e.is_at_surface = patches[k].is_at_surface;
    e.node.assign(node, node + locals);
    e.area = std::move(elements[k].area);
    e.edge = std::move(elements[k].edge);
    e.diffusion.reserve(static_cast<std::size_t>(locals * locals));
    for (Index b = 0; b < locals; ++b)
      for (Index a = 0; a < locals; ++a) {
        if (elements[k].diffusion(a, b) == 0.0) continue;
        e.diffusion.push_back(elements[k].diffusion(a, b));
        addends.push_back({node[a], node[b]});
      }
    if (!e.is_at_surface) continue;
    for (Index i = n * (n - 1); i < locals; ++i) addends.push_back({node[i], node[i]});
  }
  mesh.stiffness = find_places(count, addends);
  find_probes(mesh);
  return mesh;
}

}  // namespace thermal
