"""Properties of scenes for random input (hypothesis): signals, units, overrides, SSP round trips; and files with random
faults, which are read or refused by SceneError, never anything else.

The seeded samples here are small; by hand: TCA_COSIM_FUZZ=100000 pytest tests/test_scene_properties.py -k fault"""

from __future__ import annotations

import math
import os
import random
import re
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import make_fmu, real
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tca_cosim.cosim.signals import Constant, Ramps, Signal, Sine, Steps
from tca_cosim.fmi.archive import Archive, cached_archive
from tca_cosim.scene import read, ssp_writer
from tca_cosim.scene.unit_conversion import Unit, conversion

SAMPLES = int(os.environ.get("TCA_COSIM_FUZZ", "150"))
few = settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
fewer = settings(few, max_examples=6)
numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
lengths = st.floats(1e-3, 1e3)


@st.composite
def courses(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    steps = draw(st.lists(st.floats(1e-3, 10.0), min_size=1, max_size=8))
    times = np.cumsum([draw(st.floats(0.0, 5.0)), *steps]).tolist()
    return times, draw(st.lists(numbers, min_size=len(times), max_size=len(times)))


def value(signal: Signal, t: float) -> float:
    return signal.polynomial(t, 1e-9)[0]


@few
@given(courses(), st.floats(0.0, 50.0))
def test_ramps_are_straight_lines(course: tuple[list[float], list[float]], t: float) -> None:
    times, values = course
    expected = np.interp(t, times, values)
    assert value(Ramps(tuple(times), tuple(values)), t) == pytest.approx(expected, rel=1e-6, abs=1e-2)


@few
@given(courses(), st.integers(0, 7))
def test_steps_hold_from_their_time_on(course: tuple[list[float], list[float]], k: int) -> None:
    times, values = course
    k %= len(times)
    signal = Steps(tuple(times), tuple(values))
    assert value(signal, times[k]) == values[k]
    assert value(signal, times[k] - 1e-6) == values[max(k - 1, 0)]


@few
@given(numbers, numbers, st.floats(1e-2, 1e3), st.floats(-10.0, 10.0), st.floats(0.0, 100.0))
def test_polynomials_of_sines_meet_both_ends(mean: float, size: float, period: float, phase: float, t: float) -> None:
    h = 0.05 * period
    c = Sine(mean, size, period, phase).polynomial(t, h)
    for s in (0.0, h):
        exact = mean + size * math.sin(2.0 * math.pi * (t + s) / period + phase)
        actual = c[0] + c[1] * s + c[2] * s**2 / 2.0 + c[3] * s**3 / 6.0
        assert actual == pytest.approx(exact, abs=1e-6 * (abs(mean) + abs(size) + 1.0))


@few
@given(lengths, st.floats(-500.0, 500.0), lengths, st.floats(-500.0, 500.0), numbers)
def test_conversions_are_inverse_to_each_other(fa: float, oa: float, fb: float, ob: float, x: float) -> None:
    a, b = Unit("a", {"K": 1}, fa, oa), Unit("b", {"K": 1}, fb, ob)
    (f, o), (g, p) = conversion(a, b), conversion(b, a)
    assert g * (f * x + o) + p == pytest.approx(x, rel=1e-9, abs=1e-6 * (1.0 + abs(o * g)))
    assert conversion(a, b, difference=True) == (f, 0.0) or (fa, oa) == (fb, ob)
    base = fa * x + oa
    assert fb * (f * x + o) + ob == pytest.approx(base, rel=1e-9, abs=1e-6 * (1.0 + abs(base) + abs(ob)))


@pytest.fixture(scope="module")
def volts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    units = (
        '<Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit>'
        '<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>'
    )
    variables = [
        real("V", "input", start=0, unit="V"),
        real("T", "input", start=20, unit="degC"),
        real("u", "input", start=0),
        real("y"),
    ]
    return make_fmu(tmp_path_factory.mktemp("volts") / "a.fmu", variables, units=units)


def member(file: Path, **values: object) -> tca.Scene:
    described = {"stop_time": 1.0, "connections": [], "fmus": {"a": str(file)}, "a": values}
    return read(described, (), cached_archive)


@few
@given(x=numbers)
def test_texts_with_units_are_numbers(volts: Path, x: float) -> None:
    scene = member(volts, V=f"{x!r} mV", T=f"{x!r} K", u=f"{x!r}").member("a")
    assert scene.signals["V"].value == pytest.approx(1e-3 * x, rel=1e-12)
    assert scene.signals["T"].value == pytest.approx(x - 273.15, rel=1e-12, abs=1e-9)
    assert scene.signals["u"] == Constant(x)


def test_amplitudes_are_differences_and_offsets_are_not(volts: Path) -> None:
    """A sine of 5 degC around 20 degC goes from 15 to 25 degC; 5 K of amplitude are the same."""
    for amplitude, offset in (("5 degC", "20 degC"), ("5 K", "293.15 K"), (5.0, 20.0)):
        table = {"sine": {"offset": offset, "amplitude": amplitude, "period": "2 s"}}
        assert member(volts, T=table).member("a").signals["T"] == Sine(pytest.approx(20.0), pytest.approx(5.0), 2.0)


@few
@given(
    numbers,
    st.integers(0, 7),
    st.booleans(),
    st.sampled_from(["inside", "exchanged"]),
    st.lists(numbers, min_size=3, max_size=3),
)
def test_overrides_as_texts_and_as_tables_are_the_same(
    x: float, order: int, dynamic: bool, closure: str, voltages: list[float]
) -> None:
    table = {"thermal.V": voltages, "rod.order": order, "rod.dynamic": dynamic, "rod.gravity[1]": x}
    texts = [f"thermal.V={voltages!r}", f"rod.order={order}", f"rod.dynamic={str(dynamic).lower()}"]
    one = read("step", {**table, "rod.closure": closure}, cached_archive)
    other = read("step", [*texts, f"rod.closure={closure}", f"rod.gravity[1]={x!r}"], cached_archive)
    for a, b in zip(one.members, other.members, strict=True):
        assert (a.parameters, a.signals) == (b.parameters, b.signals)


@fewer
@given(
    st.lists(st.floats(0.0, 3.0), min_size=3, max_size=3),
    st.floats(0.02, 0.2),
    st.floats(1e4, 1e6),
    st.booleans(),
    st.floats(1e-3, 1.0),
)
def test_exported_systems_come_back(
    tmp_path_factory: pytest.TempPathFactory, voltages: list[float], length: float, E: float, dynamic: bool, step: float
) -> None:
    overrides = (
        "rod.closure=inside",
        f"thermal.V={voltages!r}",
        f"body.length={length!r}",
        f"rod.body.E={E!r}",
        f"rod.dynamic={str(dynamic).lower()}",
        f"coupling.macro_step={step!r}",
    )
    path = tmp_path_factory.mktemp("ssp") / "s.ssp"
    ssp_writer.write(path, "step", overrides)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        back = read(path, (), cached_archive)
    scene = read("step", overrides, cached_archive)
    assert (back.stop_time, back.coupling.macro_step) == (scene.stop_time, step)
    assert [str(c) for c in back.connections] == [str(c) for c in scene.connections]
    for a, b in zip(back.members, scene.members, strict=True):
        assert a.signals == {**a.signals, **b.signals}
        for name, variable in b.archive.variables.items():
            if variable.causality == "parameter":
                assert a.value(name) == b.value(name)


# -- files with random faults


WORDS = ["", *"=[]{}'\n\x00ü.", '"', "nan", "inf", "-1", "1e999", "true", "[[]]", "{}", "->"]
TOML = """title = "A"
stop_time = "2 s"
connections = ["a.y -> b.V", { from = "a.y", to = "b.u", factor = 2.0 }]
[fmus]
a = "a.fmu"
b = "a.fmu"
[a]
V = { ramps = [["0 s", "0 V"], ["1 s", "10 mV"]] }
T = "20 degC"
u = { sine = { amplitude = 1, period = "1 s" } }
[b]
T = { pulses = { high = 1, width = 0.1, period = 1, count = 3 } }
[coupling]
macro_step = 0.5
method = "iqn"
[fidelity]
quantities = ["a.y"]
"""
SSD = """<?xml version="1.0"?>
<ssd:SystemStructureDescription version="2.0" name="s"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
 xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
 xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
 <ssd:System name="root"><ssd:Connectors><ssd:Connector name="in" kind="input"><ssc:Real unit="mV"/></ssd:Connector>
 </ssd:Connectors><ssd:ParameterBindings><ssd:ParameterBinding prefix="a."><ssd:ParameterValues>
 <ssv:ParameterSet version="2.0" name="p"><ssv:Parameters><ssv:Parameter name="T"><ssv:Real value="20" unit="degC"/>
 </ssv:Parameter></ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues><ssd:ParameterMapping><ssm:ParameterMapping
 version="2.0"><ssm:MappingEntry source="a.T" target="a.T"><ssc:LinearTransformation factor="2"/></ssm:MappingEntry>
 </ssm:ParameterMapping></ssd:ParameterMapping></ssd:ParameterBinding></ssd:ParameterBindings><ssd:Elements>
 <ssd:Component name="a" source="a.fmu"><ssd:Connectors><ssd:Connector name="y" kind="output"/></ssd:Connectors>
 </ssd:Component><ssd:System name="inner"><ssd:Connectors><ssd:Connector name="u" kind="input"/></ssd:Connectors>
 <ssd:Elements><ssd:Component name="b" source="a.fmu"/></ssd:Elements><ssd:Connections>
 <ssd:Connection startConnector="u" endElement="b" endConnector="u"/></ssd:Connections></ssd:System></ssd:Elements>
 <ssd:Connections><ssd:Connection startElement="a" startConnector="y" endElement="inner" endConnector="u">
 <ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection><ssd:Connection startConnector="in" endElement="a"
 endConnector="V"/></ssd:Connections></ssd:System><ssd:Units><ssc:Unit name="mV"><ssc:BaseUnit kg="1" m="2" s="-3"
 A="-1" factor="0.001"/></ssc:Unit></ssd:Units><ssd:DefaultExperiment startTime="0" stopTime="1"/>
</ssd:SystemStructureDescription>
"""


def faulty(text: str, chance: random.Random) -> str:
    """A text with some of its tokens replaced, repeated, swapped or left out."""
    for _ in range(chance.randint(1, 4)):
        tokens = re.findall(r'\w+|"[^"]*"|\s+|.', text)
        a, b = chance.randrange(len(tokens)), chance.randrange(len(tokens))
        kind = chance.randrange(5)
        if kind == 0:
            tokens[a] = chance.choice(WORDS)
        elif kind == 1:
            tokens[a] = tokens[b]
        elif kind == 2:
            tokens[a], tokens[b] = tokens[b], tokens[a]
        elif kind == 3:
            del tokens[min(a, b) : min(a, b) + chance.randint(1, 12)]
        else:
            tokens.insert(a, tokens[b] * chance.randint(1, 3))
        text = "".join(tokens) or " "
    return text


def read_or_refused(write: Callable[[str], Path], text: str, open_fmu: Callable[[Path], Archive]) -> bool:
    """Whether a faulty file is read; anything but SceneError fails the test."""
    path = write(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            repr(read(path, (), open_fmu))
        except tca.SceneError as error:
            assert len(str(error)) < 3000  # noqa: PT017
            return False
    return True


def test_scene_files_with_faults_are_read_or_refused(volts: Path, tmp_path: Path) -> None:
    (tmp_path / "a.fmu").write_bytes(volts.read_bytes())
    chance, path = random.Random(1), tmp_path / "s.toml"

    def write(text: str) -> Path:
        path.write_text(text, encoding="utf-8", errors="replace")
        return path

    assert read_or_refused(write, TOML, cached_archive)
    outcomes = [read_or_refused(write, faulty(TOML, chance), cached_archive) for _ in range(SAMPLES)]
    assert 0 < sum(outcomes) < len(outcomes)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.fmu", "s.toml"]


def test_archives_with_faults_are_read_or_refused(volts: Path, tmp_path: Path) -> None:
    chance, path = random.Random(2), tmp_path / "s.ssp"
    known: dict[str, Archive] = {}

    def open_fmu(file: Path) -> Archive:  # one FMU, whichever entry is named
        return known.setdefault("a", Archive(volts))

    def write(text: str) -> Path:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("SystemStructure.ssd", text.encode("utf-8", "replace"))
            archive.writestr("a.fmu", b"")
        return path

    assert read_or_refused(write, SSD, open_fmu)
    outcomes = [read_or_refused(write, faulty(SSD, chance), open_fmu) for _ in range(SAMPLES)]
    assert 0 < sum(outcomes) < len(outcomes)
    assert [file.name for file in tmp_path.iterdir()] == ["s.ssp"]
