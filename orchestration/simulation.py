"""Running a scene: FMUs are loaded, wired and driven to the stop time, and their variables collected."""

from __future__ import annotations

import atexit
import contextlib
import json
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from . import results
from .cosim.converted_inputs import convert_inputs
from .cosim.frozen_subsystem import FrozenSubsystem
from .cosim.graph import assemble
from .cosim.master import Master, StepLog
from .cosim.ringing import ringing_notes
from .cosim.settings import Coupling
from .cosim.statistics import summarize
from .cosim.step_control import Control, Doubling, Embedded, Fixed
from .cosim.step_logs import StepLogs
from .cosim.subsystem import Recorder
from .cosim.time_loop import drive_parts
from .cosim.topology import Connection
from .errors import CosimError, FmuWarning, Interrupted, SceneError, SubsystemError
from .fmi.archive import Archive, Variable
from .fmi.block_steps import BlockSteps
from .fmi.log import Warned
from .fmi.model_exchange import ModelExchangeInstance
from .fmi.slave import Slave
from .results import ResultTable
from .results.identity import Identity
from .scene import Member, Scene

if TYPE_CHECKING:
    import xarray as xr

    from .fmi.isolated import IsolatedInstance

__all__ = [
    "OpenSimulation",
    "control_of",
    "load_member",
    "open_simulation",
    "partial_as_dataset",
    "recorded_variables",
    "release_instances",
    "run",
    "run_table",
    "run_to_end",
]

Instance: TypeAlias = "Slave | ModelExchangeInstance | IsolatedInstance"

MAX_KEPT = 16  # instances kept for further runs: those of several scenes with all their FMUs
_KEPT: dict[tuple[Any, ...], Slave] = {}  # FMU, name and interface -> an instance that ended its run, newest last
LONGEST = 100.0  # longest step of a control that adapts it, in macro steps: beyond, a run shows too few points


@dataclass(frozen=True)
class OpenSimulation:
    """The FMUs of a scene, loaded, wired and initialised."""

    scene: Scene
    slaves: tuple[Instance, ...]
    master: Master
    blocks: BlockSteps | None = None  # takes steps in C++ where it can

    def steps(
        self, progress: Callable[[float], None] = lambda time: None, marks: Iterable[float] = ()
    ) -> Iterator[StepLog]:
        """Run to the stop time and yield the log of every macro step. marks: times [s] at which steps end."""
        for part in self.parts(progress, marks):
            yield from part

    def parts(
        self, progress: Callable[[float], None] = lambda time: None, marks: Iterable[float] = ()
    ) -> Iterator[Sequence[StepLog]]:
        """Do the same and yield the logs of one step or more at once."""
        breaks = [t for m in self.scene.members for signal in m.signals.values() for t in signal.breaks]
        span = (self.scene.start_time, self.scene.stop_time)
        return drive_parts(self.master, control_of(self.scene.coupling), *span, breaks, progress, marks, self.blocks)

    def collect(self, first: Any, logs: Sequence[StepLog], status: str) -> ResultTable:
        """Return the result of the steps taken.

        Parameters
        ----------
        first
            Record at the start.
        logs : sequence of StepLog
            Accepted steps with their records.
        status : str
            'complete', or why the run ended early.
        """
        names = {m.name: recorded_variables(m) for m in self.scene.members}
        warned = [warning for slave in self.slaves for warning in slave.warnings()]
        result = results.collect(self.scene, names, first, logs, status, warned)
        statistics = summarize(self.master, logs)
        notes = [*self.master.notes, *([self.master.ended] if self.master.ended else [])]
        notes += ringing_notes(self.master.components, partial(_values, StepLogs.of(logs), first, names))
        result.attrs |= {"statistics": json.dumps(statistics), "notes": json.dumps(notes), "ended": self.master.ended}
        return result


def _values(
    logs: StepLogs,
    first: Mapping[str, np.ndarray],
    names: Mapping[str, Sequence[Variable]],
    member: str,
    asked: list[str],
) -> np.ndarray:
    """Return the values (1 + steps, m) of recorded variables of a member."""
    column = {variable.name: k for k, variable in enumerate(names[member])}
    return logs.record(member, first[member])[:, [column[name] for name in asked]]


def _records(systems: Mapping[str, Recorder]) -> dict[str, Any]:
    return {name: system.record() for name, system in systems.items()}


@contextlib.contextmanager
def open_simulation(
    scene: Scene, observe: Callable[[Mapping[str, Recorder]], Any] = _records
) -> Iterator[OpenSimulation]:
    """Load, wire and initialise the FMUs of a scene; everything is freed at the end.

    Parameters
    ----------
    scene : Scene
        What is run.
    observe : callable
        Maps name -> subsystem to the record of a step, at the start and after every step. Default: the recorded
        variables (n,) of each.

    Raises
    ------
    SubsystemError, CouplingError
        From loading and initialization.
    SceneError
        Where the scene leaves the choice of its models open (studies.model_selection makes it).
    """
    if scene.accuracy.level == "auto":
        raise SceneError(
            f"{scene.name}: fidelity.level = 'auto': the models are not chosen yet; use `tca-cosim run` or "
            "`tca-cosim select`, or set fidelity.level = 'given'"
        )
    with contextlib.ExitStack() as stack:
        for member in scene.members:
            stack.callback(member.archive.close)  # the extracted files; a later run extracts them again
        slaves = tuple(stack.enter_context(_lent(scene, member)) for member in scene.members)
        frozen = {m.name for m in scene.members if m.frozen}
        connections = [c for c in scene.connections if c.target[0] not in frozen]
        systems: dict[str, Recorder] = {
            slave.name: FrozenSubsystem(slave) if slave.name in frozen else _converted(slave, connections)
            for slave in slaves
        }
        _refuse_adaptive_steps(scene.coupling, systems)
        signals = {m.name: m.signals for m in scene.members}
        components = assemble(tuple(systems.values()), connections, signals, scene.coupling)
        master = Master(components, scene.coupling, lambda: observe(systems))
        master.initialise(scene.start_time)
        fixed = scene.coupling.control == "fixed" and observe is _records
        yield OpenSimulation(scene, slaves, master, BlockSteps.of(master, systems) if fixed else None)


def run(scene: Scene, progress: Callable[[float], None] = lambda time: None) -> xr.Dataset:
    """Run a scene and return its result as run_table() does, as a Dataset; also the `partial` of an error is one."""
    with partial_as_dataset():
        return run_table(scene, progress).to_xarray()


@contextlib.contextmanager
def partial_as_dataset() -> Iterator[None]:
    """Make the `partial` of errors a Dataset."""
    try:
        yield
    except (CosimError, Interrupted) as error:
        if isinstance(error.partial, ResultTable):
            error.partial = error.partial.to_xarray()
        raise


def run_table(scene: Scene, progress: Callable[[float], None] = lambda time: None) -> ResultTable:
    """Run a scene and return its result (results.collect).

    Raises SubsystemError and CouplingError. What was computed by then is the error's `partial`, whose status says why
    the run ended. What FMUs warn of is in the result's attribute `warnings`, and comes as FmuWarning.
    """
    with open_simulation(scene) as ready:
        try:
            result = run_to_end(ready, progress)
        except CosimError as error:
            if error.partial is not None:
                _warn(error.partial)
            raise
        _warn(result)
        return result


def _warn(result: ResultTable) -> None:
    """Pass on what the FMUs of a result warned of."""
    for warning in json.loads(result.attrs["warnings"]):
        warnings.warn(str(Warned(**warning)), FmuWarning, stacklevel=_level_of_user() - 1)


def _level_of_user() -> int:
    """Return how many calls up the first one from outside of the package is."""
    package, level, frame = __name__.partition(".")[0], 0, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    return level + 1


def run_to_end(ready: OpenSimulation, progress: Callable[[float], None] = lambda time: None) -> ResultTable:
    """Run what is loaded already, once, as run() does."""
    first, logs = ready.master.observe(), StepLogs()
    try:
        for part in ready.parts(progress):
            logs.add(part)
    except CosimError as error:
        error.partial = ready.collect(first, logs, f"partial: {error}")
        raise
    except KeyboardInterrupt as error:
        reached = logs[-1].time if len(logs) else 0.0
        stopped = Interrupted(f"stopped by the user at t = {reached:.6g} s of {ready.scene.stop_time:g} s")
        stopped.partial = ready.collect(first, logs, f"partial: {stopped}")
        raise stopped from error
    return ready.collect(first, logs, "complete")


def _instance(scene: Scene, member: Member) -> Instance:
    """Return an instance for co-simulation, or for model exchange where the FMU offers nothing else.

    A second instance of an FMU that allows one per process gets a process of its own.
    """
    kind: type[Slave] | type[ModelExchangeInstance] | type[IsolatedInstance] = Slave
    if member.archive.description.co_simulation is None:
        kind = ModelExchangeInstance
    if member.archive.once_per_process and _first_of_its_fmu(scene, member) is not member:
        from .fmi.isolated import IsolatedInstance  # what it needs takes long to load

        kind = IsolatedInstance
    return kind(
        member.archive,
        member.name,
        member.parameters,
        **_interface(scene, member),
        start=scene.start_time,
        stop=scene.stop_time,
        tolerance=scene.tolerance,
    )


@contextlib.contextmanager
def _lent(scene: Scene, member: Member) -> Iterator[Instance]:
    """Yield an instance that is new, or reset where that makes it one; it is kept unless the run fails."""
    facts = (member.archive.digest, member.name, *(tuple(names) for names in _interface(scene, member).values()))
    slave: Instance | None = None
    try:
        if facts in _KEPT:
            slave = kept = _KEPT.pop(facts)
            kept.reset(member.parameters, scene.start_time, scene.stop_time, scene.tolerance)
        else:
            slave = _instance(scene, member)
        yield slave
    except BaseException:
        if slave is not None:
            slave.close()
        raise
    if isinstance(slave, Slave) and slave.reusable and facts not in _KEPT:
        slave.rest()
        _KEPT[facts] = slave
        while len(_KEPT) > MAX_KEPT:
            _KEPT.pop(next(iter(_KEPT))).close()
    else:
        slave.close()


def release_instances() -> None:
    """Free the instances that are kept for further runs."""
    while _KEPT:
        _KEPT.popitem()[1].close()


atexit.register(release_instances)


def _interface(scene: Scene, member: Member) -> dict[str, list[str]]:
    """Return the names of the variables that are driven, read and recorded."""
    fed = dict.fromkeys(c.target[1] for c in scene.connections if c.target[0] == member.name)
    return {
        "inputs": [*fed, *member.signals],
        "outputs": list(dict.fromkeys(c.source[1] for c in scene.connections if c.source[0] == member.name)),
        "recorded": [v.name for v in recorded_variables(member)],
    }


def load_member(scene: Scene, member: Member) -> Recorder:
    """Load one member of a scene alone, not initialised; close it. Raises SubsystemError."""
    return _instance(scene, member)


def _first_of_its_fmu(scene: Scene, member: Member) -> Member:
    return next(m for m in scene.members if m.archive.digest == member.archive.digest)


def recorded_variables(member: Member) -> tuple[Variable, ...]:
    """Return the variables of a member that a result shows: its inputs and outputs, and what the scene asks for."""
    return _recorded(Identity(member.archive), member.recorded)


@lru_cache(maxsize=64)  # FMUs that a process runs again and again
def _recorded(archive: Identity[Archive], asked: frozenset[str]) -> tuple[Variable, ...]:
    variables = archive.it.variables.values()
    return tuple(v for v in variables if v.causality in ("input", "output") or v.name in asked)


def _converted(slave: Instance, connections: Sequence[Connection]) -> Recorder:
    """Return the subsystem, behind the conversions of the connections that feed it if there are any."""
    into = [c for c in connections if c.target[0] == slave.name]
    return convert_inputs(slave, into) if any(c.transforms for c in into) else slave


def _refuse_adaptive_steps(coupling: Coupling, systems: Mapping[str, Recorder]) -> None:
    """Raise SubsystemError where steps would have to be repeated and a subsystem cannot."""
    rigid = [name for name, system in systems.items() if not system.can_rollback]
    if rigid and coupling.control != "fixed":
        raise SubsystemError(
            f"{', '.join(rigid)} cannot save and restore state (canGetAndSetFMUstate = false), so steps cannot be "
            "repeated; export with it, or set coupling.control = 'fixed'"
        )


def control_of(coupling: Coupling) -> Control:
    """Return the control of the macro step's length that a scene asks for."""
    h = coupling.macro_step
    if coupling.control == "fixed":
        return Fixed(h)
    kind = Doubling if coupling.control == "doubling" else Embedded
    return kind(h, coupling.step_tolerance, least=coupling.least_step, most=h * LONGEST)
