"""Markers of whole modules: what `make check` leaves out, because it is slow or needs other makers' software; and
fixtures of several modules."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest
from fmu_maker import boolean, integer, make_fmu, real
from ssp_maker import Reader

# Caches of tests, and of the processes that they start, lie apart from the user's.
os.environ.setdefault("TCA_COSIM_CACHE", str(Path(tempfile.gettempdir()) / f"tca-cosim-tests-{os.environ.get('USER')}"))

HOSTS = {"test_cofmupy", "test_hosts", "test_peers", "test_portable"}
SLOW = {
    "test_any_fmu",
    "test_api",
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
    "test_mistakes",
    "test_model_exchange",
    "test_model_selection",
    "test_monolith",
    "test_monolith_events",
    "test_paper",
    "test_random",
    "test_reference",
    "test_report",
    "test_rod",
    "test_scene_properties",
    "test_select",
    "test_ssp",
    "test_stability",
    "test_sweep",
    "test_tangent",
    "test_verify",
    "test_wild_parameters",
    "test_work_precision",
}


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
