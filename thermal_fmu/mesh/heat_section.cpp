#include "mesh/heat_section.hpp"

#include <cmath>
#include <utility>

#include "mesh/section_mesh.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using SparseMatrix = Eigen::SparseMatrix<double>;
using Eigen::Triplet;

HeatSystem folded(const HeatSystem& cell, const Harmonic& harmonic) {
  HeatSystem part;
  part.mass = Eigen::VectorXd::Zero(harmonic.unknowns);
  part.loads = MatrixXd::Zero(harmonic.unknowns, harmonic.has_surface ? 2 : 1);
  for (Index b = 0; b < cell.size(); ++b) {
    const Amplitude& to = harmonic.amplitude[static_cast<std::size_t>(b)];
    if (to.even >= 0) {
      part.mass[to.even] += to.of_even * to.of_even * cell.mass[b];
      part.loads.row(to.even) += to.of_even * cell.loads.row(b).leftCols(part.loads.cols());
    }
    if (to.odd >= 0) part.mass[to.odd] += to.of_odd * to.of_odd * cell.mass[b];
  }
  part.stiffness = harmonic.stiffness.zeros();
  const double* const of_cell = cell.stiffness.valuePtr();
  for (std::size_t k = 0; k < harmonic.source.size(); ++k)
    part.stiffness.valuePtr()[harmonic.stiffness.places[k]] += harmonic.factor[k] * of_cell[harmonic.source[k]];
  return part;
}

HeatSection divided(const SectionMesh& mesh, const Parameters& parameters) {
  const HeatSystem cell = heat_system(mesh.mesh, parameters, 1);
  HeatSection section;
  section.tcas = static_cast<Index>(parameters.tca.count);
  section.order = mesh.mesh.order;
  section.surface_conductance = static_cast<double>(section.tcas) * cell.loads.col(1).sum();
  section.probes = mesh.probes;
  section.probe_patches = mesh.probe_patches;
  for (const Harmonic& harmonic : mesh.harmonics)
    section.parts.push_back({folded(cell, harmonic), harmonic.copies, harmonic.has_surface});
  return section;
}

}  // namespace

void add_response(const HeatPart& part, const MatrixXd& of_loads, MatrixXd& sum) {
  for (const HeatPart::Copy& copy : part.copies) sum += copy.channels.transpose() * of_loads * copy.channels;
}

double heat_capacity(const HeatSection& section) {
  double sum = 0.0;
  for (const HeatPart& part : section.parts)
    if (part.has_surface)
      sum += std::pow(part.copies[0].channels(part.system.loads.cols() - 1, section.tcas), 2) * part.system.mass.sum();
  return sum;
}

HeatSection undivided(const HeatMatrices& m) {
  HeatSection section;
  section.tcas = m.tcas();
  section.surface_conductance = m.surface_conductance;
  section.probes = static_cast<Index>(m.probes.size());
  section.probe_patches = m.probe_patches;
  section.order = m.order;
  section.is_insulated = m.is_insulated;
  section.error = m.error;
  HeatPart::Copy copy{MatrixXd::Identity(m.loads.cols(), m.loads.cols()), SparseMatrix(section.probes, m.size())};
  std::vector<Triplet<double>> entries;
  for (Index p = 0; p < section.probes; ++p)
    entries.emplace_back(static_cast<int>(p), m.probes[static_cast<std::size_t>(p)], 1.0);
  copy.probes.setFromTriplets(entries.begin(), entries.end());
  section.parts.push_back({m, {std::move(copy)}, true});
  return section;
}

core::Result<HeatSection> heat_section(const Parameters& parameters, int order) {
  if (core::Status status = check(parameters.body, parameters.tca); !status.is_ok()) return status;
  core::Result<std::shared_ptr<const SectionMesh>> mesh = section_mesh(parameters.body, parameters.tca, order);
  if (!mesh.status.is_ok()) return std::move(mesh.status);
  return mesh.value->harmonics.empty() ? undivided(heat_matrices(mesh.value->mesh, parameters))
                                       : divided(*mesh.value, parameters);
}

}  // namespace thermal
