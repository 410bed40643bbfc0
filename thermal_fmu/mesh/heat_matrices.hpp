// The heat problem (Eq. 1, convection of Eq. 3; docs/theory/heat.md) after discretisation in space by spectral elements
// (Gauss-Lobatto-Legendre nodes, order p):
//     mass T' = -stiffness T + sum_i mean_i P_i + surface T_ambient,
// all for the body's length. The source of TCA i is spread evenly over its annulus, so its load is the vector that
// takes the annulus' mean: T_i = mean_i' T. The surface's load takes its mean too: T_surface = surface' T / (h times
// its area).
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "mesh/heat_mesh.hpp"
#include "physics/parameters.hpp"

namespace thermal {

struct HeatSystem {
  Eigen::VectorXd mass;                   // diagonal [J/K]
  Eigen::SparseMatrix<double> stiffness;  // with the convection [W/K]; both triangles
  Eigen::MatrixXd loads;                  // columns mean_1 .. mean_N [1], surface [W/K]

  Eigen::Index size() const { return mass.size(); }
};

struct HeatMatrices : HeatSystem {
  double surface_conductance = 0.0;  // h times the surface's area, the sum of `surface` [W/K]
  std::vector<int> probes;           // as in HeatMesh
  std::vector<ProbePatch> probe_patches;
  int order = 0;
  bool is_insulated = false;  // see insulated.hpp; set where the order is searched for
  double error = 0.0;         // estimate for any T_i, in units of the reference rise; 0: not estimated

  Eigen::Index tcas() const { return loads.cols() - 1; }
};

/// Distance below which nodes of different elements are one [m].
inline double close_nodes(const Body& body) { return 1e-10 * body.radius; }

/// The system of a mesh that holds TCAs 1 to `tcas`; no heat passes its outer sides but those at the surface.
HeatSystem heat_system(const HeatMesh& mesh, const Parameters& parameters, std::size_t tcas);

/// The matrices of the mesh of a whole section.
HeatMatrices heat_matrices(const HeatMesh& mesh, const Parameters& parameters);

/// The same of a mesh made for them. Fails where check() of the cross-section or heat_mesh() does.
core::Result<HeatMatrices> heat_matrices(const Parameters& parameters, int order);

}  // namespace thermal
