"""Triangulation of the cross-section: a disc with N annuli, whose bores are holes.

Points lie on circles around every TCA, on the outer circle and on a hexagonal lattice between. A Delaunay
triangulation joins them. The middle nodes of edges between neighbours on a circle are moved onto it (isoparametric
quadratic elements: the error of an area is of fourth order in the edge length). Lengths in m.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import Delaunay, cKDTree
from skfem import MeshTri1, MeshTri2

from ...scene.manipulator import ThermalParameters

__all__ = ["Section", "triangulate"]

_RINGS = 3  # circles outside each TCA with the fine edge length: the temperature gradient is steepest there


@dataclass(frozen=True)
class Section:
    """Geometry of the cross-section with N TCAs."""

    radius: float
    outer_radius: tuple[float, ...]  # of each TCA, (N,)
    inner_radius: tuple[float, ...]  # of its bore, (N,)
    offset: tuple[float, ...]  # distance of its axis from the body's axis, (N,)
    azimuth: tuple[float, ...]  # [rad], (N,)

    @classmethod
    def of(cls, p: ThermalParameters) -> Section:
        """Take the section out of the parameters of a heat model."""
        return cls(p.geometry.radius, p.outer_radius, p.inner_radius, p.geometry.offset, p.geometry.azimuth)

    @property
    def centres(self) -> np.ndarray:
        """Positions of the TCAs' axes [m], (N, 2)."""
        return np.array(self.offset)[:, None] * np.column_stack([np.cos(self.azimuth), np.sin(self.azimuth)])

    @property
    def tca_areas(self) -> np.ndarray:
        """Areas of the annuli [m2], (N,)."""
        return np.pi * (np.array(self.outer_radius) ** 2 - np.array(self.inner_radius) ** 2)


def triangulate(section: Section, edge: float) -> MeshTri2:
    """Triangulate a cross-section.

    Parameters
    ----------
    edge : float
        Edge length [m] in and near the TCAs; the lattice between them has edges 1.6 times as long.

    Returns
    -------
    MeshTri2
        Mesh with the subdomains 'tca0', 'tca1', ... and the boundary 'outer'.

    Raises
    ------
    ValueError
        The TCAs overlap or touch the surface.
    """
    points = _points(section, edge)
    corners = Delaunay(points).simplices
    middles = points[corners].mean(axis=1)
    inside = np.full(len(corners), -1)
    bored = np.zeros(len(corners), dtype=bool)
    for i, centre in enumerate(section.centres):
        # The middle of a chord lies inside its circle, so a triangle belongs to the circle with all its corners.
        reach = np.linalg.norm(points[corners] - centre, axis=2).max(axis=1)
        inside[reach < section.outer_radius[i] * (1 + 1e-9)] = i
        bored |= reach < section.inner_radius[i] * (1 + 1e-9)
    keep = ~bored & (np.linalg.norm(middles, axis=1) < section.radius)
    mesh = MeshTri1(np.ascontiguousarray(points.T), np.ascontiguousarray(corners[keep].T))
    curved = MeshTri2.from_mesh(mesh)
    nodes = curved.doflocs.copy()
    circles = [(np.zeros(2), section.radius)]
    for centre, outer, inner in zip(section.centres, section.outer_radius, section.inner_radius, strict=True):
        circles += [(centre, outer), (centre, inner)]
    for centre, radius in circles:
        _move_onto_circle(curved, nodes, centre, radius)
    domains = {f"tca{i}": np.flatnonzero(inside[keep] == i) for i in range(len(section.centres))}
    return (
        replace(curved, doflocs=nodes)
        .with_subdomains(domains)
        .with_boundaries({"outer": lambda x: np.hypot(*x) > 0.999 * section.radius - edge**2 / section.radius})
    )


def _points(section: Section, edge: float) -> np.ndarray:
    """Corners of the triangles (n, 2) without duplicates."""
    gap = _gap(section)
    if gap <= 0.0:
        raise ValueError(f"TCAs overlap or touch the surface: gap {gap:g} m; move or shrink them")
    outside = np.array([k * edge for k in range(1, _RINGS + 1) if (k + 0.5) * edge < gap / 2])
    tca_circles, reach = [], []
    for centre, outer, inner in zip(section.centres, section.outer_radius, section.inner_radius, strict=True):
        radii = np.linspace(inner, outer, max(2, round((outer - inner) / edge)) + 1)
        radii = np.append(radii, outer + outside)
        tca_circles += [centre + _circle(r, edge, k) for k, r in enumerate(radii)]
        reach.append(radii[-1] + 0.9 * edge)
    radii_kept_clear = np.array(reach)[:, None]

    def is_clear(candidates: np.ndarray) -> np.ndarray:
        away = np.stack([np.linalg.norm(candidates - centre, axis=1) for centre in section.centres])
        return np.asarray((away > radii_kept_clear).all(axis=0))

    rim = [_circle(section.radius - k * edge, 1.4 * edge, k) for k in range(2) if (k + 0.5) * edge < gap]
    lattice = _lattice(section.radius - len(rim) * edge, 1.6 * edge)
    inner_rim = [ring[is_clear(ring)] for ring in rim[1:]]
    points = np.vstack([*tca_circles, rim[0], *inner_rim, lattice[is_clear(lattice)]])
    duplicates = cKDTree(points).query_pairs(0.2 * edge * min(1.0, min(section.inner_radius) / edge))
    return np.delete(points, sorted({max(pair) for pair in duplicates}), axis=0)


def _gap(section: Section) -> float:
    """Smallest distance of a TCA from another one or from the surface [m]."""
    centres, outer = section.centres, section.outer_radius
    between = [
        float(np.linalg.norm(centres[i] - centres[j])) - outer[i] - outer[j]
        for i in range(len(outer))
        for j in range(i)
    ]
    to_surface = [section.radius - offset - radius for offset, radius in zip(section.offset, outer, strict=True)]
    return min([*between, *to_surface])


def _circle(radius: float, edge: float, shift: int) -> np.ndarray:
    """Points on a circle (n, 2); at least 16, so that quadratic edges deviate less than 1e-5 of the radius."""
    count = max(16, round(2 * np.pi * radius / edge))
    angle = 2 * np.pi * (np.arange(count) + 0.5 * (shift % 2)) / count
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _lattice(radius: float, edge: float) -> np.ndarray:
    """Points of a hexagonal lattice in a disc (n, 2)."""
    n = int(radius / edge) + 2
    a, b = np.meshgrid(np.arange(-2 * n, 2 * n + 1), np.arange(-2 * n, 2 * n + 1))
    points = edge * np.column_stack([(a + 0.5 * b).ravel(), (np.sqrt(0.75) * b).ravel()])
    return points[np.linalg.norm(points, axis=1) < radius - 0.3 * edge]


def _move_onto_circle(mesh: MeshTri2, nodes: np.ndarray, centre: np.ndarray, radius: float) -> None:
    """Move the middle nodes of edges with both ends on a circle onto that circle; nodes (2, n) change in place."""
    ends = mesh.p[:, mesh.facets] - centre[:, None, None]
    on = np.flatnonzero((np.abs(np.hypot(*ends) - radius) < 1e-9 * radius).all(axis=0))
    middle = mesh.dofs.get_facet_dofs(on).flatten()
    middle = middle[middle >= mesh.nvertices]
    outward = nodes[:, middle] - centre[:, None]
    nodes[:, middle] = centre[:, None] + radius * outward / np.hypot(*outward)
