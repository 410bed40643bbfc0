#include "mesh/peak.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace thermal {
namespace {

constexpr int kMostNodes = 16;  // per side of an element; orders go up to 10

/// Values of the Lagrange polynomials at x.
void lagrange(const LobattoRule& rule, const Eigen::VectorXd& weights, double x,
              std::array<double, kMostNodes>& values) {
  const auto n = static_cast<std::size_t>(rule.nodes.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double distance = x - rule.nodes[static_cast<Eigen::Index>(i)];
    if (distance == 0.0) {
      values.fill(0.0);
      values[i] = 1.0;
      return;
    }
    values[i] = weights[static_cast<Eigen::Index>(i)] / distance;
    sum += values[i];
  }
  for (std::size_t i = 0; i < n; ++i) values[i] /= sum;
}

}  // namespace

Peak::Peak(const std::vector<ProbePatch>& patches, int probe_count, int order)
    : patches_(patches), rule_(lobatto_rule(order)), second_(rule_.derivative * rule_.derivative) {
  const Eigen::Index n = rule_.nodes.size();
  barycentric_.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    double product = 1.0;
    for (Eigen::Index j = 0; j < n; ++j)
      if (j != i) product *= rule_.nodes[i] - rule_.nodes[j];
    barycentric_[i] = 1.0 / product;
  }
  std::vector<std::vector<PatchNode>> by_probe(static_cast<std::size_t>(probe_count));
  for (std::size_t p = 0; p < patches_.size(); ++p)
    for (std::size_t k = 0; k < patches_[p].probes.size(); ++k)
      by_probe[static_cast<std::size_t>(patches_[p].probes[k])].push_back(
          {static_cast<int>(p), static_cast<int>(k) % patches_[p].rows, static_cast<int>(k) / patches_[p].rows});
  for (const auto& nodes : by_probe) {
    first_.push_back(static_cast<int>(patch_nodes_.size()));
    patch_nodes_.insert(patch_nodes_.end(), nodes.begin(), nodes.end());
  }
  first_.push_back(static_cast<int>(patch_nodes_.size()));
}

double Peak::of(const Eigen::Ref<const Eigen::VectorXd>& values) const {
  Eigen::Index hottest = 0;
  const double at_node = values.maxCoeff(&hottest);
  double most = at_node;
  if (first_.empty()) return most;
  const auto probe = static_cast<std::size_t>(hottest);
  for (int k = first_[probe]; k < first_[probe + 1]; ++k)
    most = std::max(most, in_patch(values, patch_nodes_[static_cast<std::size_t>(k)], at_node));
  return most;
}

double Peak::in_patch(const Eigen::Ref<const Eigen::VectorXd>& values, const PatchNode& node, double at_node) const {
  const ProbePatch& patch = patches_[static_cast<std::size_t>(node.patch)];
  const int n = patch.rows;
  const auto at = [&](int i, int j) {
    const auto index = static_cast<std::size_t>(i) + static_cast<std::size_t>(n) * static_cast<std::size_t>(j);
    return values[patch.probes[index]];
  };
  // Slope and curvature along s; a step that would leave the element stays at its side.
  double s_slope = 0.0, s_bend = 0.0, t_slope = 0.0, t_bend = 0.0, mixed = 0.0;
  for (int i = 0; i < n; ++i) {
    s_slope += rule_.derivative(node.i, i) * at(i, node.j);
    s_bend += second_(node.i, i) * at(i, node.j);
  }
  const double s_here = rule_.nodes[node.i];
  const auto leaves = [](double here, double slope) {
    return (here >= 1.0 && slope > 0.0) || (here <= -1.0 && slope < 0.0);
  };
  bool moves_s = s_bend < 0.0 && !leaves(s_here, s_slope), moves_t = false;
  double t_here = 0.0;
  if (patch.columns > 1) {
    t_here = rule_.nodes[node.j];
    for (int j = 0; j < n; ++j) {
      t_slope += rule_.derivative(node.j, j) * at(node.i, j);
      t_bend += second_(node.j, j) * at(node.i, j);
    }
    moves_t = t_bend < 0.0 && !leaves(t_here, t_slope);
    if (moves_s && moves_t)
      for (int j = 0; j < n; ++j) {
        double along = 0.0;
        for (int i = 0; i < n; ++i) along += rule_.derivative(node.i, i) * at(i, j);
        mixed += rule_.derivative(node.j, j) * along;
      }
  }
  if (!moves_s && !moves_t) return at_node;
  double ds = moves_s ? -s_slope / s_bend : 0.0, dt = moves_t ? -t_slope / t_bend : 0.0;
  const double determinant = s_bend * t_bend - mixed * mixed;
  if (moves_s && moves_t && determinant > 0.0) {
    ds = (mixed * t_slope - t_bend * s_slope) / determinant;
    dt = (mixed * s_slope - s_bend * t_slope) / determinant;
  }
  return interpolated(values, patch, std::clamp(s_here + ds, -1.0, 1.0), std::clamp(t_here + dt, -1.0, 1.0));
}

double Peak::interpolated(const Eigen::Ref<const Eigen::VectorXd>& values, const ProbePatch& patch, double s,
                          double t) const {
  std::array<double, kMostNodes> along_s{}, along_t{1.0};
  lagrange(rule_, barycentric_, s, along_s);
  if (patch.columns > 1) lagrange(rule_, barycentric_, t, along_t);
  double sum = 0.0;
  std::size_t k = 0;
  for (int j = 0; j < patch.columns; ++j)
    for (int i = 0; i < patch.rows; ++i, ++k)
      sum += along_s[static_cast<std::size_t>(i)] * along_t[static_cast<std::size_t>(j)] * values[patch.probes[k]];
  return sum;
}

}  // namespace thermal
