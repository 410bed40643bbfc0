// The mesh of a section, and how its matrices fall apart where it is cyclic (mesh/heat_section.hpp). All that follows
// from the shape: the process keeps it, since in a sweep of other parameters it is the same in every run.
#pragma once

#include <memory>
#include <vector>

#include "mesh/heat_mesh.hpp"
#include "mesh/heat_section.hpp"

namespace thermal {

/// A node's complex amplitude, real and imaginary part each a multiple of one unknown; -1: zero.
struct Amplitude {
  int even = -1, odd = -1;
  double of_even = 0.0, of_odd = 0.0;
};

/// Harmonic q of the turn, as sums over the matrices of one cell.
struct Harmonic {
  std::vector<Amplitude> amplitude;  // of each node of the cell
  Eigen::Index unknowns = 0;
  EntryPlaces stiffness;
  std::vector<int> source;     // of each addend: the entry of the cell's stiffness,
  std::vector<double> factor;  // and what it is multiplied by
  std::vector<HeatPart::Copy> copies;
  bool has_surface = false;
};

struct SectionMesh {
  HeatMesh mesh;                          // of the cell of one TCA, or of the section where there are no harmonics
  std::vector<Harmonic> harmonics;        // q = 0 .. N/2
  Eigen::Index probes = 0;                // number of them in all cells
  std::vector<ProbePatch> probe_patches;  // of all cells
};

/// Fails as heat_mesh does.
core::Result<std::shared_ptr<const SectionMesh>> section_mesh(const Body& body, const Tca& tca, int order);

}  // namespace thermal
