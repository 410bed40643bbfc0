#include "mesh/section_mesh.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <numbers>
#include <utility>

#include "core/spin_lock.hpp"
#include "mesh/heat_matrices.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using SparseMatrix = Eigen::SparseMatrix<double>;
using Eigen::Triplet;
using Eigen::Vector2d;

/// The cell of one TCA at azimuth 0, and how its nodes lie in the section.
struct Cell {
  const HeatMesh& mesh;
  std::vector<int> mirror;  // of each node
  std::vector<int> side;    // 1, -1: on the wall towards the next TCA, the one before; 0: elsewhere
  int centre = -1;          // the node on both walls
};

/// Fills `mirror`; false where a node has no image.
bool find_mirror_images(Cell& cell, double closeness) {
  const std::vector<Vector2d>& points = cell.mesh.points;  // by ascending x, to `closeness`
  cell.mirror.assign(points.size(), -1);
  for (std::size_t a = 0; a < points.size(); ++a) {
    if (cell.mirror[a] >= 0) continue;
    const Vector2d image(points[a].x(), -points[a].y());
    for (std::size_t b = a; b < points.size() && points[b].x() < image.x() + 2.0 * closeness; ++b)
      if ((points[b] - image).norm() < closeness) {
        cell.mirror[a] = static_cast<int>(b);
        cell.mirror[b] = static_cast<int>(a);
        break;
      }
    if (cell.mirror[a] < 0) return false;
  }
  return true;
}

void find_walls(Cell& cell, std::size_t count, double closeness) {
  const std::vector<Vector2d>& points = cell.mesh.points;
  cell.side.assign(points.size(), 0);
  if (count == 1) return;
  const double angle = std::numbers::pi / static_cast<double>(count);
  for (std::size_t a = 0; a < points.size(); ++a) {
    const double along = std::cos(angle) * points[a].x() + std::sin(angle) * std::abs(points[a].y());
    const double off = std::sin(angle) * points[a].x() - std::cos(angle) * std::abs(points[a].y());
    if (std::abs(off) > closeness || along < -closeness) continue;
    if (points[a].norm() < closeness) {
      cell.centre = static_cast<int>(a);
    } else {
      cell.side[a] = points[a].y() > 0.0 ? 1 : -1;
    }
  }
}

/// Unknowns of harmonic q of N. On the wall towards the next TCA u has the phase theta / 2: turned back by theta it is
/// its own mirror image.
std::vector<Amplitude> amplitudes(const Cell& cell, int q, int count, Index& unknowns) {
  const bool is_real = q == 0 || 2 * q == count;
  const double half_turn = std::numbers::pi * q / count;
  std::vector<Amplitude> result(cell.mirror.size());
  unknowns = 0;
  for (std::size_t a = 0; a < result.size(); ++a) {
    const auto image = static_cast<std::size_t>(cell.mirror[a]);
    if (image < a || (q != 0 && static_cast<int>(a) == cell.centre)) continue;
    const bool is_on_wall = cell.side[a] != 0;
    if (is_real && q != 0 && is_on_wall) continue;
    Amplitude& here = result[a];
    here.even = static_cast<int>(unknowns++);
    here.of_even = is_on_wall && !is_real ? std::cos(half_turn) : 1.0;
    if (!is_real && image != a) {
      here.odd = is_on_wall ? here.even : static_cast<int>(unknowns++);
      const double sign = is_on_wall ? cell.side[a] : 1.0;
      here.of_odd = sign * (is_on_wall ? std::sin(half_turn) : 1.0);
    }
    result[image] = here;
    if (image != a) result[image].of_odd = -here.of_odd;
  }
  return result;
}

/// Fills the places of the harmonic's stiffness.
void find_addends(const EntryPlaces& of_cell, Harmonic& harmonic) {
  std::vector<Place> addends;
  addends.reserve(2 * of_cell.rows.size());
  harmonic.source.reserve(2 * of_cell.rows.size());
  harmonic.factor.reserve(2 * of_cell.rows.size());
  const auto add = [&](int row, int column, double of_row, double of_column, int source) {
    if (row < 0 || column < 0) return;
    addends.push_back({row, column});
    harmonic.source.push_back(source);
    harmonic.factor.push_back(of_row * of_column);
  };
  for (std::size_t b = 0; b < harmonic.amplitude.size(); ++b) {
    const Amplitude& to = harmonic.amplitude[b];
    for (int source = of_cell.begins[b]; source < of_cell.begins[b + 1]; ++source) {
      const Amplitude& from = harmonic.amplitude[static_cast<std::size_t>(of_cell.rows[source])];
      add(from.even, to.even, from.of_even, to.of_even, source);
      add(from.odd, to.odd, from.of_odd, to.of_odd, source);
    }
  }
  harmonic.stiffness = find_places(harmonic.unknowns, addends);
}

/// Numbers of the probes of all cells, (probes of a cell) x N: those on a wall belong to two cells.
Eigen::MatrixXi probe_numbers(const Cell& cell, Index count, Index& probes) {
  const std::vector<int>& nodes = cell.mesh.probes;
  std::vector<int> probe_of(cell.mirror.size(), -1);
  for (std::size_t p = 0; p < nodes.size(); ++p) probe_of[static_cast<std::size_t>(nodes[p])] = static_cast<int>(p);
  Eigen::MatrixXi number(static_cast<Index>(nodes.size()), count);
  probes = 0;
  for (Index j = 0; j < count; ++j)
    for (Index p = 0; p < number.rows(); ++p)
      if (cell.side[static_cast<std::size_t>(nodes[p])] != -1) number(p, j) = static_cast<int>(probes++);
  for (Index j = 0; j < count; ++j)
    for (Index p = 0; p < number.rows(); ++p) {
      const auto node = static_cast<std::size_t>(nodes[p]);
      if (cell.side[node] == -1)
        number(p, j) = number(probe_of[static_cast<std::size_t>(cell.mirror[node])], (j + count - 1) % count);
    }
  return number;
}

/// Real (part 0) or imaginary (part 1) part of the turned amplitudes: phase e^(i theta j) by cell j.
HeatPart::Copy make_copy(const Cell& cell, const Harmonic& harmonic, int q, int part,
                         const std::vector<std::size_t>& by_cell, const Eigen::MatrixXi& number, Index probes) {
  const auto count = static_cast<Index>(by_cell.size());
  const bool is_real = q == 0 || 2 * q == count;
  // The section's heat capacity is this many times that of the harmonic: the mean of cosines squared is a half.
  const double times = is_real ? static_cast<double>(count) : 0.5 * static_cast<double>(count);
  const double scale = 1.0 / std::sqrt(times);
  HeatPart::Copy copy{MatrixXd::Zero(harmonic.has_surface ? 2 : 1, count + 1), SparseMatrix(probes, harmonic.unknowns)};
  std::vector<Triplet<double>> entries;
  entries.reserve(2 * static_cast<std::size_t>(number.size()));
  for (Index j = 0; j < count; ++j) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>((q * j) % count) / static_cast<double>(count);
    const double cosine = is_real ? (q == 0 || j % 2 == 0 ? 1.0 : -1.0) : std::cos(angle);
    const double sine = is_real ? 0.0 : std::sin(angle);
    const double of_even = scale * (part == 0 ? cosine : sine), of_odd = scale * (part == 0 ? -sine : cosine);
    copy.channels(0, static_cast<Index>(by_cell[static_cast<std::size_t>(j)])) = of_even;
    for (Index p = 0; p < number.rows(); ++p) {
      const auto node = static_cast<std::size_t>(cell.mesh.probes[static_cast<std::size_t>(p)]);
      if (cell.side[node] == -1) continue;  // of the cell before
      const Amplitude& here = harmonic.amplitude[node];
      if (here.even >= 0) entries.emplace_back(number(p, j), here.even, of_even * here.of_even);
      if (here.odd >= 0) entries.emplace_back(number(p, j), here.odd, of_odd * here.of_odd);
    }
  }
  if (q == 0) copy.channels(1, count) = static_cast<double>(count) * scale;
  copy.probes.setFromTriplets(entries.begin(), entries.end());
  return copy;
}

void find_harmonics(const Cell& cell, const Tca& tca, SectionMesh& section) {
  const auto count = static_cast<int>(tca.count);
  const std::vector<std::size_t> by_cell = by_azimuth(tca);
  const Eigen::MatrixXi number = probe_numbers(cell, count, section.probes);
  for (Index j = 0; j < count; ++j)
    for (ProbePatch patch : cell.mesh.probe_patches) {
      for (int& probe : patch.probes) probe = number(probe, j);
      section.probe_patches.push_back(std::move(patch));
    }
  for (int q = 0; 2 * q <= count; ++q) {
    Harmonic& harmonic = section.harmonics.emplace_back();
    harmonic.has_surface = q == 0;
    harmonic.amplitude = amplitudes(cell, q, count, harmonic.unknowns);
    find_addends(cell.mesh.stiffness, harmonic);
    for (int copy = 0; copy < (q == 0 || 2 * q == count ? 1 : 2); ++copy)
      harmonic.copies.push_back(make_copy(cell, harmonic, q, copy, by_cell, number, section.probes));
  }
}

core::Result<SectionMesh> make_section_mesh(const Body& body, const Tca& tca, int order) {
  const double closeness = close_nodes(body);
  if (is_cyclic(tca)) {
    core::Result<HeatMesh> mesh = heat_mesh(cyclic_cell(body, tca), closeness, order);
    if (!mesh.status.is_ok()) return std::move(mesh.status);
    SectionMesh section{std::move(mesh.value), {}, 0, {}};
    Cell cell{section.mesh, {}, {}};
    find_walls(cell, tca.count, closeness);
    if (find_mirror_images(cell, closeness)) {
      find_harmonics(cell, tca, section);
      return section;
    }
  }
  core::Result<HeatMesh> mesh = heat_mesh(cross_section(body, tca), closeness, order);
  if (!mesh.status.is_ok()) return std::move(mesh.status);
  return SectionMesh{std::move(mesh.value), {}, 0, {}};
}

/// All that a mesh follows from.
struct Shape {
  double radius;
  std::size_t tcas;
  PerTca outer_radius, inner_radius, offset, azimuth;
  bool is_cyclic;
  int order;
  bool operator==(const Shape&) const = default;
};

struct KeptMesh {
  Shape shape;
  std::shared_ptr<const SectionMesh> mesh;
};

constexpr std::size_t kMaxMeshes = 32;          // kept: those of a search for the order, of a few sections
constexpr std::size_t kMaxAddends = 1'000'000;  // of all their cells or sections together, at about 30 bytes

std::atomic_flag meshes_are_taken;

std::deque<KeptMesh>& kept_meshes() {
  static std::deque<KeptMesh> meshes;
  return meshes;
}

}  // namespace

core::Result<std::shared_ptr<const SectionMesh>> section_mesh(const Body& body, const Tca& tca, int order) {
  const Shape shape{body.radius, tca.count,   tca.outer_radius, tca.inner_radius,
                    tca.offset,  tca.azimuth, is_cyclic(tca),   order};
  {
    const core::SpinLock lock(meshes_are_taken);
    for (const KeptMesh& each : kept_meshes())
      if (each.shape == shape) return each.mesh;
  }
  core::Result<SectionMesh> made = make_section_mesh(body, tca, order);
  if (!made.status.is_ok()) return std::move(made.status);
  auto mesh = std::make_shared<const SectionMesh>(std::move(made.value));
  const core::SpinLock lock(meshes_are_taken);
  auto& meshes = kept_meshes();
  meshes.push_back({shape, mesh});
  std::size_t addends = 0;
  for (const KeptMesh& each : meshes) addends += each.mesh->mesh.stiffness.places.size();
  for (; meshes.size() > kMaxMeshes || (addends > kMaxAddends && meshes.size() > 1); meshes.pop_front())
    addends -= meshes.front().mesh->mesh.stiffness.places.size();
  return std::shared_ptr<const SectionMesh>(std::move(mesh));
}

}  // namespace thermal
