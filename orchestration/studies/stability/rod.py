"""Stability maps of a scene: macro step against the stiffness ratio k_tca/(EA/L), each cell a run of its FMUs.

The TCAs take the measured law, whose stiffness is one parameter. A rod with inertia takes one backward Euler step per
macro step, so that the map shows the coupling and not the integrator, and theory is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...errors import CouplingError, SceneError
from ...results.dataset import scene_record
from ...scene import Member, Scene, read
from ...scene.body import RodParameters
from ...scene.manipulator import CLOSURE_EXCHANGED, ROD
from ...simulation import open_simulation
from .study import Panel, StabilityStudy
from .theory import Beam, stability_limit
from .verdict import Verdict, alternating_growth, verdict_of_failure, verdict_of_run

__all__ = ["METHODS", "beam_of", "judge_run", "rod_study"]

METHODS = (
    ("none", "held"),
    ("none", "linear"),
    ("plain", "linear"),
    ("relaxed", "linear"),
    ("aitken", "linear"),
    ("iqn", "linear"),
    ("broyden", "linear"),
    ("newton", "linear"),
)
OMEGA = 0.25  # of constant relaxation: converges up to the gain 2/OMEGA - 1 = 7
STEPS, EXPLICIT_STEPS = 4, 48  # macro steps per run; the growth of explicit coupling shows after many
DEFAULTS = ("rod.closure=exchanged", "rod.method=backward_euler")


def rod_study(source: str, overrides: Sequence[str] = (), points: int = 12) -> StabilityStudy:
    """The map of a scene with that many points along each axis.

    Raises SceneError where theory does not cover its rod.
    """
    scene = read(source, [*DEFAULTS, *overrides])
    body = beam_of(scene)
    panels = tuple(
        Panel(
            title=_title(method, waveform),
            judge=partial(judge_run, source, tuple(overrides), body.stiffness, method, waveform),
            limit=partial(stability_limit, body, method=method, waveform=waveform, omega=OMEGA),
            settings={"method": method, "waveform": waveform, "omega": OMEGA},
        )
        for method, waveform in METHODS
    )
    return StabilityStudy(
        name=f"{scene.name}.stability",
        title=f"{scene.title}; rod {'with' if body.dynamic else 'without'} inertia",
        steps=np.geomspace(5e-4, 0.5, points),
        strengths=np.geomspace(0.05, 50.0, points),
        strength_label="stiffness ratio k_tca / (EA/L)",
        panels=panels,
        settings={
            **scene_record(scene, "stability map"),
            "EA/L [N/m]": body.stiffness,
            "macro steps per run": STEPS,
            "macro steps per explicit run": EXPLICIT_STEPS,
        },
    )


def _title(method: str, waveform: str) -> str:
    if method == "none":
        return f"explicit, {waveform}"
    return f"{method}, omega {OMEGA}" if method == "relaxed" else method


def judge_run(
    source: str, overrides: Sequence[str], unit: float, method: str, waveform: str, step: float, ratio: float
) -> Verdict:
    """Verdict on one run of the scene's FMUs with macro step [s] and TCAs of stiffness ratio * unit [N/m]."""
    explicit = method == "none"
    count = EXPLICIT_STEPS if explicit else STEPS
    own = {
        "rod.tca.law": "measured",
        "rod.tca.stiffness": ratio * unit,
        "stop_time": count * step,
        "coupling.macro_step": step,
        "coupling.method": method,
        "coupling.waveform": waveform,
        "coupling.omega": OMEGA,
        "coupling.control": "fixed",
        "coupling.halvings": 0,
        "coupling.max_sweeps": 200,
        "coupling.tolerance": 1e-7,
    }
    scene = read(source, [*DEFAULTS, *overrides, *(f"{key}={value}" for key, value in own.items())])
    try:
        with open_simulation(scene, lambda systems: systems[ROD].values()) as ready:
            logs = list(ready.steps())
    except CouplingError as error:
        return verdict_of_failure(error, explicit)
    return verdict_of_run(logs, alternating_growth([log.record for log in logs])) if explicit else verdict_of_run(logs)


def beam_of(scene: Scene) -> Beam:
    """The beam that theory takes for the scene's rod. Raises SceneError, which names what theory does not cover."""
    rod = next((member for member in scene.members if member.name == ROD), None)
    if rod is None or "body.E" not in rod.archive.variables:
        raise SceneError(f"{scene.name}: a stability map wants an FMU `rod` of this package in the scene")
    _refuse(rod, "body.profile", 1, "given profiles")
    _refuse(rod, "closure", CLOSURE_EXCHANGED, "a rod that closes its loop itself")
    if rod.value("dynamic"):
        _refuse(rod, "method", 1, "other integrators than backward Euler")
    for name in rod.archive.vectors["tca.helix"]:
        _refuse(rod, name, 0.0, "helical TCAs")
    p = RodParameters.of(rod)
    if len({tca.offset for tca in p.tcas}) > 1:
        raise SceneError("rod.tca.offset: theory does not cover TCAs at different distances; give all the same")
    if differences := p.differences_from_uniform():
        raise SceneError(f"{rod.name}: theory does not cover {', '.join(differences)}; give one uniform body")
    return Beam(
        body=replace(p.segments[0], length=p.length),
        offset=p.tcas[0].offset,
        azimuths=p.azimuth,
        dynamic=bool(rod.value("dynamic")),
    )


def _refuse(rod: Member, name: str, allowed: float, what: str) -> None:
    if rod.value(name) != allowed:
        raise SceneError(f"rod.{name} = {rod.value(name)}: theory does not cover {what}; allowed: {allowed}")
