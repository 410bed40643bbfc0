"""Spectral elements on [0, L]: continuous velocities at Gauss-Lobatto nodes, discontinuous strains at Gauss points.

Degree 1 is the staggered grid of discrete rods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

__all__ = ["Elements", "elements"]


@dataclass(frozen=True)
class Elements:
    """Grid of the elements and its matrices."""

    nodes: np.ndarray  # (n + 1,) [m], the first at 0
    points: np.ndarray  # (g,) [m], Gauss points
    node_weights: np.ndarray  # (n + 1,) [m], of the integral over s by values at the nodes
    point_weights: np.ndarray  # (g,) [m], of the integral over s by values at the points
    mean: np.ndarray  # (g, n + 1), interpolates from the nodes to the points
    slope: np.ndarray  # (g, n + 1) [1/m], differentiates: values at the nodes to slopes at the points


def elements(length: float, count: int, degree: int) -> Elements:
    """Divide [0, length] into `count` elements of one length and degree."""
    last = legendre.Legendre.basis(degree)
    x = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    weights = 2.0 / (degree * (degree + 1) * last(x) ** 2)
    gauss_points, gauss_weights = legendre.leggauss(degree)
    to_nodes = np.linalg.inv(legendre.legvander(x, degree))
    mean = legendre.legvander(gauss_points, degree) @ to_nodes
    slope = np.stack([legendre.Legendre.basis(k).deriv()(gauss_points) for k in range(degree + 1)], axis=1) @ to_nodes
    half = 0.5 * length / count
    nodes, points = np.zeros(count * degree + 1), np.zeros(count * degree)
    node_weights, point_weights = np.zeros_like(nodes), np.zeros_like(points)
    means, slopes = np.zeros((2, points.size, nodes.size))
    for k in range(count):
        own_nodes, own_points = slice(k * degree, (k + 1) * degree + 1), slice(k * degree, (k + 1) * degree)
        nodes[own_nodes] = half * (2 * k + 1 + x)
        points[own_points] = half * (2 * k + 1 + gauss_points)
        node_weights[own_nodes] += half * weights
        point_weights[own_points] = half * gauss_weights
        means[own_points, own_nodes], slopes[own_points, own_nodes] = mean, slope / half
    return Elements(nodes, points, node_weights, point_weights, means, slopes)
