"""Macro steps in C++: the same results, statistics, warnings and errors as those of the master."""

from __future__ import annotations

import json
import warnings
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.cosim.acceleration.secants import norm
from tca_cosim.fmi import block_steps, compiled_arithmetic, engine_library
from tca_cosim.fmi.block_steps import BlockSteps

SCENES = {
    "feedback": {"stop_time": "4 s"},  # a loop of both FMUs
    "switch": {"stop_time": "6 s"},  # events
    "sine": {"stop_time": "3 s"},  # signals that vary
    "push": {"stop_time": "1 s"},
    "drop": {"stop_time": "0.2 s"},  # warns, no loop
    "serial": {"stop_time": "2 s"},  # three FMUs
    "jump": {},  # fails a step, which is halved
    "plain": {},  # not by quasi-Newton
}


def run(name: str, overrides: dict[str, Any]) -> tuple[Any, list[str], str]:
    """Result, warnings and error of a scene."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result, error = tca.run(name, overrides), ""
        except tca.CosimError as failure:
            result, error = failure.partial, str(failure)
    return result, sorted(str(one.message) for one in caught), error


def statistics(result: Any) -> dict[str, Any]:
    return {key: value for key, value in json.loads(result.attrs["statistics"]).items() if key != "seconds"}


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of steps that blocks took."""
    counts: list[int] = []
    take = BlockSteps.take

    def counted(self: BlockSteps, *steps: np.ndarray) -> Any:
        logs = take(self, *steps)
        counts.append(len(logs))
        return logs

    monkeypatch.setattr(BlockSteps, "take", counted)
    monkeypatch.setattr(block_steps, "LIMIT", 60.0)  # a busy machine ends no block early
    return counts


def by_the_master(monkeypatch: pytest.MonkeyPatch, name: str, overrides: dict[str, Any]) -> tuple[Any, list[str], str]:
    with monkeypatch.context() as patch:
        patch.setattr(BlockSteps, "of", lambda master, recorders: None)
        return run(name, overrides)


def assert_same(one: tuple[Any, list[str], str], other: tuple[Any, list[str], str]) -> None:
    assert one[1:] == other[1:]
    for name, values in other[0].data_vars.items():
        assert one[0][name].to_numpy().tobytes() == values.to_numpy().tobytes(), name
    assert statistics(one[0]) == statistics(other[0])
    for key in ("warnings", "notes", "ended", "status"):
        assert one[0].attrs[key] == other[0].attrs[key]


@pytest.mark.parametrize("name", SCENES)
def test_blocks_give_what_the_master_gives(name: str, taken: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = run(name, SCENES[name])
    assert_same(blocks, by_the_master(monkeypatch, name, SCENES[name]))
    steps = statistics(blocks[0])["steps"]
    if name not in ("jump", "plain"):
        assert sum(taken) > 0.7 * steps
    if name == "plain":
        assert not taken


@pytest.mark.parametrize("name", ["sine", "switch"])
def test_without_a_loop_blocks_take_every_step(name: str, taken: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    inside = {"rod.closure": "inside", "stop_time": "6 s"}
    blocks = run(name, inside)
    assert sum(taken) == statistics(blocks[0])["steps"]
    assert_same(blocks, by_the_master(monkeypatch, name, inside))


@pytest.mark.parametrize(
    "overrides",
    [
        {"rod.tip_force": [{"ramps": [["0 s", "0 N"], ["2 s", "40 N"]]}, "0 N", "0 N"], "stop_time": "2 s"},
        {"coupling.max_sweeps": 2, "stop_time": "3 s"},
        {"coupling.reach": 0.05, "stop_time": "3 s"},
        {"coupling.tolerance": 1e-10, "coupling.macro_step": "0.4 s", "stop_time": "4 s"},
    ],
    ids=["fails", "does not converge", "goes too far", "halves"],
)
@pytest.mark.parametrize("limit", [block_steps.LIMIT, 1e-9], ids=["", "when the time is over"])
@pytest.mark.slow
def test_a_step_that_fails_is_the_masters(
    overrides: dict[str, Any], limit: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_steps, "LIMIT", limit)
    assert_same(run("step", overrides), by_the_master(monkeypatch, "step", overrides))


def test_progress_is_that_of_every_step() -> None:
    times: list[float] = []
    result = tca.run("step", {"stop_time": "3 s"}, progress=times.append)
    assert times == result.time.to_numpy()[1:].tolist()


def test_short_blocks_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run("feedback", {"stop_time": "2 s"})
    monkeypatch.setattr(block_steps, "LIMIT", 1e-9)  # one step at a time: each is over the limit
    assert_same(run("feedback", {"stop_time": "2 s"}), whole)


def test_without_the_blas_of_numpy_the_master_runs(taken: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run("feedback", {"stop_time": "1 s"})
    assert taken
    taken.clear()
    monkeypatch.setattr(block_steps, "find_arithmetic", lambda unknowns, outputs: None)
    assert_same(run("feedback", {"stop_time": "1 s"}), whole)
    assert not taken


def test_sums_round_as_numpys() -> None:
    actual = compiled_arithmetic.find_arithmetic(frozenset(range(1, 13)), frozenset(range(1, 25)))
    assert actual is not None


def test_norm_rounds_as_pythons() -> None:
    engine = compiled_arithmetic._arithmetic().engine
    generator = np.random.default_rng(1)
    for n in (1, 2, 3, 7):
        for v in generator.standard_normal((2000, n)) * 10.0 ** generator.integers(-200, 200, (2000, 1)):
            assert engine.tca_norm(v.ctypes, n) == norm(v)


def test_an_engine_of_another_version_leaves_the_steps_to_the_master(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its structures are of another size."""
    engine = compiled_arithmetic._arithmetic().engine

    class Other:
        tca_take_steps = engine.tca_take_steps

        @staticmethod
        def tca_layout() -> int:
            return int(engine.tca_layout()) + 8

    monkeypatch.setattr(engine_library, "load_engine", Other)
    compiled_arithmetic._arithmetic.cache_clear()
    try:
        assert compiled_arithmetic.find_arithmetic(frozenset({3}), frozenset({3})) is None
        assert engine_library.load_block_engine() is None
    finally:
        compiled_arithmetic._arithmetic.cache_clear()
