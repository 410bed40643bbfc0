"""Both FMUs in other units: what has a dimension is multiplied by powers of two; outputs must follow to the last bit.

A constant with a hidden unit, such as a length below which something counts as zero, shows at once: results are right
for bodies of micrometres and of metres, or for none.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import pytest
from fmu_host import SUBJECTS, FMU2Host

PATHS = {subject.name: subject.path for subject in SUBJECTS}
BASE = ("kg", "m", "s", "A", "K")
# Parameters of laws that a case does not use; their usual values would leave their ranges.
UNUSED = ("tca.stop", "tca.stop_width", "tca.stop_stiffness", "tca.stiffening", "tca.stroke_curvature")
ROD_SCALES = (
    {"m": 2.0**-8, "kg": 2.0**-24, "s": 2.0**-8},
    {"m": 2.0**6},
    {"kg": 2.0**-24},
    {"kg": 2.0**16},
    {"s": 2.0**12},
    {"K": 2.0**4},
)
HEAT_SCALES = (
    {"m": 2.0**-12, "kg": 2.0**-36, "s": 2.0**-12},
    {"m": 2.0**12},
    {"kg": 2.0**-12},
    {"s": 2.0**8},
    {"A": 2.0**12},
)
LOADS = {"T[1]": 340.0, "gravity[1]": 9.81, "gravity[3]": -9.81, "tip_force[1]": 1e-3}
HEAT = {"V[1]": 4.0, "V[2]": 2.0, "delta[1]": 1e-3}
CASES: list[tuple[str, dict[str, Any], dict[str, float], float]] = [
    *(("rod", {"method": method}, LOADS, 0.02) for method in (1, 2, 3, 4, 5, 6)),
    ("rod", {"dynamic": False}, LOADS, 0.1),
    ("rod", {"dynamic": False}, {"tip_force[3]": -0.1, "tip_force[1]": 1e-6}, 0.1),  # buckled
    ("rod", {"dynamic": False, "tca.pitch": 2, "start_at_equilibrium": True}, LOADS, 0.1),
    ("rod", {"tca.law": 2, "tip_body.mass": 2.0**-10}, LOADS, 0.02),
    ("rod", {"tca.contact": 2}, LOADS, 0.02),
    ("rod", {"tca.ends": 2, "planar": True}, {"T[1]": 340.0, "gravity[3]": 9.81}, 0.02),
    ("rod", {"closure": 2, "body.curvature[2]": 32.0}, LOADS, 0.02),
    *(("thermal", {"level": level, "tca.alpha_T": 2.0**-8, "tca.beta": 1.0}, HEAT, 1.0) for level in (1, 2, 3)),
    ("thermal", {"level": 2}, HEAT, 1.0),
]


def dimensions(path: Path) -> dict[str, dict[str, int]]:
    """Exponents of base units by variable."""
    description = fmpy.read_model_description(str(path), validate=False)
    units = {u.name: {b: int(getattr(u.baseUnit, b) or 0) for b in BASE} for u in description.unitDefinitions}
    return {v.name: units.get(v.unit, {}) for v in description.modelVariables}


def results(
    name: str, values: dict[str, Any], inputs: dict[str, float], h: float, scale: dict[str, float]
) -> tuple[list[float], list[str]]:
    """Real outputs after three steps in the usual units, and messages but for their numbers' scale."""
    exponents = dimensions(PATHS[name])

    def factor(variable: str) -> float:
        result = 1.0
        for base, exponent in exponents[variable].items():
            result *= scale.get(base, 1.0) ** exponent
        return result

    rows = []
    with FMU2Host(PATHS[name]) as fmu:
        for v in fmu.variables.values():
            if v.causality == "parameter" and v.type == "Real" and not v.name.startswith("segment."):
                is_unused = v.name.split("[")[0] in UNUSED or v.name.startswith("body.stiffness")
                if not is_unused:
                    fmu.write(v.name, values.get(v.name, float(v.start)) * factor(v.name))
        for key, value in values.items():  # again, since a row for all TCAs comes before those of single ones
            variable = fmu.variables[key]
            if variable.type == "Real" and f"{key}[1]" in fmu.variables:
                for i in (1, 2, 3):
                    fmu.write(f"{key}[{i}]", value * factor(key))
            elif variable.type != "Real":
                setter = fmu.setBoolean if variable.type == "Boolean" else fmu.setInteger
                setter(fmu.references([key]), [value])
        fmu.enterInitializationMode()
        for v in fmu.variables.values():
            if v.causality == "input":
                fmu.write(v.name, inputs.get(v.name, float(v.start)) * factor(v.name))
        fmu.exitInitializationMode()
        duration = h * scale.get("s", 1.0)
        for k in range(3):
            fmu.step(k * duration, duration)
            rows += [value / factor(output) for output, value in zip(fmu.outputs, fmu.read(), strict=True)]
    return rows, fmu.messages


@pytest.mark.parametrize(("name", "values", "inputs", "h"), CASES)
def test_results_do_not_depend_on_the_units(name: str, values: dict, inputs: dict, h: float) -> None:
    expected, said = results(name, values, inputs, h, {})
    for scale in ROD_SCALES if name == "rod" else HEAT_SCALES:
        actual, words = results(name, values, inputs, h, scale)
        assert actual == expected, scale
        assert len(words) == len(said), (scale, words)
