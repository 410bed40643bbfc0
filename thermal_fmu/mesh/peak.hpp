// Maximum of a temperature field over the TCAs and the surface, not of its nodes only.
//
// In an element the field is a polynomial through the nodes. From the hottest node one Newton step per element that
// holds it leads to the stationary point, where the polynomial is evaluated.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mesh/spectral.hpp"

namespace thermal {

/// Nodes of one element of a TCA (n x n) or of one edge of the surface (n x 1), as places in the list of probes.
struct ProbePatch {
  std::vector<int> probes;  // node (i, j) at i + n j
  int rows = 0;             // n of `rule`
  int columns = 0;          // n or 1
};

class Peak {
 public:
  /// Without patches: the maximum of the nodes.
  Peak() = default;
  Peak(const std::vector<ProbePatch>& patches, int probe_count, int order);

  /// The maximum of the field with these values at the probes.
  double of(const Eigen::Ref<const Eigen::VectorXd>& values) const;

 private:
  struct PatchNode {
    int patch, i, j;
  };
  double in_patch(const Eigen::Ref<const Eigen::VectorXd>& values, const PatchNode& node, double at_node) const;
  double interpolated(const Eigen::Ref<const Eigen::VectorXd>& values, const ProbePatch& patch, double s,
                      double t) const;

  std::vector<ProbePatch> patches_;
  std::vector<PatchNode> patch_nodes_;  // by probe: elements that hold it
  std::vector<int> first_;              // of a probe in patch_nodes_; one more at the end
  LobattoRule rule_;
  Eigen::MatrixXd second_;       // (i, j): second derivative of the j-th Lagrange polynomial at node i
  Eigen::VectorXd barycentric_;  // weights of the Lagrange polynomials
};

}  // namespace thermal
