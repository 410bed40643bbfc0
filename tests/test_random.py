"""Random scenes, seeded, violent ones among them: each completes or ends with a clean error, none hangs, nothing in a
result is not a number, and what was computed before an error is kept and marked."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import sys
import traceback
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.cosim.acceleration import METHODS as ITERATIONS
from tca_cosim.cosim.extrapolation import METHODS as EXCHANGES

SCENES = 500
HANG = 300.0  # [s] after which a scene that takes a second is taken for one that hangs


@cache
def rod_methods() -> list[str]:
    """All that the FMU has."""
    return list(tca.read("step").member("rod").archive.variables["method"].items)


def overrides(seed: int) -> list[str]:
    """Settings all over what is allowed, some beyond what is wise."""
    random = np.random.default_rng(seed)

    def log_uniform(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    moving = random.random() < 0.4
    stop = 0.06 if moving else 0.6
    signal = [
        lambda: f"{random.uniform(-4, 4)}",
        lambda: f"{{ steps = [[0, 0], [{random.uniform(0.01, 0.9) * stop}, {random.uniform(-20, 20)}]] }}",
        lambda: f"{{ ramps = [[0, 0], [{random.uniform(0.01, 2) * stop}, {random.uniform(-6, 6)}]] }}",
        lambda: f"{{ sine = {{ amplitude = {random.uniform(0, 5)}, period = {log_uniform(0.05, 30)} }} }}",
    ]
    return [
        f"stop_time={stop}",
        *(f"thermal.V[{k}]={random.choice(signal)()}" for k in (1, 2, 3)),
        f"coupling.macro_step={log_uniform(0.02, 2) * stop}",
        f"coupling.method={random.choice(['none', *ITERATIONS, 'iqn', 'iqn', 'iqn'])}",
        f"coupling.omega={random.uniform(0.05, 1)}",
        f"coupling.waveform={random.choice(list(EXCHANGES))}",
        f"coupling.exchange={random.choice(list(EXCHANGES))}",
        f"coupling.schedule={random.choice(['gauss_seidel', 'jacobi'])}",
        f"coupling.control={random.choice(['fixed', 'fixed', 'doubling', 'embedded'])}",
        f"coupling.step_tolerance={log_uniform(1e-4, 1e-1)}",
        f"coupling.tolerance={log_uniform(1e-9, 1e-3)}",
        f"coupling.max_sweeps={random.integers(2, 60)}",
        f"coupling.halvings={random.integers(0, 7)}",
        f"rod.dynamic={'true' if moving else 'false'}",
        f"rod.method={random.choice(rod_methods())}",
        f"rod.tca.E={log_uniform(1e6, 1e11)}",
        f"body.length={log_uniform(0.02, 0.1)}",
        f"rod.body.retardation={random.choice([0.0, log_uniform(1e-4, 1e-1)])}",
        f"rod.order={random.integers(0, 4 if moving else 8)}",
        f"rod.closure={random.choice(['inside', 'exchanged', 'exchanged'])}",
        f"rod.gravity[1]={random.choice([0.0, random.uniform(-10, 10)])}",
        f"rod.tip_force[2]={random.choice([0.0, random.uniform(-0.05, 0.05)])}",
        f"thermal.level={random.choice(['lumped', 'reduced', 'reduced', 'full'])}",
        f"thermal.tolerance={log_uniform(1e-5, 1e-2)}",
        f"thermal.tca.beta={random.choice([0.0, 0.0, random.uniform(-2, 10)])}",
        f"thermal.tca.alpha_T={random.choice([0.0, 0.004, random.uniform(-0.01, 0.02)])}",
    ]


def end(seed: int) -> tuple[str, str]:
    """How the scene ended: 'complete', 'partial' or 'refused', and what is wrong with that, empty where nothing is."""
    faulthandler.dump_traceback_later(HANG, exit=True)
    try:
        scene = tca.read("step", overrides(seed))
        try:
            result = tca.run(scene)
        except tca.CosimError as error:
            if error.partial is None:
                return "refused", ""
            result = error.partial
        complete = bool(result["time"][-1] == scene.stop_time)
        wrong = [
            name
            for name, values in result.data_vars.items()
            if name != "coupling.gain" and not np.isfinite(values).all()  # the gain: unknown at first
        ]
        status = result.attrs["status"]
        if (status == "complete") != complete or not (complete or status.startswith("partial: ")):
            wrong.append(f"status {status!r} at t = {result['time'][-1]} s")
        return "complete" if complete else "partial", ", ".join(wrong)
    except Exception:
        return "broken", traceback.format_exc()
    finally:
        faulthandler.cancel_dump_traceback_later()


@pytest.fixture(scope="module")
def ends() -> list[tuple[str, str]]:
    """Results of all scenes, by as many processes as there are cores; one that hangs or dies breaks the pool."""
    with ProcessPoolExecutor(os.cpu_count(), multiprocessing.get_context("spawn")) as pool:
        return list(pool.map(end, range(SCENES), chunksize=5))


@pytest.mark.parametrize("seed", range(SCENES))
def test_random_scene(seed: int, ends: list[tuple[str, str]]) -> None:
    how, wrong = ends[seed]
    assert how != "broken", wrong
    assert not wrong, how


def test_the_scenes_end_in_every_way(ends: list[tuple[str, str]]) -> None:
    counts = Counter(how for how, _ in ends)
    assert counts["complete"] > SCENES // 3
    assert counts["partial"] > SCENES // 20


if __name__ == "__main__":  # seeds to look at: how each ends
    for number in map(int, sys.argv[1:]):
        print(number, *end(number), *overrides(number), sep="\n  ")
