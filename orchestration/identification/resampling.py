"""Confidence by resampling: the fit is repeated on measurements whose residuals are drawn anew.

Residuals at the estimate, centred and widened by sqrt(n/(n - q)), are drawn with replacement within each vector of
outputs and added to the predictions; the means of priors are drawn from the priors (Efron & Tibshirani, An
Introduction to the Bootstrap, 1993, sections 9.4 and 13.3). Intervals are percentiles, so they need no linear model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import CosimError, SceneError
from ..fmi.vectors import split_index
from ..parallel import Worker, serial
from ..scene import Scene
from .estimate import CONFIDENCE, Estimate
from .fit import Fit
from .measurements import Measurements
from .parameters import FreeParameter
from .predictions import Predictor

__all__ = ["LEAST_REPEATS", "Bootstrap", "Refit", "bootstrap"]

LEAST_REPEATS = 20  # fewer do not have percentiles of 2.5 and 97.5 %
MOST_FAILED = 0.5  # share of repeats that may fail before the rest says nothing

Experiments = Sequence[tuple[Scene, Measurements]]


@dataclass(frozen=True)
class Bootstrap:
    """Estimates from resampled measurements.

    Attributes
    ----------
    names : tuple of str
        Of the q unknowns, as in the estimate.
    values : ndarray, shape (repeats, q)
        Estimates of the repeats that did not fail.
    deviations : ndarray, shape (q,)
        Their standard deviations.
    intervals : ndarray, shape (q, 2)
        Their percentiles of 2.5 and 97.5 %.
    failed : int
        Repeats that could not be fitted.
    """

    names: tuple[str, ...]
    values: np.ndarray
    deviations: np.ndarray
    intervals: np.ndarray
    failed: int


@dataclass(frozen=True)
class Refit:
    """The fit of one set of resampled measurements, a task for any process."""

    experiments: tuple[tuple[Scene, Measurements], ...]
    free: tuple[FreeParameter, ...]
    noise: dict[str, float]
    offsets: tuple[str, ...]
    start: np.ndarray

    def __call__(self) -> np.ndarray | None:
        """Return the unknowns (q,), or None where the fit fails."""
        predictors = [Predictor(scene, measured, threads=1) for scene, measured in self.experiments]
        fit = Fit(predictors, self.free, self.noise, self.offsets)
        try:
            values = fit.solve(self.start / fit.scales) * fit.scales
        except CosimError:
            return None
        return values if fit.converged else None

    def lost(self, why: str) -> np.ndarray | None:
        """Return what stands for a fit whose process died."""
        return None


def bootstrap(
    experiments: Experiments,
    estimate: Estimate,
    repeats: int = 200,
    seed: int = 0,
    worker: Worker[np.ndarray | None] = serial,
) -> Bootstrap:
    """Repeat an estimation on resampled measurements.

    Parameters
    ----------
    experiments : sequence of (Scene, Measurements)
        Those that the estimate was made from.
    estimate : Estimate
    repeats : int
        Number of fits; each costs about as many runs as the estimate.
    seed : int
        Of the random numbers.
    worker : callable
        Executes the fits: parallel.serial here, or parallel.spread by dask.

    Raises
    ------
    SceneError
        Too few repeats.
    CosimError
        More than half of the fits fail.
    """
    if repeats < LEAST_REPEATS:
        raise SceneError(f"bootstrap of {repeats} repeats: too few for intervals; give {LEAST_REPEATS} or more")
    predictors = [Predictor(scene, measured) for scene, measured in experiments]
    fit = Fit(predictors, estimate.free, dict(estimate.noise), estimate.offsets)
    predicted = fit.predicted(estimate.values / fit.scales)
    residuals = _residuals(fit, predicted, len(estimate.values))
    random = np.random.default_rng(seed)
    tasks = [
        Refit(
            tuple(
                (scene, _resampled(measured, values, residuals, random))
                for (scene, measured), values in zip(experiments, predicted, strict=True)
            ),
            tuple(_with_drawn_prior(parameter, random) for parameter in estimate.free),
            dict(estimate.noise),
            estimate.offsets,
            estimate.values,
        )
        for _ in range(repeats)
    ]
    outcomes = dict(worker(tasks))
    values = [outcomes[k] for k in sorted(outcomes)]
    kept = np.array([value for value in values if value is not None]).reshape(-1, len(estimate.values))
    failed = repeats - len(kept)
    if failed > MOST_FAILED * repeats:
        raise CosimError(
            f"bootstrap: {failed} of {repeats} fits failed; give narrower bounds, or fix what the data do not tell"
        )
    tail = 0.5 * (1.0 - CONFIDENCE)
    intervals = np.quantile(kept, [tail, 1.0 - tail], axis=0).T
    return Bootstrap(estimate.names, kept, kept.std(axis=0, ddof=1), intervals, failed)


def _residuals(fit: Fit, predicted: list[np.ndarray], unknowns: int) -> dict[str, np.ndarray]:
    """Return the residuals of each vector of outputs, centred and widened."""
    pools: dict[str, list[np.ndarray]] = {vector: [] for vector in fit.vectors}
    for predictor, values in zip(fit.predictors, predicted, strict=True):
        for k, name in enumerate(predictor.measured.outputs):
            difference = predictor.measured.values[:, k] - values[:, k]
            pools[split_index(name)[0]].append(difference[np.isfinite(difference)])
    widening = np.sqrt(fit.samples / (fit.samples - unknowns))
    joined = {vector: np.concatenate(parts) for vector, parts in pools.items()}
    return {vector: widening * (values - values.mean()) for vector, values in joined.items()}


def _resampled(
    measured: Measurements, predicted: np.ndarray, residuals: dict[str, np.ndarray], random: np.random.Generator
) -> Measurements:
    """Return measurements with residuals drawn anew; what was missing is missing."""
    values = predicted.copy()
    for k, name in enumerate(measured.outputs):
        values[:, k] += random.choice(residuals[split_index(name)[0]], len(values))
    values[~np.isfinite(measured.values)] = np.nan
    return replace(measured, values=values)


def _with_drawn_prior(parameter: FreeParameter, random: np.random.Generator) -> FreeParameter:
    """Return a parameter whose prior has a mean that is drawn from it."""
    if parameter.prior is None:
        return parameter
    mean, deviation = parameter.prior
    return replace(parameter, prior=(float(random.normal(mean, deviation)), deviation))
