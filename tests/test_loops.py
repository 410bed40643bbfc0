"""Runs in a loop in one process: instances that are reset give what new ones give, and nothing grows."""

from __future__ import annotations

import gc
import json
import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim import simulation
from tca_cosim.fmi import cache
from tca_cosim.fmi.slave import Slave
from tca_cosim.studies.model_selection import kept_choice, selection

TIMED = ("statistics",)  # attributes that no two runs share


@pytest.fixture(autouse=True)
def none_kept() -> Iterator[None]:
    """Start and end without instances of other tests."""
    simulation.release_instances()
    yield
    simulation.release_instances()


def new(scene: tca.Scene) -> xr.Dataset:
    """Run with new instances, which are not kept."""
    simulation.release_instances()
    result = tca.run(scene)
    simulation.release_instances()
    return result


def assert_same(one: xr.Dataset, other: xr.Dataset) -> None:
    xr.testing.assert_identical(one.drop_attrs(deep=False), other.drop_attrs(deep=False))
    attributes = [{key: value for key, value in data.attrs.items() if key not in TIMED} for data in (one, other)]
    assert attributes[0] == attributes[1]


def test_instances_that_are_reset_give_what_new_ones_give() -> None:
    """Whatever ran in between: other voltages, materials, geometry, levels, tolerances, or a failure."""
    scenes = [
        tca.read("step", overrides)
        for overrides in (
            ["stop_time=0.5"],
            ["stop_time=0.5", "thermal.V=[3, 0, 0]", "thermal.h=20"],
            ["stop_time=0.3", "body.radius=9 mm", "rod.order=2"],
            ["stop_time=0.4", "thermal.tolerance=1e-2", "rod.body.E=30000", "tolerance=1e-5"],
            ["stop_time=0.2", "rod.dynamic=true", "coupling.macro_step=0.02"],
        )
    ]
    expected = [new(scene) for scene in scenes]
    order = np.random.default_rng(1).integers(0, len(scenes), 15).tolist()
    for k in [*range(len(scenes)), *order]:
        assert_same(tca.run(scenes[k]), expected[k])
    assert len(simulation._KEPT) == 2


def test_an_instance_is_reset_and_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    instantiate = Slave._instantiate
    monkeypatch.setattr(Slave, "_instantiate", lambda self, *how: (made.append(self.name), instantiate(self, *how)))
    for _ in range(3):
        tca.run("step", ["stop_time=0.2"])
    assert made == ["thermal", "rod"]
    tca.run("step", ["stop_time=0.2", "rod.closure=inside"])  # the rod has other inputs
    assert made == ["thermal", "rod", "rod"]


def test_after_a_failure_instances_are_new() -> None:
    scene = tca.read("step", ["stop_time=0.3"])
    expected = new(scene)
    tca.run(scene)
    with pytest.raises(tca.CouplingError):
        tca.run("plain")
    assert_same(tca.run(scene), expected)


def test_foreign_instances_are_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Resets of other makers' FMUs are not trusted."""
    monkeypatch.setattr("tca_cosim.fmi.archive.REENTRANT_TOOLS", ())
    tca.run("step", ["stop_time=0.2"])
    assert simulation._KEPT == {}


def test_two_open_simulations_do_not_share_instances() -> None:
    scene = tca.read("step", ["stop_time=0.3"])
    expected = new(scene)
    with simulation.open_simulation(scene) as one:
        assert_same(tca.run(scene), expected)
        assert_same(simulation.run_to_end(one).to_xarray(), expected)


@pytest.mark.slow
def test_memory_does_not_grow_over_many_runs() -> None:
    scene = tca.read("step", ["stop_time=2", "rod.closure=inside", "coupling.macro_step=1", "rod.order=0"])
    sizes = []
    for _ in range(4):
        for _ in range(25):
            tca.run(scene)
        gc.collect()
        sizes.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    assert sizes[-1] - sizes[1] < 2000  # [KiB] over 50 runs: less than half of what one pair of instances takes


# -- choices of models


AUTO = ["stop_time=0.2", "fidelity.level=auto", "fidelity.tolerance=1e-2"]


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Names of the scenes that are searched, from an empty cache on."""
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr(kept_choice, "_CHOICES", {})
    calls: list[str] = []
    propose = selection.propose_choice
    monkeypatch.setattr(selection, "propose_choice", lambda *how: (calls.append("search"), propose(*how))[1])
    return calls


def test_the_same_scene_is_searched_once(searches: list[str]) -> None:
    first = tca.run("load", AUTO)
    for _ in range(2):
        assert_same_data(tca.run("load", AUTO), first)
    kept_choice._CHOICES.clear()  # as in the next process
    again = tca.run("load", AUTO)
    assert_same_data(again, first)
    assert searches == ["search"]
    record, known = (json.loads(result.attrs["fidelity"]) for result in (first, again))
    assert known["budget"].pop("reused") is True
    record["budget"].pop("run_s")
    known["budget"].pop("run_s")
    assert known == record


def assert_same_data(one: xr.Dataset, other: xr.Dataset) -> None:
    xr.testing.assert_identical(one.drop_attrs(deep=False), other.drop_attrs(deep=False))


@pytest.mark.parametrize(
    "change",
    [
        "fidelity.search=anew",
        "fidelity.tolerance=2e-2",
        "rod.body.E=40000",
        "rod.tip_force=[0.01, 0, 0]",
        "stop_time=0.3",
        "coupling.macro_step=0.05",
        'fidelity.quantities=["rod.tip.euler"]',
    ],
)
def test_what_decides_a_choice_is_searched_anew(searches: list[str], change: str) -> None:
    tca.run("load", AUTO)
    tca.run("load", [*AUTO, change])
    assert searches == ["search", "search"]


def test_what_decides_nothing_is_not(searches: list[str]) -> None:
    tca.run("load", AUTO)
    tca.run("load", [*AUTO, "title=another", "limits.speed=3"])
    assert searches == ["search"]


def test_other_code_and_damaged_files_are_searched_anew(
    searches: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tca.run("load", AUTO)
    (path,) = (tmp_path / "cache" / "choices").glob("*.json")
    for content in (b"", path.read_bytes()[:-5], b"no hash\n{}"):
        kept_choice._CHOICES.clear()
        path.write_bytes(content)
        tca.run("load", AUTO)
    cache.keep_bytes(f"choices/{path.name}", b'{"choice": {"order": 1}, "record": {}}')  # of other hierarchies
    kept_choice._CHOICES.clear()
    tca.run("load", AUTO)
    monkeypatch.setattr(kept_choice, "_code", lambda: ["later", ""])
    tca.run("load", AUTO)
    assert len(searches) == 6
