// The heat problem of a section in parts that do not act on each other.
//
// Equal TCAs, evenly spread, make the section the same after a turn by 2 pi / N, and its own mirror image. Its matrices
// are then block diagonal in the harmonics of the turn (finite Fourier transform; Thomas, Int. J. Numer. Methods Eng.
// 14 (1979) 81): temperatures in the cell of TCA j are the real part of e^(i theta j) u, theta = 2 pi q / N, where only
// q = 0 .. N/2 are different. By the mirror the real part of u is even and its imaginary part odd, so that the
// harmonic has as many real unknowns as one cell has nodes, those of q = 0 and q = N/2 half as many. Three TCAs: a
// sixth and a third of the nodes, in place of all of them. Any other section is one part.
#pragma once

#include <vector>

#include "mesh/heat_matrices.hpp"

namespace thermal {

/// Equal systems. Of each, y = loads * channels w drives the amplitudes of `system` (in the place of its loads), where
/// w are the section's channels, N TCAs and the surroundings; T_i and the surface are seen through the same.
struct HeatPart {
  struct Copy {
    Eigen::MatrixXd channels;            // (columns of loads) x (N + 1); at most one entry of a column is not zero
    Eigen::SparseMatrix<double> probes;  // temperatures at the probes, probes x unknowns
  };

  HeatSystem system;         // the last column of loads is the surface's where has_surface
  std::vector<Copy> copies;  // one, or two: real and imaginary part
  bool has_surface = false;  // holds the uniform temperature: 1 at each unknown
};

struct HeatSection {
  std::vector<HeatPart> parts;
  double surface_conductance = 0.0;       // [W/K], of the whole surface
  Eigen::Index tcas = 0;                  // N
  Eigen::Index probes = 0;                // number of them
  std::vector<ProbePatch> probe_patches;  // as in HeatMatrices
  int order = 0;                          // of the elements
  bool is_insulated = false;              // see insulated.hpp; set where the order is searched for
  double error = 0.0;                     // as in HeatMatrices
};

/// Splits where the section is cyclic. Fails as heat_matrices does.
core::Result<HeatSection> heat_section(const Parameters& parameters, int order);

/// Adds what a part's responses (loads) x (loads) are in the section's channels, (N + 1) x (N + 1), to `sum`.
void add_response(const HeatPart& part, const Eigen::MatrixXd& of_loads, Eigen::MatrixXd& sum);

/// [J/K], of the whole section.
double heat_capacity(const HeatSection& section);

/// The section as one part.
HeatSection undivided(const HeatMatrices& matrices);

}  // namespace thermal
