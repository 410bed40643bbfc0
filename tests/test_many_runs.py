"""Many runs of one scene: tables of runs, processes that are killed or die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import dask
import numpy as np
import pytest
import tca_cosim as tca
from sweep_plans import QUICK, TWO
from tca_cosim import CosimError
from tca_cosim.parallel import spread
from tca_cosim.studies import many_runs

PACKAGES = Path(tca.__file__).parents[1]  # for processes that import the same package


TABLE = {
    "rod.body.E": [37800.0, 30000.0, 45000.0, -1.0],  # the last one is out of range
    "thermal.h": [15.0, 18.0, 21.0, 24.0],
    "thermal.tca.R": [6.9, 7.1, 6.7, 6.9],
    "rod.tca.E": [5.6e8, 5.2e8, 6.0e8, 5.6e8],  # a scalar, and the vector that it stands for
}


@pytest.mark.parametrize(
    ("more", "engine"),
    [
        ({}, True),
        ({"rod.strains": ["bending", "extensible", "kirchhoff", "bending"]}, False),  # words
        ({"thermal.V[1]": [0.0, 1.0, 2.0, 3.0]}, False),  # an input
        ({"thermal.tca.beta": [0.0, 0.001, 0.0, 0.0]}, False),  # changes the wiring
    ],
)
def test_a_table_of_runs_gives_what_each_run_gives(more: dict, engine: bool) -> None:
    scene = tca.read("step", ["stop_time=3", "rod.closure=inside", "rod.order=1", "coupling.macro_step=1"])
    table = {**TABLE, **more}
    outputs = ["rod.tip.p", "thermal.T"]
    assert (many_runs.EngineRuns.of(scene, table, outputs) is not None) == engine
    actual = tca.run_many(scene, table, outputs)
    assert "rod.body.E = -1.0: out of range" in actual.failures[3]
    assert np.isnan(actual.outputs[3]).all()
    for k in range(3):
        assert actual.failures[k] == ""
        alone = tca.run(scene, {name: values[k] for name, values in table.items()})
        for name in outputs:
            assert np.array_equal(actual[name][k], alone[name][1:])


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"rod.body.E": [1.0, 2.0], "thermal.h": [15.0]}, "one for each run"),
        ({}, "one for each run"),
        ({"rod.body.EE": [1.0]}, "every run failed, the first with.*did you mean"),
        ({"coupling.macro_step": [0.1, 0.2]}, "other communication points"),
    ],
)
def test_mistakes_in_tables_are_named(table: dict, said: str) -> None:
    with pytest.raises(CosimError, match=said):
        tca.run_many(tca.read("step", ["stop_time=0.4"]), table)


@pytest.mark.parametrize("more", [{}, {"thermal.V[1]": [0.0, 0.1]}])  # by the engine, by the master
def test_what_fmus_warn_of_is_said_once(more: dict) -> None:
    scene = tca.read("step", ["stop_time=1", "rod.closure=inside"])
    with pytest.warns(tca.FmuWarning, match=r"^1 of 2 runs warn, the first, run 1, with: thermal: .* hottest") as said:
        runs = tca.run_many(scene, {"thermal.tca.R": [6.9, 0.3], **more})
    assert len(said) == 1
    assert runs.warnings[0] == ""
    assert runs.failures == ("", "")


@pytest.mark.filterwarnings("ignore::tca_cosim.FmuWarning", "ignore::tca_cosim.SceneWarning")
def test_a_run_with_halved_steps_is_kept_at_the_common_points() -> None:
    scene, values = tca.read("step", ["stop_time=2", "thermal.V[1]=2.9"]), [6.9, 0.15]
    runs = tca.run_many(scene, {"thermal.tca.R": values})
    assert runs.failures == ("", "")
    alone = tca.run(scene, {"thermal.tca.R": values[1]})
    assert alone.sizes["time"] > 21  # steps that failed were halved
    assert np.array_equal(runs["rod.tip.p"][1], alone["rod.tip.p"].sel(time=runs.times[1:]))


def test_killed_and_resumed(tmp_path: Path) -> None:
    """Two workers; SIGKILL of the whole process group in the middle; the file is that of an uninterrupted sweep in one
    process, byte for byte."""
    (tmp_path / "mine.toml").write_text("runs = 4000\n" + QUICK + TWO)
    command = [sys.executable, "-c", "from tca_cosim.cli import app; app()", "sweep", "mine.toml", "--workers", "2"]
    options = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": str(PACKAGES)}, "text": True}
    first = subprocess.Popen([*command], **options, stdout=subprocess.DEVNULL, start_new_session=True)
    log = tmp_path / "results" / "mine.sweep.sqlite-wal"
    while not (log.is_file() and log.stat().st_size > 60_000):
        assert first.poll() is None
        time.sleep(0.02)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    done = subprocess.run([*command, "--runs", "32"], **options, capture_output=True, check=True).stdout
    actual, now = (int(done.replace("\n", " ").split(word)[0].split()[-1]) for word in (" finished before", " now in"))
    assert actual > 2
    assert actual + now == 32
    subprocess.run([*command[:-1], "0", "--runs", "32", "--out", "whole"], **options, capture_output=True, check=True)
    names = [tmp_path / folder / "mine.sweep.nc" for folder in ("results", "whole")]
    assert names[0].read_bytes() == names[1].read_bytes()


class Dies:
    """A run in an FMU that takes its process with it."""

    def __call__(self) -> str:
        os._exit(1)

    def lost(self, why: str) -> str:
        return why


def test_a_run_that_kills_its_process_is_a_failure_of_its_own() -> None:
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
        actual = dict(spread([Dies(), lambda: "done"], workers=1))
    assert actual[0].startswith("the process that ran it died")
    assert actual[1] == "done"
