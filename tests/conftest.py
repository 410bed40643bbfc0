"""Markers of whole modules: what `make check` leaves out, because it is slow or needs other makers' software."""

from __future__ import annotations

import pytest

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
