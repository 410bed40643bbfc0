"""A scene, run: FMUs loaded, wired, driven to the stop time, and what they gave collected."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

import xarray as xr

from . import results
from .cosim import acceleration, extrapolation
from .cosim.frozen_subsystem import FrozenSubsystem
from .cosim.graph import assemble
from .cosim.master import Master, Settings, StepLog
from .cosim.step_control import Control, Doubling, Embedded, Fixed
from .cosim.time_loop import drive
from .errors import CosimError, SceneError, SubsystemError
from .fmi.archive import Variable
from .fmi.slave import Slave
from .scene import Coupling, Member, Scene

__all__ = ["OpenSimulation", "open_simulation", "recorded_variables", "run", "run_to_end"]


@dataclass(frozen=True)
class OpenSimulation:
    """A scene's FMUs, loaded, wired and initialised."""

    scene: Scene
    slaves: tuple[Slave, ...]
    master: Master

    def steps(
        self, progress: Callable[[float], None] = lambda time: None, marks: Iterable[float] = ()
    ) -> Iterator[StepLog]:
        """Runs to the stop time; yields the log of every macro step. marks: times [s] at which steps end."""
        breaks = [t for m in self.scene.members for signal in m.signals.values() for t in signal.breaks]
        return drive(self.master, _control(self.scene.coupling), 0.0, self.scene.stop_time, breaks, progress, marks)


@contextlib.contextmanager
def open_simulation(scene: Scene) -> Iterator[OpenSimulation]:
    """Everything that was loaded is freed at the end. Raises SubsystemError, CouplingError, and SceneError where the
    scene leaves its level open (fidelity.run chooses one)."""
    if scene.accuracy.level == "auto":
        raise SceneError(
            f"{scene.name}: fidelity.level = 'auto': the models are not chosen yet; use `tca-cosim run` or "
            "`tca-cosim select`, or set fidelity.level = 'given'"
        )
    with contextlib.ExitStack() as stack:
        for member in scene.members:
            stack.callback(member.archive.close)  # the extracted files; a later run extracts them again
        slaves = tuple(stack.enter_context(contextlib.closing(_slave(scene, member))) for member in scene.members)
        frozen = {m.name for m in scene.members if m.frozen}
        systems = tuple(FrozenSubsystem(slave) if slave.name in frozen else slave for slave in slaves)
        connections = [c for c in scene.connections if c.target[0] not in frozen]
        _adaptable(scene.coupling, systems)
        signals = {m.name: m.signals for m in scene.members}
        settings = _settings(scene.coupling)
        jacobi = scene.coupling.schedule == "jacobi"
        circuits = assemble(systems, connections, signals, settings.exchange, settings.waveform, jacobi)
        master = Master(circuits, settings, lambda: {system.name: system.record() for system in systems})
        master.initialise(0.0)
        yield OpenSimulation(scene, slaves, master)


def run(scene: Scene, progress: Callable[[float], None] = lambda time: None) -> xr.Dataset:
    """The result (results.collect). Raises SubsystemError and CouplingError; what had been computed by then is the
    error's `partial`, whose status says why it ended."""
    with open_simulation(scene) as ready:
        return run_to_end(ready, progress)


def run_to_end(ready: OpenSimulation, progress: Callable[[float], None] = lambda time: None) -> xr.Dataset:
    """run() of what is loaded already; once."""
    scene = ready.scene
    names = {m.name: recorded_variables(m) for m in scene.members}
    first, logs = ready.master.observe(), []
    try:
        for log in ready.steps(progress):
            logs.append(log)
    except CosimError as error:
        error.partial = results.collect(scene, names, first, logs, f"partial: {error}")
        raise
    return results.collect(scene, names, first, logs, "complete")


def _slave(scene: Scene, member: Member) -> Slave:
    fed = [c.target[1] for c in scene.connections if c.target[0] == member.name]
    return Slave(
        member.archive,
        member.name,
        member.parameters,
        inputs=[*fed, *member.signals],
        outputs=list(dict.fromkeys(c.source[1] for c in scene.connections if c.source[0] == member.name)),
        recorded=[v.name for v in recorded_variables(member)],
        stop=scene.stop_time,
    )


def recorded_variables(member: Member) -> list[Variable]:
    """The variables of a member that a result shows: its Real inputs and outputs."""
    return [v for v in member.archive.variables.values() if v.type == "Real" and v.causality in ("input", "output")]


def _adaptable(coupling: Coupling, systems: Sequence[Slave | FrozenSubsystem]) -> None:
    rigid = [system.name for system in systems if not system.can_rollback]
    if rigid and coupling.control != "fixed":
        raise SubsystemError(
            f"{', '.join(rigid)} cannot save and restore state (canGetAndSetFMUstate = false), so steps cannot be "
            "repeated; export with it, or set coupling.control = 'fixed'"
        )


def _settings(coupling: Coupling) -> Settings:
    kind = acceleration.METHODS.get(coupling.method)
    relaxed = kind is not None and any(f.name == "omega" for f in fields(kind))
    return Settings(
        exchange=extrapolation.METHODS[coupling.exchange],
        waveform=extrapolation.METHODS[coupling.waveform],
        method=None if kind is None else kind(omega=coupling.omega) if relaxed else kind(),
        tolerance=coupling.tolerance,
        max_sweeps=coupling.max_sweeps,
        halvings=coupling.halvings,
        reach=coupling.reach,
    )


def _control(coupling: Coupling) -> Control:
    h = coupling.macro_step
    if coupling.control == "fixed":
        return Fixed(h)
    kind = Doubling if coupling.control == "doubling" else Embedded
    return kind(h, coupling.step_tolerance, least=h * 0.5**coupling.halvings, most=h * 100.0)
