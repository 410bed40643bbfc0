"""Animations: GIF and MP4, their colours and sizes, and the commands that make them."""

from __future__ import annotations

import io
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from PIL import Image
from tca_cosim.cli import app
from tca_cosim.visualization import animation
from typer.testing import CliRunner


def test_a_gif_moves(step_result: xr.Dataset, tmp_path: Path) -> None:
    steps: list[None] = []
    animation.save(step_result, tmp_path / "step.gif", frames=5, fps=10.0, progress=lambda: steps.append(None))
    with Image.open(tmp_path / "step.gif") as film:
        assert (film.n_frames, film.info["duration"], film.info["loop"], len(steps)) == (5, 100, 0, 5)
        pictures = []
        for k in range(5):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB")).astype(int))
    half = pictures[0].shape[1] // 2
    for one, other in pairwise(pictures):
        changed = np.abs(one - other).max(axis=2) > 30
        assert changed[:, :half].sum() > 200  # the body
        assert changed[:, half:].sum() > 200  # the line in the charts


def test_an_mp4_has_its_frames(step_result: xr.Dataset, tmp_path: Path) -> None:
    import imageio_ffmpeg

    animation.save(step_result, tmp_path / "step.mp4", frames=6, fps=10.0)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "step.mp4"))
    assert next(reader)["size"] == (960, 540)
    assert len(list(reader)) == 6
    animation.save(step_result, tmp_path / "step.webm", frames=6, fps=10.0)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "step.webm"))
    assert next(reader)["codec"] == "vp9"


@pytest.mark.parametrize("scene", ["step", "push"])
def test_a_gif_is_small_by_default(scene: str) -> None:
    assert len(tca.run(scene).tca.animate().data) < 1e6


def test_the_colours_of_a_gif_are_those_of_the_lines(step_result: xr.Dataset) -> None:
    """One palette for all frames has the colours of the lines and of temperatures in it."""
    with Image.open(io.BytesIO(step_result.tca.animate(frames=3).data)) as film:
        film.seek(2)
        seen = np.asarray(film.convert("RGB")).reshape(-1, 3).astype(int)
    for colour in ((0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00), (0x00, 0x9E, 0x73)):
        assert np.abs(seen - colour).max(axis=1).min() <= 12


def test_films_that_cannot_be_are_refused(
    step_result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path, count, fps, text in (
        ("a.avi", 5, 10.0, r"\.gif, \.mp4, \.webm"),
        ("a.gif", 1, 10.0, "2 or more"),
        ("a.gif", 5, 0.0, "fps"),
    ):
        with pytest.raises(tca.CosimError, match=text):
            animation.save(step_result, tmp_path / path, count, fps)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(tca.CosimError, match=r"tca-cosim\[report\]"):
        animation.save(step_result, tmp_path / "a.mp4", 2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["report"], "not both"),
        (["report", "step", "--from", "step.nc"], "not both"),
        (["animate", "--from", "step.nc", "--set", "rod.order=1"], "a result cannot be changed"),
        (["animate", "--from", "nowhere.nc"], "nowhere.nc"),
        (["report", "--from", "other.nc"], "not a result of a run"),
    ],
)
def test_commands_that_have_nothing_to_show(
    arguments: list[str], text: str, step_result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    tca.write(step_result, tmp_path / "step.nc")
    xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "other.nc")
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert text in " ".join(done.stderr.split())
    assert not (tmp_path / "results").exists()


def test_a_run_that_fails_is_shown_as_far_as_it_came(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["report", "plain", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "diverges" in done.stderr
    assert "ended early" in (tmp_path / "plain.partial.html").read_text(encoding="utf-8")
