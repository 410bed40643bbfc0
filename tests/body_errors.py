"""Prints the errors of bodies of segments against independent solutions and laws of mechanics.

    python tests/body_errors.py            equilibria, energy, frequencies, cut bodies: through the FMU
    python tests/body_errors.py --cpp      also derivatives and momentum of random bodies: build/tests/test_rod
    python tests/body_errors.py --write    writes the table into docs/theory/bodies.md as well

Each function returns its rows; tests/test_body_errors.py checks them against the bounds.
"""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tca_cosim as tca

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
COLD = 298.15  # [K]
ALONE = {"fmus": {"rod": "rod.fmu"}, "connections": [], "stop_time": 1.0, "coupling": {"macro_step": 1.0}}
AT_REST = {"dynamic": False, "closure": "inside", "tolerance": 1e-10}


@dataclass(frozen=True)
class Row:
    """One number that must stay below its bound."""

    what: str
    value: float
    bound: float
    unit: str = ""


def rod_alone(rod: dict[str, Any], body: dict[str, Any] | None = None, **more: Any) -> Any:
    """Run a rod whose inputs are constant, with the limits of plausibility out of the way."""
    limits = {"strain": 10.0, "speed": 1e6}
    return tca.run({**ALONE, "limits": limits, "rod": rod, **({"body": body} if body else {}), **more})


def equilibria(order: int = 5) -> Iterator[Row]:
    """Largest error [m] in tip and displacements of each body of tests/data/bodies.toml."""
    cases = tomllib.loads((ROOT / "tests/data/bodies.toml").read_text(encoding="utf-8"))
    for name, case in cases.items():
        loads = {key: case[key] for key in ("gravity", "tip_force") if key in case}
        rod = {**AT_REST, "order": order, "T": case.get("T", [COLD] * 3), **loads, **case["rod"]}
        result = rod_alone(rod, case.get("body"))
        gaps = [result[f"rod.{key}"].to_numpy()[-1] - case[of] for key, of in (("tip.p", "tip"), ("delta", "delta"))]
        error = float(np.abs(np.concatenate(gaps)).max())
        yield Row(f"equilibrium {name}: {case['title']}", error, case.get("bound", 1e-7), "m")


def energies() -> Iterator[Row]:
    """Relative change of the energy of an undamped motion of 20 ms."""
    for name, held in (("bonded", {"tca.contact": "bonded"}), ("tethered", {"tca.ends": "tethered"})):
        loads = {"T": [330.0, COLD, COLD], "gravity": [0, 5, 0], "body.retardation": 0.0}
        rod = {"closure": "inside", "order": 3, "tolerance": 1e-11, "start_at_equilibrium": False, **loads, **held}
        result = rod_alone(rod, stop_time=0.02, coupling={"macro_step": 1e-3})
        total = sum(result[f"rod.energy.{kind}"].to_numpy() for kind in ("elastic", "tca", "kinetic", "gravity"))
        yield Row(f"energy of a motion, {name} TCAs", float(np.ptp(total) / abs(total[0])), 1e-9)


BEAMS = (  # radius at the tip over that at the clamp, mass at the tip over the beam's, first and second frequency
    ("radius to 0.6", 0.6, 0.0, 4.318779, 20.049984),
    ("radius to 0.3", 0.3, 0.0, 5.509262, 18.641255),
    ("mass at the tip", 1.0, 1.0, 1.557298, 16.250085),
)


def frequencies(slenderness: tuple[float, ...] = (25.0, 100.0, 400.0)) -> Iterator[Row]:
    """Relative error of the first two frequencies against slender beams, as length over radius grows."""
    for name, taper, payload, *exact in BEAMS:
        for ratio in slenderness:
            radius = 0.04 / ratio
            middle, density = 0.5 * (1.0 + taper) * radius, 1040.0
            rod = {
                "strains": "bending",
                "order": 5,
                "body.retardation": 0.0,
                "tca.law": "measured",
                "tca.stiffness": 0.0,
                "tca.offset": 0.1 * taper * radius,
                "tca.offset_end": 0.1 * taper * radius,
                "segment.radius": [[radius, middle], [middle, taper * radius]],
                "tip_body.mass": payload * density * math.pi * radius**2 * 0.04,
                "T": [COLD] * 3,
                "closure": "inside",
            }
            scene = {**ALONE, "body": {"segments": 2}, "rod": rod}
            actual = np.unique(np.abs(tca.linear.linearise(scene).poles().imag).round(6))
            unit = math.sqrt(37.8e3 * radius**2 / (4.0 * density)) / 0.04**2
            seen = actual[actual > 0.0] / unit
            errors = [float(np.abs(seen / value - 1.0).min()) for value in exact]
            bound = 1e-3 if ratio >= 100.0 else 2e-2
            yield Row(f"first two frequencies, {name}, length {ratio:g} radii", max(errors), bound)


def cuts() -> Iterator[Row]:
    """Largest distance [m] between the shapes of a body and of the same body cut into equal segments."""
    loads = {"T": [COLD + 30.0, COLD, COLD], "gravity": [4, 0, 0], "tip_force": [0, 5e-3, 0]}
    shapes = {}
    for segments, order in ((1, 7), (2, 6), (4, 5)):
        rod = {**AT_REST, "order": order, **loads}
        shapes[segments] = rod_alone(rod, {"segments": segments})["rod.shape.p"].to_numpy()[-1]
    for segments in (2, 4):
        yield Row(f"body cut into {segments}", float(np.abs(shapes[segments] - shapes[1]).max()), 2e-8, "m")


def random_bodies() -> Iterator[Row]:
    """Largest relative errors of random bodies, up to 12 TCAs and 6 segments, as the C++ tests report them."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [ROOT / "build/tests/test_rod", "--gtest_filter=Random*", f"--gtest_output=json:{report}"]
        subprocess.run(command, check=True, capture_output=True)
        suites = json.loads(report.read_text())["testsuites"]
    worst: dict[str, float] = {}
    count = 0
    for test in (test for suite in suites for test in suite["testsuite"]):
        count += test["name"].startswith("Derivatives")
        for what in ("tangent", "by_rates", "by_loads", "static_tangent", "clamp_force", "clamp_moment"):
            if what in test:
                worst[what] = max(worst.get(what, 0.0), float(test[what]))
    for what, value in worst.items():
        yield Row(f"{count} random bodies: {what.replace('_', ' ')}", value, 1e-9)


PAGE = ROOT / "docs/theory/bodies.md"
_BETWEEN = re.compile(r"(<!-- body errors -->\n).*?(<!-- end -->)", re.DOTALL)


def written(page: str, rows: list[Row]) -> str:
    """Put the table of the rows into the page, in the place of the one there."""
    lines = ["| what | error | bound |", "| --- | ---: | ---: |"]
    lines += [f"| {row.what} | {row.value:.1e} {row.unit} | {row.bound:.0e} |" for row in rows]
    return _BETWEEN.sub(lambda actual: "\n".join([actual[1], *lines, "", actual[2]]), page)


def main() -> int:
    """Print all rows; 1 where one is beyond its bound."""
    kinds = [equilibria, energies, frequencies, cuts, *([random_bodies] if "--cpp" in sys.argv else [])]
    rows = [row for kind in kinds for row in kind()]
    if "--write" in sys.argv:
        PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), rows), encoding="utf-8")
    for row in rows:
        verdict = "" if row.value < row.bound else "  BEYOND"
        print(f"{row.what:64s} {row.value:8.1e} {row.unit:2s} (bound {row.bound:.0e}){verdict}", flush=True)
    return int(any(row.value >= row.bound for row in rows))


if __name__ == "__main__":
    sys.exit(main())
