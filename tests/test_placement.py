"""Pictures of scenes with several manipulators: where they stand, what stands between them, what is said of each."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim import results
from tca_cosim.results.plausibility import doubtful
from tca_cosim.visualization import animation
from tca_cosim.visualization.assembly import FACES, assembly
from tca_cosim.visualization.charts import charts
from tca_cosim.visualization.report import page

PLACED = {"position": ["20 mm", 0, 0], "turn": "180 deg"}


@pytest.fixture(scope="module")
def gripper() -> xr.Dataset:
    return tca.run("gripper", {"stop_time": 3.0, "right_heat.V[1]": "3 V"})


def every_row(result: xr.Dataset) -> np.ndarray:
    return np.arange(result.sizes["time"])


def test_both_fingers_and_the_object_stand_where_the_scene_says(gripper: xr.Dataset) -> None:
    bodies = assembly(gripper, every_row(gripper))
    left, right = bodies.manipulators
    (block,) = bodies.blocks
    assert (left.name, right.name, block.name, bodies.is_arranged) == ("left", "right", "object", False)
    tips = {name: gripper[f"{name}.tip.p"].to_numpy() for name in ("left", "right")}
    np.testing.assert_allclose(left.frames.p[:, -1], tips["left"] + [-20e-3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(right.frames.p[:, -1], tips["right"] * [-1, -1, 1] + [20e-3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(block.centre[:, 0], gripper["object.x"], atol=1e-15)
    np.testing.assert_allclose(np.ptp(block.corners, axis=1), [[16e-3, 16e-3, 10e-3]] * len(block.corners))
    # Where both fingertips press, both surfaces reach the object's sides up to the penetration, below 0.3 mm.
    pressed = -1
    assert left.frames.p[pressed, -1, 0] + 5e-3 == pytest.approx(block.corners[pressed, :, 0].min(), abs=3e-4)
    assert right.frames.p[pressed, -1, 0] - 5e-3 == pytest.approx(block.corners[pressed, :, 0].max(), abs=3e-4)


def test_faces_of_a_block_are_flat_and_close_it(gripper: xr.Dataset) -> None:
    corners = assembly(gripper, np.array([0])).blocks[0].corners[0][FACES]
    areas = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1) / 2
    assert sorted(areas.tolist()) == pytest.approx([160e-6] * 4 + [256e-6] * 2)


def test_manipulators_without_a_place_stand_side_by_side(gripper: xr.Dataset) -> None:
    unplaced = gripper.copy()
    unplaced.attrs = {key: value for key, value in gripper.attrs.items() if key != "placement"}
    bodies = assembly(unplaced, every_row(unplaced))
    left, right = bodies.manipulators
    assert bodies.is_arranged
    assert bodies.blocks == ()
    assert right.extent[0][0] > left.extent[1][0] + 5e-3
    assert "they stand side by side" in page.html(unplaced)
    assert "side by side" not in page.html(gripper)


def test_pictures_and_tables_have_every_manipulator(gripper: xr.Dataset, tmp_path: Path) -> None:
    titles = [chart.title for chart in charts(gripper)]
    for name in ("left", "right"):
        assert {f"Position of the tip, {name}", f"Force on the tip, {name}", f"Temperatures, {name}_heat"} <= set(
            titles
        )
    text = page.html(gripper)
    assert {"left: tip x, y, z at the end", "right: tip x, y, z at the end", "TCA 3 of right"} <= set(
        re.findall(r"(?:left|right): tip x, y, z at the end|TCA \d of right", text)
    )
    *_, last = animation.images(gripper, 2, (640, 360))
    alone = gripper.drop_vars([name for name in gripper if str(name).startswith("right.")])
    *_, one = animation.images(alone, 2, (640, 360))
    right_half = slice(200, 330)  # where the right finger is drawn
    assert np.abs(last[:, right_half].astype(int) - one[:, right_half]).max() > 50
    results.write(gripper, tmp_path / "gripper.nc")
    again = assembly(results.read(tmp_path / "gripper.nc"), every_row(gripper))
    np.testing.assert_array_equal(again.blocks[0].centre, assembly(gripper, every_row(gripper)).blocks[0].centre)


def test_limits_hold_for_every_manipulator() -> None:
    hot = tca.read("gripper", {"stop_time": 0.5, "right_heat.V[1]": "6 V", "limits.temperature": "40 degC"})
    with pytest.warns(tca.SceneWarning, match="right_heat: TCA 1 is hotter"):
        result = tca.run(hot)
    assert any(text.startswith("right_heat: TCA 1 is hotter") for text in doubtful(hot, result))


@pytest.mark.parametrize(
    ("placement", "words"),
    [
        ({"middle": PLACED}, "no FMU 'middle'"),
        ({"left": {"place": [0, 0, 0]}}, "unknown; "),
        ({"left": {"position": [0, 0]}}, "give three lengths"),
        ({"left": {"position": [0, 0, "3 s"]}}, "give a number in 'm'"),
        ({"left": {"turn": "1 m"}}, "give a number in 'rad'"),
        ({"left": {"size": ["1 mm"] * 3}}, "is a rod, whose shape is computed"),
        ({"left": {"motion": "tip.p"}}, "is a rod, whose shape is computed"),
        ({"object": {"size": 3}}, "give three lengths"),
        ({"object": {"size": [0, "1 mm", "1 mm"]}}, "out of range"),
        ({"object": {"motion": "left"}}, "not an output of one or three elements"),
        ({"left_heat": {"position": [0, 0, 0]}}, "has no shape to draw; add size"),
        ("left", "give a table"),
    ],
)
def test_placements_that_cannot_be_are_refused(placement: Any, words: str) -> None:
    with pytest.raises(tca.SceneError, match=re.escape(words)):
        tca.read("gripper", {"placement": placement})


def test_a_placement_is_changed_by_one_key() -> None:
    scene = tca.read("gripper", ["placement.left.turn=90 deg"])
    assert scene.placement["left"].turn == pytest.approx(np.pi / 2)
    assert scene.placement["left"].position == (-20e-3, 0.0, 0.0)
    assert scene.title == tca.read("gripper").title
