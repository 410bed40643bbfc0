"""FMUs made for tests: valid by the schema, and right in another host in both interfaces."""

from __future__ import annotations

import math
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmu_maker import boolean, enumeration, integer, make_fmu, real, string

GRAVITY = 9.81  # m/s^2
GEARS = '<SimpleType name="Gear"><Enumeration><Item name="low" value="3"/></Enumeration></SimpleType>'


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball dropped from 1 m that keeps 7/10 of its speed at each bounce."""
    return make_fmu(
        tmp_path_factory.mktemp("fmus") / "ball.fmu",
        [
            real("height", start=1.0),
            real("speed", start=0.0),
            real("der(height)", "local"),
            real("der(speed)", "local"),
            real("e", "parameter", start=0.7),
        ],
        output=f"real[2] = real[1]; real[3] = -{GRAVITY}; indicator[0] = real[0];",
        event="if (real[0] <= 0.0 && real[1] < 0.0) { real[0] = 0.0; real[1] *= -real[4]; }",
        states={"height": "der(height)", "speed": "der(speed)"},
        indicators=1,
        substeps=2000,
        model_exchange={},
    )


@pytest.mark.parametrize("interface", ["ModelExchange", "CoSimulation"])
def test_a_ball_bounces_in_both_interfaces(ball: Path, interface: str) -> None:
    result = fmpy.simulate_fmu(str(ball), stop_time=0.8, output_interval=0.1, fmi_type=interface, validate=True)
    impact = math.sqrt(2.0 / GRAVITY)
    later = 0.8 - impact
    expected = 0.7 * GRAVITY * impact * later - 0.5 * GRAVITY * later**2
    assert result["height"][-1] == pytest.approx(expected, abs=2e-3)


def test_variables_of_all_types(tmp_path: Path) -> None:
    path = make_fmu(
        tmp_path / "types.fmu",
        [
            real("y", start=1.5),
            integer("n", "input", start=4),
            boolean("on", "input", start="true"),
            string("text", "parameter", start='a "b" ä'),
            enumeration("gear", "parameter", declaredType="Gear", start=3),
            integer("count"),
        ],
        output="integer[2] = integer[0] + boolean[0] + integer[1] + (int)strlen(string[0]);",
        types=GEARS,
    )
    result = fmpy.simulate_fmu(str(path), stop_time=1.0, validate=True, output=["y", "count"])
    np.testing.assert_array_equal(result["y"], 1.5)
    np.testing.assert_array_equal(result["count"], 4 + 1 + 3 + 8)
