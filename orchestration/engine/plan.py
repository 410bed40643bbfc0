"""A scene as the engine runs it: members, wiring and signals as plain arrays.

The scene is opened once by the master, which checks it and decides how inputs are described; the engine does the same
with every run. What only the master can do is refused: methods of loops but quasi-Newton, adapted steps, discrete
values, conversions between units, FMUs of other makers, whose libraries may have global variables that threads would
share.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..cosim.communication_points import Segment, segments
from ..cosim.extrapolation import BY_DEGREE, reduce_degree
from ..cosim.graph import WiredComponent
from ..cosim.initialization import INSTANT
from ..cosim.node import Columns, Node
from ..cosim.signals import Constant
from ..errors import SceneError, similar
from ..fmi.archive import library_path
from ..fmi.block_interface import Blas
from ..fmi.block_memory import TORN_METHODS
from ..fmi.compiled_arithmetic import Arithmetic, find_arithmetic
from ..fmi.slave import Slave
from ..scene import Member as SceneMember
from ..scene import Scene
from ..simulation import OpenSimulation, open_simulation, recorded_variables
from . import binding

__all__ = ["EnginePlan", "communication_points", "expanded"]

ROWS = 4  # of a polynomial of inputs
MAX_STEPS = 10**7  # of a plan: inputs, outputs and times of all of them are kept, some hundred bytes each
BY_MASTER = "run it by the master instead (tca.run)"


@dataclass(eq=False)
class EnginePlan:
    """A scene for the engine.

    Attributes
    ----------
    scene : Scene
        What is run.
    structure : binding.Plan
        For the C functions.
    parameters : tuple of str
        Names of the columns of the table of parameters.
    inputs : tuple of str
        Names of the inputs of each run's own, elements of vectors one by one.
    outputs : dict of str to slice
        Name of each output -> its columns in a row.
    times : ndarray, shape (steps + 1,)
        Start and ends of the steps [s].
    rounds_as_master : bool
        Whether loops round as the master's; else they agree to the coupling's tolerance.
    """

    scene: Scene
    structure: binding.Plan
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: dict[str, slice]
    times: np.ndarray
    rounds_as_master: bool
    kept: list[Any]  # memory that the structure points into

    @property
    def width(self) -> int:
        """Number of columns of a row of outputs."""
        return sum(columns.stop - columns.start for columns in self.outputs.values())

    @classmethod
    def of(cls, scene: Scene, parameters: Sequence[str], inputs: Sequence[str], outputs: Sequence[str]) -> EnginePlan:
        """Make the plan of a scene.

        Parameters
        ----------
        scene
            What is run.
        parameters, inputs
            Names 'member.variable' of Real parameters and inputs that differ between runs; a vector stands for all its
            elements: a parameter has one value for them, an input one for each.
        outputs
            Names of Real inputs and outputs, whole vectors too.

        Raises
        ------
        SceneError
            The scene has what only the master can do, or a name is not known.
        """
        with open_simulation(scene) as ready:
            return _Builder(scene, ready).plan(parameters, inputs, outputs)


class _Builder:
    def __init__(self, scene: Scene, ready: OpenSimulation) -> None:
        self.scene, self.ready = scene, ready
        self.kept: list[Any] = []
        self.components = ready.master.components
        for component in self.components:
            self._check_loop(component)
        self.nodes = [self._checked(node) for component in self.components for node in component.nodes]
        self.slaves: list[Any] = [node.subsystem for node in self.nodes]
        self.members = [scene.member(slave.name) for slave in self.slaves]
        self.first = np.cumsum([0, *(len(slave.inputs) for slave in self.slaves)])

    def refuse(self, what: str, remedy: str) -> None:
        raise SceneError(f"{self.scene.name}: the engine cannot run it: {what}; {remedy}")

    def _check_loop(self, component: WiredComponent) -> None:
        interface, coupling = component.interface, self.scene.coupling
        if not interface.size:
            return
        names = ", ".join(node.subsystem.name for node in component.nodes)
        if coupling.method != "iqn":
            self.refuse(f"it solves the loop of {names} by quasi-Newton alone", "set coupling.method = 'iqn'")
        if coupling.waveform not in TORN_METHODS:
            self.refuse(
                f"it does not iterate {coupling.waveform} inputs of {names}", "set coupling.waveform = 'linear'"
            )
        if interface.fits_nominals:
            k = int(np.argmax(interface.adaptive))
            self.refuse(f"{interface.name(k)} is iterated and has no nominal", BY_MASTER)

    def _checked(self, node: Node) -> Node:
        if not isinstance(node.subsystem, Slave):
            self.refuse(f"{node.subsystem.name} is frozen, converted, or no co-simulation FMU", BY_MASTER)
        if not self.scene.member(node.subsystem.name).archive.reentrant:
            self.refuse(f"{node.subsystem.name} is not known to be reentrant", BY_MASTER)
        ports = (*node.subsystem.inputs, *node.subsystem.outputs)
        if any(port.discrete for port in ports) or any(link.held for link in node.upstream) or node.delayed:
            self.refuse(f"{node.subsystem.name} exchanges discrete values", BY_MASTER)
        if self.scene.coupling.control != "fixed":
            self.refuse("its steps are adapted", "set coupling.control = 'fixed'")
        return node

    def plan(self, parameters: Sequence[str], inputs: Sequence[str], outputs: Sequence[str]) -> EnginePlan:
        driven = [self._driven(name) for base in inputs for name in expanded(self.scene, base, ("input",))]
        varied = {name: expanded(self.scene, name, ("parameter",)) for name in parameters}
        recorded = {name: expanded(self.scene, name, ("input", "output")) for name in dict.fromkeys(outputs)}
        columns, begin = {}, 0
        for member in self.members:  # a row has member after member
            for name in (name for name in recorded if name.partition(".")[0] == member.name):
                columns[name] = slice(begin, begin + len(recorded[name]))
                begin += len(recorded[name])
        shown = [name for base in columns for name in recorded[base]]
        structures = [self._member(number, varied, shown) for number in range(len(self.nodes))]
        parts, arithmetic = [self._part(component) for component in self.components], self._arithmetic()
        steps = _macro_steps(self.scene)
        ends = np.array([step.end for step in steps])
        times, lengths = np.r_[self.scene.start_time, ends[:-1]], np.array([step.length for step in steps])
        events = [step.event or bool(driven) for step in steps]  # inputs of each run's own jump after each step
        structure = binding.Plan(
            members=len(structures),
            member=self._keep((binding.Member * len(structures))(*structures)),
            parts=len(parts),
            part=self._keep((binding.Part * len(parts))(*parts)),
            coupling_tolerance=self.scene.coupling.tolerance,
            reach=self.scene.coupling.trust_radius,
            max_sweeps=self.scene.coupling.max_sweeps,
            blas=arithmetic.blas if arithmetic else Blas(),
            start=self.scene.start_time,
            stop=self.scene.stop_time,
            tolerance=self.scene.tolerance or 0.0,
            steps=len(steps),
            times=self._doubles(times),
            lengths=self._doubles(lengths),
            ends=self._doubles(ends),
            events=self._keep((ctypes.c_ubyte * len(steps))(*events)),
            polynomials=self._doubles(self._polynomials(times, lengths)),
            starts=self._doubles(self._starts(times, ends)),
            driven=len(driven),
            driven_columns=self._sizes(driven),
        )
        names = tuple(name for base in inputs for name in expanded(self.scene, base, ("input",)))
        return EnginePlan(
            self.scene,
            structure,
            tuple(parameters),
            names,
            columns,
            np.r_[self.scene.start_time, ends],
            arithmetic is not None or not any(part.unknowns for part in parts),
            self.kept,
        )

    def _driven(self, name: str) -> int:
        """Return the column of an input among those of all members."""
        member, _, variable = name.partition(".")
        number = [m.name for m in self.members].index(member)
        ports = [port.name for port in self.slaves[number].inputs]
        if variable not in ports or variable not in self.members[number].signals:
            self.refuse(f"{name} is fed by another FMU, or by none", f"give it a value in the scene: {name} = 0")
        return int(self.first[number]) + ports.index(variable)

    def _member(self, number: int, varied: Mapping[str, Sequence[str]], recorded: Sequence[str]) -> binding.Member:
        member, node, slave = self.members[number], self.nodes[number], self.slaves[number]
        archive = member.archive
        identifier = archive.description.interface.model_identifier
        folder = archive.extract()
        mine = [
            (archive.variables[name.partition(".")[2]].reference, column)
            for column, names in enumerate(varied.values())
            for name in names
            if name.partition(".")[0] == member.name
        ]
        of_runs = {reference for reference, _ in mine}
        set_once = {n: v for n, v in member.parameters.items() if archive.variables[n].reference not in of_runs}
        links = [
            binding.Link(
                self.nodes.index(link.source), output, target, BY_DEGREE.index(link.method.name), link in node.torn
            )
            for link in node.upstream + node.forward + node.torn
            for output, target in zip(_indices(link.columns), _indices(link.targets), strict=True)
        ]
        shown = [name.partition(".")[2] for name in recorded if name.partition(".")[0] == member.name]
        return binding.Member(
            name=member.name.encode(),
            library=str(library_path(folder, identifier)).encode(),
            guid=archive.guid.encode(),
            resources=(folder / "resources").as_uri().encode(),
            **self._constants(member, set_once),
            varied=len(mine),
            varied_references=self._references(reference for reference, _ in mine),
            varied_columns=self._sizes(column for _, column in mine),
            inputs=len(slave.inputs),
            outputs=len(slave.outputs),
            recorded=len(shown),
            input_references=self._references(archive.variables[port.name].reference for port in slave.inputs),
            output_references=self._references(archive.variables[port.name].reference for port in slave.outputs),
            recorded_references=self._references(archive.variables[name].reference for name in shown),
            links=len(links),
            link=self._keep((binding.Link * len(links))(*links)),
            needs_rates=int(node.needs_rates),
            input_degree=slave.accepted_order,
        )

    def _part(self, component: WiredComponent) -> binding.Part:
        torn = component.interface.outputs
        source = [self.nodes.index(outputs.node) for outputs in torn for _ in outputs.columns]
        output = [int(column) for outputs in torn for column in outputs.columns]
        nominals = np.concatenate([outputs.nominals for outputs in torn] + [[]])
        first, count = self.nodes.index(component.nodes[0]), len(component.nodes)
        return binding.Part(
            first, count, len(source), self._sizes(source), self._sizes(output), self._doubles(nominals)
        )

    def _arithmetic(self) -> Arithmetic | None:
        """Return what the sums of loops are taken from, so that they round as the master's."""
        sizes, outputs = set(), set()
        for interface in (component.interface for component in self.components if component.interface.size):
            rated = sum(torn.columns.size for torn in interface.outputs if torn.node.needs_rates)
            sizes |= {interface.size, interface.size + rated}
            outputs |= {len(torn.node.subsystem.outputs) for torn in interface.outputs}
        return find_arithmetic(frozenset(sizes), frozenset(outputs))

    def _constants(self, member: SceneMember, values: Mapping[str, Any]) -> dict[str, binding.Values]:
        kinds: dict[str, tuple[tuple[str, ...], Any]] = {
            "reals": (("Real",), ctypes.c_double),
            "integers": (("Integer", "Enumeration"), ctypes.c_int),
            "booleans": (("Boolean",), ctypes.c_int),
            "strings": (("String",), ctypes.c_char_p),
        }
        constants = {}
        for key, (types, kind) in kinds.items():
            chosen = {n: v for n, v in values.items() if member.archive.variables[n].type in types}
            items = [v.encode() if isinstance(v, str) else v for v in chosen.values()]
            array = self._keep((kind * len(items))(*items))
            references = self._references(member.archive.variables[n].reference for n in chosen)
            constants[key] = binding.Values(len(items), references, ctypes.cast(array, ctypes.c_void_p))
        return constants

    def _signals(self) -> Iterable[tuple[int, Node, Any]]:
        for number, node in enumerate(self.nodes):
            for column, signal in node.signals:
                yield int(self.first[number]) + column, node, signal

    def _polynomials(self, times: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        polynomials = np.zeros((times.size, ROWS, self.first[-1]))
        for column, node, signal in self._signals():
            if isinstance(signal, Constant):
                polynomials[:, 0, column] = signal.value
                continue
            for k, (time, length) in enumerate(zip(times.tolist(), lengths.tolist(), strict=True)):
                c = signal.polynomial(time, length)
                polynomials[k, :, column] = reduce_degree(c, length, node.degree) if node.degree < signal.degree else c
        return polynomials

    def _starts(self, times: np.ndarray, ends: np.ndarray) -> np.ndarray:
        instants = [float(times[0]), *ends.tolist()]
        starts = np.zeros((len(instants), 2, self.first[-1]))
        starts[0, 0] = [port.start for slave in self.slaves for port in slave.inputs]
        for column, _, signal in self._signals():
            if isinstance(signal, Constant):
                starts[:, 0, column] = signal.value
                continue
            for k, time in enumerate(instants):
                starts[k, :, column] = signal.polynomial(time, INSTANT)[:2]
        return starts

    def _keep(self, memory: Any) -> Any:
        self.kept.append(memory)
        return memory

    def _sizes(self, numbers: Iterable[int]) -> Any:
        items = list(numbers)
        return self._keep((ctypes.c_size_t * len(items))(*items))

    def _references(self, references: Iterable[int]) -> Any:
        numbers = list(references)
        return self._keep((ctypes.c_uint * len(numbers))(*numbers))

    def _doubles(self, values: np.ndarray) -> Any:
        array = self._keep(np.ascontiguousarray(values, dtype=float))
        return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def communication_points(scene: Scene) -> np.ndarray:
    """Return start and ends of the macro steps [s] where none fails, shape (steps + 1,)."""
    return np.array([scene.start_time, *(step.end for step in _macro_steps(scene))])


def _macro_steps(scene: Scene) -> list[Segment]:
    count = (scene.stop_time - scene.start_time) / scene.coupling.macro_step
    if count > MAX_STEPS:
        raise SceneError(
            f"{scene.name}: coupling.macro_step = {scene.coupling.macro_step:g} s: {count:.3g} steps until "
            f"{scene.stop_time:g} s; the engine keeps the outputs of at most {MAX_STEPS:.0e}; make the macro step (the "
            "period of realtime) longer, or stop_time less"
        )
    breaks = [t for member in scene.members for signal in member.signals.values() for t in signal.breaks]
    return list(segments(scene.start_time, scene.stop_time, scene.coupling.macro_step, breaks))


def _indices(columns: Columns) -> list[int]:
    return list(range(columns.start, columns.stop)) if isinstance(columns, slice) else columns.tolist()


def expanded(scene: Scene, name: str, causalities: Sequence[str]) -> list[str]:
    """Return the Real variables that 'member.variable' stands for: itself, and the elements of a vector behind it.

    Raises
    ------
    SceneError
        There is none, or it is not Real or of another causality.
    """
    member = next((m for m in sorted(scene.members, key=lambda m: -len(m.name)) if name.startswith(f"{m.name}.")), None)
    if member is None:
        raise SceneError(f"{scene.name}: {name!r}: no such FMU; {similar(name, [m.name for m in scene.members])}")
    variable = name[len(member.name) + 1 :]
    archive = member.archive
    shown = recorded_variables(member) if "output" in causalities else ()
    allowed = {
        v.name: v for v in (*archive.variables.values(), *shown) if v.causality in causalities and v.type == "Real"
    }
    vector = archive.vectors.get(variable, ())
    elements = (variable, *vector) if variable in allowed or not vector else vector
    if any(element not in allowed for element in elements):
        known = [*allowed, *(base for base, names in archive.vectors.items() if names[0] in allowed)]
        raise SceneError(f"{scene.name}: {name!r} is no Real {' or '.join(causalities)}; {similar(variable, known)}")
    return [f"{member.name}.{element}" for element in elements]
