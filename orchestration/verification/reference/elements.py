"""Spectral elements on [0, L]: velocities continuous at Gauss-Lobatto nodes, strains free at Gauss points between them.
Degree 1 is the staggered grid of discrete rods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

__all__ = ["Elements", "elements"]


@dataclass(frozen=True)
class Elements:
    """nodes (n + 1,), the first at 0; points (g,); weights of both for integrals over s [m]; at the points, from values
    at the nodes: mean (g, n + 1) interpolates, slope (g, n + 1) differentiates [1/m]."""

    nodes: np.ndarray
    points: np.ndarray
    node_weights: np.ndarray
    point_weights: np.ndarray
    mean: np.ndarray
    slope: np.ndarray


def elements(length: float, count: int, degree: int) -> Elements:
    """count elements of the same length and degree."""
    last = legendre.Legendre.basis(degree)
    x = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    weights = 2.0 / (degree * (degree + 1) * last(x) ** 2)
    at, gauss = legendre.leggauss(degree)
    to_nodes = np.linalg.inv(legendre.legvander(x, degree))
    mean = legendre.legvander(at, degree) @ to_nodes
    slope = np.stack([legendre.Legendre.basis(k).deriv()(at) for k in range(degree + 1)], axis=1) @ to_nodes
    half = 0.5 * length / count
    nodes, points = np.zeros(count * degree + 1), np.zeros(count * degree)
    node_weights, point_weights = np.zeros_like(nodes), np.zeros_like(points)
    means, slopes = np.zeros((2, points.size, nodes.size))
    for k in range(count):
        here, own = slice(k * degree, (k + 1) * degree + 1), slice(k * degree, (k + 1) * degree)
        nodes[here] = half * (2 * k + 1 + x)
        points[own] = half * (2 * k + 1 + at)
        node_weights[here] += half * weights
        point_weights[own] = half * gauss
        means[own, here], slopes[own, here] = mean, slope / half
    return Elements(nodes, points, node_weights, point_weights, means, slopes)
