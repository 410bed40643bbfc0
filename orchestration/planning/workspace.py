"""Where the tip can be: equilibria within the limits, and how fast it can move there."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..api import Overrides, Source, read
from ..errors import SceneError
from .heat import HeatModel
from .limits import PlanLimits
from .rod import StaticRod

__all__ = ["Workspace", "workspace"]

TIP = ("tip.p[1]", "tip.p[2]", "tip.p[3]")
MAX_EQUILIBRIA = 100_000  # of a map: each takes about 0.3 ms
NEGLIGIBLE = 1e-6  # [K] by which a limit lies above the temperatures at rest at least: rounding of theirs is less
_DIRECTIONS = 48  # of the plane, in which the least speed is looked for


@dataclass(frozen=True)
class Workspace:
    """Equilibria that constant voltages within the limits reach.

    Attributes
    ----------
    powers, temperatures : ndarray, shape (n, N)
        [W], [K]
    tips : ndarray, shape (n, 3)
        [m]
    speeds : ndarray, shape (n,)
        Speed [m/s] that the tip has at once in every direction across the axis: the least over the directions of the
        largest over the powers within the limits.
    """

    powers: np.ndarray
    temperatures: np.ndarray
    tips: np.ndarray
    speeds: np.ndarray


def workspace(scene: Source, limits: PlanLimits | None = None, points: int = 9, overrides: Overrides = ()) -> Workspace:
    """Map the workspace of a manipulator.

    Parameters
    ----------
    scene, overrides
        As read() takes them.
    limits : PlanLimits, optional
    points : int
        Powers of each TCA, evenly spaced from 0 to the largest that a limit allows: points^N equilibria at most.

    Raises
    ------
    SceneError
        The scene is no manipulator, or nothing is within the limits.
    """
    limits = limits or PlanLimits()
    if points < 2:
        raise SceneError(f"points = {points}: give 2 or more")
    described = read(scene, overrides)
    with HeatModel(described) as heat, StaticRod(described, TIP) as rod:
        count = heat.B.shape[1]
        if points**count > MAX_EQUILIBRIA:
            raise SceneError(
                f"points = {points}: {points**count:.2g} equilibria of {count} TCAs; give "
                f"{int(MAX_EQUILIBRIA ** (1.0 / count))} or fewer"
            )
        largest = limits.voltage**2 / heat.electrics.R
        most = np.minimum(largest, (limits.temperature - heat.T_rest) / np.diag(heat.gain))
        if (heat.T_rest >= limits.temperature - NEGLIGIBLE).any():
            raise SceneError(
                f"nothing is within the limits: without power the TCAs get {heat.T_rest.max() - 273.15:.4g} degC, the "
                f"limit of temperature is {limits.temperature - 273.15:.4g} degC; raise it"
            )
        axes = [np.linspace(0.0, m, points) for m in most]
        powers = np.array(list(itertools.product(*axes)))
        temperatures = heat.T_rest + powers @ heat.gain.T
        kept = (temperatures <= limits.temperature * (1.0 + 1e-12)).all(axis=1)
        powers, temperatures = powers[kept], temperatures[kept]
        tips, tangents = rod.linear(temperatures)
        # Rates of the temperatures right after the powers jump to 0 or to the largest: columns of C B.
        instant = heat.C @ heat.B
        angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        directions = np.stack([np.cos(angles), np.sin(angles)])
        gains = np.einsum("kpn,nm,pd->kmd", tangents[:, :2], instant, directions)
        up, down = (largest - powers)[:, :, None], -powers[:, :, None]
        speeds = np.maximum(gains * up, gains * down).sum(axis=1).min(axis=1)
        return Workspace(powers, temperatures, tips, speeds)
