"""A subsystem at rest gives what it would give if it were stepped and nothing drove it, and costs no call."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim.scene import Scene
from tca_cosim.simulation import open_simulation, run_to_end

SHORT = ["stop_time=0.1", "rod.planar=true", "rod.order=2"]


def resting(scene: Scene, name: str = "thermal") -> Scene:
    return replace(scene, members=tuple(replace(m, frozen=m.name == name) for m in scene.members))


class Counted:
    """The functions of a library, and how often each was called."""

    def __init__(self, library: object) -> None:
        self.library, self.calls = library, Counter()

    def __getattr__(self, name: str) -> object:
        def counted(*arguments: object) -> object:
            self.calls[name] += 1
            return getattr(self.library, name)(*arguments)

        return counted


def watched(scene: Scene) -> tuple[xr.Dataset, dict[str, Counter[str]]]:
    """The result, and the calls of every FMU from the first macro step to the last."""
    with open_simulation(scene) as ready:
        for slave in ready.slaves:
            slave.watch_calls(Counted)
        libraries = {slave.name: slave.library for slave in ready.slaves}
        return run_to_end(ready).to_xarray(), {name: library.calls.copy() for name, library in libraries.items()}


@pytest.mark.parametrize("control", ["fixed", "doubling", "embedded"])
def test_nothing_heated_is_the_same_at_rest(control: str) -> None:
    scene = tca.read("drop", [*SHORT, f"coupling.control={control}"])
    moved, _ = watched(scene)
    still, calls = watched(resting(scene))
    assert not calls["thermal"]
    assert calls["rod"]["fmi2DoStep"] >= still.sizes["time"] - 1
    assert calls["rod"]["fmi2SetReal"] == calls["rod"]["fmi2SetFMUstate"]  # nothing varies: sent where states were set
    assert still.sizes["time"] > 5
    assert set(still.data_vars) == set(moved.data_vars)
    for name, array in moved.data_vars.items():
        np.testing.assert_array_equal(still[name], array, err_msg=str(name))
    assert json.loads(still.attrs["members"])["thermal"]["frozen"] is True


def test_its_loop_is_open() -> None:
    """TCAs whose winding answers their stroke close a loop through the heat; a member at rest is in none."""
    scene = tca.read("drop", [*SHORT, "thermal.tca.beta=1"])
    assert any(c.target[0] == "thermal" for c in scene.connections)
    still, calls = watched(resting(scene))
    assert not calls["thermal"]
    assert set(still["coupling.sweeps"].to_numpy()[1:]) == {1}
    np.testing.assert_array_equal(still["thermal.T"], np.full_like(still["thermal.T"], still["thermal.T"][0, 0]))


def test_what_stands_still_is_what_was_initialised() -> None:
    """Also where it is driven: then it is the scene that is wrong, not the values at the start."""
    scene = tca.read("step", ["stop_time=1", "rod.order=1"])
    still, _ = watched(resting(scene))
    np.testing.assert_array_equal(still["thermal.V"][0], still["thermal.V"][-1])
    np.testing.assert_array_equal(still["thermal.T"], np.full_like(still["thermal.T"], 298.15))
    assert np.abs(still["rod.delta"]).max() < 1e-9
