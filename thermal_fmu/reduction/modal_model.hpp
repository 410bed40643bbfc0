// A small heat model in modal form, z' = -rate z + load w with w = powers and ambient rise, and how it is derived:
//   reduced()  rational Krylov space, balanced truncation in it, by a bound that is proved against the unreduced mesh;
//   lumped()   resistor-capacitor network: one node per TCA and the surface.
#pragma once

#include <Eigen/Core>

#include "mesh/heat_section.hpp"

namespace thermal {

struct ModalModel {
  Eigen::VectorXd rate;        // [1/s], positive
  Eigen::MatrixXd load;        // modes x channels; T_i and the surface are seen through the same columns
  Eigen::VectorXd capacity;    // heat per amplitude; also the amplitudes of a uniform rise of 1 K
  Eigen::MatrixXd probe;       // nodes looked at for T_max x modes
  Peak peak;                   // the maximum of the field from the probes
  Eigen::MatrixXd step_bound;  // TCAs x channels: bound of the error of T_i for a unit step of the channel
  Eigen::VectorXd reference;   // rise of each TCA that tolerances refer to [K/W]
  double bound = 0.0;          // largest bound for a step of a TCA's power, in units of its reference rise
  double surface_conductance = 0.0;

  Eigen::Index size() const { return rate.size(); }
};

/// Smallest model whose error bound for a step of power is below `tolerance` times the reference rise of the heated TCA
/// (mesh/insulated.hpp). The search ends at a cap: `bound` says what was reached.
ModalModel reduced(const HeatSection& section, double tolerance);

/// The same of the undivided section.
ModalModel reduced(const HeatMatrices& matrices, double tolerance);

/// The network over the TCAs' mean temperatures and the surface's mean temperature: conductances [W/K], capacities
/// [J/K].
struct Network {
  Eigen::MatrixXd
      conductance;  // between nodes TCA 1..N, surface; the surface's diagonal holds the way to the surroundings
  Eigen::VectorXd capacity;
};
Network network(const HeatMatrices& matrices);

/// The network in modal form, its error measured against `reference`.
ModalModel lumped(const HeatMatrices& matrices, const ModalModel& reference);

}  // namespace thermal
