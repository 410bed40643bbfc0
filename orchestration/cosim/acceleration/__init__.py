"""Acceleration of the fixed-point iteration of a loop: x = G(x), with the residual r = G(x) - x of a sweep G.

Every method is a small frozen value with one function, update(history) -> change of x. solve() drives them and stops on
the estimated true error e = (I - S)^-1 r of the guess, S = dG/dx, and e - r of what the sweep gave. The residual alone
would mislead: for a loop gain -g it is g + 1 times the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .aitken import Aitken
from .broyden import Broyden
from .fixed_point import FixedPoint
from .history import IterationHistory, Method, no_jacobian
from .newton import FiniteDifferenceNewton, TangentNewton
from .past_solutions import KEPT, LEAST, PastSolutions
from .quasi_newton import QuasiNewton
from .relaxation import Relaxation
from .secants import Secants, norm, spectral_radius

__all__ = [
    "KEPT",
    "LEAST",
    "METHODS",
    "IterationHistory",
    "Method",
    "Outcome",
    "PastSolutions",
    "Secants",
    "create",
    "norm",
    "solve",
    "spectral_radius",
]

RELAXED: dict[str, Callable[..., Method]] = {
    "relaxed": Relaxation,
    "aitken": Aitken,
    "broyden": Broyden,
}
UNRELAXED: dict[str, Callable[[], Method]] = {
    "plain": FixedPoint,
    "iqn": QuasiNewton,
    "newton": FiniteDifferenceNewton,
    "tangent": TangentNewton,
}
METHODS = ("plain", "relaxed", "aitken", "iqn", "broyden", "newton", "tangent")  # words of a scene

BLIND_SHARE = 1e-3  # share of the tolerance that a residual must meet before a secant has shown the loop's gain
NOISE_SHARE = 0.01  # share of the tolerance below which differences are noise of the subsystems' solvers


def create(name: str, omega: float | None = None) -> Method:
    """Return the method of that name; omega: relaxation where it has one, None for its own default."""
    if name in UNRELAXED:
        return UNRELAXED[name]()
    kind = RELAXED[name]
    return kind() if omega is None else kind(omega)


@dataclass(frozen=True)
class Outcome:
    """Result of solve().

    Attributes
    ----------
    x : ndarray, shape (n,)
        The last guess, whose sweep the subsystems have done.
    converged : bool
        Whether the estimated error is within the tolerance.
    error : float
        Estimated Euclidean norm of the error of x, in units of the nominals.
    residuals : tuple of float
        Norm of the residual after each sweep, in units of the nominals.
    solution : ndarray, shape (n,)
        x without its estimated error: what a next iteration would have tried.
    """

    x: np.ndarray
    converged: bool
    error: float
    residuals: tuple[float, ...]
    solution: np.ndarray


def solve(
    sweep: Callable[[np.ndarray], np.ndarray],
    x: np.ndarray,
    scale: np.ndarray,
    method: Method,
    history: IterationHistory,
    tolerance: float,
    max_sweeps: int,
    jacobian: Callable[[], np.ndarray | None] = no_jacobian,
) -> Outcome:
    """Iterate until the estimated error is within tolerance * scale.

    Parameters
    ----------
    sweep : callable
        The map G, (n,) -> (n,).
    x, scale : ndarray, shape (n,)
        First guess and nominals of the unknowns.
    method : Method
        Acceleration.
    history : IterationHistory
        Kept from step to step.
    tolerance : float
        Share of the nominals.
    max_sweeps : int
        Limit of the number of sweeps.
    jacobian : callable
        Returns dr/dx (n, n) in units of the nominals at the end of the last sweep, or None.
    """
    history.start_step(jacobian)
    residuals: list[float] = []
    while True:
        r = (sweep(x) - x) / scale
        residuals.append(norm(r))
        if not residuals[-1] < math.inf:  # nan or infinite
            return Outcome(x, False, math.inf, tuple(residuals), x)
        history.x.append(x / scale)
        history.r.append(r)
        secants = history.secants
        if len(residuals) > 1:
            dx, dr = history.x[-1] - history.x[-2], r - history.r[-2]
            if max(norm(dx), norm(dr)) > NOISE_SHARE * tolerance:  # gains may be hundreds, as near buckling
                secants.add(dx, dr)
        history.split = secants.split(r)
        e = history.split[0] + history.split[1]
        error = max(norm(e), norm(e - r))
        if error <= (tolerance if secants.columns else BLIND_SHARE * tolerance):
            return Outcome(x, True, error, tuple(residuals), x + scale * e)
        if len(residuals) >= max_sweeps:
            return Outcome(x, False, error, tuple(residuals), x)
        x = x + scale * method.update(history)
