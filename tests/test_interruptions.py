"""Full disks, missing permissions, interrupted runs, unexpected errors."""

from __future__ import annotations

import errno
import os
import signal
import types
from pathlib import Path

import pytest
import tca_cosim as tca
from command_line import call
from tca_cosim import results
from tca_cosim.cli import console
from tca_cosim.files import atomic_write


def test_full_disks_and_missing_permissions_are_one_line(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for code, words in {errno.ENOSPC: "no space left on device; free some space", errno.EACCES: "--out"}.items():

        def fail(*_: object, code: int = code) -> None:
            raise OSError(code, os.strerror(code), "results/good.nc")

        monkeypatch.setattr(results, "write", fail)
        done = call("run", "good.toml")
        assert done.exit_code == 2
        assert "error: results/good.nc: " in done.stderr
        assert words in done.stderr


def test_a_full_disk_leaves_no_part_of_a_file(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the library that writes says of it."""

    def write(draft: Path, error: Exception) -> None:
        draft.write_text("half")
        raise error

    for error in (OSError(errno.ENOSPC, "full"), PermissionError(errno.EACCES, "denied"), RuntimeError("NetCDF: HDF")):
        with monkeypatch.context() as patch:
            patch.setattr("shutil.disk_usage", lambda folder: types.SimpleNamespace(free=0))
            with (
                pytest.raises(OSError, match="No space left") as caught,
                atomic_write(here / "there" / "a.nc") as draft,
            ):
                write(draft, error)
        assert caught.value.filename == str(here / "there" / "a.nc")
        assert list((here / "there").iterdir()) == []
    with pytest.raises(PermissionError) as denied, atomic_write(here / "a.nc") as draft:
        write(draft, PermissionError(errno.EACCES, "denied", str(draft)))
    assert denied.value.filename == str(here / "a.nc")


def test_an_interrupted_run_keeps_what_was_computed(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(time: float) -> None:
        if time > 0.15:
            raise KeyboardInterrupt

    with pytest.raises(tca.Interrupted, match=r"stopped by the user at t = .* of 0\.5 s") as caught:
        tca.run("good.toml", {"stop_time": 0.5}, interrupt)
    assert caught.value.partial["time"].size >= 2
    monkeypatch.setattr(console, "watched", lambda scene, solve: solve(interrupt))
    done = call("run", "good.toml", "--set", "stop_time=0.5")
    assert done.exit_code == 130
    assert "good.partial.nc" in done.stdout
    assert "partial: stopped by the user" in results.read(here / "results" / "good.partial.nc").attrs["status"]


def test_sigterm_does_what_ctrl_c_does(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def terminate(time: float) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(console, "watched", lambda scene, solve: solve(terminate))
    before = signal.getsignal(signal.SIGTERM)
    done = call("run", "good.toml")
    assert done.exit_code == 130
    assert (here / "results" / "good.partial.nc").is_file()
    assert signal.getsignal(signal.SIGTERM) == before


def test_unexpected_errors_are_one_line_too(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise TypeError("a fault\nof two lines")

    monkeypatch.setattr(results, "write", fail)
    done = call("run", "good.toml")
    assert done.exit_code == 70
    assert "unexpected TypeError: a fault of two lines; this is a fault of tca-cosim" in done.stderr
    monkeypatch.setenv(console.TRACEBACK, "1")
    assert isinstance(call("run", "good.toml").exception, TypeError)
