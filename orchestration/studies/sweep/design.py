"""Designs of experiments: samples of the unit cube, one row per run, one column per parameter.

A grid samples the middle of each cell, so that the values of a distribution there are equally likely.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from scipy.stats import qmc

from ...errors import CosimError

__all__ = ["DESIGNS", "saltelli_base", "samples"]

DESIGNS = ("sobol", "latin", "random", "grid", "saltelli")


def samples(design: str, runs: int, seed: int, cells: Sequence[int]) -> np.ndarray:
    """Samples (runs, parameters) of the unit cube.

    The first samples of sobol and random stay the same when there are more runs.

    Parameters
    ----------
    design : str
        One of DESIGNS.
    runs : int
        Number of samples; a grid has the product of its cells.
    seed : int
        Seed of the random designs.
    cells : sequence of int
        Number of cells of each parameter; its length is the number of parameters. Only a grid uses the values.

    Raises
    ------
    CosimError
        Where a design has no such number of runs.
    """
    count = len(cells)
    if design == "grid":
        grids = np.meshgrid(*((np.arange(n) + 0.5) / n for n in cells), indexing="ij")
        return np.stack([grid.ravel() for grid in grids], axis=1)
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


def saltelli_base(runs: int, parameters: int) -> int:
    """Base size n of the n (parameters + 2) runs from which Sobol' indices are estimated.

    The runs are A, B, and A with each column from B (Saltelli et al., Comput. Phys. Commun. 181, 2010). Raises
    CosimError where `runs` is not such a number.
    """
    n = max(runs // (parameters + 2), 1)
    lower = 1 << (n.bit_length() - 1)
    if lower * (parameters + 2) != runs:
        fit = " or ".join(str(k * (parameters + 2)) for k in (lower, 2 * lower))
        raise CosimError(
            f"runs = {runs}: design 'saltelli' with {parameters} parameters wants a power of 2 times {parameters + 2}; "
            f"take {fit}"
        )
    return n


def _sobol(parameters: int, runs: int, seed: int) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The balance properties", UserWarning)  # any number is allowed, 2^m is best
        return qmc.Sobol(parameters, scramble=True, rng=seed).random(runs)
