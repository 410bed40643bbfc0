"""The command line as a person uses it, in its own process."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import tca_cosim
import xarray as xr
from rich.table import Table
from tca_cosim import results
from tca_cosim.cli import console

ROOT = Path(__file__).parent.parent
PACKAGES = Path(tca_cosim.__file__).parents[1]  # for processes that import the same package


def tca(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(PACKAGES), "COLUMNS": "300"}
    command = [sys.executable, "-c", "from tca_cosim.cli import app; app()", *arguments]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )


def test_run_writes_both_files(tmp_path: Path) -> None:
    done = tca("run", "step", "--set", "stop_time=1", "--set", "thermal.V[3]=2.5 V", "--out", "there", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "10 macro steps" in done.stdout
    assert sorted(file.name for file in (tmp_path / "there").iterdir()) == ["step.csv", "step.nc"]
    assert results.read(tmp_path / "there" / "step.nc")["thermal.V"][-1, 2] == 2.5


def test_a_scene_file_runs_from_anywhere(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('stop_time = "0.2 s"\n[rod]\ndynamic = false\n')
    done = tca("run", "mine.toml", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results" / "mine.nc").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "stepp"], "did you mean 'step'"),
        (["run", "step", "--set", "rod.order=99"], "allowed: 0 to 7"),
        (["run", "step", "--set", "tca.offset=4.9 mm"], "thermal: "),
        (["run", "step", "--set", "thermal.V[2]=nan"], "not finite"),
        (["export"], "--ssp FILE.ssp"),
    ],
    ids=["scene", "range", "geometry", "nan", "export"],
)
def test_mistakes_give_one_message_and_no_file(arguments: list[str], said: str, tmp_path: Path) -> None:
    done = tca(*arguments, folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert said in done.stderr
    assert "Traceback" not in done.stderr + done.stdout
    assert not (tmp_path / "results").exists()


def test_the_failure_scene_names_the_gain_and_keeps_older_results(tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "plain.nc").write_text("older")
    done = tca("run", "plain", folder=tmp_path)
    assert done.returncode == 2
    assert "Estimated loop gain 3.2" in done.stderr
    assert "coupling.method = 'iqn'" in done.stderr
    assert (tmp_path / "results" / "plain.nc").read_text() == "older"
    assert isinstance(results.read(tmp_path / "results" / "plain.partial.nc"), xr.Dataset)


def test_export_and_list(tmp_path: Path) -> None:
    assert tca("export", "fmus", folder=tmp_path).returncode == 0
    assert sorted(file.name for file in (tmp_path / "fmus").iterdir()) == ["rod.fmu", "thermal.fmu"]
    assert tca("export", "--ssp", "there/scene.ssp", folder=tmp_path).returncode == 0
    assert zipfile.is_zipfile(tmp_path / "there" / "scene.ssp")
    listed = tca("list", folder=tmp_path).stdout
    assert all(name in listed for name in ("step", "switch", "sine", "plain"))
    assert f"files: {PACKAGES / 'tca_cosim' / 'scenes'}" in listed


def test_units_in_tables_are_no_markup(capsys: pytest.CaptureFixture[str]) -> None:
    console.out.print(Table("length [m]", title="in 2 [s]"))
    shown = capsys.readouterr().out
    assert "length [m]" in shown
    assert "in 2 [s]" in shown
