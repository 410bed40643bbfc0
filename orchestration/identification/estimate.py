"""Estimation of parameters by nonlinear least squares.

    minimise  sum over samples ((measured - predicted(theta) - offset)/sigma)^2
              + sum over priors ((theta - mean)/deviation)^2

within bounds, by a trust-region method (scipy.optimize.least_squares). Derivatives are differences of order 4 in the
scaled parameters; all runs of a Jacobian are one call of the engine. Where no noise is given, that of each vector of
outputs is estimated from its residuals and the fit repeated. With the Jacobian J of the weighted residuals, cov =
(J^T J)^-1 (Seber & Wild, Nonlinear Regression, 2003, section 5.1), intervals are those of Student's t.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from ..errors import CosimError, SceneError
from ..fmi.vectors import split_index
from ..scene import Scene
from .measurements import Measurements
from .parameters import FreeParameter
from .predictions import Predictor

__all__ = ["Estimate", "identify"]

STEP = 1e-2  # of the differences, in scaled parameters: truncation 1e-8, and far above the models' own tolerances
CENTRAL = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}  # node -> weight of differences of order 4
FORWARD = {0: -25 / 12, 1: 4.0, 2: -3.0, 3: 4 / 3, 4: -1 / 4}
FIT_TOLERANCE = 1e-6  # relative change of cost or parameters at which the fit ends
MAX_RUNS = 60  # evaluations of the fit
NOISE_ROUNDS = 2  # repetitions with the noise that the residuals show
UNCERTAIN = 0.5  # relative standard deviation of a combination of parameters from which on the data do not tell it
INVOLVED = 0.2  # share of a parameter in such a combination from which on it is named
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """Estimated parameters.

    Attributes
    ----------
    free : tuple of FreeParameter
        Parameters, p of them; offsets of outputs follow in the arrays.
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
    undetermined : tuple of tuple of str
        Sets of unknowns of which the data fix fewer combinations than there are unknowns.
    at_bounds : tuple of str
        Unknowns that end at a bound, where intervals do not hold.
    samples, runs : int
    """

    free: tuple[FreeParameter, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    deviations: np.ndarray
    intervals: np.ndarray
    correlations: np.ndarray
    noise: Mapping[str, float]
    residuals: Mapping[str, float]
    undetermined: tuple[tuple[str, ...], ...]
    at_bounds: tuple[str, ...]
    samples: int
    runs: int

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
    fit = _Fit([Predictor(scene, measured) for scene, measured in experiments], tuple(free), dict(noise or {}), offsets)
    x = fit.start()
    for _ in range(1 if fit.knows_all_noise else 1 + NOISE_ROUNDS):
        x = fit.solve(x)
        fit.estimate_noise(x)
    return fit.describe(x)


class _Fit:
    def __init__(
        self,
        predictors: list[Predictor],
        free: tuple[FreeParameter, ...],
        noise: dict[str, float],
        offsets: Sequence[str],
    ) -> None:
        self.predictors, self.free = predictors, free
        outputs = list(dict.fromkeys(name for p in predictors for name in p.measured.outputs))
        self.vectors = list(dict.fromkeys(split_index(name)[0] for name in outputs))
        for name in noise:
            if name not in self.vectors:
                raise SceneError(f"noise of {name!r}: not measured; measured are {', '.join(self.vectors)}")
            if not noise[name] > 0.0:
                raise SceneError(f"noise of {name!r} = {noise[name]}: give a positive standard deviation")
        self.offsets = [name for name in outputs if name in offsets or split_index(name)[0] in offsets]
        unknown = [o for o in offsets if o not in outputs and o not in self.vectors]
        if unknown:
            raise SceneError(f"offset of {unknown[0]!r}: not measured; measured are {', '.join(outputs)}")
        self.given = noise
        self.knows_all_noise = set(noise) == set(self.vectors)
        self.samples = sum(int(np.isfinite(p.measured.values).sum()) for p in predictors)
        if self.samples <= len(free) + len(self.offsets):
            raise SceneError(f"{self.samples} samples for {len(free) + len(self.offsets)} unknowns; measure more")
        spread = {v: self._spread(v) for v in self.vectors}
        self.sigma = spread | noise
        self.scales = np.array([p.scale for p in free] + [spread[split_index(o)[0]] for o in self.offsets])

    def _spread(self, vector: str) -> float:
        values = [p.measured.values[:, k] for p in self.predictors for k in self._columns(p, vector)]
        return float(np.nanstd(np.concatenate(values))) or 1.0

    @staticmethod
    def _columns(predictor: Predictor, vector: str) -> list[int]:
        return [k for k, name in enumerate(predictor.measured.outputs) if split_index(name)[0] == vector]

    # ------------------------------------------------------------ residuals in scaled unknowns x = theta / scale

    def start(self) -> np.ndarray:
        """Return the first guess (q,)."""
        return np.array([p.start for p in self.free] + [0.0] * len(self.offsets)) / self.scales

    def residuals(self, points: np.ndarray) -> np.ndarray:
        """Return the weighted residuals (runs, samples + priors) at points (runs, q); nan where a run fails."""
        count = len(self.free)
        theta = points * self.scales
        names = [p.name for p in self.free]
        parts = []
        for predictor in self.predictors:
            measured = predictor.measured
            predicted = predictor(names, theta[:, :count])
            for k, name in enumerate(measured.outputs):
                there = np.isfinite(measured.values[:, k])
                difference = measured.values[there, k] - predicted[:, there, k]
                if name in self.offsets:
                    difference = difference - theta[:, count + self.offsets.index(name), None]
                parts.append(difference / self.sigma[split_index(name)[0]])
        for k, parameter in enumerate(self.free):
            if parameter.prior is not None:
                mean, deviation = parameter.prior
                parts.append((mean - theta[:, k, None]) / deviation)
        return np.concatenate(parts, axis=1)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return the derivatives (samples + priors, q) of the weighted residuals, in one call of the models."""
        steps = STEP * np.maximum(np.abs(x), 1e-2)
        least, most = self.bounds()
        points, weights = [], []
        for k, step in enumerate(steps):
            room_below, room_above = x[k] - least[k], most[k] - x[k]
            stencil = CENTRAL
            if min(room_below, room_above) <= 2.0 * step:  # of the same order, away from the bound
                stencil = FORWARD if room_above > room_below else {-node: -factor for node, factor in FORWARD.items()}
            for node, factor in stencil.items():
                points.append(x + node * step * np.eye(len(x))[k])
                weights.append((k, factor / step))
        values = self._require_runs(self.residuals(np.array(points)))
        J = np.zeros((values.shape[1], len(x)))
        for (k, weight), row in zip(weights, values, strict=True):
            J[:, k] += weight * row
        return J

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds (q,) of the scaled unknowns."""
        free = [-np.inf] * len(self.offsets), [np.inf] * len(self.offsets)
        least = np.array([p.least for p in self.free] + free[0]) / self.scales
        return least, np.array([p.most for p in self.free] + free[1]) / self.scales

    def _require_runs(self, values: np.ndarray) -> np.ndarray:
        """Return the residuals (runs, r). Raises CosimError where a run failed."""
        if not np.isfinite(values).all():
            where, why = next((p.scene.name, p.failure) for p in self.predictors if p.failure)
            raise CosimError(
                f"{where}: a set of parameters cannot be run: {why}; start elsewhere (--set), or give narrower bounds"
            )
        return values

    def solve(self, x: np.ndarray) -> np.ndarray:
        """Return the solution (q,) from x on; steps to parameters that cannot be run are shortened."""
        self._require_runs(self.residuals(x[None]))
        solution = least_squares(
            lambda x: self.residuals(x[None])[0],
            x,
            jac=self.jacobian,
            bounds=self.bounds(),
            method="trf",
            xtol=FIT_TOLERANCE,
            ftol=FIT_TOLERANCE,
            max_nfev=MAX_RUNS,
        )
        return np.asarray(solution.x)

    def estimate_noise(self, x: np.ndarray) -> None:
        """Set the noise that was not given to what the residuals show."""
        for vector, rms in self.rms(x).items():
            if vector not in self.given:
                self.sigma[vector] = max(rms, 1e-12 * self._spread(vector))

    def rms(self, x: np.ndarray) -> dict[str, float]:
        """Return the root mean square residual of each vector of outputs, per degree of freedom."""
        weighted = self.residuals(x[None])[0]
        labels = [
            split_index(name)[0]
            for p in self.predictors
            for k, name in enumerate(p.measured.outputs)
            for _ in range(int(np.isfinite(p.measured.values[:, k]).sum()))
        ]
        lost = np.sqrt(self.samples / (self.samples - len(x)))
        chosen = {v: np.array([label == v for label in labels]) for v in self.vectors}
        r = weighted[: len(labels)]
        return {v: float(np.sqrt(np.mean(r[k] ** 2)) * self.sigma[v] * lost) for v, k in chosen.items()}

    def describe(self, x: np.ndarray) -> Estimate:
        """Return the estimate with its confidence."""
        J = self.jacobian(x)
        relative = J * np.maximum(np.abs(x), 1e-12)  # per relative change
        relative[:, len(self.free) :] = J[:, len(self.free) :]
        _, singular, directions = np.linalg.svd(relative, full_matrices=False)
        names = (*(p.name for p in self.free), *(f"offset({o})" for o in self.offsets))
        undetermined = [
            tuple(names[k] for k in np.flatnonzero(np.abs(v) > INVOLVED * np.abs(v).max()))
            for s, v in zip(singular, directions, strict=True)
            if s * UNCERTAIN < 1.0
        ]
        floor = singular.max() * np.finfo(float).eps * len(J)
        inverse = np.where(singular > floor, 1.0 / np.maximum(singular, floor), 1.0 / floor)
        size = np.maximum(np.abs(x), 1e-12)
        size[len(self.free) :] = 1.0
        root = (directions.T * inverse) * (size * self.scales)[:, None]
        covariance = root @ root.T
        deviations = np.sqrt(np.diag(covariance))
        values = x * self.scales
        reach = student.ppf(0.5 + 0.5 * CONFIDENCE, self.samples - len(x)) * deviations
        least, most = self.bounds()
        units = [p.unit for p in self.free] + [self._unit(o) for o in self.offsets]
        return Estimate(
            free=self.free,
            names=names,
            units=tuple(units),
            values=values,
            deviations=deviations,
            intervals=np.stack([values - reach, values + reach], axis=1),
            correlations=covariance / np.outer(deviations, deviations),
            noise=dict(self.sigma),
            residuals=self.rms(x),
            undetermined=tuple(undetermined),
            at_bounds=tuple(n for n, v, a, b in zip(names, x, least, most, strict=True) if min(v - a, b - v) < 1e-6),
            samples=self.samples,
            runs=sum(p.runs for p in self.predictors),
        )

    def _unit(self, output: str) -> str:
        member, _, variable = output.partition(".")
        return self.predictors[0].scene.member(member).archive.variables[variable].unit
