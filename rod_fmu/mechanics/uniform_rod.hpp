// A uniform rod: one segment of constant section, TCAs that slide in their channels over the whole length, nothing at
// the tip. The fastest rod.
#pragma once

#include "mechanics/rod.hpp"
#include "physics/section.hpp"

namespace rod {

class UniformRod final : public Rod {
 public:
  explicit UniformRod(const Parameters& p) : UniformRod(p, Section::of(p)) {}
  UniformRod(const Parameters& p, const Section& section);

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
  void damping_force(ConstVectorRef v, Vector& force) const override { force = damping_.cwiseProduct(v); }
  double damping_power(ConstVectorRef v) const override { return damping_.dot(v.cwiseAbs2()); }
  void outputs(const double* q, const double* v, const Loads& loads, Workspace& work, Outputs& y,
               unsigned parts = part::motion) const override;
  void clamp_reaction(const Loads& loads, const Workspace& work, Outputs& y) const override;

 private:
  StrainRange strain_range(const double* q) const override;
  /// Stiffness of a constant strain of component c, int K ds in units of the unknowns [J].
  double stiffness_per_strain(int c) const {
    return section_.stiffness[c] * (c < 3 ? 1.0 / length() : length());  // curvatures are multiplied by L
  }
  /// Sizes the workspace for this rod and returns where a loop writes the gradients b.
  Gradients gradients(Workspace& work) const;
  /// The same for the equations of motion, which need none of TCAs that are slack.
  Gradients acting_gradients(Workspace& work) const;
  void pull(const Loads& loads, Workspace& work) const;
  /// See Outputs::out_of_plane; loads are those of the fixed frame.
  double out_of_plane(const Loads& loads, const Workspace& work) const;

  Section section_;
  std::vector<int> components_;           // strain components of this rod
  std::vector<int> excluded_components_;  // those that would leave the plane of a planar rod
  RodConstants constants_;
  RodConstants acting_;  // the same without TCAs where these are slack: constants of the equations of motion
  ResidualLoops residual_loops_;
  TangentLoops tangent_loops_;
  SpatialErrorLoop spatial_error_loop_ = nullptr;
  PerTca<double> reference_path_{};  // int |u_i| ds/L of the unstrained rod
  Vector damping_;
};

}  // namespace rod
