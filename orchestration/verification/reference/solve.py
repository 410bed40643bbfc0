"""Reference solution of a scene: heat first, then the rod together with its TCAs.

Where the displacements act on the heat, both are solved over the whole time repeatedly until they agree.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from typing import TypeVar

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ...errors import SceneError, SubsystemError
from ...packages import version
from ...results.dataset import describe_vector
from ...scene import Member, Scene
from ...scene.manipulator import ROD, THERMAL, ThermalParameters
from .dynamics import DynamicRod
from .heat import HeatCourse, Matrices, heat
from .inputs import Inputs, breaks, rod_data
from .rod import Loads, RodData
from .statics import equilibrium

__all__ = ["Resolution", "prepare", "run"]

_MAX_PASSES = 40  # over a whole scene whose displacements act on its heat
_PASS_TOLERANCE = 1e-8  # smallest tolerance of the displacements between passes, as a fraction of the length
_PASS_FRACTION = 1e-2  # that tolerance as a fraction of the tolerance of the equilibria
_BATCH = 400  # equilibria solved at once; their arrays fit into the cache

T = TypeVar("T")
Course = Callable[[float, float, float], np.ndarray]  # (t, a, b) as Inputs
Observer = Callable[[float], None]  # called with the current time [s]; an exception that it raises ends the solution


@dataclass(frozen=True)
class Resolution:
    """Resolution in space and time. The defaults leave errors of 1e-3 K and 1e-7 m on the scenes of the package."""

    edge: float = 0.04  # edge length of the heat's mesh as a fraction of the body's radius
    heat_step: float = 0.1  # longest step of the heat [s]
    elements: int = 4  # of the dynamic rod
    degree: int = 4  # of these elements
    rtol: float = 1e-6  # of the dynamic rod in time
    shooting: float = 1e-9  # rtol of an equilibrium along s

    def refined(self) -> Resolution:
        """Finer resolution, to estimate the error of this one."""
        return Resolution(
            self.edge / 1.5, self.heat_step / 2, self.elements, self.degree + 1, self.rtol / 10, self.shooting / 10
        )


def run(scene: Scene, resolution: Resolution | None = None, times: np.ndarray | None = None) -> xr.Dataset:
    """Solve a scene.

    Parameters
    ----------
    times : ndarray, optional
        Output times [s], increasing from 0; by default those of macro steps of constant length.

    Returns
    -------
    xr.Dataset
        T, P, E_stored, Q_loss of the heat model and delta, N, tip.p, tip.euler of the rod, named and measured as in a
        result of the co-simulation. The attribute `evaluations` counts the evaluations of the rod's equations of
        motion, or the integrations along the rod.

    Raises
    ------
    SceneError
        The reference does not cover a member, a connection or a parameter of the scene.
    SubsystemError
        A solution was not found.
    """
    return prepare(scene, resolution, times)(lambda time: None)


def prepare(
    scene: Scene, resolution: Resolution | None = None, times: np.ndarray | None = None
) -> Callable[[Observer], xr.Dataset]:
    """Check a scene and assemble its matrices; the function returned solves it as `run` does, any number of times.

    The argument of that function is called with the current time [s]; an exception that it raises ends the solution.
    """
    resolution = resolution or Resolution()
    thermal, rod = (next(iter(scene.models(model)), None) for model in (THERMAL, ROD))
    _check(scene, thermal, rod)
    outputs = None if times is None else np.asarray(times, dtype=float)
    pieces = _pieces(scene, outputs)
    marks = np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])
    keep = np.arange(marks.size) if outputs is None else np.searchsorted(marks, outputs - 1e-9 * scene.stop_time)
    if thermal:
        data = ThermalParameters.of(thermal)
        matrices = Matrices(data, resolution.edge * data.geometry.radius)
        volts, ambient = Inputs.from_member(thermal, "V"), Inputs.from_member(thermal, "T_ambient")
        surroundings = lambda t, a, b: float(ambient(t, a, b)[0])  # noqa: E731

    def solve_once(
        observe: Observer, shift: Callable[[float], np.ndarray | float]
    ) -> tuple[HeatCourse | None, dict[str, np.ndarray]]:
        """Solve heat, then rod, with a given relative change of the resistances."""
        course = None
        if thermal:
            course = heat(
                data, _observed(volts, observe), surroundings, pieces, 0.0, resolution.heat_step, matrices, shift
            )
        if not rod:
            return course, {}
        loads = _loads(scene, rod, thermal, course)
        solve_rod = _dynamic if rod.value("dynamic") else _quasistatic
        at_equilibrium = bool(rod.value("start_at_equilibrium"))
        return course, solve_rod(rod_data(rod), loads, pieces, at_equilibrium, resolution, observe)

    def solve(observe: Observer) -> xr.Dataset:
        dataset = xr.Dataset(coords={"time": ("time", marks[keep], {"units": "s", "long_name": "time"})})
        course, rod_courses = solve_once(observe, lambda t: 0.0)
        if thermal and rod and thermal.acts("tca.beta"):
            solve_pass = partial(solve_once, observe)
            course, rod_courses = _iterate_feedback(scene, thermal, rod, pieces, solve_pass, rod_courses, resolution)
        if thermal and course:
            heated = {"T": course.T, "P": course.P, "E_stored": course.stored, "Q_loss": course.loss}
            _add(dataset, thermal, {name: values[keep] for name, values in heated.items()})
        evaluations = float(rod_courses.pop("evaluations", np.zeros(())))
        if rod:
            _add(dataset, rod, {name: values[keep] for name, values in rod_courses.items()})
        dataset.attrs = {**_attributes(scene, resolution), "evaluations": evaluations}
        return dataset

    return solve


def _iterate_feedback(
    scene: Scene,
    thermal: Member,
    rod: Member,
    pieces: list[np.ndarray],
    solve_pass: Callable[..., tuple[HeatCourse | None, dict[str, np.ndarray]]],
    rod_courses: dict[str, np.ndarray],
    resolution: Resolution,
) -> tuple[HeatCourse | None, dict[str, np.ndarray]]:
    """Iterate over whole time courses until the resistances R (1 + beta delta/L) agree with the displacements.

    Waveform iteration: it converges because the future does not act on the past. Splines interpolate the displacements
    between the outputs. Raises SubsystemError where it does not converge.
    """
    p = ThermalParameters.of(thermal)
    scale = np.array(p.beta) / p.geometry.length
    own, sources = Inputs.from_member(thermal, "delta"), {c.target: c.source for c in scene.connections}
    connected = [sources.get((thermal.name, name)) for name in thermal.archive.vectors["delta"]]
    columns = [rod.archive.vectors["delta"].index(source[1]) if source else None for source in connected]
    ends = np.cumsum([piece.size - 1 for piece in pieces])
    tolerance = max(_PASS_TOLERANCE, _PASS_FRACTION * resolution.shooting) * thermal.real("body.length")
    delta, evaluations = rod_courses["delta"], rod_courses["evaluations"]
    for _ in range(_MAX_PASSES):
        splines = [
            CubicSpline(piece, delta[end - piece.size + 1 : end + 1]) for piece, end in zip(pieces, ends, strict=True)
        ]

        def shift(t: float, splines: list[CubicSpline] = splines) -> np.ndarray:
            number = min(int(np.searchsorted([piece[-1] for piece in pieces], t)), len(pieces) - 1)
            coupled, start = splines[number](t), own(t, pieces[number][0], pieces[number][-1])
            return scale * np.array([start[k] if c is None else coupled[c] for k, c in enumerate(columns)])

        course, rod_courses = solve_pass(shift)
        change = float(np.abs(rod_courses["delta"] - delta).max())
        delta, evaluations = rod_courses["delta"], evaluations + rod_courses["evaluations"]
        if change <= tolerance:
            rod_courses["evaluations"] = evaluations
            return course, rod_courses
    raise SubsystemError(
        f"reference: the feedback of displacements on resistances does not converge in {_MAX_PASSES} passes "
        f"(last change {change:.3g} m); make thermal.tca.beta or the stop time smaller"
    )


def _check(scene: Scene, thermal: Member | None, rod: Member | None) -> None:
    if scene.start_time:
        raise SceneError(f"{scene.name}: start_time = {scene.start_time:g} s: the reference starts at 0 s; remove it")
    known = [m for m in (thermal, rod) if m]
    for m in scene.members:
        if m not in known:
            raise SceneError(
                f"reference: member {m.name!r} ({m.archive.path.name}): the reference solves one thermal and one rod "
                "model, each once; take such a scene"
            )
    for c in scene.connections:
        source, target = c.source[1].partition("[")[0], c.target[1].partition("[")[0]
        if c.transforms or (source, target) not in {("T", "T"), ("delta", "delta_guess"), ("delta", "delta")}:
            raise SceneError(f"reference: connection {c} is not covered; allowed: T to T, delta to delta_guess")


def _pieces(scene: Scene, times: np.ndarray | None) -> list[np.ndarray]:
    """Divide the output times at the jumps of the inputs; each piece contains both its ends."""
    ends = np.array([0.0, *breaks(scene), scene.stop_time])
    if times is None:
        step = scene.coupling.macro_step
        return [np.linspace(a, b, max(1, int(np.ceil((b - a) / step - 1e-9))) + 1) for a, b in pairwise(ends)]
    slack = 1e-9 * scene.stop_time
    if times[0] < 0.0 or times[-1] > scene.stop_time + slack or (np.diff(times) <= slack).any():
        raise SceneError(f"reference: output times must increase from 0 to at most {scene.stop_time:g} s")
    inside = [times[(times > a + slack) & (times < b - slack)] for a, b in pairwise(ends)]
    return [np.array([a, *t, b]) for (a, b), t in zip(pairwise(ends), inside, strict=True)]


def _loads(scene: Scene, rod: Member, thermal: Member | None, course: HeatCourse | None) -> Callable[..., Loads]:
    """Combine the loads of the rod into a function (t, a, b) of time t in the stretch [a, b] without jumps."""
    own, sources = Inputs.from_member(rod, "T"), {c.target: c.source for c in scene.connections}
    heated = []  # index of the TCA in the rod, its index in the heat model
    for index, name in enumerate(rod.archive.vectors["T"]):
        source = sources.get((rod.name, name))
        if source and thermal:
            heated.append((index, thermal.archive.vectors["T"].index(source[1])))
    others = [Inputs.from_member(rod, name) for name in ("gravity", "tip_force", "tip_moment")]

    def loads(t: float, a: float, b: float) -> Loads:
        T = own(t, a, b)
        if heated and course:
            temperatures = course.temperature(t, 0.5 * (a + b))
            for index, source in heated:
                T[index] = temperatures[source]
        return Loads(T, *(signals(t, a, b) for signals in others))

    return loads


def _observed(course: Callable[..., T], observe: Observer) -> Callable[[float, float, float], T]:
    """Call the observer before every evaluation of an input."""

    def evaluate(t: float, a: float, b: float) -> T:
        observe(t)
        return course(t, a, b)

    return evaluate


def _quasistatic(
    data: RodData,
    loads: Callable[..., Loads],
    pieces: list[np.ndarray],
    _: bool,
    resolution: Resolution,
    observe: Observer,
) -> dict[str, np.ndarray]:
    """Equilibria at the output times; at a jump of a load, the equilibrium before it."""
    all_loads = [loads(pieces[0][0], pieces[0][0], pieces[0][-1])]
    all_loads += [loads(t, piece[0], piece[-1]) for piece in pieces for t in piece[1:]]
    times = np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])
    solutions = []
    for k in range(0, len(all_loads), _BATCH):
        columns = [vars(load).values() for load in all_loads[k : k + _BATCH]]
        batch = Loads(*(np.stack(rows, axis=-1) for rows in zip(*columns, strict=True)))
        observe_batch = partial(observe, float(times[k]))
        solutions.append(equilibrium(data, batch, rtol=resolution.shooting, observe=observe_batch))
    R = np.concatenate([e.R[:, :, -1].transpose(2, 0, 1) for e in solutions])
    return {
        "delta": np.concatenate([e.delta.T for e in solutions]),
        "N": np.concatenate([e.N.T for e in solutions]),
        "tip.p": np.concatenate([e.p[:, -1].T for e in solutions]),
        "tip.euler": Rotation.from_matrix(R).as_euler("XYZ"),
        "evaluations": np.array(sum(e.evaluations for e in solutions)),
    }


def _dynamic(
    data: RodData,
    loads: Callable[..., Loads],
    pieces: list[np.ndarray],
    at_equilibrium: bool,
    resolution: Resolution,
    observe: Observer,
) -> dict[str, np.ndarray]:
    """Motion of the rod from rest."""
    loads = _observed(loads, observe)
    rod = DynamicRod(data, resolution.elements, resolution.degree)
    first = loads(pieces[0][0], pieces[0][0], pieces[0][-1])
    unloaded = Loads(np.full(len(data.azimuth), data.T_0), *np.zeros((3, 3)))
    start = equilibrium(data, first if at_equilibrium else unloaded, rod.stations(), resolution.shooting)
    y = rod.state_at_rest(start)
    snapshots = [rod.snapshot(y, first)]
    for piece in pieces:
        during = lambda t, a=piece[0], b=piece[-1]: loads(t, a, b)  # noqa: E731
        states = rod.run(y, piece, during, resolution.rtol)
        snapshots += [rod.snapshot(column, during(t)) for t, column in zip(piece[1:], states.T[1:], strict=True)]
        y = states[:, -1]
    return {
        "delta": np.array([s.delta for s in snapshots]),
        "N": np.array([s.N for s in snapshots]),
        "tip.p": np.array([s.p for s in snapshots]),
        "tip.euler": Rotation.from_quat([s.quaternion for s in snapshots]).as_euler("XYZ"),
        "evaluations": np.array(start.evaluations + rod.evaluations),
    }


def _add(dataset: xr.Dataset, owner: Member, rows: dict[str, np.ndarray]) -> None:
    """Add time courses (time,) or (time, n) by name of an output, with units and texts from the FMU's description."""
    for name, values in rows.items():
        elements = owner.archive.vectors.get(name, (name,))
        variable = owner.archive.variables[elements[0]]
        text = describe_vector([owner.archive.variables[element].description for element in elements])
        attributes = {"units": variable.unit, "long_name": text, "causality": variable.causality}
        dims = ("time", *(f"index{n}" for n in values.shape[1:]))
        dataset[f"{owner.name}.{name}"] = (dims, values, attributes)


def _attributes(scene: Scene, resolution: Resolution) -> dict[str, str | float]:
    packages = {name: version(name) for name in ("numpy", "scipy", "scikit-fem")}
    return {
        "title": f"Reference: {scene.title}",
        "scene": scene.name,
        "status": "complete",
        "stop_time_s": scene.stop_time,
        "method": "quadratic triangles and Radau IIA; shooting, or mixed elements and Radau or DOP853",
        "resolution": json.dumps(asdict(resolution)),
        "sources": json.dumps(scene.sources),
        "versions": json.dumps({**packages, "python": platform.python_version()}),
    }
