#include "mesh/heat_section.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using SparseMatrix = Eigen::SparseMatrix<double>;
using Eigen::Triplet;
using Eigen::Vector2d;

constexpr double kClose = 1e-10;  // of the body's radius: points closer than this are one

/// The cell of one TCA at azimuth 0, and how its nodes lie in the section.
struct Cell {
  HeatMatrices matrices;
  std::vector<int> mirror;  // of each node
  std::vector<int> side;    // 1, -1: on the wall towards the next TCA, the one before; 0: elsewhere
  int centre = -1;          // the node on both walls
};

/// Fills `mirror`; false where a node has no image.
bool find_mirror_images(Cell& cell, double closeness) {
  const std::vector<Vector2d>& points = cell.matrices.points;  // by ascending x, to `closeness`
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
  const std::vector<Vector2d>& points = cell.matrices.points;
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

/// A node's complex amplitude, real and imaginary part each a multiple of one unknown; -1: zero.
struct Amplitude {
  int even = -1, odd = -1;
  double of_even = 0.0, of_odd = 0.0;
};

/// Unknowns of harmonic q of N. On the wall towards the next TCA u has the phase theta / 2: turned back by theta it is
/// its own mirror image.
std::vector<Amplitude> amplitudes(const Cell& cell, int q, int count, int& unknowns) {
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
    here.even = unknowns++;
    here.of_even = is_on_wall && !is_real ? std::cos(half_turn) : 1.0;
    if (!is_real && image != a) {
      here.odd = is_on_wall ? here.even : unknowns++;
      const double sign = is_on_wall ? cell.side[a] : 1.0;
      here.of_odd = sign * (is_on_wall ? std::sin(half_turn) : 1.0);
    }
    result[image] = here;
    if (image != a) result[image].of_odd = -here.of_odd;
  }
  return result;
}

HeatSystem folded(const HeatSystem& cell, const std::vector<Amplitude>& amplitude, int unknowns, bool has_surface) {
  HeatSystem part;
  part.mass = Eigen::VectorXd::Zero(unknowns);
  part.loads = MatrixXd::Zero(unknowns, has_surface ? 2 : 1);
  std::vector<Triplet<double>> entries;
  entries.reserve(2 * static_cast<std::size_t>(cell.stiffness.nonZeros()));
  for (Index b = 0; b < cell.size(); ++b) {
    const Amplitude& to = amplitude[static_cast<std::size_t>(b)];
    if (to.even >= 0) {
      part.mass[to.even] += to.of_even * to.of_even * cell.mass[b];
      part.loads.row(to.even) += to.of_even * cell.loads.row(b).leftCols(part.loads.cols());
    }
    if (to.odd >= 0) part.mass[to.odd] += to.of_odd * to.of_odd * cell.mass[b];
    for (SparseMatrix::InnerIterator entry(cell.stiffness, b); entry; ++entry) {
      const Amplitude& from = amplitude[static_cast<std::size_t>(entry.row())];
      if (from.even >= 0 && to.even >= 0)
        entries.emplace_back(from.even, to.even, from.of_even * to.of_even * entry.value());
      if (from.odd >= 0 && to.odd >= 0) entries.emplace_back(from.odd, to.odd, from.of_odd * to.of_odd * entry.value());
    }
  }
  part.stiffness.resize(unknowns, unknowns);
  part.stiffness.setFromTriplets(entries.begin(), entries.end());
  return part;
}

/// Numbers of the probes of all cells, (probes of a cell) x N: those on a wall belong to two cells.
Eigen::MatrixXi probe_numbers(const Cell& cell, Index count, Index& probes) {
  const std::vector<int>& nodes = cell.matrices.probes;
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
HeatPart::Copy make_copy(const Cell& cell, const std::vector<Amplitude>& amplitude, int q, int part,
                         const std::vector<std::size_t>& by_cell, const Eigen::MatrixXi& number, Index probes,
                         const HeatSystem& system) {
  const auto count = static_cast<Index>(by_cell.size());
  const bool is_real = q == 0 || 2 * q == count;
  // The section's heat capacity is this many times that of `system`: the mean of cosines squared is a half.
  const double times = is_real ? static_cast<double>(count) : 0.5 * static_cast<double>(count);
  const double scale = 1.0 / std::sqrt(times);
  HeatPart::Copy copy{MatrixXd::Zero(system.loads.cols(), count + 1), SparseMatrix(probes, system.size())};
  std::vector<Triplet<double>> entries;
  entries.reserve(2 * static_cast<std::size_t>(number.size()));
  for (Index j = 0; j < count; ++j) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>((q * j) % count) / static_cast<double>(count);
    const double cosine = is_real ? (q == 0 || j % 2 == 0 ? 1.0 : -1.0) : std::cos(angle);
    const double sine = is_real ? 0.0 : std::sin(angle);
    const double of_even = scale * (part == 0 ? cosine : sine), of_odd = scale * (part == 0 ? -sine : cosine);
    copy.channels(0, static_cast<Index>(by_cell[static_cast<std::size_t>(j)])) = of_even;
    for (Index p = 0; p < number.rows(); ++p) {
      const auto node = static_cast<std::size_t>(cell.matrices.probes[static_cast<std::size_t>(p)]);
      if (cell.side[node] == -1) continue;  // of the cell before
      const Amplitude& here = amplitude[node];
      if (here.even >= 0) entries.emplace_back(number(p, j), here.even, of_even * here.of_even);
      if (here.odd >= 0) entries.emplace_back(number(p, j), here.odd, of_odd * here.of_odd);
    }
  }
  if (q == 0) copy.channels(1, count) = static_cast<double>(count) * scale;
  copy.probes.setFromTriplets(entries.begin(), entries.end());
  return copy;
}

HeatSection divided(const Cell& cell, const Tca& tca) {
  const HeatMatrices& m = cell.matrices;
  const auto count = static_cast<int>(tca.count);
  const std::vector<std::size_t> by_cell = by_azimuth(tca);
  HeatSection section;
  section.tcas = count;
  section.order = m.order;
  section.surface_conductance = count * m.surface_conductance;
  const Eigen::MatrixXi number = probe_numbers(cell, count, section.probes);
  for (Index j = 0; j < count; ++j)
    for (ProbePatch patch : m.probe_patches) {
      for (int& probe : patch.probes) probe = number(probe, j);
      section.probe_patches.push_back(std::move(patch));
    }
  for (int q = 0; 2 * q <= count; ++q) {
    int unknowns = 0;
    const std::vector<Amplitude> amplitude = amplitudes(cell, q, count, unknowns);
    HeatPart part{folded(m, amplitude, unknowns, q == 0), {}, q == 0};
    for (int copy = 0; copy < (q == 0 || 2 * q == count ? 1 : 2); ++copy)
      part.copies.push_back(make_copy(cell, amplitude, q, copy, by_cell, number, section.probes, part.system));
    section.parts.push_back(std::move(part));
  }
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
  if (is_cyclic(parameters.tca)) {
    core::Result<HeatMatrices> matrices =
        heat_matrices(cyclic_cell(parameters.body, parameters.tca), parameters, 1, order);
    if (!matrices.status.is_ok()) return std::move(matrices.status);
    Cell cell{std::move(matrices.value), {}, {}};
    const double closeness = kClose * parameters.body.radius;
    find_walls(cell, parameters.tca.count, closeness);
    if (find_mirror_images(cell, closeness)) return divided(cell, parameters.tca);
  }
  core::Result<HeatMatrices> matrices = heat_matrices(parameters, order);
  if (!matrices.status.is_ok()) return std::move(matrices.status);
  return undivided(matrices.value);
}

}  // namespace thermal
