"""What a new user does: four TCAs, a tapered body and voltages from a file in one scene, without a compiler."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmu_host import ROOT
from tca_cosim import results

PAGE = ROOT / "docs" / "tutorials" / "own_manipulator.md"


def written(name: str) -> str:
    """The text that the tutorial writes to a file."""
    actual = re.search(rf'Path\("{re.escape(name)}"\)\.write_text\("""\n?(.*?)"""\)', PAGE.read_text(), re.DOTALL)
    assert actual, name
    return actual[1]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("volts.csv", "four.toml"):
        (tmp_path / name).write_text(written(name))
    return tmp_path


@pytest.mark.slow
def test_one_scene_of_twenty_lines_is_enough(folder: Path) -> None:
    assert len((folder / "four.toml").read_text().strip().splitlines()) <= 20
    bare = {k: os.environ[k] for k in ("PYTHONPATH", "SYSTEMROOT") if k in os.environ}  # no PATH, so no compiler
    command = [sys.executable, "-c", "from tca_cosim.cli import app; app()", "run", "four.toml"]
    done = subprocess.run(
        command,
        cwd=folder,
        env={**bare, "HOME": str(folder), "XDG_CACHE_HOME": str(folder / "cache")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    result = results.read(folder / "results" / "four.nc")
    assert result["thermal.T"].shape[1] == 4
    np.testing.assert_allclose(result["thermal.V"].sel(time=11.0), [1.5, 1.0, 1.25, 0.0], atol=1e-12)
    hot = int(np.argmin(np.abs(result["time"].to_numpy() - 10.0)))
    assert result["rod.tip.p"][hot, 0] < -5e-3  # away from the hot TCA
    assert result["rod.tip.p"][-1, 0] > 5e-3
