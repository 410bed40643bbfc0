"""Model selection as a whole: choices whose true error is audited with the finest models, their reasons, commands and
mistakes."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import pytest
from rich.console import Console
from tca_cosim import SceneError, read, results, run, titles
from tca_cosim.cli import app, console
from tca_cosim.studies import model_selection
from tca_cosim.studies.model_selection.cost_study import ChoiceRating, candidates
from tca_cosim.studies.model_selection.search import SHARE
from test_cli import tca
from typer.testing import CliRunner

# -- scenes ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", ["step", "switch", "sine"])
def test_the_scenes_of_the_paper_need_constant_strain_and_no_inertia(scene: str) -> None:
    result = run(read(scene, ["fidelity.level=auto", "fidelity.tolerance=1e-3"]))
    record = json.loads(result.attrs["fidelity"])
    choice, why = record["choice"], " ".join(record["reasons"])
    assert (choice["rod.dynamic"], choice["rod.order"], choice["rod.strains"]) == (False, 0, "extensible")
    assert "Quasi-static: loads grow over 3.7 s against a first period of 0.19 s" in why
    assert "no gravity, no load at the tip and parallel TCAs: equilibria are arcs exactly" in why
    budget = record["budget"]
    assert budget["estimate"] <= SHARE * budget["tolerance"] == SHARE * 1e-3
    assert budget["model"] > max(budget["time"], budget["coupling"])  # inertia, left out
    assert result.sizes["time"] == 301
    assert json.loads(result.attrs["members"])["rod"]["parameters"]["order"] == 0


# In CI the cheap ones; `tca-cosim select SCENE... --tolerance X --study` is for all.
@pytest.mark.parametrize(
    ("scene", "tolerance", "overrides", "dynamic"),
    [
        ("step", 1e-3, [], False),
        ("drop", 1e-4, ["stop_time=0.4"], True),
        ("load", 1e-3, [], False),
        ("push", 1e-2, [], False),
        ("pulse", 1e-3, ["stop_time=1.5"], True),
    ],
)
def test_the_true_error_is_within_the_tolerance(
    scene: str, tolerance: float, overrides: list[str], dynamic: bool
) -> None:
    actual = model_selection.select(read(scene, [*overrides, f"fidelity.tolerance={tolerance}"]))
    true = model_selection.audit(actual)
    assert true <= tolerance
    assert actual.search.estimate == pytest.approx(true, rel=0.3)
    assert actual.record()["choice"]["rod.dynamic"] is dynamic
    assert len(actual.record(true)["reasons"]) == len(actual.hierarchies)
    assert actual.record(true)["budget"]["true_error"] == true


@pytest.mark.parametrize("scene", ["drop", "load"])
def test_where_nothing_is_heated_the_heat_rests(scene: str) -> None:
    actual = model_selection.select(read(scene, ["stop_time=0.2"]))
    record = actual.record()
    assert record["choice"]["thermal.frozen"] is True
    assert record["reasons"][0].startswith("Heat: at rest, never stepped. Nothing is heated: no voltage at any time")
    assert actual.search.gaps["heat"] == 0.0
    assert json.loads(actual.result().attrs["members"])["thermal"]["frozen"] is True
    moved = actual.runs.difference(actual.search.choice, {**actual.search.choice, "heat": 1}, 0.2)
    actual.runs.close()
    assert moved == 0.0


def test_other_quantities_need_other_models() -> None:
    """A temperature needs nothing of the rod: it does not act on the heat here."""
    actual = model_selection.select(read("drop", ["stop_time=0.1", 'fidelity.quantities=["thermal.T"]']))
    assert actual.record()["choice"]["rod.dynamic"] is False
    assert actual.record()["choice"]["rod.order"] == 0


def test_choices_are_near_the_cheapest_that_is_enough() -> None:
    actual = [model_selection.select(read("drop", ["stop_time=0.05", f"fidelity.tolerance={x}"])) for x in (1e-2, 1e-3)]
    assert len(list(candidates(actual[0].hierarchies, [f.search.choice for f in actual]))) > 90
    for tolerance, judged in zip((1e-2, 1e-3), model_selection.cost_study(actual), strict=True):
        assert judged.chosen.error <= tolerance >= judged.best.error
        assert judged.best.cost <= judged.chosen.cost
        assert judged.ratio >= 1.0


def test_what_is_dearer_than_all_choices_is_not_studied() -> None:
    many = "coupling.macro_step=1e-5"  # steps, so that a run does not end with its first block of them
    actual = model_selection.select(read("drop", ["stop_time=0.02", "fidelity.tolerance=0.1", many]))
    rating = ChoiceRating([actual])
    chosen = rating.rate(actual.search.choice)
    assert chosen.error <= 0.1
    assert rating.rate({**actual.search.choice, "inertia": 0}).error > 0.1
    rating.limit = 0.0
    dear, finer = ({**actual.search.choice, "strains": 3, "order": order} for order in (2, 3))
    assert rating.rate(dear).cost == math.inf
    rating.limit = math.inf
    assert rating.rate(finer).cost == math.inf  # not tried: finer in one, and no coarser in anything
    assert rating.rate({**finer, "strains": 2}).cost < math.inf


# -- commands and mistakes ---------------------------------------------------------------------------------------------


def test_commands(tmp_path: Path) -> None:
    done = tca("select", "load", "--tolerance", "1e-2", "--set", "stop_time=2", "--audit", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Quasi-static" in done.stdout
    assert "true error" in done.stdout
    record = json.loads(results.read(tmp_path / "results" / "load.select.nc").attrs["fidelity"])
    assert record["budget"]["true_error"] <= 1e-2
    auto = tca("run", "load", "--set", "fidelity.level=auto", "--set", "stop_time=1", folder=tmp_path)
    assert auto.returncode == 0, auto.stderr
    assert "Heat: at rest" in auto.stdout


def test_a_search_says_what_it_is_at(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    texts: list[str] = []
    scene = read("load", ["stop_time=0.2", "fidelity.level=auto", "fidelity.search=anew"])
    result = model_selection.run_selected_table(scene, status=texts.append).to_xarray()
    assert [text.split(":")[0].split(",")[0] for text in texts] == [f"run {k + 1}" for k in range(len(texts))]
    assert len(texts) == json.loads(result.attrs["fidelity"])["budget"]["runs"]
    assert "heat at rest, all six strains, spatial, dynamic, order" in texts[0]
    assert "last estimate" in texts[-1]
    shown = io.StringIO()
    terminal = Console(file=shown, force_terminal=True, width=200, _environ={"TERM": "xterm"})
    monkeypatch.setattr(console.out, "_console", terminal)
    monkeypatch.chdir(tmp_path)
    auto = ["--set", "fidelity.level=auto", "--set", "fidelity.search=anew"]
    done = CliRunner().invoke(app, ["run", "load", "--set", "stop_time=0.2", *auto])
    assert done.exit_code == 0
    assert "load, run" in shown.getvalue()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["fit", "step", "--tolerance", "0.1"], "run `tca-cosim select step --tolerance 0.1`"),
        (["select", "step", "--tolerance", "0"], "allowed: 1e-06 to 0.3"),
        (["select", "step", "--tolerance", "nan"], "not finite"),
        (["select", "step", "--tolerance", "much"], "fidelity.tolerance = 'much'"),
        (["select", "step", "--of", "rod.tip"], "not a Real output"),
        (["select", "step", "--of", "rod.tip.p[1]"], "give the whole vector, 'rod.tip.p'"),
        (["timing", "step", "--set", "fidelity.level=auto"], "use `tca-cosim run` or `tca-cosim select`"),
    ],
)
def test_mistakes_are_one_message(arguments: list[str], said: str) -> None:
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert said in done.output.replace("\n", " ")


def test_mistakes_in_the_table() -> None:
    for slip, said in (
        ("fidelity=3", "give a table"),
        ("fidelity.level=some", "allowed: "),
        ("fidelity.quantities=3", "give a list of outputs"),
        ('fidelity.quantities=["rod.T"]', "not a Real output"),
        ("fidelity.tolerence=1", "did you mean 'tolerance'"),
    ):
        with pytest.raises(SceneError, match=said):
            read("step", [slip])


def test_scenes_ask_for_given_models_unless_they_say_auto() -> None:
    assert all(read(name).accuracy.level == "given" for name in titles())
