// A mesh of spectral elements (Gauss-Lobatto-Legendre nodes, order p): what shape alone decides of the matrices.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "mesh/cross_section.hpp"
#include "mesh/peak.hpp"

namespace thermal {

/// A sparse matrix whose entries are sums of addends, each at a place that stays.
struct EntryPlaces {
  std::vector<int> begins, rows;  // of the matrix as Eigen stores it: first entry of each column, row of each entry
  std::vector<int> places;        // of each addend: the entry that it belongs to

  /// The matrix with zeros in the place of the sums.
  Eigen::SparseMatrix<double> zeros() const;
};

struct Place {
  int row, column;
};

/// The places of addends in a square matrix.
EntryPlaces find_places(Eigen::Index size, const std::vector<Place>& addends);

/// Local node (i, j): s at the rule's node i, t at its node j, counted i + (p + 1) j.
struct HeatElement {
  int tca = -1;                   // -1: body
  bool is_at_surface = false;     // its nodes (i, p) lie on the outer circle
  std::vector<int> node;          // numbers of its nodes in the mesh
  Eigen::VectorXd area;           // quadrature weights [m2]
  Eigen::VectorXd edge;           // quadrature weights along the side at t_to, nodes (i, p) [m]
  std::vector<double> diffusion;  // addends of the stiffness for conductivity 1 [1]
};

struct HeatMesh {
  std::vector<HeatElement> elements;
  EntryPlaces stiffness;                // of each element: those of `diffusion`, then one for each node at the surface
  std::vector<Eigen::Vector2d> points;  // of the nodes [m]
  std::vector<int> probes;              // nodes of the TCAs and of the surface, where T_max is looked for
  std::vector<ProbePatch> probe_patches;  // elements and edges that they belong to
  int order = 0;                          // of the elements

  Eigen::Index size() const { return static_cast<Eigen::Index>(points.size()); }
};

/// Points of different patches closer than `closeness` [m] are one node. Fails when an element is folded.
core::Result<HeatMesh> heat_mesh(const std::vector<Patch>& patches, double closeness, int order);

}  // namespace thermal
