"""Scenes: what is read, and that every slip is refused with file, key, value and remedy."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import tca_cosim as tca
from tca_cosim import scene as scenes
from tca_cosim.cosim.signals import Constant, Impulse, Ramps, Sine, Steps

GOOD = """
stop_time = "30 s"
[thermal]
V = ["0 V", "1.5 V", "3 V"]
[rod]
closure = "exchanged"
dynamic = false
[coupling]
macro_step = "0.1 s"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


WIRED = {"gripper", "fan"}  # have connections of their own, to FMUs written in Python


def test_shipped_scenes_are_read() -> None:
    for name in tca.titles():
        scene = tca.read(name)
        assert scene.title
        if name in WIRED:
            continue
        inside = scene.member("rod").value("closure") == 1  # then the master has no displacements to exchange
        tcas = len(scene.member("rod").archive.vectors["T"])
        assert len(scene.connections) == tcas * (1 if inside else 3 if name == "feedback" else 2)


def test_the_switch_is_an_event() -> None:
    signals = tca.read("switch").member("thermal").signals
    assert signals["V[1]"] == Steps((0.0, 15.0), (3.0, 0.0))
    assert signals["V[1]"].breaks == (15.0,)
    assert signals["V[3]"] == Constant(0.0)


def test_impulses_and_pulses_are_signals() -> None:
    assert tca.read("tap").member("rod").signals["tip_force[1]"] == Impulse(peak=0.02, width=0.02, start=0.05)
    train = tca.read("pulse").member("thermal").signals["V[3]"]
    assert train.times == pytest.approx([k + edge for k in range(10) for edge in (0.0, 0.2)])
    assert train.values == (3.0, 0.0) * 10
    late = tca.read("pulse", ["thermal.V[3]={pulses={low=1,high=3,width=0.2,period=1,count=2,start=0.5}}"])
    assert late.member("thermal").signals["V[3]"] == Steps((0.0, 0.5, 0.7, 1.5, 1.7), (1.0, 3.0, 1.0, 3.0, 1.0))


@pytest.mark.parametrize("name", ["fig3", "literature", "paper_literal", "measured"])
def test_parameter_sets(name: str, tmp_path: Path) -> None:
    """Values of the table of parameter sets, in SI units."""
    scene = tca.read(written(tmp_path, f'parameters = "{name}"' + GOOD))
    thermal, rod = scene.member("thermal"), scene.member("rod")
    expected = {
        "fig3": (0.19, 0.669e6, 0.969e6, 6.9, 6.5e-4),
        "literature": (4.6, 1.092e6, 1.647e6, 5.66, 6.5e-4),
        "paper_literal": (0.19, 0.669e6, 0.969e6, 10.0, 5e-5),
        "measured": (0.19, 0.669e6, 0.969e6, 6.9, 6.5e-4),
    }[name]
    actual = [thermal.value(v) for v in ("tca.k[1]", "body.rho_c", "tca.rho_c[3]", "tca.R[2]")] + [
        rod.value("tca.rho_T")
    ]
    assert actual == pytest.approx(expected)
    if name == "measured":
        assert (rod.value("tca.law"), rod.value("tca.stiffness"), rod.value("tca.stroke")) == (2, 10.0, 1.5e-4)


def test_units_and_signals(tmp_path: Path) -> None:
    text = (
        GOOD
        + """
[rod.body]
length = "35 mm"
[rod.tip_force]
"""
    )
    text = """
stop_time = "0.5 min"
[thermal]
T_ambient = "20 degC"
"V[1]" = { sine = { offset = "1500 mV", amplitude = "1.5 V", period = "30 s", phase = "90 deg" } }
V = 1.0
[rod]
body.length = "35 mm"
tip_force = [{ ramps = [["0 s", "0 N"], ["1 s", "10 mN"]] }, "0 N", 0.0]
T = "300 K"
"""
    scene = tca.read(written(tmp_path, text.replace("V = 1.0\n", "")))
    thermal, rod = scene.member("thermal"), scene.member("rod")
    assert scene.stop_time == 30.0
    assert thermal.signals["T_ambient"] == Constant(pytest.approx(293.15))
    assert thermal.signals["V[1]"] == Sine(1.5, 1.5, 30.0, pytest.approx(1.5707963267948966))
    assert rod.value("body.length") == pytest.approx(0.035)
    assert rod.signals["tip_force[1]"] == Ramps((0.0, 1.0), (0.0, pytest.approx(0.01)))
    assert [c for c in scene.connections if c.target[1].startswith("T[")] == []  # what is set is not wired


def test_wiring_follows_what_acts(tmp_path: Path) -> None:
    def connected(*overrides: str) -> set[str]:
        return {
            f"{c.source[0]}.{c.source[1][:-3]}->{c.target[0]}.{c.target[1][:-3]}"
            for c in tca.read("step", overrides).connections
        }

    assert connected() == {"thermal.T->rod.T", "rod.delta->rod.delta_guess"}
    assert connected("rod.closure=inside") == {"thermal.T->rod.T"}
    assert connected("thermal.tca.beta=0.1") == {
        "thermal.T->rod.T",
        "rod.delta->rod.delta_guess",
        "rod.delta->thermal.delta",
    }


# what is changed in GOOD, its replacement, what the error must say
SLIPS = {
    "unknown section": ("[coupling]", "[copling]", ["copling", "did you mean 'coupling'"]),
    "unknown key": ("macro_step", "makro_step", ["coupling.makro_step", "did you mean 'macro_step'"]),
    "unknown top key": ("stop_time", "stop", ["stop", "did you mean 'stop_time'"]),
    "unknown variable": ("closure", "closur", ["rod.closur", "did you mean 'closure'"]),
    "unknown item": ('"exchanged"', '"exchange"', ["rod.closure", "did you mean 'exchanged'"]),
    "wrong unit": ('"1.5 V"', '"1.5 mm"', ["thermal.V[2]", "1.5 mm", "'V'"]),
    "unknown unit": ('"1.5 V"', '"1.5 bolt"', ["thermal.V[2]", "bolt"]),
    "not a number": ('"1.5 V"', '"much"', ["thermal.V[2]", "much"]),
    "wrong type": ('"1.5 V"', "true", ["thermal.V[2]", "wrong type"]),
    "nan": ('"1.5 V"', "nan", ["thermal.V[2]", "not finite"]),
    "infinite": ('"1.5 V"', "inf", ["thermal.V[2]", "not finite"]),
    "wrong count": ('"0 V", ', "", ["thermal.V", "2 values for 3"]),
    "boolean as number": ("dynamic = false", "dynamic = 0", ["rod.dynamic", "true, false"]),
    "real as integer": ("dynamic = false", "order = 2.5", ["rod.order", "whole number"]),
    "order out of range": ("dynamic = false", "order = 99", ["rod.order", "99", "0 to 7"]),
    "negative length": ("dynamic = false", 'body.length = "-40 mm"', ["rod.body.length", "-40 mm", "out of range"]),
    "output set": ("dynamic = false", "delta = 1e-3", ["rod.delta[1]", "output"]),
    "no stop": ('stop_time = "30 s"', "", ["stop_time", "missing"]),
    "negative stop": ('"30 s"', '"-1 s"', ["stop_time", "out of range"]),
    "zero step": ('"0.1 s"', "0.0", ["coupling.macro_step", "out of range"]),
    "parameter set": ("[thermal]", 'parameters = "fig4"\n[thermal]', ["fig4", "did you mean 'fig3'"]),
    "signal on a parameter": ("dynamic = false", "order = { steps = [[0, 1]] }", ["rod.order", "whole number"]),
    "unknown signal": (
        '"1.5 V"',
        "{ step = [[0, 1]] }",
        ["thermal.V[2]", "steps, ramps, table"],
    ),
    "signal backwards": ('"1.5 V"', "{ steps = [[1, 1], [0, 2]] }", ["thermal.V[2]", "times must increase"]),
    "sine without period": ('"1.5 V"', "{ sine = { amplitude = 1 } }", ["thermal.V[2]", "without period"]),
    "sine typo": ('"1.5 V"', "{ sine = { amplitude = 1, perod = 2 } }", ["perod", "did you mean 'period'"]),
    "impulse of no width": (
        '"1.5 V"',
        "{ impulse = { peak = 1, width = 0 } }",
        ["thermal.V[2]", "width must be positive"],
    ),
    "impulse before the run": ('"1.5 V"', "{ impulse = { peak = 1, width = 1, start = -1 } }", ["-1", "0 s or later"]),
    "impulse out of range": (
        "dynamic = false",
        "T = { impulse = { peak = -1, width = 1 } }",
        ["rod.T[1]", "out of range"],
    ),
    "half a pulse": (
        '"1.5 V"',
        "{ pulses = { high = 1, width = 1, period = 2, count = 0.5 } }",
        ["thermal.V[2]", "0.5", "count as a whole number"],
    ),
    "overlapping pulses": (
        '"1.5 V"',
        "{ pulses = { high = 1, width = 2, period = 2, count = 2 } }",
        ["thermal.V[2]", "shorter than period"],
    ),
    "unknown connection": (
        "[thermal]",
        'connections = ["thermal.Q -> rod.T"]\n[thermal]',
        ["thermal.Q", "not an output; "],
    ),
    "connection of unlike units": (
        "[thermal]",
        'connections = ["rod.delta -> rod.T"]\n[thermal]',
        ["rod.delta -> rod.T", "units differ: 'm' (m) and 'K' (K)"],
    ),
    "connection of unlike counts": (
        "[thermal]",
        'connections = ["thermal.T -> rod.T[1]"]\n[thermal]',
        ["3 outputs for 1"],
    ),
    "unknown FMU": ("[thermal]", 'connections = ["therml.T -> rod.T"]\n[thermal]', ["did you mean 'thermal'"]),
    "FMU file": (
        "[thermal]",
        '[fmus]\nthermal = "thermal.fmu"\nrod = "rot.fmu"\n[thermal]',
        ["rot.fmu", "did you mean 'rod.fmu'"],
    ),
    "not TOML": ("[thermal]", "[thermal", ["mine.toml", "line"]),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_are_refused(slip: str, tmp_path: Path) -> None:
    old, new, said = SLIPS[slip]
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(tca.SceneError) as caught:
        tca.read(path)
    for text in said:
        assert text in str(caught.value)
    if slip not in ("parameter set", "FMU file"):  # these name the folders looked into instead
        assert "mine.toml" in str(caught.value) or "unknown" in slip


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("bom.toml", b"\xef\xbb\xbf" + GOOD.encode()),
        ("crlf.toml", GOOD.replace("\n", "\r\n").encode()),
        ("UPPER.TOML", GOOD.encode()),
        ("größe 測試/scène one.toml", GOOD.encode()),
    ],
)
def test_files_of_any_editor_and_place_are_read(name: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    assert tca.read(path).stop_time == 30.0
    path.write_bytes(content.replace(b"1.5 V", b"1.5 mm"))
    with pytest.raises(tca.SceneError, match=r":4: thermal\.V\[2\] = '1\.5 mm'"):
        tca.read(path)


def test_the_body_is_given_once_for_both_fmus(tmp_path: Path) -> None:
    text = GOOD.replace(
        "[thermal]", '[body]\nlength = "60 mm"\n[tca]\nazimuth = ["0 deg", "90 deg", "180 deg"]\n[thermal]'
    )
    scene = tca.read(written(tmp_path, text), {"body.radius": "6mm"})
    for name in ("thermal", "rod"):
        member = scene.member(name)
        assert member.value("body.length") == pytest.approx(0.06)
        assert member.value("body.radius") == pytest.approx(0.006)
        assert member.reals("tca.azimuth") == pytest.approx((0.0, 1.5707963267948966, 3.141592653589793))
    with pytest.raises(tca.SceneError, match=r"rod\.body\.length = 0\.07 m, but thermal\.body\.length = 0\.06 m"):
        tca.read(written(tmp_path, text.replace("[rod]", "[rod]\nbody.length = 0.07")))
    with pytest.raises(tca.SceneError, match=r"no FMU has it; did you mean 'tca\.azimuth'"):
        tca.read(written(tmp_path, text.replace("azimuth", "azimut")))


def test_a_slip_is_named_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(tca.SceneError, match=r"mine\.toml:4: thermal\.V\[2\] = '1\.5 mm'"):
        tca.read(written(tmp_path, GOOD.replace("1.5 V", "1.5 mm")))


def test_overrides_are_checked_alike() -> None:
    scene = tca.read("step", ["coupling.macro_step=50 ms", "thermal.V[2]=2 V", "rod.order=2", "stop_time=3"])
    assert (scene.coupling.macro_step, scene.stop_time) == (0.05, 3.0)
    assert scene.member("thermal").signals["V[2]"] == Constant(2.0)
    assert scene.member("rod").value("order") == 2
    for text, said in {
        "rod.ordr=2": "did you mean 'order'",
        "rod.order=99": "0 to 7",
        "rod.order": "key=value",
    }.items():
        with pytest.raises(tca.SceneError, match=said):
            tca.read("step", [text])


def test_overrides_reach_everything(tmp_path: Path) -> None:
    copy = tmp_path / "other.fmu"
    copy.write_bytes(tca.read("step").member("rod").archive.path.read_bytes())
    scene = tca.read("step", [f"fmus.rod={copy}", "thermal.V=1"])
    assert [m.archive.path.name for m in scene.members] == ["thermal.fmu", "other.fmu"]
    assert scene.sources[-1] == ("overrides", f"fmus.rod={copy}\nthermal.V=1")
    for twice in (["rod=3", "rod.order=2"], ["rod=3"]):
        with pytest.raises(tca.SceneError, match="rod"):
            tca.read("step", twice)


def test_an_input_is_fed_once(tmp_path: Path) -> None:
    both = 'connections = ["thermal.T -> rod.T"]' + GOOD.replace("dynamic = false", "T = 300.0")
    with pytest.raises(tca.SceneError, match=r"rod\.T\[1\] is set as well"):
        tca.read(written(tmp_path, both))
    twice = 'connections = ["rod.delta -> rod.delta_guess", "rod.delta -> rod.delta_guess"]' + GOOD
    with pytest.raises(tca.SceneError, match="fed twice"):
        tca.read(written(tmp_path, twice))


def test_shipped_folder_holds_scenes_and_sets() -> None:
    paper, failing = {"step", "switch", "sine"}, {"plain", "explicit"}
    loaded = {"drop", "hang", "tap", "pulse", "load", "push"}
    bodies = {"taper", "serial", "antagonist", "payload"}
    assert set(tca.titles()) == paper | failing | loaded | bodies | WIRED | {"stiff", "long", "jump", "feedback"}
    assert scenes.Coupling().macro_step == 0.1


@pytest.mark.parametrize(("length", "kept"), [(80, "x" * 80), (81, "x" * 80 + "...")])
def test_records_have_long_overrides_by_their_beginning(length: int, kept: str) -> None:
    assert tca.read("step", {"title": "x" * length}).overrides == (f"title={kept}",)


def test_lists_for_another_number_of_tcas_may_be_overridden(tmp_path: Path) -> None:
    file = tmp_path / "three.toml"
    file.write_text('stop_time = 1\n[tca]\nazimuth = ["0 deg", "120 deg", "240 deg"]\n[thermal]\nV = [0, 1, 2]\n')
    four = {"body.tcas": 4, "tca.azimuth": ["0 deg", "80 deg", "180 deg", "260 deg"], "thermal.V": [3, 0, 0, 1]}
    scene = tca.read(file, four)
    angles = [math.radians(angle) for angle in (0, 80, 180, 260)]
    assert scene.member("rod").reals("tca.azimuth") == pytest.approx(angles)
    with pytest.raises(tca.SceneError, match=r"three\.toml:5: thermal\.V = .*: 3 values for 4 elements of V"):
        tca.read(file, {name: value for name, value in four.items() if name != "thermal.V"})
