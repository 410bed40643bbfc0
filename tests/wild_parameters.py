"""Random parameters over the allowed ranges of the rod and of the heat model, with every method, closure and level.

What completes without a word is audited: the rod by its balance of energy and by finer runs, heat by its steady state,
which is known, by the second law and by steps of another length.

`python tests/wild_parameters.py COUNT [SEED [thermal]]` runs a long campaign by hand and prints its table;
test_wild_parameters.py runs a sample."""

from __future__ import annotations

import math
import random
import re
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

WARNING, DISCARD = 1, 2
ROD = Path(__file__).parents[1] / "fmus" / "rod.fmu"
THERMAL = ROD.with_name("thermal.fmu")
# Typical size of what starts at 0.
SIZES = {"body.retardation": 1e-2, "body.curvature": 20.0, "tca.helix": 60.0}
HANG = 60.0  # [s] of CPU time that no draw may take, some hundred times the typical one
STEPS = 4
AUDITED = 3  # one of this many draws that complete without a word: an audit costs several runs


@dataclass
class Draw:
    """Parameters and inputs by name; h: communication step [s]."""

    values: dict[str, float]
    inputs: dict[str, float]
    h: float


@dataclass
class Outcome:
    """How a run ended: refused, discard, error or complete; said: whether it warned; rows: Real outputs of each row."""

    end: str
    said: bool
    rows: list[dict[str, float]] = field(default_factory=list)
    message: str = ""


class Fmu:
    """An unpacked FMU, of which every run makes an instance."""

    def __init__(self, path: Path) -> None:
        self.name = path.stem
        self.description = fmpy.read_model_description(str(path), validate=False)
        self.folder = fmpy.extract(str(path))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [v for v in self.description.modelVariables if v.causality == "output" and v.type == "Real"]

    def run(self, draw: Draw, steps: int = STEPS, h: float | None = None) -> Outcome:
        """Initialise, and take steps under constant inputs."""
        messages: list[tuple[int, str]] = []
        log = fmi2CallbackLoggerTYPE(lambda env, name, status, category, text: messages.append((status, text.decode())))
        slave = FMU2Slave(
            guid=self.description.guid, unzipDirectory=self.folder, modelIdentifier=self.name, instanceName="wild"
        )
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = log
        slave.instantiate(callbacks=callbacks, loggingOn=True)
        out = Outcome("refused", said=False)
        try:
            slave.setupExperiment(startTime=0.0)
            self._write(slave, draw.values)
            slave.enterInitializationMode()
            self._write(slave, draw.inputs)
            slave.exitInitializationMode()
            out.end = "error"
            out.rows.append(self._read(slave))
            h = draw.h if h is None else h
            for k in range(steps):
                slave.doStep(k * h, h)
                out.rows.append(self._read(slave))
            out.end = "complete"
        except FMICallException as error:
            if error.status == DISCARD:
                out.end = "discard"
        finally:
            out.said = any(status >= WARNING for status, _ in messages)
            out.message = messages[-1][1] if messages else out.message
            slave.freeInstance()
        return out

    def start(self, name: str) -> float:
        """Start value of a parameter."""
        text = self.variables[name].start
        return float(text) if text not in ("true", "false") else float(text == "true")

    def _write(self, slave: FMU2Slave, values: dict[str, float]) -> None:
        for name, value in values.items():
            variable = self.variables[name]
            if variable.type == "Real":
                slave.setReal([variable.valueReference], [value])
            elif variable.type == "Boolean":
                slave.setBoolean([variable.valueReference], [bool(value)])
            else:
                slave.setInteger([variable.valueReference], [int(value)])

    def _read(self, slave: FMU2Slave) -> dict[str, float]:
        values = slave.getReal([v.valueReference for v in self.outputs])
        return dict(zip((v.name for v in self.outputs), values, strict=True))


def _is_drawn(name: str) -> bool:
    """Whether a parameter is drawn: those of the whole body, not of single segments and TCAs, which nearly always
    contradict each other at random."""
    if re.fullmatch(r"tca\.(?!azimuth|helix|R\b).*\[\d+\]", name):
        return False
    if name.startswith(("segment.", "tip_body.")) or name in ("tca.contact", "tca.ends", "tca.handedness"):
        return False
    return "[" not in name or name.startswith(("body.", "tca.azimuth", "tca.helix", "tca.R"))


def drawn(fmu: Fmu, chance: random.Random) -> Draw:
    """Each parameter moved with a probability, by a width, that are drawn too: from nearly usual to wild."""
    share, width = chance.choice((0.1, 0.3, 1.0)), chance.choice((0.2, 1.0, 3.0, 6.0))
    values: dict[str, float] = {}
    for v in fmu.description.modelVariables:
        if v.causality != "parameter" or not _is_drawn(v.name):
            continue
        if v.type == "Enumeration":
            values[v.name] = chance.randint(1, len(v.declaredType.items))
        elif v.type == "Boolean":
            values[v.name] = chance.randint(0, 1)
        elif v.type == "Integer":
            values[v.name] = chance.randint(int(v.min), min(int(v.max), 50))
        elif v.name == "tolerance":  # tighter ones cost a hundred times as much and fail in no other way
            values[v.name] = 10.0 ** chance.uniform(-5.0, -1.0)
        elif chance.random() < share:
            values[v.name] = _real(v, chance, width)
    if fmu.name == "thermal":
        inputs = {f"V[{k}]": chance.choice((0.0, 10.0 ** chance.uniform(-2.0, 1.5))) for k in (1, 2, 3)}
        inputs["T_ambient"] = chance.choice((298.15, values.get("T_0", 298.15), chance.uniform(250.0, 400.0)))
        return Draw(values, inputs, 10.0 ** chance.uniform(-3.0, 4.0))
    inputs = {f"T[{k}]": 298.15 + chance.choice((0.0, 30.0, 200.0)) * chance.random() for k in (1, 2, 3)}
    weight = 10.0 ** chance.uniform(-4.0, -0.5)
    for k in (1, 2, 3):
        inputs[f"gravity[{k}]"] = chance.choice((0.0, chance.uniform(-10.0, 10.0)))
        inputs[f"tip_force[{k}]"] = chance.choice((0.0, weight * chance.uniform(-1.0, 1.0)))
        inputs[f"tip_moment[{k}]"] = chance.choice((0.0, 0.0, 0.02 * weight * chance.uniform(-1.0, 1.0)))
    return Draw(values, inputs, 10.0 ** chance.uniform(-5.0, -1.0))


def _real(v: Any, chance: random.Random, width: float) -> float:
    size = float(v.start) or SIZES.get(v.name.split("[")[0], 1.0)
    value = size * 10.0 ** chance.uniform(-width, width)
    if v.min is not None and float(v.min) < 0.0 and chance.random() < 0.3:
        value = -value
    return min(max(value, float(v.min)), float(v.max))


def audit(fmu: Fmu, draw: Draw, run: Outcome) -> list[str]:
    """What is wrong: balance of energy where forces have a potential; finer order and repetition where it is static."""
    wrong, last = [], run.rows[-1]
    value = lambda name: draw.values.get(name, fmu.start(name))  # noqa: E731
    length, tolerance = value("body.length"), value("tolerance")
    method = fmu.variables["method"].declaredType.items[int(value("method")) - 1].name
    tip = lambda row: np.array([row[f"tip.p[{k}]"] for k in (1, 2, 3)])  # noqa: E731
    if not value("dynamic"):
        if np.max(np.abs(tip(run.rows[-2]) - tip(last))) > 1e-5 * length:
            wrong.append("static: the same inputs give another shape")
        if method != "pade_euler" and value("order") <= 5:
            finer = fmu.run(Draw({**draw.values, "order": value("order") + 2}, draw.inputs, draw.h), 1)
            if finer.end == "complete" and not finer.said:
                off = float(np.max(np.abs(tip(finer.rows[-1]) - tip(last)))) / length
                if off > max(0.03, 3.0 * last["spatial_error"] / length):
                    wrong.append(f"order + 2: tip {off:.2g} of the length apart without a warning")
        return wrong
    conservative = not any(draw.inputs[f"tip_moment[{k}]"] for k in (1, 2, 3))
    accurate = method in ("rosenbrock", "rosenbrock_3", "bdf") and tolerance <= 1e-4
    if conservative and accurate and value("closure") == 1 and value("tca.pitch") == 1 and not value("planar"):
        force = np.array([draw.inputs[f"tip_force[{k}]"] for k in (1, 2, 3)])
        parts = np.array(
            [
                [
                    *(row[f"energy.{e}"] for e in ("elastic", "tca", "kinetic", "gravity", "dissipated")),
                    -force @ tip(row),
                ]
                for row in run.rows
            ]
        )
        size = float(np.max(np.ptp(parts, axis=0)))
        drift = float(np.ptp(parts.sum(axis=1)))
        noise = 1e-10 * float(np.max(np.abs(parts)))  # rounding of large parts
        if drift > 0.02 * size + noise and size > 100.0 * noise:
            wrong.append(f"energy: drifts by {drift / size:.2g} of what is exchanged")
    return wrong


def audit_heat(fmu: Fmu, draw: Draw, run: Outcome) -> list[str]:
    """What is wrong: the second law, steps of half the length, the steady state."""
    wrong = []
    value = lambda name: draw.values.get(name, fmu.start(name))  # noqa: E731
    ambient, T_0, tolerance = draw.inputs["T_ambient"], value("T_0"), value("tolerance")
    last = run.rows[-1]
    size = max(abs(row[f"T[{k}]"] - T_0) for row in run.rows for k in (1, 2, 3))
    slack = tolerance * max(size, abs(ambient - T_0)) + last["reduction.bound"] + 1e-6
    if min(last[f"T[{k}]"] for k in (1, 2, 3)) < min(T_0, ambient) - slack:
        wrong.append("a TCA is colder than everything around it ever was")
    if last["T_max"] < max(last[f"T[{k}]"] for k in (1, 2, 3)) - slack:
        wrong.append("T_max is below a TCA's mean")
    if value("convection") != 1:
        return wrong
    halved = fmu.run(draw, 2 * STEPS, draw.h / 2)
    if halved.end == "complete":
        off = max(abs(halved.rows[-1][f"T[{k}]"] - last[f"T[{k}]"]) for k in (1, 2, 3))
        if off > slack:
            wrong.append(f"steps of half the length: {off:.2g} K apart")
    if any(value(f"tca.{name}") for name in ("alpha_T", "beta")):
        return wrong
    film = 2.0 * math.pi * value("body.radius") * value("body.length") * value("h")
    slowest = (
        value("body.radius")
        * max(value("body.rho_c"), value("tca.rho_c"))
        * (1.0 / value("h") + value("body.radius") / min(value("body.k"), value("tca.k")))
    )
    steady = fmu.run(draw, 1, min(1e3 * slowest, 1e30))
    if steady.end == "complete":
        power = sum(steady.rows[-1][f"P[{k}]"] for k in (1, 2, 3))
        exact = ambient + power / film
        if abs(steady.rows[-1]["T_surface"] - exact) > 1e-6 * abs(exact - T_0) + 1e-7:
            wrong.append(f"the surface ends at {steady.rows[-1]['T_surface']:.8g} K instead of {exact:.8g} K")
    return wrong


def campaign(fmu: Fmu, count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Counts by outcome, and what is wrong without a word, by the seed of its draw."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    for number in range(seed, seed + count):
        draw = drawn(fmu, random.Random(number))
        begin = time.process_time()
        run = fmu.run(draw)
        if time.process_time() - begin > HANG:
            wrong.append(f"{number}: takes more than {HANG:g} s")
        counts[f"{run.end}{', with a warning' if run.said and run.end == 'complete' else ''}"] += 1
        problems = [f"{name} = {value}" for row in run.rows for name, value in row.items() if not math.isfinite(value)]
        if run.end in ("refused", "error", "discard") and not run.message:
            problems.append(f"{run.end} without a message")
        if run.end == "complete" and not run.said and number % AUDITED == 0:
            counts["complete and audited"] += 1
            problems += (audit_heat if fmu.name == "thermal" else audit)(fmu, draw, run)
        wrong += [f"{number}: {problem}" for problem in problems[:2]]
    return counts, wrong


if __name__ == "__main__":
    path = THERMAL if "thermal" in sys.argv else ROD
    totals, actual = campaign(Fmu(path), int(sys.argv[1]), int((sys.argv[2:] or [0])[0]))
    for what, often in sorted(totals.items()):
        print(f"{often:8} {what}")
    print(f"{len(actual):8} wrong without a word", *actual, sep="\n  ")
