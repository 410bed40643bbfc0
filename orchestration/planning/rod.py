"""The rod at rest: outputs as functions of the TCAs' temperatures, with exact derivatives."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

import numpy as np

from ..errors import SceneError, SubsystemError
from ..fmi.archive import similar
from ..fmi.slave import Slave
from ..scene import Scene
from ..scene.manipulator import CLOSURE_INSIDE
from .manipulator import Manipulator

__all__ = ["StaticRod"]

_STEP = 1.0  # [s] of the FMU's clock from one equilibrium to the next; equilibria know no time


class StaticRod:
    """Equilibria of a scene's rod under its loads; use as a context manager.

    Parameters
    ----------
    scene : Scene
        With one rod FMU of this project. Its loads (gravity, forces at the tip) are those of the scene at each time.
    outputs : sequence of str
        Names of the rod's outputs, p of them.

    Attributes
    ----------
    names : tuple of str
        Of the outputs.
    equilibria : int
        Number of equilibria computed so far.

    Raises
    ------
    SceneError
        The scene has no rod, or the rod no such output.
    """

    def __init__(self, scene: Scene, outputs: Sequence[str]) -> None:
        manipulator = Manipulator.of(scene)
        member = manipulator.rod
        archive = member.archive
        self.names = tuple(outputs)
        known = [v.name for v in archive.variables.values() if v.causality == "output" and v.type == "Real"]
        for name in self.names:
            if name not in known:
                raise SceneError(f"output {name!r}: the rod has no such output; {similar(name, known)}")
        self.equilibria = 0
        self.member = member.name
        self._stack = contextlib.ExitStack()
        self._stack.callback(archive.close)
        temperatures = list(manipulator.fed)
        self._heating, self._shift = manipulator.heating, manipulator.shift
        self._signals = [s for name, s in member.signals.items() if name not in temperatures]
        loads = [name for name in member.signals if name not in temperatures]
        fixed = {"dynamic": False, "closure": CLOSURE_INSIDE, "start_at_equilibrium": True}
        parameters = member.with_values(fixed).parameters
        self._slave = Slave(archive, member.name, parameters, [*temperatures, *loads], list(outputs))
        self._stack.enter_context(contextlib.closing(self._slave))
        self._count = len(temperatures)
        self._columns = np.arange(self._count)
        self._inputs = np.zeros((4, self._count + len(loads)))
        self._inputs[0, : self._count] = [archive.variables[t].start for t in temperatures]
        self._set_loads(scene.start_time)
        self._slave.initialise(0.0, self._inputs[0])
        self._slave.begin()
        self._clock = 0.0

    def __enter__(self) -> StaticRod:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the FMU."""
        self._stack.close()

    def outputs(self, temperatures: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """Return the outputs (K, p) at temperatures (K, N) [K] of the sections' TCAs and times (K,) [s].

        The loads are those of these times.

        Raises SubsystemError where there is no equilibrium.
        """
        return np.array([self._settle(T, None if times is None else times[k]) for k, T in enumerate(temperatures)])

    def linear(
        self, temperatures: np.ndarray, times: np.ndarray | None = None, wanted: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the outputs (K, p) and their derivatives (K, p, N) [per K] at temperatures (K, N) [K].

        The derivatives are 0 where they are not wanted (K,); without `wanted` all are.
        """
        values = np.zeros((len(temperatures), len(self.names)))
        tangents = np.zeros((*values.shape, temperatures.shape[1]))
        for k, T in enumerate(temperatures):
            values[k] = self._settle(T, None if times is None else times[k])
            if wanted is not None and not wanted[k]:
                continue
            tangent = self._slave.tangent(self._columns)
            if tangent is None:
                raise SubsystemError(f"{self.member}: the FMU has no directional derivatives; export it with them")
            tangents[k] = tangent @ self._heating
        return values, tangents

    def _settle(self, temperatures: np.ndarray, time: float | None) -> np.ndarray:
        self._inputs[0, : self._count] = self._heating @ temperatures + self._shift
        if time is not None:
            self._set_loads(time)
        self._slave.set_inputs(self._inputs)
        try:
            self._slave.step(self._clock, _STEP)
        except SubsystemError as error:
            warm = ", ".join(f"{T - 273.15:.4g}" for T in temperatures)
            raise SubsystemError(
                f"{error}. This is the rod at rest at {warm} degC; lower the limits of voltage and temperature, or the "
                "loads"
            ) from error
        self._clock += _STEP
        self.equilibria += 1
        return self._slave.values()

    def _set_loads(self, time: float) -> None:
        self._inputs[0, self._count :] = [signal.polynomial(time, _STEP)[0] for signal in self._signals]
