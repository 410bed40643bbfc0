"""Weighted residuals of measurements, their derivatives, and the nonlinear least-squares fit.

    minimise  sum over samples ((measured - predicted(theta) - offset)/sigma)^2
              + sum over priors ((theta - mean)/deviation)^2

within bounds, by a trust-region method (scipy.optimize.least_squares). Derivatives are differences of order 4 in the
scaled parameters; all runs of a Jacobian are one call of the engine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from ..errors import CosimError, SceneError
from ..fmi.vectors import split_index
from .parameters import FreeParameter
from .predictions import Predictor

__all__ = ["Fit"]

STEP = 1e-2  # of the differences, in scaled parameters: truncation 1e-8, and far above the models' own tolerances
CENTRAL = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}  # node -> weight of differences of order 4
FORWARD = {0: -25 / 12, 1: 4.0, 2: -3.0, 3: 4 / 3, 4: -1 / 4}
FIT_TOLERANCE = 1e-6  # relative change of cost or parameters at which the fit ends
MAX_RUNS = 60  # evaluations of the fit
FAR = 1e3  # bounds farther away, in sizes of the parameter, are none: the method scales a variable by its distance


class Fit:
    """The problem in scaled unknowns x = theta/scale: free parameters, then offsets of sensors; q of them."""

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
                why = "give that of the whole vector" if name in outputs else "not measured"
                raise SceneError(f"noise of {name!r}: {why}; measured are {', '.join(self.vectors)}")
            if not 0.0 < noise[name] < np.inf:
                raise SceneError(f"noise of {name!r} = {noise[name]}: give a positive, finite standard deviation")
        self.offsets = [name for name in outputs if name in offsets or split_index(name)[0] in offsets]
        unknown = [o for o in offsets if o not in outputs and o not in self.vectors]
        if unknown:
            raise SceneError(f"offset of {unknown[0]!r}: not measured; measured are {', '.join(outputs)}")
        self.given = noise
        self.converged = False
        self.knows_all_noise = set(noise) == set(self.vectors)
        self.samples = sum(int(np.isfinite(p.measured.values).sum()) for p in predictors)
        if self.samples <= len(free) + len(self.offsets):
            raise SceneError(
                f"samples: {self.samples}, unknowns: {len(free) + len(self.offsets)}; measure more, or free less"
            )
        spread = {v: self._spread(v) for v in self.vectors}
        self.sigma = spread | noise
        self.scales = np.array([p.scale for p in free] + [spread[split_index(o)[0]] for o in self.offsets])

    def _spread(self, vector: str) -> float:
        values = [p.measured.values[:, k] for p in self.predictors for k in self._columns(p, vector)]
        return float(np.nanstd(np.concatenate(values))) or 1.0

    def spread_around_means(self, vector: str) -> float:
        """Return the standard deviation of what was measured of a vector, about the mean of each of its outputs."""
        deviations = [
            p.measured.values[:, k] - np.nanmean(p.measured.values[:, k])
            for p in self.predictors
            for k in self._columns(p, vector)
        ]
        return float(np.nanstd(np.concatenate(deviations)))

    @staticmethod
    def _columns(predictor: Predictor, vector: str) -> list[int]:
        return [k for k, name in enumerate(predictor.measured.outputs) if split_index(name)[0] == vector]

    # ------------------------------------------------------------ residuals in scaled unknowns x = theta / scale

    def start(self) -> np.ndarray:
        """Return the first guess (q,)."""
        return np.array([p.start for p in self.free] + [0.0] * len(self.offsets)) / self.scales

    def predicted(self, x: np.ndarray) -> list[np.ndarray]:
        """Return what each predictor expects its sensors to show (n, m) at a point (q,), their offsets included."""
        theta, count = x * self.scales, len(self.free)
        shown = []
        for predictor in self.predictors:
            values = predictor([p.name for p in self.free], theta[None, :count])[0].copy()
            for k, name in enumerate(predictor.measured.outputs):
                if name in self.offsets:
                    values[:, k] += theta[count + self.offsets.index(name)]
            shown.append(values)
        return shown

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
        """Return the derivatives (samples + priors, q) of the weighted residuals, in one call of the models.

        Differences are central, and one-sided of the same order beside a bound or where a run fails.
        """
        steps = STEP * np.maximum(np.abs(x), 1e-2)
        choices = [self._stencils(x[k], step, k) for k, step in enumerate(steps)]
        columns: dict[int, np.ndarray] = {}
        while len(columns) < len(x):
            left = [k for k in range(len(x)) if k not in columns]
            chosen = [(k, choices[k].pop(0)) for k in left]
            points = [x + node * steps[k] * np.eye(len(x))[k] for k, stencil in chosen for node in stencil]
            values = self.residuals(np.array(points))
            begin = 0
            for k, stencil in chosen:
                rows = values[begin : begin + len(stencil)]
                begin += len(stencil)
                if np.isfinite(rows).all():
                    columns[k] = np.array(list(stencil.values())) @ rows / steps[k]
                elif not choices[k]:
                    self._require_runs(rows)
        return np.array([columns[k] for k in range(len(x))]).T

    def _stencils(self, x: float, step: float, k: int) -> list[dict[int, float]]:
        """Return the stencils that fit between the bounds of unknown k, the best first."""
        least, most = self.bounds()
        below, above = x - least[k], most[k] - x
        backward = {-node: -factor for node, factor in FORWARD.items()}
        sides = [FORWARD, backward] if above > below else [backward, FORWARD]
        return sides[:1] if min(below, above) <= 2.0 * step else [CENTRAL, *sides]

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds (q,) of the scaled unknowns."""
        offsets = np.full(len(self.offsets), np.inf)
        least = np.append([p.least for p in self.free], -offsets) / self.scales
        most = np.append([p.most for p in self.free], offsets) / self.scales
        return np.where(least < -FAR, -np.inf, least), np.where(most > FAR, np.inf, most)

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
        try:
            solution = least_squares(
                lambda x: self.residuals(x[None])[0],
                x,
                jac=self.jacobian,
                bounds=self.bounds(),
                method="trf",
                x_scale="jac",
                xtol=FIT_TOLERANCE,
                ftol=FIT_TOLERANCE,
                max_nfev=MAX_RUNS,
            )
        except ValueError:  # what least_squares says of a first point that is not finite
            self._require_runs(self.residuals(x[None]))
            raise
        self.converged = solution.status > 0
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
