"""A scene stepped from outside: by a controller, an optimiser, a learning environment.

    with tca.Simulation("step") as sim:
        while sim.time < 10.0:
            sim.step(sim.time + 0.1, {"thermal.V": [0.0, 1.5, 3.0]})
            tip = sim["rod.tip.p"]

No file is written. Models, coupling and steps are those of the scene; only its inputs come from outside.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..api import Overrides, Source, read
from ..cosim.communication_points import TIME_RTOL
from ..cosim.master import Checkpoint
from ..cosim.signals import Signal
from ..cosim.time_loop import drive
from ..errors import SceneError, SubsystemError
from ..fmi.archive import similar
from ..fmi.instance import Instance
from ..simulation import OpenSimulation, control_of, open_simulation, recorded_variables
from .live_inputs import LiveInput, number_of, signals_of, with_live_inputs

__all__ = ["SavedState", "Simulation"]

_TIME_RTOL = 1e-12  # share of a time below which a step has no length


@dataclass(frozen=True)
class SavedState:
    """A state of a simulation that it can return to: time [s], states of all FMUs, signals of all inputs."""

    time: float
    checkpoint: Checkpoint
    signals: Mapping[tuple[str, str], Signal]


class Simulation:
    """A scene, opened and initialised, that is stepped from outside.

    Parameters
    ----------
    scene, overrides
        As read() takes them.

    Attributes
    ----------
    scene : Scene
        What is run, with every input that no connection feeds driven by a signal.
    time : float
        Time reached [s].

    Raises
    ------
    SceneError
        The scene cannot be run as written.
    SubsystemError, CouplingError
        An FMU cannot be loaded or initialised.
    """

    def __init__(self, scene: Source, overrides: Overrides = ()) -> None:
        described = read(scene, overrides)
        self._live: dict[tuple[str, str], LiveInput] = {}
        self.scene = with_live_inputs(described, self._live)
        self._stack = contextlib.ExitStack()
        self._open: OpenSimulation | None = self._stack.enter_context(
            open_simulation(self.scene, observe=lambda systems: None)
        )
        self._columns = {m.name: {v.name: k for k, v in enumerate(recorded_variables(m))} for m in self.scene.members}
        self._records: dict[str, np.ndarray] = {}
        self._elements: dict[str, tuple[str, list[str], bool]] = {}
        self._control = control_of(self.scene.coupling)
        self.time = self.scene.start_time
        self._first = self.save()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the FMUs. May be called twice; what steps or reads afterwards raises SceneError."""
        self._open = None
        self._records.clear()
        self._stack.close()

    @property
    def _ready(self) -> OpenSimulation:
        if self._open is None:
            raise SceneError(f"{self.scene.name}: the simulation is closed; open it again")
        return self._open

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names 'member.variable' of the inputs that can be set."""
        return tuple(f"{member}.{variable}" for member, variable in self._live)

    def step(self, until: float, inputs: Mapping[str, Any] | None = None) -> None:
        """Advance to a time, in as many macro steps as the scene's coupling takes.

        Parameters
        ----------
        until : float
            Time to reach [s].
        inputs : mapping, optional
            As set_inputs() takes them; they hold from the present time on.

        Raises
        ------
        SceneError
            The time or an input is not allowed.
        SubsystemError, CouplingError
            An FMU refuses an input, and nothing was changed; or a step failed, and the simulation stands at the last
            time reached.
        """
        until = self._time_of(until)
        if inputs is not None:
            self.set_inputs(inputs)
        master = self._ready.master
        known = len(master.notes)
        breaks = {t for live in self._live.values() for t in live.breaks if self.time < t < until}
        self._records.clear()
        for log in drive(master, self._control, self.time, until, breaks):
            self.time = log.time
        del master.notes[known:]  # what they say of steps is true of every call
        if master.ended:
            raise SubsystemError(master.ended)

    def set_inputs(self, inputs: Mapping[str, Any]) -> None:
        """Set inputs from the present time on.

        Parameters
        ----------
        inputs : mapping
            'member.variable' of a scalar, a vector or one of its elements -> number, sequence of as many, or signal
            (cosim.signals), in the variable's own unit. A number is held until it is set again.

        Raises
        ------
        SceneError
            The message names the key, what is allowed and the remedy; nothing was changed.
        SubsystemError
            An FMU refuses a value; nothing was changed.
        """
        master = self._ready.master
        if not isinstance(inputs, Mapping):
            raise SceneError(f"inputs: {type(inputs).__name__}; give a mapping such as {{'{self.inputs[0]}': 1.0}}")
        changes: dict[tuple[str, str], Signal] = {}
        for key, value in inputs.items():
            member, elements, _ = self._resolve(key)
            for element, signal in zip(elements, signals_of(key, value, len(elements)), strict=True):
                if (member, element) not in self._live:
                    raise SceneError(f"{key} cannot be set; inputs that nothing feeds are {', '.join(self.inputs)}")
                if (member, element) in changes:
                    raise SceneError(f"{key}: {member}.{element} is set twice; keep one")
                changes[member, element] = signal
        changed = {port: signal for port, signal in changes.items() if self._live[port].signal != signal}
        if not changed:
            return
        before = {port: self._live[port].signal for port in changed}
        self._records.clear()
        self._exchange(changed)
        try:
            master.arrive(self.time)
        except SubsystemError:
            self._exchange(before)
            master.arrive(self.time)
            raise

    def __getitem__(self, key: str) -> Any:
        """Return a variable now: a float, or an array for a vector. Raises SceneError for an unknown name."""
        member, elements, is_vector = self._resolve(key)
        columns = self._columns[member]
        if elements[0] not in columns:
            raise SceneError(f"{key} is not recorded; add record = ['{key}'] to the scene")
        record = self._record(member)
        if not is_vector:
            return float(record[columns[elements[0]]])
        return record[[columns[element] for element in elements]]

    def values(self, names: Iterable[str] | None = None) -> dict[str, Any]:
        """Return variables now by name, as [] does; without names, all inputs and outputs, vectors whole."""
        if isinstance(names, str):
            names = [names]
        elif names is None:
            names = [
                f"{m.name}.{n}"
                for m in self.scene.members
                for n in _whole_names(m.archive.vectors, self._columns[m.name])
            ]
        return {name: self[name] for name in names}

    def instance(self, member: str) -> Instance:
        """Return the FMU instance of a member. Raises SceneError for a name that the scene does not have."""
        self._require_member(member, member)
        for slave in self._ready.slaves:
            if slave.name == member and isinstance(slave, Instance):
                return slave
        raise SubsystemError(f"{member}: not in this process (canBeInstantiatedOnlyOncePerProcess); use one of a kind")

    def save(self) -> SavedState:
        """Save the state of all FMUs and inputs. Raises SubsystemError where an FMU cannot save its state."""
        master = self._ready.master
        rigid = [node.subsystem.name for node in master.nodes if not node.subsystem.can_rollback]
        checkpoint = master.checkpoint()
        if not rigid:
            master.save(checkpoint)
            master.restart(checkpoint)  # what was learned of loops is no part of a state: from here on as after restore
        return SavedState(self.time, checkpoint, {port: live.signal for port, live in self._live.items()})

    def restore(self, state: SavedState) -> None:
        """Return to a saved state, which stays valid. Steps from it are the same each time, to the last bit.

        Raises
        ------
        SceneError
            The state is one of another simulation; nothing was changed.
        SubsystemError
            An FMU cannot be set back, or the state was released; nothing was changed.
        """
        master = self._ready.master
        self._require_own(state)
        if len(state.checkpoint.handles) < len(master.nodes):
            rigid = [node.subsystem.name for node in master.nodes if node not in state.checkpoint.handles]
            raise SubsystemError(
                f"{', '.join(rigid)} cannot be set back (canGetAndSetFMUstate = false, or the state was released); "
                "open the scene again"
            )
        self._exchange(state.signals)
        master.restart(state.checkpoint)
        self.time = state.time
        master.ended = ""
        self._records.clear()

    def release(self, state: SavedState) -> None:
        """Free what a saved state holds. Raises SceneError for a state of another simulation."""
        master = self._ready.master
        self._require_own(state)
        master.release(state.checkpoint)

    def restart(self) -> None:
        """Return to the start of the scene."""
        self.restore(self._first)

    def _exchange(self, signals: Mapping[tuple[str, str], Signal]) -> None:
        for port, signal in signals.items():
            self._live[port].signal = signal

    def _require_own(self, state: SavedState) -> None:
        """Raise SceneError where a state was saved by another simulation; one that an FMU could not save is empty."""
        saved = state.checkpoint.samples if isinstance(state, SavedState) else None
        if saved is None or (saved and not all(node in saved for node in self._ready.master.nodes)):
            raise SceneError(f"{self.scene.name}: not a state of this simulation; give one that its save() returned")

    def _record(self, member: str) -> np.ndarray:
        if member not in self._records:
            self._records[member] = next(slave for slave in self._ready.slaves if slave.name == member).record()
        return self._records[member]

    def _resolve(self, key: str) -> tuple[str, list[str], bool]:
        """Return member, elements and whether the name is that of a vector."""
        if not isinstance(key, str):
            raise SceneError(
                f"{key!r}: {type(key).__name__}; name variables 'member.variable', such as {self.inputs[0]!r}"
            )
        if key not in self._elements:
            name, _, variable = key.partition(".")
            self._require_member(key, name)
            archive = self.scene.member(name).archive
            if variable in archive.vectors:
                self._elements[key] = (name, list(archive.vectors[variable]), True)
            elif variable in archive.variables:
                self._elements[key] = (name, [variable], False)
            else:
                raise SceneError(
                    f"{key}: {archive.path.name} has no variable {variable!r}; {similar(variable, archive.variables)}"
                )
        return self._elements[key]

    def _require_member(self, key: str, name: str) -> None:
        names = [m.name for m in self.scene.members]
        if name not in names:
            raise SceneError(f"{key}: no FMU {name!r}; the scene has {', '.join(names)}")

    def _time_of(self, until: Any) -> float:
        """Return the time to reach. Raises SceneError where it is none, not later than now, or after the stop time."""
        time, now = number_of(until), self.time
        if not np.isfinite(time) or time - now <= max(TIME_RTOL * self._control.step, _TIME_RTOL * now):
            raise SceneError(f"step to t = {until!r} s from {now:.6g} s: give a later time")
        if time > self.scene.stop_time * (1.0 + _TIME_RTOL):
            raise SceneError(
                f"step to t = {time:.6g} s: after the scene's stop time {self.scene.stop_time:g} s; open it with a "
                "later stop_time"
            )
        return time


def _whole_names(vectors: Mapping[str, Sequence[str]], columns: Mapping[str, int]) -> list[str]:
    """Return the names of vectors and of scalars outside of vectors, of what is recorded."""
    owner = {element: vector for vector, elements in vectors.items() for element in elements}
    return list(dict.fromkeys(owner.get(name, name) for name in columns))
