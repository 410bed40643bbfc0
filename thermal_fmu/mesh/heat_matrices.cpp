#include "mesh/heat_matrices.hpp"

#include <utility>

#include "physics/convection.hpp"

namespace thermal {

using Eigen::Index;

HeatSystem heat_system(const HeatMesh& mesh, const Parameters& parameters, std::size_t tcas) {
  const Body& body = parameters.body;
  const Tca& tca = parameters.tca;
  const Index n = mesh.order + 1, locals = n * n;
  const auto surface = static_cast<Index>(tcas);  // column of the loads, behind the TCAs
  HeatSystem m;
  m.mass = Eigen::VectorXd::Zero(mesh.size());
  m.loads = Eigen::MatrixXd::Zero(mesh.size(), surface + 1);
  m.stiffness = mesh.stiffness.zeros();
  double* const entries = m.stiffness.valuePtr();
  const int* position = mesh.stiffness.places.data();
  const double h = Convection(parameters).reference();
  for (const HeatElement& e : mesh.elements) {
    const bool is_tca = e.tca >= 0;
    const double rho_c = body.length * (is_tca ? tca.rho_c[e.tca] : body.rho_c);
    const double conductivity = body.length * (is_tca ? tca.k[e.tca] : body.k);
    for (Index b = 0; b < locals; ++b) {
      m.mass[e.node[b]] += rho_c * e.area[b];
      if (is_tca) m.loads(e.node[b], e.tca) += e.area[b];
    }
    for (const double each : e.diffusion) entries[*position++] += conductivity * each;
    if (!e.is_at_surface) continue;
    for (Index i = 0; i < n; ++i) {
      const double convection = h * body.length * e.edge[i];
      m.loads(e.node[i + n * (n - 1)], surface) += convection;
      entries[*position++] += convection;
    }
  }
  for (Index i = 0; i < surface; ++i) m.loads.col(i) /= m.loads.col(i).sum();  // annulus area -> mean
  return m;
}

core::Result<HeatMatrices> heat_matrices(const Parameters& parameters, int order) {
  if (core::Status status = check(parameters.body, parameters.tca); !status.is_ok()) return status;
  core::Result<HeatMesh> mesh =
      heat_mesh(cross_section(parameters.body, parameters.tca), close_nodes(parameters.body), order);
  if (!mesh.status.is_ok()) return std::move(mesh.status);
  return heat_matrices(mesh.value, parameters);
}

HeatMatrices heat_matrices(const HeatMesh& mesh, const Parameters& parameters) {
  HeatMatrices m;
  static_cast<HeatSystem&>(m) = heat_system(mesh, parameters, parameters.tca.count);
  m.surface_conductance = m.loads.col(m.tcas()).sum();
  m.probes = mesh.probes;
  m.probe_patches = mesh.probe_patches;
  m.order = mesh.order;
  return m;
}

}  // namespace thermal
