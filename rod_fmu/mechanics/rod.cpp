// What all rods share: their TCAs (Eqs. 4 and 17), limits of the strains, and the choice of a rod for its parameters.
#include "mechanics/rod.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "mechanics/segmented_rod.hpp"
#include "mechanics/uniform_rod.hpp"
#include "physics/section.hpp"

namespace rod {

namespace {

// Largest rate of a strain in units of wave_rate_ [1]: tens of radians, the most that is admitted, at the frequency of
// the highest polynomial are a few thousand.
constexpr double kMaxRate = 1e5;

std::vector<int> components_of(Strains strains) {
  switch (strains) {
    case Strains::bending:
      return {0, 1};
    case Strains::extensible:
      return {0, 1, 5};
    case Strains::kirchhoff:
      return {0, 1, 2, 5};
    case Strains::cosserat:
      break;
  }
  return {0, 1, 2, 3, 4, 5};
}

bool leaves_plane(int c) { return c == 0 || c == 2 || c == 4; }

}  // namespace

std::vector<int> components_of(Strains strains, bool planar, std::vector<int>& excluded) {
  std::vector<int> components;
  for (const int c : components_of(strains)) (planar && leaves_plane(c) ? excluded : components).push_back(c);
  return components;
}

bool is_uniform(const Parameters& p) {
  const Segment& body = p.segment[0];
  return p.segments == 1 && body.radius == body.radius_end && p.tip_body.mass == 0.0 &&
         p.tip_body.inertia == Triple{} && p.contact == Contact::sliding && p.ends == Ends::free && !p.has_load;
}

std::unique_ptr<Rod> make_rod(const Parameters& p) {
  if (is_uniform(p)) return std::make_unique<UniformRod>(p);
  return std::make_unique<SegmentedRod>(p);
}

Rod::Rod(const Parameters& p)
    : frame_(p.planar ? Frame{std::cos(p.plane), std::sin(p.plane)} : Frame{}),
      closure_(p.closure),
      length_(p.length()) {
  for (std::size_t i = 0; i < p.tcas; ++i) laws_.emplace_back(p, i);
  has_slack_tcas_ = std::ranges::all_of(laws_, &TcaLaw::is_slack);
  for (std::size_t j = 0; j < p.segments; ++j)
    for (const double radius : {p.segment[j].radius, p.segment[j].radius_end}) {
      const Section section = Section::of(p.segment[j], p.profile, radius);
      double stiffness = *std::max_element(section.stiffness.begin() + 3, section.stiffness.end());
      for (const TcaLaw& law : laws_) stiffness += std::abs(law.stiffness()) * length_;
      wave_rate_ = std::max(wave_rate_, std::sqrt(stiffness / section.mass) / p.segment[j].length);
    }
}

void Rod::pull_tcas(const Loads& loads, Workspace& work) const {
  const bool inside = closure_ == Closure::inside;
  for (std::size_t i = 0; i < tcas(); ++i) {
    work.tension[i] = laws_[i].tension(inside ? work.delta[i] : loads.delta_guess[i], loads.T[i]);
    if (!inside) work.tension[i].per_delta = 0.0;  // the force does not follow this rod's own displacement
  }
}

void Rod::add_tca_stiffness(const Workspace& work, const Loads& loads, Matrix& J) const {
  if (closure_ == Closure::inside || has_slack_tcas_) return;
  for (std::size_t i = 0; i < tcas(); ++i)
    J.noalias() += laws_[i].tension(work.delta[i], loads.T[i]).per_delta * work.b[i] * work.b[i].transpose();
}

bool Rod::has_stiff_tcas(const Workspace& work, const Loads& loads) const {
  if (closure_ == Closure::inside || has_slack_tcas_) return true;  // the tangent has it all
  for (std::size_t i = 0; i < tcas(); ++i)
    if (!(laws_[i].tension(work.delta[i], loads.T[i]).per_delta >= 0.0)) return false;
  return true;
}

void Rod::tca_outputs(const double* v, const Loads& loads, const Workspace& work, Outputs& y) const {
  const Eigen::Map<const Vector> rates(v, unknowns());
  for (std::size_t i = 0; i < tcas(); ++i) {
    y.delta[i] = work.delta[i];
    y.delta_rate[i] = work.b[i].dot(rates);
    y.N[i] = work.tension[i].value;
    y.creep[i] = laws_[i].creeps() ? laws_[i].creep(work.delta[i], loads.T[i]).z : 0.0;
  }
}

double Rod::tca_energy(const Loads& loads, const Workspace& work) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < tcas(); ++i)
    sum += laws_[i].energy(closure_ == Closure::inside ? work.delta[i] : loads.delta_guess[i], loads.T[i]);
  return sum;
}

bool Rod::is_admissible(const double* q) const {
  const StrainRange range = strain_range(q);
  return Eigen::Map<const Vector>(q, unknowns()).allFinite() && range.curvature <= range.max_curvature &&
         range.stretch > 0.0;
}

core::Status Rod::check_strains(const double* q) const {
  if (is_admissible(q)) return {};
  const StrainRange range = strain_range(q);
  std::ostringstream what;
  if (range.curvature > range.max_curvature)
    what << "the rod's curvature times its length is " << range.curvature
         << " rad; the quadrature of this order resolves " << range.max_curvature << " rad";
  else if (range.stretch <= 0.0)
    what << "the rod's stretch is " << range.stretch
         << "; a section would lie behind its neighbours, it must be positive";
  else
    what << "the rod's strains are not finite";
  return core::Status::discard(what.str(), "reduce the loads or the heat, or raise order");
}

core::Status Rod::check_rates(const double* v) const {
  const double most = Eigen::Map<const Vector>(v, unknowns()).lpNorm<Eigen::Infinity>(),
               allowed = kMaxRate * wave_rate_;
  if (most <= allowed) return {};
  std::ostringstream what;
  what << "a strain changes at " << most << " 1/s, waves in this rod reach less than " << allowed << " 1/s";
  return core::Status::discard(
      what.str(), "the host's integration has diverged: take shorter steps or a method for stiff equations");
}

}  // namespace rod
