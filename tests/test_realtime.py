"""Runs in step with the clock: the numbers of the master, one duration for each step, allocations counted."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.cli import realtime as cli_realtime
from tca_cosim.engine.realtime import counting_library, run_realtime
from test_cli import tca as command

DROP = ["stop_time=0.05", "coupling.macro_step=1 ms"]


def test_a_paced_run_is_the_masters() -> None:
    scene = tca.read("drop", DROP)
    result = run_realtime(scene, 0.002, ["rod.tip.p"])
    alone = tca.run(scene)
    assert np.array_equal(result.times, alone["time"])
    np.testing.assert_allclose(result.outputs, alone["rod.tip.p"], rtol=0.0, atol=1e-14)
    assert result.durations.shape == (50,)
    assert (result.durations > 0.0).all()
    assert result.worst_lateness >= 0.0
    assert 0 <= result.misses <= 50
    assert result.busy.shape == (50,)
    assert result.allocations is None  # nobody counts in this process


@pytest.mark.parametrize("name", ["drop", "tap", "pulse", "serial", "payload", "step", "feedback", "fan"])
@pytest.mark.skipif(counting_library() is None, reason="allocations are counted on Linux")
def test_steps_allocate_nothing(name: str, tmp_path: Path) -> None:
    sets = ["--set", "stop_time=0.5", "--set", "coupling.macro_step=20 ms"]
    done = command("realtime", name, *sets, "--period", "0 ms", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "allocations in steps: 0;" in done.stdout


def test_deadlines_that_cannot_be_met_are_missed_and_said() -> None:
    result = run_realtime(tca.read("drop", DROP), 1e-7)
    assert result.misses > 40
    if np.isfinite(result.busy).all():
        assert result.own_misses > 40  # whoever else had the core
    assert run_realtime(tca.read("drop", DROP), 0.0).misses == 0  # as fast as it can: there is no deadline


@pytest.mark.parametrize("period", [1e-4, 0.01])
def test_what_others_take_is_no_miss_of_the_steps(period: float) -> None:
    """Steps as late as they are for a thread that has a core whenever it asks for one."""
    result = run_realtime(tca.read("drop", DROP), period)
    if np.isnan(result.busy).any():
        pytest.skip("no clock of a thread's processor time")
    assert (result.busy > 0.0).all()
    assert (result.busy <= result.durations + 1e-6).all()  # read within
    end, expected = 0.0, 0
    for k, busy in enumerate(result.busy):
        end = max(end, k * period) + busy
        expected += end > (k + 1) * period
    assert abs(result.own_misses - expected) <= 1  # periods are whole nanoseconds
    assert result.own_misses <= result.misses + 1  # the clocks of thread and system differ by a microsecond


def test_the_same_work_beside_every_step_shows_the_host() -> None:
    paced = run_realtime(tca.read("drop", DROP), 0.01)
    assert np.isfinite(paced.fixed).sum() > 15  # nan in the first steps, and where a step left no time for it
    typical = np.nanmedian(paced.fixed) / np.median(paced.durations)
    assert 0.05 < typical < 20.0  # about as long as a step
    assert np.isnan(run_realtime(tca.read("drop", DROP), 0.0).fixed).all()


@pytest.mark.usefixtures("interruptible")
def test_the_user_stops_a_run_and_keeps_its_steps() -> None:
    scene = tca.read("drop", ["stop_time=60", "coupling.macro_step=1 ms"])
    reached: list[float] = []

    def interrupt_after_some(time: float) -> None:
        reached.append(time)
        if time > 0.0:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(tca.Interrupted, match=r"stopped by the user at t = .* of 60 s") as stopped:
        run_realtime(scene, 0.001, progress=interrupt_after_some)
    partial = stopped.value.partial
    steps = partial.durations.size
    assert 0 < steps < 60_000
    assert (partial.durations > 0.0).all()
    assert partial.times.size == len(partial.outputs) == steps + 1
    assert partial.times[-1] >= reached[-1] > 0.0


@pytest.mark.usefixtures("interruptible")
def test_the_command_shows_and_writes_what_was_measured_until_ctrl_c(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt_after_some(time: float) -> None:
        if time > 0.0:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(cli_realtime, "watched", lambda scene, solve: solve(interrupt_after_some))
    monkeypatch.setattr(cli_realtime, "count_allocations", lambda: None)  # it would start this process anew
    with pytest.raises(SystemExit) as ended:
        cli_realtime.command("drop", ["stop_time=600"], "1 ms", tmp_path)
    assert ended.value.code == 130
    shown, said = capsys.readouterr()
    assert "stopped by the user at t = " in said
    assert "steps, " in shown
    assert len((tmp_path / "drop.realtime.csv").read_text().splitlines()) > 1


@pytest.mark.parametrize(("name", "stop"), [("step", 1.0), ("feedback", 1.0), ("switch", 16.0)])
def test_loops_are_iterated_as_the_master_does(name: str, stop: float) -> None:
    scene = tca.read(name, {"stop_time": stop})
    result, alone = run_realtime(scene, 0.0, ["rod.tip.p"]), tca.run(scene)
    np.testing.assert_allclose(result.outputs, alone["rod.tip.p"], rtol=0.0, atol=1e-14)
    assert result.sweeps == json.loads(alone.attrs["statistics"])["most_sweeps"]
    assert run_realtime(tca.read("drop", DROP), 0.0).sweeps == 1


def test_a_refused_step_is_an_error() -> None:
    with pytest.raises(tca.SubsystemError, match=r"not solved after 3 sweeps.*coupling.max_sweeps"):
        run_realtime(tca.read("step", ["stop_time=1", "coupling.max_sweeps=3"]), 0.0)
    with pytest.raises(tca.SceneError, match="quasi-Newton"):
        run_realtime(tca.read("plain", ["stop_time=0.1"]), 0.0)


@pytest.mark.parametrize("name", ["step", "feedback"])
@pytest.mark.skipif(counting_library() is None, reason="allocations are counted on Linux")
def test_events_allocate_nothing(name: str, tmp_path: Path) -> None:
    """Loops are iterated at the instant of an event too."""
    steps = 'thermal.V[1]={ steps = [["0 s", "0 V"], ["0.1 s", "2 V"], ["0.2 s", "1 V"]] }'
    done = command("realtime", name, "--set", "stop_time=0.4", "--set", steps, "--period", "0 ms", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "allocations in steps: 0;" in done.stdout


@pytest.mark.skipif(counting_library() is None, reason="allocations are counted on Linux")
def test_the_command_counts_and_writes(tmp_path: Path) -> None:
    done = command("realtime", "drop", "--set", "stop_time=0.1", "--period", "5 ms", folder=tmp_path)
    assert done.returncode in (0, 1), done.stderr  # 1: a busy machine
    assert "20 steps, " in done.stdout
    assert "of them by their own processor time" in done.stdout
    assert "processor time at most" in done.stdout
    assert "allocations in steps: 0;" in done.stdout
    lines = (tmp_path / "results" / "drop.realtime.csv").read_text().splitlines()
    assert lines[0] == "time [s],duration [s],processor time [s]"
    assert len(lines) == 21
    assert float(lines[2].split(",")[0]) == 0.005


@pytest.mark.skipif(counting_library() is None, reason="allocations are counted on Linux")
def test_every_allocation_of_a_thread_is_counted() -> None:
    code = (
        "import ctypes; c = ctypes.CDLL(None); f = c.tca_allocations; f.restype = ctypes.c_ulong; "
        "c.malloc.restype = ctypes.c_void_p; before = f(); [c.malloc(10) for _ in range(1000)]; print(f() - before)"
    )
    environment = {"LD_PRELOAD": str(counting_library())}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert int(done.stdout) >= 1000
