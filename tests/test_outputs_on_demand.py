"""Outputs are calculated where a host reads them: any choice of them, in any order of calls, has the bits of all
read at once from the same state by another instance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_host import FMU2Host, FMU2Model
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.fmi.configuration import Configuration, configured_fmu

MEASURED = {f"tca.law[{i}]": "measured" for i in (1, 2, 3)}
SLACK = {**MEASURED, **{f"tca.stiffness[{i}]": 0.0 for i in (1, 2, 3)}}
UNDAMPED = {"body.retardation": 0.0}
LOOSE = {"tolerance": 1e-2}  # steps cross the communication points
ROD = {
    "dynamic": LOOSE,
    "undamped": {**UNDAMPED, **LOOSE},
    "undamped, slack TCAs": {**UNDAMPED, **SLACK, **LOOSE},
    "planar, slack TCAs": {**SLACK, **LOOSE, "planar": True},
    "planar": {**LOOSE, "planar": True},
    "exchanged": {**LOOSE, "closure": "exchanged"},
    "static": {"dynamic": False},
    "static, exchanged": {"dynamic": False, "closure": "exchanged"},
    "static, planar, slack TCAs": {"dynamic": False, "planar": True, **SLACK},
    "rosenbrock_3": {**LOOSE, "method": "rosenbrock_3"},
    "midpoint": {"method": "midpoint"},
    "bdf": {**LOOSE, "method": "bdf"},
    "grid": {"method": "pade_euler", "grid_points": 9},
}
OTHERS = {
    "segments": Configuration(tcas=2, segments=2, ports=True, starts=LOOSE),
    "planar segments": Configuration(tcas=2, segments=2, starts={**LOOSE, "planar": True}),
    "static segments": Configuration(tcas=2, segments=2, ports=True, starts={"dynamic": False}),
    "tip body": Configuration(starts={**LOOSE, **UNDAMPED, "tip_body.mass": 2e-3}),
    "bonded": Configuration(starts={**LOOSE, "tca.contact": "bonded"}),
    "tethered": Configuration(starts={"dynamic": False, "tca.ends": "tethered"}),
    "creep": Configuration(
        creep=True,
        starts={"dynamic": False, **MEASURED, **{f"tca.creep_compliance[{i}]": 0.02 for i in (1, 2, 3)}},
    ),
}
CASES = {name: Configuration(starts=starts) for name, starts in ROD.items()} | OTHERS
INPUTS = {"T[1]": (295.0, 320.0), "T[2]": (295.0, 320.0), "gravity[1]": (-3.0, 3.0), "tip_force[1]": (-2e-3, 2e-3)}
CALLS = 60


def fmu_of(case: str) -> Path:
    return configured_fmu(Archive(find_fmu("rod.fmu")), CASES[case])


class Twins:
    """An instance that is read in parts, and one that restores its state and reads everything."""

    def __init__(self, kind: Any, path: Path, rng: np.random.Generator) -> None:
        self.fmu, self.whole, self.rng = kind(path), kind(path), rng
        self.names = np.array(self.fmu.outputs)
        self.saved: list[tuple[Any, float]] = []
        self.restart()

    def __enter__(self) -> Twins:
        return self

    def __exit__(self, *_: object) -> None:
        for each in (self.fmu, self.whole):
            each.__exit__()

    def restart(self) -> None:
        self.t = 0.0
        self.fmu.start()

    def compare(self, names: np.ndarray) -> None:
        """Read these outputs, where that is possible, and all of them from the same state."""
        state = self.fmu.getFMUstate()
        copy = self.whole.deSerializeFMUstate(self.fmu.serializeFMUstate(state))
        self.whole.setFMUstate(copy)
        self.whole.freeFMUstate(copy)
        self.fmu.freeFMUstate(state)
        everything = dict(zip(self.fmu.outputs, self.whole.read(), strict=True))
        read = self.fmu.getReal(self.fmu.references(names.tolist()))
        assert np.array(read).tobytes() == np.array([everything[name] for name in names]).tobytes(), names

    def read(self) -> None:
        for _ in range(self.rng.integers(1, 4)):
            self.compare(self.rng.choice(self.names, self.rng.integers(1, 4), replace=False))

    def write(self) -> None:
        for name, (least, most) in INPUTS.items():
            if self.rng.random() < 0.5:
                self.fmu.write(name, self.rng.uniform(least, most))

    def save(self) -> None:
        self.saved.append((self.fmu.getFMUstate(), self.t))

    def restore(self) -> None:
        if self.saved:
            state, self.t = self.saved[self.rng.integers(len(self.saved))]
            self.fmu.setFMUstate(state)

    def reset(self) -> None:
        self.fmu.reset()
        self.restart()

    def retune(self) -> None:
        self.fmu.write("T_0", self.rng.uniform(297.0, 299.0))

    def differentiate(self) -> None:
        unknown, known = self.fmu.references([str(self.rng.choice(self.names))]), self.fmu.references(["gravity[1]"])
        self.fmu.getDirectionalDerivative(unknown, known, [1.0])


class SteppedTwins(Twins):
    """Co-simulation."""

    def step(self) -> None:
        if self.rng.random() < 0.3:
            self.fmu.setRealInputDerivatives(self.fmu.references(["T[1]"]), [1], [self.rng.uniform(-50.0, 50.0)])
        h = float(self.rng.choice([1e-3, 5e-3, 2e-2]))
        self.fmu.step(self.t, h)
        self.t += h

    def read_rates(self) -> None:
        if self.t > 0.0:
            self.fmu.getRealOutputDerivatives(self.fmu.references(["delta[1]"]), [1])


class IntegratedTwins(Twins):
    """Model exchange."""

    def move(self) -> None:
        x = self.fmu.states()
        self.fmu.put(x + self.fmu.used * self.rng.uniform(-1e-3, 1e-3, x.size))

    def read_derivatives(self) -> None:
        self.fmu.rates()

    def pass_time(self) -> None:
        self.t += 1e-3
        self.fmu.setTime(self.t)

    def complete_step(self) -> None:
        self.fmu.completedIntegratorStep()


def walk(twins: Any, rng: np.random.Generator, moves: list[str]) -> None:
    """Make calls in a random order."""
    common = ["read", "read", "write", "save", "restore", "differentiate"]
    for call in rng.choice(common + moves, CALLS):
        getattr(twins, call)()
    twins.reset()
    twins.compare(twins.names)


@pytest.mark.parametrize("case", CASES)
def test_any_order_of_calls_gives_the_bits_of_all_outputs(case: str) -> None:
    rng = np.random.default_rng(len(case))
    with SteppedTwins(FMU2Host, fmu_of(case), rng) as twins:
        walk(twins, rng, ["step", "step", "step", "read_rates", "reset", "retune"])


@pytest.mark.parametrize("case", ["dynamic", "undamped, slack TCAs", "planar", "exchanged"])
def test_hosts_that_integrate_get_the_bits_of_all_outputs(case: str) -> None:
    rng = np.random.default_rng(len(case))
    with IntegratedTwins(FMU2Model, fmu_of(case), rng) as twins:
        walk(twins, rng, ["move", "move", "read_derivatives", "pass_time", "complete_step"])


@pytest.mark.parametrize("case", ["undamped", "static", "segments"])
def test_instances_do_not_share_what_they_have_calculated(case: str) -> None:
    rng = np.random.default_rng(7)
    path = fmu_of(case)
    with SteppedTwins(FMU2Host, path, rng) as one, SteppedTwins(FMU2Host, path, rng) as other:
        for _ in range(8):
            for each in (one, other):
                each.write()
                each.step()
            one.compare(one.names[:3])
            other.compare(other.names[-3:])
            one.compare(one.names[-3:])
