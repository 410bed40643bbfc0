"""One FMU in this process with its log kept: the smallest host that the contract tests need, on FMPy's bindings."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model as Model
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

ROOT = Path(__file__).parents[1]
Self = TypeVar("Self")


@dataclass(frozen=True)
class Subject:
    """An FMU and inputs that make it move: values [unit of the variable] and first derivatives [unit/s]."""

    path: Path
    inputs: Mapping[str, tuple[float, float]]
    step: float
    out_of_range: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.path.stem


SUBJECTS = (
    Subject(ROOT / "build/tests/probe.fmu", {"force": (1.0, -2.0), "bias": (0.5, 0.0)}, 0.1, {"mass": 0.05}),
    Subject(ROOT / "fmus/thermal.fmu", {"V[1]": (3.0, 0.0), "V[2]": (1.0, 0.5)}, 0.2, {"body.radius": -1.0}),
    Subject(ROOT / "fmus/rod.fmu", {"T[1]": (330.0, 5.0), "gravity[1]": (1.0, 0.0)}, 0.1, {"body.length": -1.0}),
)


class _Hosted:
    """What both interfaces share: loading, the log, variables by name."""

    def __init__(self, path: Path):
        self.description = fmpy.read_model_description(str(path), validate=False)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [v.name for v in self.description.modelVariables if v.causality == "output" and v.type == "Real"]
        self.messages: list[str] = []
        self.worst = 0  # fmi2Status of all of them
        super().__init__(
            guid=self.description.guid,
            unzipDirectory=fmpy.extract(str(path)),
            modelIdentifier=path.stem,
            instanceName=path.stem,
        )
        callbacks = fmi2CallbackFunctions()
        self._logger = fmi2CallbackLoggerTYPE(self._take)  # kept alive as long as the instance
        callbacks.logger = self._logger
        self.instantiate(callbacks=callbacks, loggingOn=True)

    def _take(self, environment, instance, status, category, message) -> None:
        self.messages.append(message.decode())
        self.worst = max(self.worst, status)

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.freeInstance()
        shutil.rmtree(self.unzipDirectory)

    def references(self, names: Sequence[str]) -> list[int]:
        return [self.variables[name].valueReference for name in names]

    def start(self) -> None:
        self.enterInitializationMode()
        self.exitInitializationMode()

    def write(self, name: str, value: float) -> None:
        self.setReal(self.references([name]), [value])

    def read(self) -> list[float]:
        return self.getReal(self.references(self.outputs))


class FMU2Host(_Hosted, FMU2Slave):
    """`with FMU2Host(path) as fmu:` loads it; `messages` is what it logged. FMPy wants FMU2 in the name."""

    def apply(self, inputs: Mapping[str, tuple[float, float]]) -> None:
        for name, (value, slope) in inputs.items():
            self.write(name, value)
            self.setRealInputDerivatives(self.references([name]), [1], [slope])

    def step(self, t: float, h: float) -> None:
        self.doStep(t, h, False)


class FMU2Model(_Hosted, Model):
    """The same for model exchange. Arrays have one number per state."""

    def start(self) -> None:
        super().start()
        self.newDiscreteStates()
        self.enterContinuousTimeMode()
        x = self.states()
        self.put(x + 1.0)
        self.used = (self.states() != x).astype(float)  # 1 for states that the parameters need
        self.put(x)

    @property
    def derivative_rows(self) -> list:
        return [unknown.variable for unknown in self.description.derivatives]

    @property
    def rate_references(self) -> list[int]:
        return [row.valueReference for row in self.derivative_rows]

    @property
    def state_references(self) -> list[int]:
        return [row.derivative.valueReference for row in self.derivative_rows]

    @property
    def nominals(self) -> np.ndarray:
        values = np.zeros(len(self.derivative_rows))
        self.getNominalsOfContinuousStates(_pointer(values), values.size)
        return values

    def apply(self, inputs: Mapping[str, tuple[float, float]]) -> None:
        for name, (value, _) in inputs.items():
            self.write(name, value)

    def states(self) -> np.ndarray:
        values = np.zeros(len(self.derivative_rows))
        self.getContinuousStates(_pointer(values), values.size)
        return values

    def put(self, values: np.ndarray) -> None:
        values = np.ascontiguousarray(values, dtype=float)
        self.setContinuousStates(_pointer(values), values.size)

    def rates(self) -> np.ndarray:
        values = np.zeros(len(self.derivative_rows))
        self.getDerivatives(_pointer(values), values.size)
        return values


def _pointer(values: np.ndarray) -> ctypes.Array:
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def run(path: Path, inputs: Mapping[str, tuple[float, float]], h: float, steps: int) -> list[list[float]]:
    """All Real outputs after each of `steps` steps of `h` [s] from 0 under the same inputs."""
    with FMU2Host(path) as fmu:
        fmu.start()
        rows = []
        for i in range(steps):
            fmu.apply(inputs)
            fmu.step(i * h, h)
            rows.append(fmu.read())
        return rows


def resume(path: Path, state: bytes, inputs: Mapping[str, tuple[float, float]], t: float, h: float) -> list[float]:
    """All Real outputs one step after a serialised state, in an instance that was never initialised."""
    with FMU2Host(path) as fmu:
        fmu.setFMUstate(fmu.deSerializeFMUstate(state))
        fmu.apply(inputs)
        fmu.step(t, h)
        return fmu.read()
