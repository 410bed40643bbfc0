"""Designs: points of the unit cube (runs, axes). Cells of a grid lie in their middle, so that a distribution's values
there are equally likely."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from scipy.stats import qmc

from ...errors import CosimError

__all__ = ["DESIGNS", "points", "saltelli_base"]

DESIGNS = ("sobol", "latin", "random", "grid", "saltelli")


def points(design: str, runs: int, seed: int, cells: Sequence[int]) -> np.ndarray:
    """(runs, axes). cells: of each axis, for the grid alone, whose number of runs is their product. The first points
    of sobol and random stay when there are more runs. Raises CosimError where a design has no such number of runs."""
    count = len(cells)
    if design == "grid":
        axes = np.meshgrid(*((np.arange(n) + 0.5) / n for n in cells), indexing="ij")
        return np.stack([axis.ravel() for axis in axes], axis=1)
    if design == "latin":
        return qmc.LatinHypercube(count, rng=seed).random(runs)
    if design == "random":
        return np.random.default_rng(seed).random((runs, count))
    if design == "sobol":
        return _sobol(count, runs, seed)
    n = saltelli_base(runs, count)
    both = _sobol(2 * count, n, seed)
    first, second = both[:, :count], both[:, count:]
    mixed = [np.where(np.arange(count) == k, second, first) for k in range(count)]
    return np.concatenate([first, second, *mixed])


def saltelli_base(runs: int, axes: int) -> int:
    """n of the n (axes + 2) runs from which Sobol' indices are estimated: A, B, and A with each column from B
    (Saltelli 2010). Raises CosimError where there is none."""
    n = max(runs // (axes + 2), 1)
    lower = 1 << (n.bit_length() - 1)
    if lower * (axes + 2) != runs:
        fit = " or ".join(str(k * (axes + 2)) for k in (lower, 2 * lower))
        raise CosimError(
            f"runs = {runs}: design 'saltelli' with {axes} parameters wants a power of 2 times {axes + 2}; take {fit}"
        )
    return n


def _sobol(axes: int, runs: int, seed: int) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The balance properties", UserWarning)  # any number is allowed, 2^m is best
        return qmc.Sobol(axes, scramble=True, rng=seed).random(runs)
