"""Geometry of a soft body in space: cross-sections along its centreline, surfaces of points that are fixed in them.

    x(k) = p_k + a d1_k + b d2_k      (a, b) fixed in the cross-section of station k [m]

d1 and d2 follow the centreline by parallel transport (Bishop, "There is more than one way to frame a curve", 1975). An
even twist is added, so that they end in the orientation of the tip. Cross-sections are drawn normal to the centreline:
the shear of a slender body is not visible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

__all__ = ["Frames", "Surface", "ball", "disc", "frames", "tube"]


@dataclass(frozen=True)
class Frames:
    """Cross-sections over time."""

    p: np.ndarray  # centreline (time, station, 3) [m]
    d1: np.ndarray  # first unit vector of the cross-section (time, station, 3)
    d2: np.ndarray  # second one

    def sweep(self, offsets: np.ndarray, stations: np.ndarray) -> np.ndarray:
        """Positions (time, n, 3) [m] of points with offsets (n, 2) [m] in the cross-sections of stations (n,)."""
        a, b = offsets.T[:, :, None]
        return self.p[:, stations] + a * self.d1[:, stations] + b * self.d2[:, stations]


@dataclass(frozen=True)
class Surface:
    """Triangles whose corners are fixed in cross-sections."""

    offsets: np.ndarray  # of the corners in their cross-sections (n, 2) [m]
    stations: np.ndarray  # indices of these cross-sections (n,)
    triangles: np.ndarray  # indices of the corners (m, 3)


def frames(points: np.ndarray, tip: np.ndarray, stations: int | np.ndarray) -> Frames:
    """Construct cross-sections along a centreline.

    Parameters
    ----------
    points : ndarray
        Centreline (time, n >= 4, 3) [m], evenly spaced along the body from the clamp, where it starts along z.
    tip : ndarray
        Quaternions (time, 4) of the tip's orientation, scalar part first.
    stations : int or ndarray
        Number of evenly spaced cross-sections, or where they are as shares of the length, from 0 to 1, not falling.
    """
    along = np.linspace(0.0, 1.0, points.shape[1])
    fine = np.linspace(0.0, 1.0, stations) if isinstance(stations, int) else stations
    line = CubicSpline(along, points, axis=1)
    p, t = line(fine), line(fine, 1)
    t /= np.linalg.norm(t, axis=2, keepdims=True)
    d1 = np.empty_like(t)
    d1[:, 0] = _unit(_across(np.array([1.0, 0.0, 0.0]), t[:, 0]))
    for k in range(fine.size - 1):  # the smallest rotation that takes one tangent to the next
        a, b = t[:, k], t[:, k + 1]
        share = (d1[:, k] * b).sum(axis=1, keepdims=True) / (1.0 + (a * b).sum(axis=1, keepdims=True))
        d1[:, k + 1] = _unit(_across(d1[:, k] - share * (a + b), b))
    d2 = np.cross(t, d1)
    end = Rotation.from_quat(tip[:, [1, 2, 3, 0]]).apply([1.0, 0.0, 0.0])
    twist = np.arctan2((end * d2[:, -1]).sum(axis=1), (end * d1[:, -1]).sum(axis=1))
    turn = np.unwrap(twist)[:, None, None] * fine[:, None]
    return Frames(p, np.cos(turn) * d1 + np.sin(turn) * d2, np.cos(turn) * d2 - np.sin(turn) * d1)


def tube(centres: np.ndarray, radius: float | np.ndarray, around: int, first: int = 0) -> Surface:
    """Surface of a tube.

    Parameters
    ----------
    centres : ndarray
        Its centres in successive cross-sections (n, 2) [m].
    radius : float or ndarray
        Radius [m], one or one for each of them (n,).
    around : int
        Number of corners of its circles.
    first : int
        Index of the first of its cross-sections.
    """
    stations = len(centres)
    angle = 2.0 * np.pi * np.arange(around) / around
    ring = np.broadcast_to(radius, stations)[:, None, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    here = np.arange(around)
    beside = (here + 1) % around
    strip = np.vstack(
        [np.column_stack([here, beside, around + beside]), np.column_stack([here, around + beside, around + here])]
    )
    triangles = (strip + around * np.arange(stations - 1)[:, None, None]).reshape(-1, 3)
    return Surface((centres[:, None] + ring).reshape(-1, 2), np.repeat(first + np.arange(stations), around), triangles)


def disc(radius: float, station: int, around: int) -> Surface:
    """Surface of a whole cross-section."""
    ring = tube(np.zeros((1, 2)), radius, around).offsets
    here = np.arange(around)
    fan = np.column_stack([np.full(around, around), here, (here + 1) % around])
    return Surface(np.vstack([ring, np.zeros(2)]), np.full(around + 1, station), fan)


def ball(radius: float, around: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3) [m] around 0 and triangles (m, 3) of a ball."""
    rings = around // 2 + 1
    polar = np.pi * np.arange(rings) / (rings - 1)
    surface = tube(np.zeros((rings, 2)), radius * np.sin(polar), around)
    heights = radius * np.cos(polar)[surface.stations]
    return np.column_stack([surface.offsets, heights]), surface.triangles


def _across(v: np.ndarray, t: np.ndarray) -> np.ndarray:
    return v - (v * t).sum(axis=-1, keepdims=True) * t


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
