"""Mistakes in commands and scenes: one message each, suggestions and remedies that work."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from command_line import call
from fmu_maker import make_fmu, real

SHORT = ("--set", "stop_time=0.2")


def set_in(*overrides: str) -> list[str]:
    return ["run", "good.toml", *(part for override in overrides for part in ("--set", override))]


# what is typed, what the message has
MISTAKES: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "scene misspelt": (["run", "stepp"], ["'stepp'", "did you mean 'step'"]),
    "scene of another name": (["run", "nothing"], ["no scene 'nothing'", "nearest: "]),
    "scene file missing": (["run", "mine.toml"], ["'mine.toml': no such file", "check the path"]),
    "scene file in a missing folder": (["run", "there/mine.toml"], ["no such file", "check the path"]),
    "scene is a folder": (["run", "folder"], ["folder: a folder", "give a .toml or .ssp file"]),
    "scene is a table of data": (["run", "data.csv"], ["data.csv: a file, but not a scene", ".toml or .ssp"]),
    "scene is not TOML": (["run", "bad.toml"], ["bad.toml: not valid TOML", "line 1"]),
    "scene is not text": (["run", "latin.toml"], ["latin.toml: not a text in UTF-8", "save the file as UTF-8"]),
    "scene is UTF-16": (["run", "wide.toml"], ["wide.toml: not a text in UTF-8"]),
    "archive is not one": (["run", "bad.ssp"], ["bad.ssp: not a readable SSP archive"]),
    "override without value": (set_in("rod.order"), ["--set 'rod.order'", "key=value"]),
    "override without key": (set_in("=2"), ["not of the form key=value"]),
    "override of table and key": (set_in("rod=3", "rod.order=2"), ["set as a whole as well; keep one"]),
    "key misspelt": (set_in("rod.ordr=2"), ["rod.ordr", "did you mean 'order'"]),
    "section misspelt": (set_in("rodd.order=2"), ["rodd", "did you mean 'rod'"]),
    "top key misspelt": (set_in("stoptime=2"), ["stoptime", "did you mean 'stop_time'"]),
    "input misspelt": (set_in("rod.gravty=2"), ["rod.gravty", "did you mean 'gravity'"]),
    "input that is none": (set_in("rod.volume=2"), ["no such variable in rod.fmu", "nearest: ", "of "]),
    "element beyond the vector": (set_in("thermal.V[7]=2"), ["thermal.V[7] = 2: no such element; V has V[1] to V[3]"]),
    "coupling key misspelt": (set_in("coupling.macrostep=1"), ["did you mean 'macro_step'"]),
    "coupling method misspelt": (set_in("coupling.method=newtn"), ["did you mean 'newton'"]),
    "unit of another quantity": (set_in("thermal.V[1]=1 mm"), ["'mm' does not fit", "'V'"]),
    "unit unknown": (set_in("thermal.V[1]=1 bolt"), ["unit 'bolt' is not known", "'V'"]),
    "unit of an angle": (set_in("tca.azimuth=1 Hz"), ["'Hz' does not fit"]),
    "number misspelt": (set_in("thermal.V[1]=1,5"), ["'1,5': not a number with a unit; write a point: '1.5'"]),
    "number as text": (set_in("thermal.V[1]=much"), ["not a number with a unit"]),
    "nan": (set_in("thermal.V[1]=nan"), ["not finite"]),
    "infinite": (set_in("rod.body.E=inf"), ["not finite"]),
    "boolean as number": (set_in("rod.dynamic=1"), ["allowed: true, false"]),
    "fraction as integer": (set_in("rod.order=2.5"), ["give a whole number"]),
    "integer out of range": (set_in("rod.order=99"), ["out of range; allowed: 0 to 7"]),
    "item misspelt": (set_in("rod.closure=insid"), ["did you mean 'inside'"]),
    "item number": (set_in("rod.closure=7"), ["not the value of an item", "inside, exchanged"]),
    "length negative": (set_in("body.length=-40 mm"), ["body.length", "-40 mm", "out of range"]),
    "length zero": (set_in("body.length=0"), ["out of range"]),
    "part of a signal": (
        set_in("thermal.T_ambient.sine.period=2"),
        ["set it as a whole: thermal.T_ambient={sine={...}}"],
    ),
    "output set": (set_in("rod.delta=1"), ["is output; only parameters, inputs and start values can be set"]),
    "vector too short": (set_in("thermal.V=[1, 2]"), ["2 values for 3 elements of V; give 3"]),
    "list for a scalar": (set_in("rod.order=[1]"), ["wrong type; give a whole number"]),
    "stop time negative": (set_in("stop_time=-1"), ["stop_time = -1", "positive"]),
    "stop time as date": (set_in("stop_time=2020-01-01"), ["stop_time", "wrong type"]),
    "macro step zero": (set_in("coupling.macro_step=0"), ["out of range"]),
    "macro step in metres": (set_in("coupling.macro_step=1 m"), ["'m' does not fit"]),
    "title is a number": (set_in("title=3"), ["title = 3: wrong type", "in quotes"]),
    "parameter set misspelt": (set_in("parameters=fig4"), ["did you mean 'fig3'"]),
    "parameter set of wrong type": (set_in("parameters=3"), ["parameters = 3: wrong type"]),
    "signal unknown": (
        set_in("thermal.V[1]={step=[[0, 1]]}"),
        ["thermal.V[1]", "'step' is not a signal; did you mean 'steps'"],
    ),
    "signal without period": (set_in("thermal.V[1]={sine={amplitude=1}}"), ["sine without period; add it"]),
    "signal backwards": (set_in("thermal.V[1]={steps=[[1, 1], [0, 2]]}"), ["times must increase"]),
    "signal for a parameter": (set_in("rod.body.E={steps=[[0, 1]]}"), ["rod.body.E", "wrong type"]),
    "table missing": (set_in("thermal.V[1]={table={file='no.csv'}}"), ["no.csv: no such file", "check the path"]),
    "column missing": (
        set_in("thermal.V[1]={table={file='data.csv', column='V2'}}"),
        ["no such column in data.csv; allowed:"],
    ),
    "geometry in one FMU": (set_in("rod.body.length=60 mm"), ["describe one manipulator", "--set body.length"]),
    "geometry twice": (set_in("rod.body.length=60 mm", "thermal.body.length=50 mm"), ["describe one manipulator"]),
    "profile without values": (set_in("rod.body.profile=given"), ["body.stiffness[1]", "give all six"]),
    "limits misspelt": (set_in("limits.temprature=3"), ["did you mean 'temperature'"]),
    "geometry misspelt": (set_in("body.lenth=60 mm"), ["no FMU has it; did you mean 'body.length'"]),
    "geometry impossible": (set_in("tca.offset=4.9 mm"), ["thermal: "]),
    "FMU missing": (set_in("fmus.rod=rot.fmu"), ["rot.fmu", "did you mean 'rod.fmu'"]),
    "FMU not one": (set_in("fmus.rod=data.csv"), ["data.csv: not a readable FMU"]),
    "FMU with the name of a key": (set_in("fmus.coupling=rod.fmu"), ["taken by a key of scenes; rename"]),
    "connection without arrow": (set_in("connections=['thermal.T rod.T']"), ["give 'fmu.output -> fmu.input'"]),
    "connection of no FMU": (
        set_in("connections=['therml.T -> rod.T']"),
        ["no FMU 'therml'"],
    ),
    "connection of no output": (set_in("connections=['thermal.Q -> rod.T']"), ["not an output"]),
    "connection of unlike units": (set_in("connections=['rod.delta -> rod.T']"), ["do not measure the same quantity"]),
    "connection of unlike counts": (set_in("connections=['thermal.T -> rod.T[1]']"), ["3 outputs for 1 inputs"]),
    "fidelity misspelt": (set_in("fidelity.level=automatic"), ["fidelity.level", "auto"]),
    "result of none": (["report"], ["name a scene or --from RESULT.nc"]),
    "result missing": (["report", "--from", "no.nc"], ["no.nc"]),
    "result is not one": (["report", "--from", "data.csv"], ["data.csv"]),
    "result with overrides": (["report", "--from", "data.csv", "--set", "rod.order=2"], ["cannot be changed"]),
    "name of a file with a slash": (["run", "good.toml", "--name", "a/b"], ["--name 'a/b': not the name of a file"]),
    "export of nothing": (["export"], ["--ssp FILE.ssp"]),
    "export of a scene to nowhere": (["export", "there", "--scene", "step"], ["add --ssp FILE.ssp"]),
    "export of a varying input": (["export", "--ssp", "x.ssp", "--scene", "sine"], ["varies in time", "constants"]),
    "new over an older file": (["new", "good.toml"], ["exists already; give another name"]),
    "new with another ending": (["new", "mine.txt"], ["give mine.toml"]),
    "key to explain misspelt": (["explain", "thermal.VV"], ["no such key", "did you mean 'thermal.V"]),
    "old name of a command": (["fit", "step"], ["run `tca-cosim select step`"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_message(mistake: str, here: Path) -> None:
    (here / "bad.toml").write_text("stop_time = = 3\n")
    (here / "latin.toml").write_bytes('title = "Täst"\n'.encode("latin-1"))
    (here / "wide.toml").write_bytes("stop_time = 3\n".encode("utf-16"))
    (here / "bad.ssp").write_text("no archive")
    before = {path.name for path in here.rglob("*")}
    arguments, words = MISTAKES[mistake]
    done = call(*arguments)
    assert done.exit_code == 2, done.output
    assert done.stderr.count("error: ") == 1
    assert "Traceback" not in done.output
    assert "unexpected" not in done.stderr
    message = " ".join(done.stderr.split())
    assert len(message) < 700, message
    for word in words:
        assert word in message
    assert {path.name for path in here.rglob("*")} == before


FOREIGN = """stop_time = 1
connections = ["a.y -> b.u", "b.y -> a.u"]
fmus = { a = "gain.fmu", b = "gain.fmu" }
a = { k = 0.5 }
b = { k = -1.0 }
coupling = { exchange = "held", waveform = "held" }
"""


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["run", "foreign.toml"], []),
        (["timing", "foreign.toml", "--repeats", "1"], []),
        (["export", "--ssp", "x.ssp"], []),
        (["animate", "foreign.toml"], ["no shape to draw", "run a scene with rod.fmu"]),
        (["modes", "foreign.toml"], ["gain.fmu offers no model exchange"]),
        (["monolith", "foreign.toml"], ["gain.fmu offers no model exchange"]),
        (["reference", "foreign.toml"], ["the reference solves one thermal and one rod"]),
        (["select", "foreign.toml"], ["set fidelity.quantities"]),
        (["halving", "foreign.toml"], ["varies settings of rod.fmu, which the scene does not have"]),
        (["chart", "foreign.toml"], ["varies settings of thermal.fmu and rod.fmu"]),
        (["stability", "foreign.toml", "--workers", "0"], ["varies settings of rod.fmu"]),
    ],
)
def test_commands_on_foreign_fmus_work_or_say_what_they_need(command: list[str], words: list[str], here: Path) -> None:
    variables = [real("u", "input", start=0), real("y"), real("k", "parameter", start=2)]
    make_fmu(here / "gain.fmu", variables, output="real[1] = real[2] * real[0];")
    (here / "foreign.toml").write_text(FOREIGN)
    done = call(*command)
    assert done.exit_code == (2 if words else 0), done.output
    assert "Traceback" not in done.output
    assert done.stderr.count("error: ") == bool(words)
    for word in words:
        assert word in " ".join(done.stderr.split())


SUGGESTED = [name for name, (_, words) in MISTAKES.items() if any("did you mean" in word for word in words)]


def mended(arguments: Sequence[str], suggestion: str) -> list[str]:
    """The arguments with the word that is most like the suggestion replaced by it."""
    word = r"[\w.]+(?:\[\d+\])?" if "." in suggestion else r"\w+"
    words = {part for argument in arguments[1:] for part in re.findall(word, argument)} - {suggestion}
    (wrong,) = difflib.get_close_matches(suggestion, words, 1, 0.0)
    return [arguments[0], *(argument.replace(wrong, suggestion) for argument in arguments[1:])]


@pytest.mark.parametrize("mistake", SUGGESTED)
def test_suggestions_work(mistake: str, here: Path) -> None:
    """What a message suggests takes the place of what was misspelt."""
    arguments, _ = MISTAKES[mistake]
    (suggestion,) = re.findall(r"did you mean '([^']+)'", " ".join(call(*arguments).stderr.split()))
    again = mended(arguments, suggestion)
    done = call(*again, *(SHORT if again[0] == "run" and not any("stop_time" in word for word in again) else ()))
    assert done.exit_code == 0, (again, done.output)


# Of messages that say in words what to do: the mistake, and the arguments with that done.
REMEDIES: dict[str, list[str]] = {
    "override of table and key": set_in("rod.order=2"),
    "element beyond the vector": set_in("thermal.V[3]=2"),
    "unit of another quantity": set_in("thermal.V[1]=1 mV"),
    "number misspelt": set_in("thermal.V[1]=1.5"),
    "boolean as number": set_in("rod.dynamic=true", "rod.body.retardation=1e-2"),
    "fraction as integer": set_in("rod.order=2"),
    "integer out of range": set_in("rod.order=7"),
    "vector too short": set_in("thermal.V=[1, 2, 3]"),
    "list for a scalar": set_in("rod.order=1"),
    "stop time negative": set_in("stop_time=0.1"),
    "macro step zero": set_in("coupling.macro_step=0.1"),
    "title is a number": set_in("title='3'"),
    "signal without period": set_in("thermal.V[1]={sine={amplitude=1, period=1}}"),
    "signal backwards": set_in("thermal.V[1]={steps=[[0, 2], [1, 1]]}"),
    "column missing": set_in("thermal.V[1]={table={file='data.csv', column='V1'}}"),
    "geometry in one FMU": set_in("body.length=60 mm"),
    "geometry twice": set_in("body.length=60 mm"),
    "profile without values": set_in("rod.body.profile=given", "rod.body.stiffness=[1e-5, 1e-5, 1e-5, 1, 1, 3]"),
    "connection without arrow": set_in("connections=['thermal.T -> rod.T']"),
    "connection of no FMU": set_in("connections=['thermal.T -> rod.T']"),
    "connection of unlike counts": set_in("connections=['thermal.T[1] -> rod.T[1]']"),
    "result of none": ["report", "good.toml"],
    "result with overrides": ["report", "good.toml", "--set", "rod.order=2"],
    "name of a file with a slash": ["run", "good.toml", "--name", "a-b"],
    "export of nothing": ["export", "--ssp", "x.ssp"],
    "export of a scene to nowhere": ["export", "--ssp", "x.ssp", "--scene", "good.toml"],
    "export of a varying input": ["export", "--ssp", "x.ssp", "--scene", "sine", "--set", "thermal.V=1"],
    "new over an older file": ["new", "another.toml"],
    "new with another ending": ["new", "mine.toml"],
}


@pytest.mark.parametrize("mistake", REMEDIES)
def test_remedies_work(mistake: str, here: Path) -> None:
    assert call(*MISTAKES[mistake][0]).exit_code == 2
    done = call(*REMEDIES[mistake])
    assert done.exit_code == 0, done.output
