"""Hosts that cannot be installed here, imitated call by call from their sources: what OMSimulator, the FMU Compliance
Checker and Simulink importers ask of an FMU that a careful host would not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import tca_cosim as tca
from fmu_host import ROOT, SUBJECTS, FMU2Host, Subject

EACH = pytest.mark.parametrize("subject", SUBJECTS, ids=lambda subject: subject.name)
VOLTS = {"V[1]": 0.0, "V[2]": 1.5, "V[3]": 3.0}
HEAT = [f"T[{k}]" for k in (1, 2, 3)]
TIP = [f"tip.p[{k}]" for k in (1, 2, 3)]
STOP = 4.0  # s
TOLERANCE = 1e-6


@contextmanager
def talkative(name: str) -> Iterator[FMU2Host]:
    """Visible and logging everything, as OMSimulator instantiates FMUs."""
    with FMU2Host(ROOT / "fmus" / f"{name}.fmu") as fmu:
        fmu.fmi2FreeInstance(fmu.component)
        fmu.instantiate(visible=True, callbacks=fmu.callbacks, loggingOn=True)
        yield fmu


def everything(fmu: FMU2Host) -> list[float]:
    """All variables, each by the function for its type, one call per variable."""
    get = {"Real": fmu.getReal, "Boolean": fmu.getBoolean, "Integer": fmu.getInteger, "Enumeration": fmu.getInteger}
    return [get[variable.type]([variable.valueReference])[0] for variable in fmu.description.modelVariables]


def set_starts(fmu: FMU2Host) -> None:
    """Every start value that the XML gives."""
    for variable in fmu.description.modelVariables:
        references, start = [variable.valueReference], variable.start
        if start is None:
            continue
        if variable.type == "Real":
            fmu.setReal(references, [float(start)])
        elif variable.type == "Boolean":
            fmu.setBoolean(references, [start == "true"])
        else:
            fmu.setInteger(references, [int(start)])


def omsimulator(h: float, extrapolate: bool, thermal: FMU2Host, rod: FMU2Host) -> tuple[np.ndarray, np.ndarray]:
    """Its fixed-step master: all step at once, then values are handed on; with --inputExtrapolation their rates too. No
    stop time, one tolerance for all, everything read for the result file. Returns T [K] and tip [m] of every step."""
    rod.setBoolean(rod.references(["dynamic"]), [False])
    rod.setInteger(rod.references(["closure"]), [1])
    thermal.setReal(thermal.references(list(VOLTS)), list(VOLTS.values()))
    hot, heated, tip = thermal.references(HEAT), rod.references(HEAT), rod.references(TIP)
    for fmu in (thermal, rod):
        fmu.setupExperiment(tolerance=TOLERANCE, startTime=0.0)
        fmu.enterInitializationMode()
        everything(fmu)
    rod.setReal(heated, thermal.getReal(hot))
    for fmu in (thermal, rod):
        fmu.exitInitializationMode()
    rows = []
    for k in range(round(STOP / h)):
        rod.setReal(heated, thermal.getReal(hot))
        if extrapolate and k > 0:
            rod.setRealInputDerivatives(heated, [1, 1, 1], thermal.getRealOutputDerivatives(hot, [1, 1, 1]))
        for fmu in (thermal, rod):
            fmu.doStep(k * h, h, True)
            everything(fmu)
        rows.append((*thermal.getReal(hot), *rod.getReal(tip)))
    for fmu in (thermal, rod):
        fmu.terminate()
    table = np.array(rows)
    return table[:, :3], table[:, 3:]


@pytest.mark.parametrize(("extrapolate", "order"), [(False, 1), (True, 2)])
def test_omsimulators_master_agrees_to_its_order(extrapolate: bool, order: int) -> None:
    apart = []
    for h in (0.1, 0.05):
        settings = [f"stop_time={STOP}", f"thermal.tolerance={TOLERANCE}", f"coupling.macro_step={h}"]
        ours = tca.run(tca.read("step", ["rod.closure=inside", *settings]))
        with talkative("thermal") as thermal, talkative("rod") as rod:
            T, tip = omsimulator(h, extrapolate, thermal, rod)
            for fmu in (thermal, rod):
                fmu.reset()
            again = omsimulator(h, extrapolate, thermal, rod)
        np.testing.assert_array_equal(again, (T, tip))
        np.testing.assert_allclose(T, ours["thermal.T"].to_numpy()[1:], rtol=0.0, atol=1e-9)
        late = round(1.0 / h)  # heat begins with a square root of time, where a rate says little
        apart.append(np.abs(tip - ours["rod.tip.p"].to_numpy()[1:])[late:].max())
    assert np.log2(apart[0] / apart[1]) == pytest.approx(order, abs=0.1)


@EACH
def test_the_compliance_checker_sees_no_complaint(subject: Subject) -> None:
    """All categories of the log, no stop time, every variable read wherever that is allowed, a shorter last step."""
    with FMU2Host(subject.path) as fmu:
        fmu.setDebugLogging(True, [category.name for category in fmu.description.logCategories])
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        assert np.isfinite(everything(fmu)).all()
        fmu.exitInitializationMode()
        h = subject.step
        for t, step in ((0.0, h), (h, h), (2.0 * h, 0.3 * h)):
            fmu.step(t, step)
            assert np.isfinite(everything(fmu)).all()
        fmu.terminate()
        assert np.isfinite(everything(fmu)).all()
        assert fmu.worst == 0, fmu.messages


@EACH
def test_setting_every_start_value_changes_nothing(subject: Subject) -> None:
    """As importers into Simulink do, and once more in initialization mode."""

    def outputs(prepare: Callable[[FMU2Host], None]) -> list[float]:
        with FMU2Host(subject.path) as fmu:
            prepare(fmu)
            fmu.setupExperiment(startTime=0.0, stopTime=1.0)
            fmu.enterInitializationMode()
            prepare(fmu)
            fmu.exitInitializationMode()
            fmu.apply(subject.inputs)
            fmu.step(0.0, subject.step)
            return fmu.read()

    assert outputs(set_starts) == outputs(lambda fmu: None)


@pytest.mark.parametrize(
    "clock",
    [lambda k, h: k * h, lambda k, h: sum([h] * k), lambda k, h: k * round(h * 1e9) * 1e-9],
    ids=["product", "sum", "nanoseconds"],
)
def test_clocks_of_hosts_agree_with_ours(clock: Callable[[int, float], float]) -> None:
    """Steps of a third of a tenth; libcosim counts nanoseconds. The stop time is the last of them, to its rounding."""
    h, steps = 0.1 / 3.0, 900
    with FMU2Host(ROOT / "fmus" / "thermal.fmu") as fmu:
        fmu.setupExperiment(startTime=0.0, stopTime=steps * h)
        fmu.start()
        for k in range(steps):
            fmu.step(clock(k, h), clock(k + 1, h) - clock(k, h))
        assert fmu.worst == 0
