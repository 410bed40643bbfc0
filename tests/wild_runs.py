"""Runs of the rod and of the heat model with given parameters and inputs, for campaigns of random ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

WARNING, DISCARD = 1, 2
ROD = Path(__file__).parents[1] / "fmus" / "rod.fmu"
THERMAL = ROD.with_name("thermal.fmu")
STEPS = 4  # of a draw


@dataclass
class Draw:
    """Parameters and inputs by name; h: communication step [s]."""

    values: dict[str, float]
    inputs: dict[str, float]
    h: float

    def changed(self, **values: float) -> Draw:
        """The draw with other parameters."""
        return Draw({**self.values, **values}, self.inputs, self.h)


@dataclass
class Outcome:
    """How a run ended.

    end: refused, discard, error or complete. said: whether it warned. rows: Real outputs at the start and after each
    step. states: of the strain polynomials at the end. message: the last one logged.
    """

    end: str
    said: bool
    rows: list[dict[str, float]] = field(default_factory=list)
    states: dict[str, float] = field(default_factory=dict)
    message: str = ""


class Fmu:
    """An unpacked FMU, of which every run makes an instance."""

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.stem
        self.description = fmpy.read_model_description(str(path), validate=False)
        self.folder = fmpy.extract(str(path))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [v for v in self.description.modelVariables if v.causality == "output" and v.type == "Real"]
        self.strains = [n for n in self.variables if n.startswith("strain[")]

    def run(self, draw: Draw, steps: int | Sequence[float] = STEPS, h: float | None = None) -> Outcome:
        """Initialise, and take steps under constant inputs: so many of the draw's length or of h, or these [s]."""
        messages: list[tuple[int, str]] = []
        log = fmi2CallbackLoggerTYPE(lambda env, name, status, category, text: messages.append((status, text.decode())))
        slave = FMU2Slave(
            guid=self.description.guid, unzipDirectory=self.folder, modelIdentifier=self.name, instanceName="wild"
        )
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = log
        slave.instantiate(callbacks=callbacks, loggingOn=True)
        out = Outcome("refused", said=False)
        lengths = [draw.h if h is None else h] * steps if isinstance(steps, int) else steps
        try:
            slave.setupExperiment(startTime=0.0)
            self.write(slave, draw.values)
            slave.enterInitializationMode()
            self.write(slave, draw.inputs)
            slave.exitInitializationMode()
            out.end = "error"
            out.rows.append(self._read(slave))
            t = 0.0
            for length in lengths:
                slave.doStep(t, length)
                t += length
                out.rows.append(self._read(slave))
            references = [self.variables[name].valueReference for name in self.strains]
            out.states = dict(zip(self.strains, slave.getReal(references), strict=True)) if references else {}
            out.end = "complete"
        except FMICallException as error:
            if error.status == DISCARD:
                out.end = "discard"
        finally:
            out.said = any(status >= WARNING for status, _ in messages)
            out.message = messages[-1][1] if messages else out.message
            slave.freeInstance()
        return out

    def value(self, draw: Draw, name: str) -> float:
        """Value of a parameter in the draw."""
        if name in draw.values:
            return draw.values[name]
        text = self.variables[name].start
        return float(text) if text not in ("true", "false") else float(text == "true")

    def write(self, instance, values: dict[str, float]) -> None:
        """Set variables of all types in an instance of FMPy."""
        for name, value in values.items():
            variable = self.variables[name]
            if variable.type == "Real":
                instance.setReal([variable.valueReference], [value])
            elif variable.type == "Boolean":
                instance.setBoolean([variable.valueReference], [bool(value)])
            else:
                instance.setInteger([variable.valueReference], [int(value)])

    def _read(self, slave: FMU2Slave) -> dict[str, float]:
        values = slave.getReal([v.valueReference for v in self.outputs])
        return dict(zip((v.name for v in self.outputs), values, strict=True))


def tip(row: dict[str, float]) -> np.ndarray:
    """Position of the tip [m], (3,)."""
    return np.array([row[f"tip.p[{k}]"] for k in (1, 2, 3)])


def shape(row: dict[str, float]) -> np.ndarray:
    """Points of the centreline [m], (points, 3)."""
    return np.array([value for name, value in row.items() if name.startswith("shape.p[")]).reshape(-1, 3)
