"""Audits of runs that complete without a warning: what must hold whatever the parameters are.

The moving rod: its balance of energy, steps of half the length, a finer order. The rod at rest: the same shape again, a
finer order, the linearised equations of motion, the end of damped motion. Heat: the second law, steps of half the
length, a tighter tolerance, the bound of the reduction against the full mesh, the steady state.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu_host import FMU2Model
from wild_runs import STEPS, Draw, Fmu, Outcome, shape, tip

ORDER_SHARE = 0.03  # of the length: what a finer order may move the tip by without a warning, as the FMU promises
HALVING = 100.0  # local errors, of the size of the tolerance, that may add up over a run
GROWTH = 2e-3  # over the lowest frequency of the unloaded rod: the solver takes slower growth for neutral
MOVED = 1e-5  # distance [1] of a strain coefficient to an equilibrium of the moving rod, by one step of Newton's method
APART = 1e-4  # of the length: distance to the end of damped motion
AT_REST = 1e-7  # of the length: motion in a long step of a rod that has come to rest
# Steps of the damped motion, over the lowest frequency: implicit Euler, which damps all that is faster.
DAMPED_STEPS = (*(0.2,) * 20, *(1.0,) * 40, *(10.0,) * 40, *(100.0,) * 20, 100.0)


def audit_rod(fmu: Fmu, draw: Draw, run: Outcome, counts: Counter[str]) -> list[str]:
    """What is wrong with a rod, at rest or moving."""
    wrong = _order(fmu, draw, run, counts)
    if not fmu.value(draw, "dynamic"):
        length = fmu.value(draw, "body.length")
        if np.max(np.abs(tip(run.rows[-2]) - tip(run.rows[-1]))) > 1e-5 * length:
            wrong.append("at rest: the same inputs give another shape")
        return wrong + _rest(fmu, draw, run, counts)
    return wrong + _energy(fmu, draw, run, counts) + _halving(fmu, draw, run, counts)


def _method(fmu: Fmu, draw: Draw) -> str:
    return fmu.variables["method"].declaredType.items[int(fmu.value(draw, "method")) - 1].name


def _order(fmu: Fmu, draw: Draw, run: Outcome, counts: Counter[str]) -> list[str]:
    """A finer order, where the strains are polynomials and the motion is short of chaos."""
    is_dynamic, order = fmu.value(draw, "dynamic"), fmu.value(draw, "order")
    if (is_dynamic and _method(fmu, draw) == "pade_euler") or order > 5:
        return []
    finer = fmu.run(draw.changed(order=order + 2))
    if finer.end != "complete" or finer.said:
        return []
    counts["audits: order + 2"] += 1
    length, last = fmu.value(draw, "body.length"), run.rows[-1]
    off = float(np.max(np.abs(tip(finer.rows[-1]) - tip(last)))) / length
    if off > max(ORDER_SHARE, 3.0 * last["spatial_error"] / length):
        return [f"order + 2: tip {off:.2g} of the length apart without a warning"]
    return []


def _energy(fmu: Fmu, draw: Draw, run: Outcome, counts: Counter[str]) -> list[str]:
    """The balance of energy, where forces have a potential and the method has an error of the step."""
    is_potential = not any(draw.inputs[f"tip_moment[{k}]"] for k in (1, 2, 3))
    is_potential = is_potential and fmu.value(draw, "closure") == 1 and fmu.value(draw, "tca.pitch") == 1
    is_accurate = _method(fmu, draw) in ("rosenbrock", "rosenbrock_3", "bdf") and fmu.value(draw, "tolerance") <= 1e-4
    if not (is_potential and is_accurate) or fmu.value(draw, "planar"):
        return []
    counts["audits: energy"] += 1
    force = np.array([draw.inputs[f"tip_force[{k}]"] for k in (1, 2, 3)])
    names = [f"energy.{part}" for part in ("elastic", "tca", "kinetic", "gravity", "dissipated")]
    parts = np.array([[*(row[name] for name in names), -force @ tip(row)] for row in run.rows])
    size = float(np.max(np.ptp(parts, axis=0)))
    drift = float(np.ptp(parts.sum(axis=1)))
    noise = 1e-10 * float(np.max(np.abs(parts)))  # rounding of large parts
    if drift > 0.02 * size + noise and size > 100.0 * noise:
        return [f"energy: drifts by {drift / size:.2g} of what is exchanged"]
    return []


def _halving(fmu: Fmu, draw: Draw, run: Outcome, counts: Counter[str]) -> list[str]:
    """Communication steps of half the length, where the method controls its error."""
    tolerance = fmu.value(draw, "tolerance")
    if _method(fmu, draw) not in ("rosenbrock", "rosenbrock_3", "bdf") or tolerance > 1e-3:
        return []
    halved = fmu.run(draw, 2 * STEPS, draw.h / 2)
    if halved.end != "complete" or halved.said:
        return []
    counts["audits: step halving"] += 1
    moved = max(float(np.max(np.abs(shape(row) - shape(run.rows[0])))) for row in run.rows)
    off = float(np.max(np.abs(shape(halved.rows[-1]) - shape(run.rows[-1]))))
    length = fmu.value(draw, "body.length")
    if off > HALVING * tolerance * max(moved, 1e-3 * length):
        return [f"steps of half the length: {off / length:.2g} of the length apart, moved by {moved / length:.2g}"]
    return []


class Linearisation:
    """The equations of motion about a shape at rest, by the exact derivatives of the model exchange instance."""

    def __init__(self, model: FMU2Model, fmu: Fmu, draw: Draw) -> None:
        self.model, self.fmu = model, fmu
        self.names = [row.derivative.name for row in model.derivative_rows]
        loads = {name: draw.inputs[name] for name in draw.inputs}
        cold = {name: fmu.value(draw, "T_0") if name.startswith("T[") else 0.0 for name in loads}
        self._start(draw, cold, 0.0)
        stiffness, _ = self._slopes({})
        self.frequency = math.sqrt(max(float(np.min(np.linalg.eigvals(-stiffness).real)), 0.0))  # lowest, unloaded
        if self.frequency > 0.0:
            self._start(draw, loads, 2.0 / self.frequency)

    def _start(self, draw: Draw, inputs: dict[str, float], retardation: float) -> None:
        model = self.model
        model.reset()
        retardation = min(retardation, 1e6)
        values = draw.changed(dynamic=1, method=2, start_at_equilibrium=0).values
        self.fmu.write(model, {**values, "body.retardation": retardation})
        model.enterInitializationMode()
        self.fmu.write(model, inputs)
        model.exitInitializationMode()
        model.newDiscreteStates()
        model.enterContinuousTimeMode()
        ones = np.linspace(1e-3, 2e-3, len(self.names))
        model.put(ones)
        used = model.states() != 0.0
        model.put(np.zeros(len(self.names)))
        self.position = [k for k, name in enumerate(self.names) if used[k] and name.startswith("strain[")]
        self.velocity = [self.names.index(self.names[k].replace("strain[", "strain_rate[")) for k in self.position]

    def _slopes(self, strains: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        states = np.zeros(len(self.names))
        for name, value in strains.items():
            states[self.names.index(name)] = value
        self.model.put(states)
        rates = [self.model.rate_references[k] for k in self.velocity]
        known = lambda k: [self.model.state_references[k]]  # noqa: E731
        columns = [
            np.array([self.model.getDirectionalDerivative(rates, known(k), [1.0]) for k in group]).T
            for group in (self.position, self.velocity)
        ]
        return columns[0], columns[1]

    def problems(self, strains: dict[str, float]) -> list[str]:
        """What is wrong with strains as a stable equilibrium."""
        stiffness, damping = self._slopes(strains)
        size = len(self.position)
        block = np.block([[np.zeros((size, size)), np.eye(size)], [stiffness, damping]])
        growth = float(np.linalg.eigvals(block).real.max()) / self.frequency
        moved = float(np.abs(np.linalg.lstsq(stiffness, self.model.rates()[self.velocity], rcond=1e-9)[0]).max())
        wrong = []
        if growth > GROWTH:
            wrong.append(f"unstable: a deviation grows at {growth:.3g} of the lowest frequency")
        if moved > MOVED:
            wrong.append(f"no equilibrium: a strain is {moved:.2g} away")
        return wrong


def _rest(fmu: Fmu, draw: Draw, run: Outcome, counts: Counter[str]) -> list[str]:
    """Whether a shape at rest is a stable equilibrium of the moving rod, and where damped motion ends."""
    with FMU2Model(fmu.path) as model:
        try:
            linear = Linearisation(model, fmu, draw)
            if not linear.frequency > 0.0:
                return []
            wrong = linear.problems(run.states)
        except (FMICallException, np.linalg.LinAlgError):
            counts["audits: no linearisation"] += 1
            return []
    counts["audits: stable equilibrium"] += 1
    damped = draw.changed(dynamic=1, method=1, start_at_equilibrium=0)
    damped.values["body.retardation"] = min(2.0 / linear.frequency, 1e6)
    motion = fmu.run(damped, [h / linear.frequency for h in DAMPED_STEPS])
    length = fmu.value(draw, "body.length")
    is_at_rest = (
        motion.end == "complete" and np.max(np.abs(shape(motion.rows[-1]) - shape(motion.rows[-2]))) <= AT_REST * length
    )
    if not is_at_rest:
        counts["audits: damped motion without an end"] += 1
        return wrong
    if motion.said:  # on its way it left what its order resolves, and may end at what the polynomials alone have
        counts["audits: damped motion with a warning"] += 1
        return wrong
    off = float(np.max(np.abs(shape(motion.rows[-1]) - shape(run.rows[-1])))) / length
    counts["audits: end of damped motion"] += 1
    if off > APART:
        wrong.append(f"damped motion ends {off:.2g} of the length away")
    return wrong


def audit_heat(fmu: Fmu, draw: Draw, run: Outcome, counts: Counter[str]) -> list[str]:
    """What is wrong with temperatures."""
    wrong = []
    ambient, T_0, tolerance = draw.inputs["T_ambient"], fmu.value(draw, "T_0"), fmu.value(draw, "tolerance")
    last, temperatures = run.rows[-1], [f"T[{k}]" for k in (1, 2, 3)]
    size = max(abs(row[name] - T_0) for row in run.rows for name in temperatures)
    slack = tolerance * max(size, abs(ambient - T_0)) + last["reduction.bound"] + 1e-6
    counts["audits: second law"] += 1
    if min(last[name] for name in temperatures) < min(T_0, ambient) - slack:
        wrong.append("a TCA is colder than everything around it ever was")
    if last["T_max"] < max(last[name] for name in temperatures) - slack:
        wrong.append("T_max is below a TCA's mean")

    def apart(other: Outcome) -> float:
        return max(abs(other.rows[-1][name] - last[name]) for name in temperatures)

    if fmu.value(draw, "level") != 3:
        full = fmu.run(draw.changed(level=3))
        if full.end == "complete" and not full.said:
            counts["audits: bound of the reduction"] += 1
            if apart(full) > 3.0 * slack:
                wrong.append(f"the full mesh: {apart(full):.2g} K apart, bound {last['reduction.bound']:.2g} K")
    if fmu.value(draw, "level") != 1 and tolerance > 1e-5:
        tight = fmu.run(draw.changed(tolerance=tolerance / 10.0))
        if tight.end == "complete" and not tight.said:
            counts["audits: tighter tolerance"] += 1
            if apart(tight) > 10.0 * slack:
                wrong.append(f"a tenth of the tolerance: {apart(tight):.2g} K apart")
    if fmu.value(draw, "convection") != 1:
        return wrong
    halved = fmu.run(draw, 2 * STEPS, draw.h / 2)
    if halved.end == "complete":
        counts["audits: step halving"] += 1
        if apart(halved) > slack:
            wrong.append(f"steps of half the length: {apart(halved):.2g} K apart")
    if not any(fmu.value(draw, f"tca.{name}") for name in ("alpha_T", "beta")):
        wrong += _steady(fmu, draw, counts)
    return wrong


def _steady(fmu: Fmu, draw: Draw, counts: Counter[str]) -> list[str]:
    """The steady mean temperature of the surface, which the power fixes."""
    value = lambda name: fmu.value(draw, name)  # noqa: E731
    film = 2.0 * math.pi * value("body.radius") * value("body.length") * value("h")
    slowest = (
        value("body.radius")
        * max(value("body.rho_c"), value("tca.rho_c"))
        * (1.0 / value("h") + value("body.radius") / min(value("body.k"), value("tca.k")))
    )
    steady = fmu.run(draw, 1, min(1e3 * slowest, 1e30))
    if steady.end != "complete":
        return []
    counts["audits: steady state"] += 1
    exact = draw.inputs["T_ambient"] + sum(steady.rows[-1][f"P[{k}]"] for k in (1, 2, 3)) / film
    found = steady.rows[-1]["T_surface"]
    if abs(found - exact) > 1e-6 * abs(exact - value("T_0")) + 1e-7:
        return [f"the surface ends at {found:.8g} K instead of {exact:.8g} K"]
    return []
