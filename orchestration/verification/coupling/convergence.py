"""Error estimate and observed order of every output from three runs with macro steps H, H/2, H/4.

With d1 = |y_H - y_(H/2)| and d2 = |y_(H/2) - y_(H/4)| (rms over the times of the first run, share of the range) the
observed order is p = log2(d1/d2). Where the differences shrink like a geometric series of ratio r = 2^-p, the error of
y_H is d1/(1 - r), that of y_(H/4) is d2 r/(1 - r) (Richardson; Roache: Perspective. A method for uniform reporting of
grid refinement studies. J. Fluids Eng. 116, 1994).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .runs import CoupledRun

__all__ = ["KINDS", "SignalVerdict", "assess_signal", "common_rows", "scales_of"]

KINDS = {
    "constant": "does not move, so that there is nothing to judge",
    "count": "whole numbers that only grow: a count, not compared",
    "settled": "can be trusted",
    "step": "macro step too long",
    "unsettled": "does not settle as steps are halved",
    "unknown": "too few runs to tell",
}
_LEAST_ORDER = 0.4  # below which differences are taken not to shrink; a jump that shifts with the step has 0.5
_AGREES = 0.01  # share of the tolerance: smaller differences need no order
_MOST_ORDER = 8.0  # above which the ratio of differences is not that of a power of the step
_CONSTANT = 1e-9  # share of the largest magnitude below which a signal does not move
_LEAST_RANGE = 1e-12  # share of the nominal: smaller ranges are rounding
_SAME_TIME = 1e-9  # share of the step below which two times are equal


@dataclass(frozen=True)
class SignalVerdict:
    """What the three runs tell of one output.

    Parameters
    ----------
    name, unit : str
        Name, member.variable, and unit.
    kind : str
        Key of KINDS.
    scale : float
        Range of the signal, in its unit; its magnitude where it does not move.
    error : float
        Estimated error with the macro step H, share of the scale; inf where it does not settle, nan: unknown.
    fine_error : float
        The same with H/4.
    order : float
        Observed order; nan where the differences are too small to tell.
    needed : float
        Longest macro step [s] whose estimated error meets the tolerance; nan where H does or none is known.
    text : str
        The verdict in words.
    """

    name: str
    unit: str
    kind: str
    scale: float
    error: float
    fine_error: float
    order: float
    needed: float
    text: str


def common_rows(runs: Sequence[CoupledRun]) -> list[np.ndarray]:
    """Rows of each run at the times that all of them have, in ascending order."""
    first = runs[0]
    rows = [np.arange(first.times.size)]
    kept = np.ones(first.times.size, dtype=bool)
    for run in runs[1:]:
        right = np.clip(np.searchsorted(run.times, first.times), 0, run.times.size - 1)
        left = np.maximum(right - 1, 0)
        nearest = np.where(np.abs(run.times[left] - first.times) <= np.abs(run.times[right] - first.times), left, right)
        kept &= np.abs(run.times[nearest] - first.times) <= _SAME_TIME * run.step
        rows.append(nearest)
    return [each[kept] for each in rows]


def scales_of(names: Sequence[str], nominals: Sequence[float], values: np.ndarray) -> list[tuple[float, bool]]:
    """Scale of each course in values (n, k), and whether it moves.

    The elements of a vector share the largest range among them, so that rounding in a component that rests counts as
    nothing. Where none moves, the scale is their magnitude.
    """
    spans: dict[str, float] = {}
    sizes: dict[str, float] = {}
    vectors = [name.partition("[")[0] for name in names]
    for vector, nominal, course in zip(vectors, nominals, values.T, strict=True):
        finite = course[np.isfinite(course)]
        span, size = (float(np.ptp(finite)), float(np.abs(finite).max())) if finite.size else (0.0, 0.0)
        spans[vector] = max(spans.get(vector, 0.0), span if span > _LEAST_RANGE * abs(nominal) else 0.0)
        sizes[vector] = max(sizes.get(vector, 0.0), size)
    moving = {vector for vector, span in spans.items() if span > _CONSTANT * sizes[vector]}
    return [(spans[v], True) if v in moving else (sizes[v] or 1.0, False) for v in vectors]


def assess_signal(
    name: str,
    unit: str,
    courses: Sequence[np.ndarray],
    step: float,
    tolerance: float,
    discrete: bool = False,
    size: tuple[float, bool] | None = None,
) -> SignalVerdict:
    """Judge one output.

    Parameters
    ----------
    name, unit : str
        For the verdict.
    courses : sequence of ndarray (n,)
        Values at common times with the macro steps H, H/2, H/4; fewer where runs failed, the finest last.
    step : float
        H [s].
    tolerance : float
        Error allowed, share of the range.
    discrete : bool
        Whether the values are numbers of states, such as enumerations: differences are shares of the times then.
    size : (float, bool), optional
        Scale and whether it moves, of scales_of(); by default from the finest course alone.

    Returns
    -------
    SignalVerdict
    """

    def verdict(
        kind: str,
        text: str,
        error: float = math.nan,
        fine: float = math.nan,
        order: float = math.nan,
        needed: float = math.nan,
    ) -> SignalVerdict:
        return SignalVerdict(name, unit, kind, scale, error, fine, order, needed, text)

    scale, moves = size or scales_of([name], [0.0], courses[-1][:, None])[0]
    finite = all(np.isfinite(course).all() for course in courses)
    if finite and _counts(courses):
        return verdict("count", KINDS["count"])
    if len(courses) < 2:
        return verdict("unknown", "only one of the three runs reached its end, so that no error can be estimated")
    with np.errstate(over="ignore", invalid="ignore"):
        gaps = [float(np.mean(a != b)) if discrete else _rms(a - b) / scale for a, b in itertools.pairwise(courses)]
    if not moves and all(gap <= _CONSTANT for gap in gaps):
        return verdict("constant", KINDS["constant"], 0.0, 0.0)
    if len(gaps) < 2:
        if gaps[0] <= tolerance:
            text = f"H/2 and H/4 differ by {_percent(gaps[0])} of its range; the run with H fails"
        else:
            text = f"H/2 and H/4 still differ by {_percent(gaps[0])} of its range, and the run with H fails"
        return verdict("step" if gaps[0] <= tolerance else "unsettled", text, math.inf, gaps[0], needed=step / 2.0)
    first, second = (gap if math.isfinite(gap) else math.inf for gap in gaps)
    order = _observed_order(first, second)
    if max(first, second) <= _AGREES * tolerance:
        shown = order if _LEAST_ORDER <= order <= _MOST_ORDER else math.nan
        error = max(first, second)
        return verdict(
            "settled",
            f"can be trusted: halving the step changes it by {_percent(error)} of its range",
            error,
            second,
            shown,
        )
    if order < _LEAST_ORDER:
        if max(first, second) <= tolerance:
            return verdict(
                "settled",
                f"changes by {_percent(first)} and {_percent(second)} of its range as the step is halved: within the "
                "tolerance, but not shrinking, so that tolerances inside the FMUs may decide",
                max(first, second),
                second,
                order,
            )
        return verdict(
            "unsettled",
            f"does not settle: it changes by {_percent(first)} of its range from H to H/2 and by {_percent(second)} "
            "from H/2 to H/4",
            math.inf,
            math.inf,
            order,
        )
    ratio = 2.0 ** -min(order, _MOST_ORDER)
    error, middle, fine = first / (1.0 - ratio), second / (1.0 - ratio), second * ratio / (1.0 - ratio)
    words = f"error about {_percent(error)} of its range ({error * scale:.2g} {unit}), order {_order(order)}"
    if error <= tolerance:
        return verdict("settled", f"can be trusted: {words}", error, fine, order)
    needed = _needed(step, tolerance, error, middle, fine, order)
    return verdict(
        "step",
        f"{words}: the macro step is too long; for {_percent(tolerance)} take at most {needed:.2g} s",
        error,
        fine,
        order,
        needed,
    )


def _observed_order(first: float, second: float) -> float:
    """log2(first/second); -inf where the differences appear or grow without bound, inf where they vanish."""
    if second == math.inf or first == 0.0 < second:
        return -math.inf
    return math.log2(first / second) if second > 0.0 and first < math.inf else math.inf


def _needed(step: float, tolerance: float, error: float, middle: float, fine: float, order: float) -> float:
    if middle <= tolerance:
        return step / 2.0
    if fine <= tolerance:
        return step / 4.0
    return min(step / 4.0, step * (tolerance / error) ** (1.0 / min(order, _MOST_ORDER)))


def _counts(courses: Sequence[np.ndarray]) -> bool:
    """Whether courses are whole numbers that only grow, by more than 0, and end differently."""
    whole = all(np.array_equal(course, np.round(course)) and (np.diff(course) >= 0.0).all() for course in courses)
    return whole and len({float(course[-1]) for course in courses}) > 1


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if math.isfinite(share) else "an infinite share"


def _order(order: float) -> str:
    return f"{order:.1f}" if order <= _MOST_ORDER else f"above {_MOST_ORDER:.0f}"
