"""Estimation of parameters from measurements, with confidence.

Where no noise is given, that of each vector of outputs is estimated from its residuals and the fit repeated. With the
Jacobian J of the weighted residuals, cov = (J^T J)^-1 (Seber & Wild, Nonlinear Regression, 2003, section 5.1),
intervals are those of Student's t.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from ..scene import Scene
from .fit import Fit
from .measurements import Measurements
from .parameters import FreeParameter
from .predictions import Predictor

__all__ = ["CONFIDENCE", "Estimate", "identify"]

NOISE_ROUNDS = 2  # repetitions with the noise that the residuals show
UNCERTAIN = 0.5  # relative standard deviation of a combination of parameters from which on the data do not tell it
INVOLVED = 0.2  # share of a parameter in such a combination from which on it is named
LEAST_SIZE = 0.1  # share of its start that a parameter has at least where deviations are relative: it may be 0
NO_INFLUENCE = 1e-100  # singular value taken where no parameter changes any prediction: numbers stay finite
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """Estimated parameters.

    Attributes
    ----------
    free : tuple of FreeParameter
        Parameters, p of them; offsets of outputs follow in the arrays.
    offsets : tuple of str
        Outputs whose sensor has an offset.
    names : tuple of str
        Of all q unknowns: parameters, then 'offset(output)'.
    units : tuple of str
    values, deviations : ndarray, shape (q,)
        Estimates and their standard deviations.
    intervals : ndarray, shape (q, 2)
        95 % confidence intervals.
    correlations : ndarray, shape (q, q)
    noise : dict of str to float
        Standard deviation of each vector of outputs, as given or estimated.
    residuals : dict of str to float
        Root mean square of the residuals of each vector of outputs.
    spread : dict of str to float
        Standard deviation of the measurements of each vector of outputs, about the mean of each output.
    undetermined : tuple of tuple of str
        Sets of unknowns of which the data fix fewer combinations than there are unknowns.
    at_bounds : tuple of str
        Unknowns that end at a bound, where intervals do not hold.
    samples, runs : int
    converged : bool
        False: the fit was ended after MAX_RUNS steps, short of the optimum.
    """

    free: tuple[FreeParameter, ...]
    offsets: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    deviations: np.ndarray
    intervals: np.ndarray
    correlations: np.ndarray
    noise: Mapping[str, float]
    residuals: Mapping[str, float]
    spread: Mapping[str, float]
    undetermined: tuple[tuple[str, ...], ...]
    at_bounds: tuple[str, ...]
    samples: int
    runs: int
    converged: bool

    def parameters(self) -> dict[str, float]:
        """Return the estimated parameters by name."""
        return {p.name: float(v) for p, v in zip(self.free, self.values, strict=False)}


def identify(
    experiments: Sequence[tuple[Scene, Measurements]],
    free: Sequence[FreeParameter],
    noise: Mapping[str, float] | None = None,
    offsets: Sequence[str] = (),
) -> Estimate:
    """Estimate parameters from measurements of one scene or several.

    Parameters
    ----------
    experiments : sequence of (Scene, Measurements)
        All have the free parameters in common.
    free : sequence of FreeParameter
    noise : mapping, optional
        Vector of outputs, such as 'thermal.T' -> standard deviation in its unit; estimated where it is not given.
    offsets : sequence of str
        Outputs, such as 'thermal.T[1]', or vectors of them, whose sensor has an unknown offset.

    Raises
    ------
    SceneError
        Names that do not fit, or fewer samples than unknowns.
    CosimError
        The parameters at the start, or those next to a point of the search, cannot be run.
    """
    fit = Fit([Predictor(scene, measured) for scene, measured in experiments], tuple(free), dict(noise or {}), offsets)
    x = fit.start()
    for _ in range(1 if fit.knows_all_noise else 1 + NOISE_ROUNDS):
        x = fit.solve(x)
        fit.estimate_noise(x)
    return _described(fit, x)


def _described(fit: Fit, x: np.ndarray) -> Estimate:
    """Return the estimate with its confidence."""
    J = fit.jacobian(x)
    size = np.maximum(np.abs(x), LEAST_SIZE)
    size[len(fit.free) :] = 1.0
    relative = J * size  # per relative change
    _, singular, directions = np.linalg.svd(relative, full_matrices=False)
    names = (*(p.name for p in fit.free), *(f"offset({o})" for o in fit.offsets))
    undetermined = [
        tuple(names[k] for k in np.flatnonzero(np.abs(v) > INVOLVED * np.abs(v).max()))
        for s, v in zip(singular, directions, strict=True)
        if s * UNCERTAIN < 1.0
    ]
    floor = max(singular.max() * np.finfo(float).eps * len(J), NO_INFLUENCE)
    inverse = np.where(singular > floor, 1.0 / np.maximum(singular, floor), 1.0 / floor)
    root = (directions.T * inverse) * (size * fit.scales)[:, None]
    covariance = root @ root.T
    deviations = np.sqrt(np.diag(covariance))
    values = x * fit.scales
    reach = student.ppf(0.5 + 0.5 * CONFIDENCE, fit.samples - len(x)) * deviations
    least, most = fit.bounds()
    units = [p.unit for p in fit.free] + [_unit(fit, o) for o in fit.offsets]
    return Estimate(
        free=fit.free,
        offsets=tuple(fit.offsets),
        names=names,
        units=tuple(units),
        values=values,
        deviations=deviations,
        intervals=np.stack([values - reach, values + reach], axis=1),
        correlations=covariance / np.outer(deviations, deviations),
        noise=dict(fit.sigma),
        residuals=fit.rms(x),
        spread={vector: fit.spread_around_means(vector) for vector in fit.vectors},
        undetermined=tuple(undetermined),
        at_bounds=tuple(n for n, v, a, b in zip(names, x, least, most, strict=True) if min(v - a, b - v) < 1e-6),
        samples=fit.samples,
        runs=sum(p.runs for p in fit.predictors),
        converged=fit.converged,
    )


def _unit(fit: Fit, output: str) -> str:
    member, _, variable = output.partition(".")
    scene = next(p.scene for p in fit.predictors if output in p.measured.outputs)
    return scene.member(member).archive.variables[variable].unit
