"""Inputs' derivatives go to an FMU up to the order that it takes; what else is offered falls back, said once."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
import tca_cosim as tca
from fmu_maker import make_fmu, real

SCENE = """
stop_time = 0.5
connections = []
[fmus]
a = "a.fmu"
[a]
u = { sine = { amplitude = 1, period = 2 } }
[coupling]
macro_step = 0.1
"""


def integrator(path: Path, order: int) -> Path:
    """x' = u; takes input derivatives up to an order."""
    return make_fmu(
        path,
        [real("u", "input", start=0.0), real("x", start=0.0)],
        step="real[1] += h * (real[0] + h * (slope[0][1] / 2 + h * (slope[0][2] / 6 + h * slope[0][3] / 24)));",
        co_simulation={"canInterpolateInputs": "true"} if order else {},
        flags=(f"-DINPUT_ORDER={order}",),
    )


@pytest.mark.parametrize(("order", "error"), [(3, 1e-6), (2, 1e-6), (1, 4e-3), (0, 6e-2)])
def test_a_signal_goes_as_high_as_the_fmu_takes_it(order: int, error: float, tmp_path: Path) -> None:
    """The integral of sin(pi t) over 0.5 s: exact mean for 3 and 2, trapezoidal rule for 1, end values for 0."""
    integrator(tmp_path / "a.fmu", order)
    (tmp_path / "scene.toml").write_text(SCENE)
    result = tca.run(tca.read(tmp_path / "scene.toml"))
    actual = abs(float(result["a.x"][-1]) - 1.0 / math.pi)
    assert actual < error
    assert order > 1 or actual > 0.1 * error
    notes = json.loads(result.attrs["notes"])
    said = {3: [], 2: ["up to order 2"], 1: ["up to order 1"], 0: ["no input derivatives"]}[order]
    assert len(notes) == len(said)
    assert all(part in note for part, note in zip(said, notes, strict=True))


def test_a_loop_of_fmus_that_take_lines_alone(tmp_path: Path) -> None:
    """The default exchange is a cubic and the source offers no rates: it runs, and says what it does."""
    integrator(tmp_path / "a.fmu", 1)
    make_fmu(
        tmp_path / "b.fmu",
        [real("x", "input", start=0.0), real("u")],
        step="real[0] += h * slope[0][1];",
        output="real[1] = 1.0 - 4.0 * real[0];",
        co_simulation={"canInterpolateInputs": "true"},
        flags=("-DINPUT_ORDER=1",),
    )
    (tmp_path / "scene.toml").write_text(
        """
stop_time = 1
connections = ["a.x -> b.x", "b.u -> a.u"]
[fmus]
a = "a.fmu"
b = "b.fmu"
[coupling]
macro_step = 0.05
"""
    )
    result = tca.run(tca.read(tmp_path / "scene.toml"))
    assert result.attrs["status"] == "complete"
    assert float(result["a.x"][-1]) == pytest.approx(0.25 * (1.0 - math.exp(-4.0)), abs=1e-3)
    notes = json.loads(result.attrs["notes"])
    assert len(notes) == len(set(notes))
    assert "b takes up to order 1 input derivatives" in notes
