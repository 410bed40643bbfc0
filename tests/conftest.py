"""Markers of whole modules: what `make check` leaves out, because it is slow or needs other makers' software; and
fixtures of several modules."""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from command_line import SCENE
from fmu_maker import boolean, integer, make_fmu, real
from ssp_maker import Reader
from tca_cosim.cli import console
from tca_cosim.visualization.report.field import Field, field

# Caches of tests, and of the processes that they start, lie apart from the user's.
os.environ.setdefault("TCA_COSIM_CACHE", str(Path(tempfile.gettempdir()) / f"tca-cosim-tests-{os.environ.get('USER')}"))

HOSTS = {"test_cofmupy", "test_hosts", "test_peers", "test_portable"}
SLOW = {
    "test_animation",
    "test_any_fmu_archives",
    "test_any_fmu_runs",
    "test_any_fmu_variables",
    "test_api",
    "test_body_errors",
    "test_call_orders",
    "test_cli",
    "test_communication_points",
    "test_failures",
    "test_fmu_exchange",
    "test_fmu_files",  # also needs what only the C++ build makes
    "test_fmu_maker",
    "test_fmu_slave",
    "test_foreign",
    "test_frozen_subsystem",
    "test_fuzz_description",
    "test_interruptions",
    "test_many_runs",
    "test_mistakes",
    "test_model_exchange",
    "test_model_selection",
    "test_monolith",
    "test_monolith_events",
    "test_outcomes",
    "test_paper",
    "test_placement",
    "test_random",
    "test_random_loads",
    "test_reference",
    "test_report",
    "test_report_pages",
    "test_rod",
    "test_scene_properties",
    "test_select",
    "test_ssp",
    "test_stability",
    "test_step_halving",
    "test_sweep",
    "test_sweep_mistakes",
    "test_tangent",
    "test_verify",
    "test_wild_parameters",
    "test_work_precision",
}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds --numbers."""
    parser.addoption("--numbers", action="store_true", help="print the numbers that tests compare with a bar")


@pytest.fixture
def at_most(record_property: Callable[[str, object], None]) -> Callable[[str, float, float], None]:
    """Asserts that a number does not pass its bar, and records both, which --numbers prints."""

    def check(what: str, value: float, bar: float) -> None:
        record_property(what, (float(value), bar))
        assert value <= bar, f"{what}: {value:.4g}, at most {bar:g}"

    return check


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Prints the recorded numbers beside their bars."""
    if not config.getoption("--numbers"):
        return
    terminalreporter.section("numbers")
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for what, (value, bar) in report.user_properties if report.when == "call" else ():
                terminalreporter.line(f"{value:11.4g}  at most {bar:<8g} {what}  [{report.nodeid}]")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of these modules."""
    for item in items:
        name = item.path.stem
        if name in HOSTS:
            item.add_marker(pytest.mark.hosts)
        if name in SLOW:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def ssp_fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """src: y = k; dst: y = u + 1000 p; none of them has units, celsius has."""
    folder = tmp_path_factory.mktemp("fmus")
    source = [real("y"), real("k", "parameter", start=1), boolean("on", "parameter", start="false")]
    target = [
        real("u", "input", start=0),
        real("y"),
        real("p", "parameter", start=7),
        integer("n", "parameter", start=0),
    ]
    celsius = [real("u", "input", start=0, unit="degC"), real("y", unit="degC")]
    made = [
        make_fmu(folder / "src.fmu", source, output="real[0] = real[1];"),
        make_fmu(folder / "dst.fmu", target, output="real[1] = real[0] + 1000 * real[2];"),
        make_fmu(
            folder / "celsius.fmu",
            celsius,
            output="real[1] = real[0];",
            units='<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>',
        ),
    ]
    return {path.name: path.read_bytes() for path in made}


@pytest.fixture
def reading(tmp_path: Path, ssp_fmus: dict[str, bytes]) -> Reader:
    return Reader(tmp_path, ssp_fmus)


@pytest.fixture
def make(tmp_path: Path) -> Callable[..., str]:
    """Makes an FMU of that name; returns the name of its file."""

    def fmu(name: str, variables: list, **more: Any) -> str:
        return make_fmu(tmp_path / f"{name}.fmu", variables, **more).name

    return fmu


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tca.Scene]:
    """Reads a scene of FMUs in the folder of the test."""
    monkeypatch.chdir(tmp_path)

    def read(fmus: dict[str, str], *connections: str, stop: float = 1.0, step: float = 0.25, **more: Any) -> tca.Scene:
        coupling = {"macro_step": step, "exchange": "held", "waveform": "held", **more.pop("coupling", {})}
        table = {"stop_time": stop, "connections": list(connections), "fmus": fmus, "coupling": coupling, **more}
        return tca.read(table)

    return read


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a good scene, a table of data and a folder, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(console.out.console, "width", 200)
    (tmp_path / "good.toml").write_text(SCENE)
    (tmp_path / "data.csv").write_text("t,V1\n0,0\n1,2\n")
    (tmp_path / "folder").mkdir()
    return tmp_path


@pytest.fixture(scope="session")
def step_result() -> xr.Dataset:
    """The scene `step`, shortened, for what looks at results."""
    return tca.run(tca.read("step", ["stop_time=12", "coupling.macro_step=0.25"]))


@pytest.fixture(scope="session")
def step_field(step_result: xr.Dataset) -> Field:
    return field(step_result, "thermal", np.arange(49))


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let SIGINT raise KeyboardInterrupt: a shell's jobs in the background start with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
