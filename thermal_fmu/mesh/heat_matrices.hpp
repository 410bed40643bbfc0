// The heat problem (Eq. 1, convection of Eq. 3; docs/theory/heat.md) after discretisation in space by spectral elements
// (Gauss-Lobatto-Legendre nodes, order p):
//     mass T' = -stiffness T + sum_i mean_i P_i + surface T_ambient,
// all for the body's length. The source of TCA i is spread evenly over its annulus, so its load is the vector that
// takes the annulus' mean: T_i = mean_i' T. The surface's load takes its mean too: T_surface = surface' T / (h times
// its area).
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "mesh/cross_section.hpp"
#include "mesh/peak.hpp"
#include "physics/parameters.hpp"

namespace thermal {

struct HeatSystem {
  Eigen::VectorXd mass;                   // diagonal [J/K]
  Eigen::SparseMatrix<double> stiffness;  // with the convection [W/K]; both triangles
  Eigen::MatrixXd loads;                  // columns mean_1 .. mean_N [1], surface [W/K]

  Eigen::Index size() const { return mass.size(); }
};

struct HeatMatrices : HeatSystem {
  double surface_conductance = 0.0;       // h times the surface's area, the sum of `surface` [W/K]
  std::vector<Eigen::Vector2d> points;    // of the nodes [m]
  std::vector<int> probes;                // nodes of the TCAs and of the surface, where T_max is looked for
  std::vector<ProbePatch> probe_patches;  // elements and edges that they belong to
  int order = 0;                          // of the elements
  bool is_insulated = false;              // see insulated.hpp; set where the order is searched for
  double error = 0.0;                     // estimate for any T_i, in units of the reference rise; 0: not estimated

  Eigen::Index tcas() const { return loads.cols() - 1; }
};

/// Fails where check() of the cross-section does, or when an element is folded.
core::Result<HeatMatrices> heat_matrices(const Parameters& parameters, int order);

/// The matrices over patches of the section that hold TCAs 1 to `tcas`; no heat passes their outer sides but those at
/// the surface.
core::Result<HeatMatrices> heat_matrices(const std::vector<Patch>& patches, const Parameters& parameters,
                                         std::size_t tcas, int order);

}  // namespace thermal
