"""Scenes of contact and moving air: stiff contact is iterated where explicit coupling fails, a fan cools."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim.fmi import python_fmu

SHORT = {"stop_time": 3.0, "right_heat.V[1]": "3 V"}  # both fingers alike: the object stays in the middle


@pytest.fixture(scope="module")
def iterated() -> xr.Dataset:
    return tca.run("gripper", SHORT)


def compliance(result: xr.Dataset) -> float:
    """Displacement of a fingertip per force [m/N] from the loop gain k c of the squeezed object at the end."""
    return float(result["coupling.gain"][-1]) / 100.0


def test_stiff_contact_is_iterated(iterated: xr.Dataset) -> None:
    """100 N/m are about 70 times as stiff as a finger, so one exchange per step would multiply errors by 70."""
    assert 60.0 < iterated["coupling.gain"][-1] < 80.0
    assert iterated["coupling.sweeps"].mean() < 5.0
    left, right = iterated["object.force_left"], iterated["object.force_right"]
    np.testing.assert_allclose(left, right, atol=1e-7)
    assert left[-1] < -5e-3
    np.testing.assert_allclose(iterated["object.x"], 0.0, atol=1e-8)
    # The finger touches the object: 40 mm between bases, half width 8 mm, radius of a finger 5 mm.
    penetration = iterated["left.tip.p"].to_numpy()[-1, 0] - 7e-3
    assert penetration == pytest.approx(-float(left[-1]) / 100.0 + 0.05e-3, rel=1e-3)


@pytest.mark.parametrize(("waveform", "limit"), [("held", 1.0), ("linear", 1.0 / 3.0)])
def test_explicit_exchange_of_contact_has_the_limits_of_theory(
    iterated: xr.Dataset, waveform: str, limit: float
) -> None:
    """An error e of the force moves the fingertip by c e, and the contact answers with -k c e in the next step; linear
    extrapolation answers with -k c (2 e - e before)."""
    for share, stable in ((0.82, True), (1.2, False)):
        k = share * limit / compliance(iterated)
        explicit = {"coupling.method": "none", "coupling.waveform": waveform, "coupling.macro_step": 0.05}
        forces = tca.run("gripper", {**SHORT, **explicit, "object.stiffness": k})["object.force_left"].to_numpy()
        changes = np.diff(forces[-9:])
        chatters = bool((changes[1:] * changes[:-1] < 0.0).all())
        assert chatters is not stable


def test_contact_that_sets_in_within_a_step_wants_quasi_newton_or_shorter_steps() -> None:
    """At k c = 7000 the response bends from slope 0 to k within the shortest step of the default. Newton's method
    cycles there; both remedies of its message work, and the force is that of a nearly rigid contact."""
    stiff = {**SHORT, "stop_time": 1.5, "object.stiffness": 1e4, "coupling.method": "newton"}
    with pytest.raises(tca.CouplingError, match=r"a larger coupling\.halvings|Raise coupling\.halvings"):
        tca.run("gripper", stiff)
    shorter = tca.run("gripper", {**stiff, "coupling.halvings": 12})
    safeguarded = tca.run("gripper", {**stiff, "coupling.method": "iqn", "coupling.halvings": 0})
    assert safeguarded["coupling.sweeps"].sum() < 0.7 * shorter["coupling.sweeps"].sum()
    soft = tca.run("gripper", {**SHORT, "stop_time": 1.5})
    for result in (shorter, safeguarded):
        assert 300.0 < float(result["coupling.gain"][-1]) < 1000.0  # k c where the contact is not yet fully set in
        assert 1.0 < float(result["object.force_left"][-1] / soft["object.force_left"][-1]) < 1.2


@pytest.mark.parametrize("dynamic", [False, True])
def test_no_step_is_taken_back_where_contact_sets_in(dynamic: bool) -> None:
    """The left finger arrives first, so that one force has a size to go by while the other is still zero."""
    inertia = {"left.dynamic": True, "right.dynamic": True, "left.tolerance": 1e-3, "right.tolerance": 1e-3}
    result = tca.run("gripper", {"stop_time": 3.0, "coupling.halvings": 0, **(inertia if dynamic else {})})
    statistics = json.loads(result.attrs["statistics"])
    assert statistics["rejected_steps"] == 0
    assert statistics["sweeps_per_step"] < 6.0


def test_files_that_make_no_fmu_are_refused(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    contents = {
        "plain": ("x = 1\n", "derived from pythonfmu.Fmi2Slave"),
        "bad": ("raise ValueError(3)\n", "ValueError: 3"),
    }
    for name, (content, named) in contents.items():
        (tmp_path / f"{name}.py").write_text(content)
        scene.write_text(f'stop_time = 1.0\n[fmus]\na = "{name}.py"\n')
        with pytest.raises(tca.SceneError, match=re.escape(named)):
            tca.read(scene)


def test_python_fmus_work_without_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(python_fmu.cache, "kept_folder", lambda name, fill: None)
    source = Path(tca.__file__).parent / "scenes" / "gripper_object.py"
    assert python_fmu.built_fmu(source).is_file()


def test_a_fan_cools() -> None:
    """The heat transfer follows the speed of the air; what was warmed at constant voltage cools."""
    coarse = {"stop_time": 160.0, "coupling.macro_step": 2.0, "thermal.tolerance": 1e-3}
    result = tca.run("fan", coarse)
    before = int(np.searchsorted(result["time"], 149.0))
    h, T = result["thermal.h_surface"].to_numpy(), result["thermal.T"].to_numpy()
    assert 5.0 < h[-1] / h[before] < 7.0
    assert (T[-1] < T[before] - 1.0).all()
    assert (np.diff(T[1 : before + 1, 0]) > 0.0).all()
    tip = result["rod.tip.p"].to_numpy()[:, 0]
    assert tip[before] < -16e-3
    assert tip[-1] > tip[before] + 0.5e-3
