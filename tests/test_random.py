"""Random scenes, seeded: each completes or ends with a clean error, and nothing in a result is not a number."""

from __future__ import annotations

import numpy as np
import pytest

import orchestration as tca
from orchestration.scene import ITERATIONS

SCENES = 120


def overrides(seed: int) -> list[str]:
    """Settings all over what is allowed, some beyond what is wise."""
    random = np.random.default_rng(seed)

    def log_uniform(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    signal = [
        lambda: f"{random.uniform(-4, 4)}",
        lambda: f"{{ steps = [[0, 0], [{random.uniform(0.01, 0.9)}, {random.uniform(-20, 20)}]] }}",
        lambda: f"{{ ramps = [[0, 0], [{random.uniform(0.01, 2)}, {random.uniform(-6, 6)}]] }}",
        lambda: f"{{ sine = {{ amplitude = {random.uniform(0, 5)}, period = {log_uniform(0.05, 30)} }} }}",
    ]
    return [
        "stop_time=1",
        *(f"thermal.V[{k}]={random.choice(signal)()}" for k in (1, 2, 3)),
        f"coupling.macro_step={log_uniform(0.02, 2)}",
        f"coupling.method={random.choice(['none', *ITERATIONS, 'iqn', 'iqn', 'iqn'])}",
        f"coupling.omega={random.uniform(0.05, 1)}",
        f"coupling.waveform={random.choice(['held', 'linear', 'quadratic', 'hermite'])}",
        f"coupling.exchange={random.choice(['held', 'linear', 'quadratic', 'hermite'])}",
        f"coupling.schedule={random.choice(['gauss_seidel', 'jacobi'])}",
        f"coupling.control={random.choice(['fixed', 'fixed', 'doubling'])}",
        f"coupling.tolerance={log_uniform(1e-9, 1e-3)}",
        f"coupling.max_sweeps={random.integers(2, 60)}",
        f"rod.tca.E={log_uniform(1e6, 1e11)}",
        f"rod.body.length={log_uniform(0.02, 0.1)}",
        f"rod.order={random.integers(0, 5)}",
        f"rod.closure={random.choice(['inside', 'exchanged', 'exchanged'])}",
        f"rod.gravity[1]={random.choice([0.0, random.uniform(-10, 10)])}",
        f"rod.tip_force[2]={random.choice([0.0, random.uniform(-0.05, 0.05)])}",
        f"thermal.level={random.choice(['lumped', 'reduced'])}",
        f"thermal.tca.beta={random.choice([0.0, 0.0, random.uniform(-2, 10)])}",
        f"thermal.tca.alpha_T={random.choice([0.0, 0.004, random.uniform(-0.01, 0.02)])}",
    ]


@pytest.mark.parametrize("seed", range(SCENES))
def test_random_scene(seed: int) -> None:
    try:
        result = tca.run(tca.read("step", overrides(seed)))
    except tca.CosimError as error:
        result = error.partial
        if result is None:  # refused before the start
            return
    assert (result.attrs["status"] == "complete") == (float(result["time"][-1]) == 1.0)
    for name, values in result.data_vars.items():
        if name != "coupling.gain":  # not a number while nothing is known of it
            assert np.isfinite(values).all(), name
