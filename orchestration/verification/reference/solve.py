"""A scene, solved by other methods than the FMUs' and without a master: heat first, then the rod with its TCAs as one
system; again and again where the shape acts on the heat."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from itertools import pairwise
from typing import TypeVar

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ...errors import SceneError, SubsystemError
from ...scene import Member, Scene
from ...scene.manipulator import ROD, THERMAL
from .dynamics import DynamicRod
from .heat import HeatCourse, Matrices, heat
from .inputs import Inputs, breaks, heat_data, rod_data
from .rod import Loads, RodData
from .statics import equilibrium

__all__ = ["Resolution", "prepared", "run"]

_PASSES = 40  # over a whole scene whose shape acts on its heat
_SETTLED = 1e-8  # share of the length; at least
_SHARE = 1e-2  # of the tolerance of the equilibria, likewise
_BATCH = 400  # equilibria found at once: what fits into a cache

T = TypeVar("T")
Course = Callable[[float, float, float], np.ndarray]  # (t, a, b) as Inputs
Watch = Callable[[float], None]  # hears what time a solution is at [s], again and again; what it raises ends it


@dataclass(frozen=True)
class Resolution:
    """The defaults leave 1e-3 K and 1e-7 m on the scenes that come with the package."""

    edge: float = 0.04  # of the heat's mesh, share of the body's radius
    heat_step: float = 0.1  # s
    elements: int = 4  # of the moving rod
    degree: int = 4
    rtol: float = 1e-6  # of the moving rod in time
    shooting: float = 1e-9  # rtol of an equilibrium along s

    def refined(self) -> Resolution:
        return Resolution(
            self.edge / 1.5, self.heat_step / 2, self.elements, self.degree + 1, self.rtol / 10, self.shooting / 10
        )


def run(scene: Scene, resolution: Resolution | None = None, times: np.ndarray | None = None) -> xr.Dataset:
    """A Dataset as results.collect makes it, without the coupling's log: T, P, E_stored, Q_loss; delta, N, tip.p,
    tip.euler; attribute evaluations: states of the rod at which its equations were evaluated, or shots through it.
    times [s]: of the output, from 0; where not given, the macro steps of a fixed control. Raises SceneError
    for what is not covered, SubsystemError where a solution is not found."""
    return prepared(scene, resolution, times)(lambda time: None)


def prepared(
    scene: Scene, resolution: Resolution | None = None, times: np.ndarray | None = None
) -> Callable[[Watch], xr.Dataset]:
    """run() with the scene checked, the mesh made and its matrices assembled; to be called as often as wanted, with
    what hears of the time."""
    resolution = resolution or Resolution()
    thermal, rod = scene.model(THERMAL), scene.model(ROD)
    _check(scene, thermal, rod)
    wanted = None if times is None else np.asarray(times, dtype=float)
    pieces = _pieces(scene, wanted)
    marks = np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])
    keep = np.arange(marks.size) if wanted is None else np.searchsorted(marks, wanted - 1e-9 * scene.stop_time)
    if thermal:
        data = heat_data(thermal)
        matrices = Matrices(data, resolution.edge * data.section.radius)
        volts, ambient = Inputs.of(thermal, "V"), Inputs.of(thermal, "T_ambient")
        warm = lambda t, a, b: float(ambient(t, a, b)[0])  # noqa: E731

    def passed(
        watch: Watch, shift: Callable[[float], np.ndarray | float]
    ) -> tuple[HeatCourse | None, dict[str, np.ndarray]]:
        """Heat first, then the rod."""
        course = None
        if thermal:
            course = heat(data, _told(volts, watch), warm, pieces, 0.0, resolution.heat_step, matrices, shift)
        if not rod:
            return course, {}
        loads = _loads(scene, rod, thermal, course)
        move = _moving if rod.value("dynamic") else _resting
        return course, move(rod_data(rod), loads, pieces, bool(rod.value("start_at_equilibrium")), resolution, watch)

    def solve(watch: Watch) -> xr.Dataset:
        dataset = xr.Dataset(coords={"time": ("time", marks[keep], {"units": "s", "long_name": "time"})})
        course, moved = passed(watch, lambda t: 0.0)
        if thermal and rod and thermal.value("tca.beta"):
            course, moved = _fed_back(scene, thermal, rod, pieces, partial(passed, watch), moved, resolution)
        if thermal and course:
            heated = {"T": course.T, "P": course.P, "E_stored": course.stored, "Q_loss": course.loss}
            _add(dataset, thermal, {name: values[keep] for name, values in heated.items()})
        spent = float(moved.pop("evaluations", np.zeros(())))
        if rod:
            _add(dataset, rod, {name: values[keep] for name, values in moved.items()})
        dataset.attrs = {**_about(scene, resolution), "evaluations": spent}
        return dataset

    return solve


def _fed_back(
    scene: Scene,
    thermal: Member,
    rod: Member,
    pieces: list[np.ndarray],
    passed: Callable[..., tuple[HeatCourse | None, dict[str, np.ndarray]]],
    moved: dict[str, np.ndarray],
    resolution: Resolution,
) -> tuple[HeatCourse | None, dict[str, np.ndarray]]:
    """Resistances that follow the displacements, R (1 + beta delta/L): whole courses again and again, since what comes
    later does not act on what was before. Splines between the outputs. Raises SubsystemError."""
    scale = thermal.real("tca.beta") / thermal.real("body.length")
    own, sources = Inputs.of(thermal, "delta"), {c.target: c.source for c in scene.connections}
    wired = [sources.get((thermal.name, name)) for name in thermal.archive.vectors["delta"]]
    columns = [rod.archive.vectors["delta"].index(source[1]) if source else None for source in wired]
    ends = np.cumsum([piece.size - 1 for piece in pieces])
    settled = max(_SETTLED, _SHARE * resolution.shooting) * thermal.real("body.length")
    delta, spent = moved["delta"], moved["evaluations"]
    for _ in range(_PASSES):
        splines = [
            CubicSpline(piece, delta[end - piece.size + 1 : end + 1]) for piece, end in zip(pieces, ends, strict=True)
        ]

        def shift(t: float, splines: list[CubicSpline] = splines) -> np.ndarray:
            number = min(int(np.searchsorted([piece[-1] for piece in pieces], t)), len(pieces) - 1)
            found, given = splines[number](t), own(t, pieces[number][0], pieces[number][-1])
            return scale * np.array([given[k] if c is None else found[c] for k, c in enumerate(columns)])

        course, moved = passed(shift)
        change = float(np.abs(moved["delta"] - delta).max())
        delta, spent = moved["delta"], spent + moved["evaluations"]
        if change <= settled:
            moved["evaluations"] = spent
            return course, moved
    raise SubsystemError(
        f"reference: the feedback of displacements on resistances does not settle in {_PASSES} passes (last change "
        f"{change:.3g} m); make thermal.tca.beta or the stop time smaller"
    )


def _check(scene: Scene, thermal: Member | None, rod: Member | None) -> None:
    known = [m for m in (thermal, rod) if m]
    for m in scene.members:
        if m not in known:
            raise SceneError(f"reference: member {m.name!r} ({m.archive.path.name}) is no thermal or rod model")
    for c in scene.connections:
        source, target = c.source[1].partition("[")[0], c.target[1].partition("[")[0]
        if (source, target) not in {("T", "T"), ("delta", "delta_guess"), ("delta", "delta")}:
            raise SceneError(f"reference: connection {c} is not covered; allowed: T to T, delta to delta_guess")


def _pieces(scene: Scene, times: np.ndarray | None) -> list[np.ndarray]:
    """Output times between jumps, each piece with both its ends."""
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
    """loads(t, a, b) at t in a stretch from a to b without jumps."""
    own, sources = Inputs.of(rod, "T"), {c.target: c.source for c in scene.connections}
    wired = []
    for place, name in enumerate(rod.archive.vectors["T"]):
        source = sources.get((rod.name, name))
        if source and thermal:
            wired.append((place, thermal.archive.vectors["T"].index(source[1])))
    others = [Inputs.of(rod, name) for name in ("gravity", "tip_force", "tip_moment")]

    def loads(t: float, a: float, b: float) -> Loads:
        T = own(t, a, b)
        if wired and course:
            heated = course.temperature(t, 0.5 * (a + b))
            for place, source in wired:
                T[place] = heated[source]
        return Loads(T, *(signals(t, a, b) for signals in others))

    return loads


def _told(course: Callable[..., T], watch: Watch) -> Callable[[float, float, float], T]:
    """Every look at what drives a solution is heard of."""

    def look(t: float, a: float, b: float) -> T:
        watch(t)
        return course(t, a, b)

    return look


def _resting(
    data: RodData, loads: Callable[..., Loads], pieces: list[np.ndarray], _: bool, resolution: Resolution, watch: Watch
) -> dict[str, np.ndarray]:
    """Equilibria; where a load jumps, the one before."""
    asked = [loads(pieces[0][0], pieces[0][0], pieces[0][-1])]
    asked += [loads(t, piece[0], piece[-1]) for piece in pieces for t in piece[1:]]
    times = np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])
    found = []
    for k in range(0, len(asked), _BATCH):
        columns = [vars(load).values() for load in asked[k : k + _BATCH]]
        batch = Loads(*(np.stack(rows, axis=-1) for rows in zip(*columns, strict=True)))
        found.append(equilibrium(data, batch, rtol=resolution.shooting, watch=partial(watch, float(times[k]))))
    R = np.concatenate([e.R[:, :, -1].transpose(2, 0, 1) for e in found])
    return {
        "delta": np.concatenate([e.delta.T for e in found]),
        "N": np.concatenate([e.N.T for e in found]),
        "tip.p": np.concatenate([e.p[:, -1].T for e in found]),
        "tip.euler": Rotation.from_matrix(R).as_euler("XYZ"),
        "evaluations": np.array(sum(e.evaluations for e in found)),
    }


def _moving(
    data: RodData,
    loads: Callable[..., Loads],
    pieces: list[np.ndarray],
    at_equilibrium: bool,
    resolution: Resolution,
    watch: Watch,
) -> dict[str, np.ndarray]:
    loads = _told(loads, watch)
    mover = DynamicRod(data, resolution.elements, resolution.degree)
    first = loads(pieces[0][0], pieces[0][0], pieces[0][-1])
    unloaded = Loads(np.full(len(data.azimuth), data.T_0), *np.zeros((3, 3)))
    start = equilibrium(data, first if at_equilibrium else unloaded, mover.places(), resolution.shooting)
    y = mover.resting(start)
    found = [mover.snapshot(y, first)]
    for piece in pieces:
        during = lambda t, a=piece[0], b=piece[-1]: loads(t, a, b)  # noqa: E731
        states = mover.run(y, piece, during, resolution.rtol)
        found += [mover.snapshot(column, during(t)) for t, column in zip(piece[1:], states.T[1:], strict=True)]
        y = states[:, -1]
    return {
        "delta": np.array([s.delta for s in found]),
        "N": np.array([s.N for s in found]),
        "tip.p": np.array([s.p for s in found]),
        "tip.euler": Rotation.from_quat([s.quaternion for s in found]).as_euler("XYZ"),
        "evaluations": np.array(start.evaluations + mover.evaluations),
    }


def _add(dataset: xr.Dataset, owner: Member, rows: dict[str, np.ndarray]) -> None:
    """rows: base name of an output -> (time,) or (time, n); units and texts are those of the FMU's description."""
    for name, values in rows.items():
        about = owner.archive.variables[owner.archive.vectors.get(name, (name,))[0]]
        attributes = {"units": about.unit, "long_name": about.description, "causality": about.causality}
        dims = ("time", *(f"index{n}" for n in values.shape[1:]))
        dataset[f"{owner.name}.{name}"] = (dims, values, attributes)


def _about(scene: Scene, resolution: Resolution) -> dict[str, str | float]:
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
