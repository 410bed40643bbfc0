"""Stability maps of analytic systems: macro step against coupling strength, with their known limits.

Split Dahlquist x' = -x + u, u = -r x; an actuator of relative stiffness r on an oscillator, x'' = -x - d x' - r x; two
masses with a spring and a damper of strength r between them (Busch, Schweizer), as force against displacement (F/D) or
displacement against displacement (D/D). Limits at one strength that have no closed form are marked as points; they
are roots of the spectral radius of exact step matrices minus 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import expm

from ...errors import CouplingError
from . import model_problems
from .study import Panel, StabilityStudy
from .verdict import Verdict, mean_growth, spectral_growth, verdict_of_failure, verdict_of_run

__all__ = ["DAMPING", "judge_run", "oscillator_study", "panels"]

DAMPING = 0.1  # coefficient of the actuated oscillator: 5 % of critical damping
PLAIN = {"method": "plain", "max_sweeps": 2000}  # plain iteration needs 1400 sweeps at 1 % below its limit
MODEL_PROBLEMS: dict[str, Callable[[float], model_problems.CoupledSystem]] = {
    "dahlquist": lambda r: model_problems.dahlquist(r),
    "actuated": lambda r: model_problems.actuated(0.0, r),
    "actuated, damped": lambda r: model_problems.actuated(DAMPING, r),
    "actuated, backward Euler": lambda r: model_problems.actuated(0.0, r, model_problems.Implicit),
    "force/displacement": lambda r: model_problems.two_masses("force", cc=r, dc=r),
    "displacement/displacement": lambda r: model_problems.two_masses("displacement", cc=r, dc=r),
}


def judge_run(system: str, how: dict[str, Any], step: float, strength: float) -> Verdict:
    """Verdict on one run of a system of MODEL_PROBLEMS.

    how: settings of model_problems.couple; step: macro step [s]; strength: of the coupling. Plain iteration is judged
    by the convergence of one step alone.
    """
    plain, explicit = how["method"] == "plain", how["method"] is None
    try:
        record, logs = model_problems.state_record(*MODEL_PROBLEMS[system](strength), step, 1 if plain else 80, **how)
    except CouplingError as error:
        return verdict_of_failure(error, explicit)
    if plain:
        return verdict_of_run(logs)
    return verdict_of_run(logs, spectral_growth(record) if explicit else mean_growth(record))


def oscillator_study(points: int = 24) -> StabilityStudy:
    """The map of the analytic systems with that many points along each axis."""
    return StabilityStudy(
        name="oscillators.stability",
        title="Analytic systems; dots: limits known for one strength",
        steps=np.geomspace(0.02, 3.0, points),
        strengths=np.geomspace(0.1, 30.0, points),
        strength_label="strength of the coupling r",
        panels=panels(),
        settings={"damping of the actuated oscillator": DAMPING},
    )


def panels() -> tuple[Panel, ...]:
    """One panel per system and coupling method."""
    explicit = {"method": None}
    held, line = {"waveform": "held", "through": "held"}, {"waveform": "linear", "through": "linear"}
    parabola = {"waveform": "quadratic", "through": "quadratic"}
    panels = [
        _panel("Dahlquist: explicit, held", "dahlquist", {**explicit, **held}, _dahlquist_explicit, math.log(5 / 3), 4),
        _panel("Dahlquist: plain, held", "dahlquist", {**PLAIN, **held}, _dahlquist_plain, math.log(4 / 3), 4),
        _panel("actuator: explicit, held, 5 % damped", "actuated, damped", {**explicit, **held}, _damped, 0.0505, 4),
        _panel("actuator: explicit, linear, 5 % damped", "actuated, damped", {**explicit, **line}, None, 0.244, 4),
        _panel("actuator: plain, held", "actuated", {**PLAIN, **held}, _held, math.acos(0.75), 4),
        _panel("actuator: plain, linear", "actuated", {**PLAIN, **line}, _line, 1.2757, 4),
        _panel("actuator: plain, backward Euler", "actuated, backward Euler", {**PLAIN, **held}, _euler, 0.5774, 4),
    ]
    for label, system, jacobi, limits in (
        ("F/D Jacobi", "force/displacement", True, (0.444, 0.130)),
        ("F/D G.-Seidel", "force/displacement", False, (1.014, 0.503)),
        ("D/D Jacobi", "displacement/displacement", True, (0.940, 0.509)),
    ):
        for degree, shape, mark in zip(("linear", "quadratic"), (line, parabola), limits, strict=True):
            how = {**explicit, **shape, "jacobi": jacobi}
            panels.append(_panel(f"masses {label}: explicit, {degree}", system, how, None, mark, 1))
    iterated = {"method": "iqn", "tolerance": 1e-10, **line}
    panels.append(_panel("masses D/D: iqn, linear", "displacement/displacement", iterated))
    return tuple(panels)


def _panel(
    title: str,
    system: str,
    how: dict[str, Any],
    limit: Callable[[np.ndarray], np.ndarray] | None = None,
    step: float | None = None,
    strength: float = 1.0,
) -> Panel:
    marks = () if step is None else ((step, float(strength)),)
    return Panel(title, partial(judge_run, system, how), limit, marks, {"system": system, **how})


def _dahlquist_explicit(steps: np.ndarray) -> np.ndarray:
    """Strength at which the factor (1 + r) exp(-H) - r of x reaches -1; H = ln(5/3) for r = 4."""
    return 1.0 / np.tanh(0.5 * steps)


def _dahlquist_plain(steps: np.ndarray) -> np.ndarray:
    """Strength at which r (1 - exp(-H)) reaches 1; H = ln(4/3) for r = 4."""
    return -1.0 / np.expm1(-steps)


def _held(steps: np.ndarray) -> np.ndarray:
    """Strength at which r (1 - cos H) reaches 1."""
    return 1.0 / (1.0 - np.cos(steps))


def _line(steps: np.ndarray) -> np.ndarray:
    """Strength at which r (1 - sin(H)/H) reaches 1."""
    return 1.0 / (1.0 - np.sinc(steps / math.pi))


def _euler(steps: np.ndarray) -> np.ndarray:
    """Strength at which r/(1 + 1/H^2) reaches 1."""
    return 1.0 + 1.0 / steps**2


def _damped(steps: np.ndarray) -> np.ndarray:
    """Strength at which det(P - r (1 - P) e e^T) reaches 1, P = exp(A H), e = (1, 0): about 2 d/H for short steps.

    The change is of rank one in r, so that det P (1 - r ((P^-1)_11 - 1)) = 1.
    """
    A = np.array([[0.0, 1.0], [-1.0, -DAMPING]])
    limits = []
    for step in steps:
        back = expm(-step * A)
        limits.append((1.0 - np.linalg.det(back)) / (back[0, 0] - 1.0) if back[0, 0] < 1.0 else math.nan)
    return np.array(limits)
