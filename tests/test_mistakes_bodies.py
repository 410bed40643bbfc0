"""Typical mistakes in describing bodies, voltages from files and what design commands need: as in test_mistakes, each
is one message with place, key, value and remedy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from command_line import call
from tca_cosim.cli import explain, realtime
from test_mistakes import set_in

SEGMENTS = """stop_time = "0.2 s"
[body]
segments = 2
[rod]
dynamic = false
"""


def segments(*overrides: str) -> list[str]:
    return ["run", "segments.toml", *(part for override in overrides for part in ("--set", override))]


def volts(content: str) -> list[str]:
    return set_in(f"thermal.V={{{content}}}")


ALL = "columns=['V1', 'V1', 'V1']"
# what is typed, what the message has, and what is typed with its remedy applied; None: nothing to apply
MISTAKES: dict[str, tuple[Sequence[str], Sequence[str], Sequence[str] | None]] = {
    "too many TCAs": (set_in("body.tcas=13"), ["body.tcas = 13", "whole number from 1 to 12"], None),
    "half a TCA": (set_in("body.tcas=2.5"), ["body.tcas = 2.5", "whole number from 1 to 12"], None),
    "too many segments": (set_in("body.segments=7"), ["body.segments = 7", "1 to 6"], None),
    "size misspelt": (set_in("body.segment=2"), ["did you mean 'body.segments'"], set_in("body.segments=2")),
    "span beyond the body": (
        segments("rod.tca.first_segment=3"),
        ["rod.tca.first_segment[1] = 3", "allowed: 1 to 2"],
        segments("rod.tca.first_segment=2", "thermal.body.length=20 mm"),
    ),
    "span backwards": (
        segments("rod.tca.first_segment=[2, 1, 1]", "rod.tca.last_segment=[1, 2, 2]"),
        ["rod.tca.first_segment[1] = 2", "rod.tca.last_segment[1] = 1", "first <= last"],
        None,
    ),
    "segment that there is not": (
        segments("rod.segment.E[3]=40 kPa"),
        ["no such element", "segment.E[1] to segment.E[2]"],
        segments("rod.segment.E[2]=40 kPa"),
    ),
    "list without quotes": (
        segments("rod.segment.E=[40 kPa, 50 kPa]"),
        ["put its texts in quotes: ['40 kPa', '50 kPa']"],
        segments("rod.segment.E=['40 kPa', '50 kPa']"),
    ),
    "payload misspelt": (
        set_in("rod.tip_body.mas=2 g"),
        ["did you mean 'tip_body.mass'"],
        set_in("rod.tip_body.mass=2 g"),
    ),
    "payload negative": (set_in("rod.tip_body.mass=-2 g"), ["-2 g", "allowed: 0 to"], None),
    "convection for the reduced level": (
        set_in("thermal.convection=free"),
        ["level = reduced", "choose level = full or lumped"],
        set_in("thermal.convection=free", "thermal.level=lumped", "thermal.tolerance=0.1"),
    ),
    "bonded and tethered": (
        set_in("rod.tca.contact=bonded", "rod.tca.ends=tethered"),
        ["tca.contact = bonded and tca.ends = tethered", "set tca.contact = sliding or tca.ends = free"],
        set_in("rod.tca.contact=sliding", "rod.tca.ends=tethered"),
    ),
    "column missing": (
        volts("file='data.csv', columns=['V1', 'V2', 'V1']"),
        ["thermal.V[2]", "column = 'V2'", "no such column in data.csv", "allowed: V1, t"],
        volts(f"file='data.csv', {ALL}"),
    ),
    "column for some": (volts("file='data.csv', columns=['V1']"), ["1 values for 3 elements", "give 3"], None),
    "file of columns missing": (volts(f"file='no.csv', {ALL}"), ["no.csv: no such file", "check the path"], None),
    "hold misspelt": (
        volts(f"file='data.csv', {ALL}, hold='linaer'"),
        ["hold = 'linaer'", "did you mean 'linear'"],
        volts(f"file='data.csv', {ALL}, hold='linear'"),
    ),
    "entry misspelt": (volts(f"file='data.csv', {ALL}, hld='linear'"), ["hld: unknown", "did you mean 'hold'"], None),
    "file misspelt": (volts(f"flie='data.csv', {ALL}"), ["'flie' is not a signal", "did you mean 'file'"], None),
    "word for a number": (volts("file='words.csv', column='V1'"), ["words.csv: row 1", "'zero'"], None),
    "export like no scene": (["export", "x", "--like", "unknown"], ["no scene 'unknown'", "nearest: "], None),
    "export like a scene at another size": (
        ["export", "x", "--like", "segments.toml", "--tcas", "4"],
        ["--like takes the size from the scene", "--set body.tcas=4"],
        ["export", "x", "--like", "segments.toml", "--set", "body.tcas=4"],
    ),
    "export of too many TCAs": (["export", "x", "--tcas", "13"], ["--tcas", "less than or equal to 12"], None),
    "period in metres": (["realtime", "good.toml", "--period", "0.1m"], ["--period", "unit 'm' does not fit"], None),
    "period negative": (["realtime", "good.toml", "--period=-1ms"], ["--period -1ms", "above 0"], None),
    "path missing": (["plan", "no.csv"], ["no.csv: no such file", "check the path"], None),
    "path of no output": (["plan", "path.csv"], ["path.csv", "'y'", "such as tip.p[1]"], None),
    "path of another unit": (["plan", "unit.csv"], ["unit.csv: unit 'V' does not fit"], None),
    "measurements missing": (
        ["identify", "good.toml", "--data", "no.csv", "--free", "rod.body.E"],
        ["no.csv: no such file", "check the path"],
        None,
    ),
    "measurements of no output": (
        ["identify", "good.toml", "--data", "data.csv", "--free", "rod.body.E"],
        ["data.csv", "'V1'", "such as rod.tip.p[1]"],
        None,
    ),
    "parameter that is none": (
        ["identify", "good.toml", "--data", "tip.csv", "--free", "rod.body.EE"],
        ["--free rod.body.EE", "did you mean 'body.E'"],
        None,
    ),
    "linear model of no input": (
        ["linearise", "good.toml", "--input", "thermal.VV", "--output", "rod.tip.p"],
        ["thermal.VV", "did you mean 'thermal.V'"],
        ["linearise", "good.toml", "--input", "thermal.V", "--output", "rod.tip.p"],
    ),
    "linear model after the end": (["linearise", "good.toml", "--time", "99"], ["99 s", "set stop_time"], None),
    "measured samples missing": (["report", "good.toml", "--measured", "no.csv"], ["no.csv", "check the path"], None),
    "size to explain misspelt": (["explain", "body.tca"], ["no such key", "did you mean 'body.tcas'"], None),
}


@pytest.fixture
def folder(here: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(realtime, "count_allocations", lambda: None)  # it starts the process anew
    files = {
        "segments.toml": SEGMENTS,
        "words.csv": "t,V1\n0,zero\n",
        "path.csv": "x,y,z\n1,2,3\n2,3,4\n",
        "unit.csv": "time [s],tip.p[1] [V]\n0,0\n5,5\n",
        "tip.csv": "time [s],rod.tip.p[1] [mm]\n0,0\n0.1,0\n",
    }
    for name, text in files.items():
        (here / name).write_text(text)
    return here


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_message_whose_remedy_works(mistake: str, folder: Path) -> None:
    before = {path.name for path in folder.rglob("*")}
    arguments, words, mended = MISTAKES[mistake]
    done = call(*arguments)
    assert done.exit_code == 2, done.output
    assert done.stderr.lower().count("error: ") == 1
    assert "Traceback" not in done.output
    assert "unexpected" not in done.stderr
    assert "[Errno" not in done.stderr
    message = " ".join(done.stderr.split())
    assert len(message) < 700, message
    for word in words:
        assert word in message
    assert {path.name for path in folder.rglob("*")} == before
    if mended is not None:
        again = call(*mended)
        assert again.exit_code == 0, again.output


def test_sizes_and_what_depends_on_them_are_explained() -> None:
    assert "number of TCAs, 1 to 12" in explain.meaning("body.tcas")
    assert "number of segments of the rod, 1 to 6" in explain.meaning("body.segments")
    assert "one per TCA, body.tcas of them" in explain.meaning("thermal.V")
    assert "up to body.segments" in explain.meaning("tca.first_segment")
    assert "one per segment" in explain.meaning("segment.E")
    assert "unit kg" in explain.meaning("tip_body.mass")
    assert "allowed: constant, free, forced" in explain.meaning("convection")
