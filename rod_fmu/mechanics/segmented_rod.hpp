// A body of segments, each of its own material, radii, order and strains; TCAs over spans of it, sliding or bonded,
// with ends that turn freely or not; a rigid body at the tip; forces along the body.
//
// Every segment has strain polynomials and a quadrature of its own, so that strains may jump where a stiffness jumps or
// a TCA ends. Motion passes from segment to segment towards the tip, the wrench back towards the clamp:
//   (start_j; q_j, v_j, a_j) -> start_j+1,   (wrench_j+1; q_j, ...) -> wrench_j, r_j.
// The exact tangent is the chain of the derivatives of these maps. What depends on the strains of one section alone,
// the stiffness of the body and the second derivatives of the TCAs' paths, enters as a 6 x 6 matrix per node.
#pragma once

#include "mechanics/rod.hpp"
#include "mechanics/tip_body.hpp"
#include "physics/section.hpp"

namespace rod {

class SegmentedRod final : public Rod {
 public:
  explicit SegmentedRod(const Parameters& p);

  void to_states(const double* unknowns, double* states) const override;
  void from_states(const double* states, double* unknowns) const override;
  void residual(const double* q, const double* v, const double* a, const Loads& loads, Workspace& work,
                Vector& r) const override;
  void static_residual(const double* q, const Loads& loads, Workspace& work, Vector& r) const override;
  void kinematics(const double* q, const double* v, const Loads& loads, Workspace& work,
                  unsigned stages = stage::all) const override;
  unsigned stages_of(unsigned parts) const override;
  void tangent(const Workspace& work, const Weights& weights, Matrix& J) const override;
  void rate_derivative(const Workspace& work, const Vector& dv, const Vector& da, Vector& dr) const override;
  void load_derivative(const Workspace& work, const Loads& loads, const Loads& rates, Vector& dr) const override;
  double spatial_error(const double* q, const Loads& loads, Workspace& work) const override;
  double spatial_error(const double* q) const override;
  void damping_force(ConstVectorRef v, Vector& force) const override;
  double damping_power(ConstVectorRef v) const override;
  void outputs(const double* q, const double* v, const Loads& loads, Workspace& work, Outputs& y,
               unsigned parts = part::motion) const override;
  void clamp_reaction(const Loads& loads, const Workspace& work, Outputs& y) const override;

 private:
  /// Where an output station lies.
  struct Station {
    std::size_t segment = 0;
    ScalarField weights;  // of the integral from the segment's start
  };
  /// One segment; its unknowns are those from `first` on.
  struct Part {
    RodConstants constants;
    SegmentInertia inertia;
    std::vector<int> components, excluded;
    int first = 0;
    double retardation = 0.0;
    Matrix stiffness;                                    // int Phi^T K Phi ds [J]
    std::array<ScalarField, 6> local_stiffness;          // K at the nodes in units of the unknowns [J]
    std::vector<ScalarField> reference_length;           // |u_i| of the unstrained body
    PerTca<double> reference_path{}, reference_twist{};  // int |u_i| ds [m], int kappa . t_i ds
    std::array<ScalarField, kShapeStations> hat;         // int_s^end of the stations' hat functions ds [m]
    std::array<double, kShapeStations> hat_total{};      // the same from the start
    SegmentLoops loops;
    SegmentTangentLoops tangent_loops;

    int unknowns() const { return constants.unknowns(); }
  };
  void add_inertia(const Parameters& p, std::size_t j, Part& part) const;
  void add_stiffness(const Parameters& p, std::size_t j, Part& part) const;
  void route_tcas(const Parameters& p, std::size_t j, Part& part) const;
  void locate_stations(const Parameters& p);
  StrainRange strain_range(const double* q) const override;

  void shape(const Workspace& work, Outputs& y) const;
  void tip_motion(const Workspace& work, Outputs& y) const;
  void energies(const double* q, const Loads& loads, Workspace& work, Outputs& y) const;
  void size(Workspace& work) const;
  void forward(const double* q, const double* v, const double* a, bool moving, Workspace& work) const;
  void pull(const Loads& loads, Workspace& work) const;
  void backward(const Loads& loads, Workspace& work, Vector& r) const;
  SegmentLoads segment_loads(const Part& part, const BodyLoads& turned, const Loads& loads, const Wrench& end) const;
  void add_body_and_tcas(const double* q, const Workspace& work, Vector& r) const;
  Wrench end_wrench(const Workspace& work, const BodyLoads& turned) const;
  void add_local_stiffness(const Workspace& work, double weight, Matrix& J) const;
  void pull_bonded(const Loads& loads, Workspace& work) const;
  void pull_tethered(const Loads& loads, Workspace& work) const;
  double energy_of_tca(std::size_t i, double T, const Workspace& work) const;
  double out_of_plane(const Workspace& work) const;
  /// Leaves the internal forces of the shape at rest in the workspace, and the load's part of the residual in r.
  void backward_at_rest(const Loads& loads, Workspace& work, Vector& r) const;
  /// Writes what the TCAs leave of the internal couple and force to the stiffness of the body, in units of the
  /// unknowns [J].
  void section_balance(const Workspace& work, std::size_t j, VectorField& couple, VectorField& force) const;

  std::vector<Part> parts_;
  std::array<Station, kShapeStations> stations_;
  TipBody tip_body_;
  Contact contact_;
  Ends ends_;
  bool has_load_ = false, is_planar_ = false;
  PerTca<double> span_{};  // routed length in the straight body, int |u_i| ds [m]
};

/// Subtracts the densities of the torque Q [N m] of tethered TCA i from those of the couple and the force.
void subtract_torque(const RodConstants& segment, const SegmentWorkspace& w, std::size_t i, double Q,
                     VectorField& couple, VectorField& force);

}  // namespace rod
