"""Draws the figures of the page on bodies, from runs of the rod FMU.

python docs/bodies.py     writes docs/figures/measured_law.png, holding.png and module.png
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import tca_cosim as tca
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation
from tca_cosim.plotting import series_colour

__all__ = ["FITTED_LAW", "LENGTH", "MODULE", "hanging_lengths", "measured_lengths", "module_angles", "module_measured"]

FOLDER = Path(__file__).parent / "figures"
DATA = Path(__file__).parent.parent / "tests" / "data"
G = 9.81  # [m/s2]
LENGTH = 88.29e-3  # of the TCA without load at T_0 [m]
FITTED_LAW = {  # type 1-180 of Sun et al. 2021, one set for all loads and temperatures; SI units
    "tca.law": "measured",
    "tca.chirality": -1,
    "tca.stiffness": 2.506,
    "tca.stiffening": 148.0,
    "tca.stroke": 1.499e-4,
    "tca.stroke_curvature": 1.775e-6,
    "tca.stop": -12.6e-3,
    "tca.stop_width": 6e-3,
    "tca.stop_stiffness": 30.3,
    "T_0": 303.15,
}
ALONE: dict[str, Any] = {
    "fmus": {"rod": "rod.fmu"},
    "connections": [],
    "coupling": {"macro_step": 1.0},
    "limits": {"strain": 1.0},
}
STILL = {"dynamic": False, "closure": "inside"}
COLD = 298.15  # [K]


def measured_lengths() -> tuple[np.ndarray, np.ndarray]:
    """Oven temperatures (n,) [K] and lengths (n, 6) [m] under 50, 40, ... 0 g, nan where not measured."""
    lines = [
        line for line in (DATA / "tca_length_over_temperature.csv").read_text().splitlines() if not line.startswith("#")
    ]
    table = np.array([[float(cell) if cell else np.nan for cell in row] for row in csv.reader(lines[1:])])
    return table[:, 0] + 273.15, 1e-3 * np.where(table[:, 1:7] == 0.0, np.nan, table[:, 1:7])


def hanging_lengths(temperatures: np.ndarray, mass: float) -> np.ndarray:
    """Lengths (n,) [m] of the fitted TCA under a mass [kg]: in the axis of a body that weighs and resists nothing."""
    steps = [[float(k), float(T)] for k, T in enumerate(temperatures)]
    nothing = {"body.E": 1e-3, "body.rho": 1e-3, "body.length": LENGTH, "strains": "extensible", "order": 0}
    result = tca.run(
        {
            **ALONE,
            "stop_time": float(len(steps)),
            "body": {"tcas": 1},
            "tca": {"offset": 0.0},
            "rod": {**STILL, **nothing, **FITTED_LAW, "T": [{"steps": steps}], "tip_force": [0.0, 0.0, G * mass]},
        }
    )
    return LENGTH + result["rod.delta"].to_numpy()[1:, 0]


# The bending module: EcoFlex 00-30, 45 mm, three TCAs. Its radius, the distance of its TCAs from the axis and the heat
# per power are not published: they are fitted to the angles, the law is that above for the module's length.
MODULE = {"radius": 3e-3, "offset": 2.4e-3, "kelvin_per_watt": 58.0}
_POWERS = tuple((ratio * power, power) for power in (0.2, 0.4) for ratio in (1, 2, 3, 4, 5))  # of TCA 1 and 2 [W]
_MODULE_LENGTH, _MODULE_E = 45e-3, 45e3  # [m], [Pa] the middle of 43 to 49 kPa


def module_measured() -> tuple[np.ndarray, np.ndarray]:
    """Bending angles and directions (2, 5) [deg] after 2 s: 0.2 and 0.4 W in TCA 2, 1 to 5 times that in TCA 1."""
    lines = [line for line in (DATA / "bending_module.csv").read_text().splitlines() if not line.startswith("#")]
    table = np.array([[float(cell) for cell in row] for row in csv.reader(lines[1:])])
    return table[:, [1, 3]].T, table[:, [2, 4]].T


def module_angles(radius: float, offset: float, kelvin_per_watt: float) -> tuple[np.ndarray, np.ndarray]:
    """The same, computed."""
    share = _MODULE_LENGTH / LENGTH
    law = dict(FITTED_LAW)
    for key, power in (("tca.stroke", 1), ("tca.stroke_curvature", 1), ("tca.stop", 1), ("tca.stop_width", 1)):
        law[key] *= share**power
    for key, power in (("tca.stiffness", 1), ("tca.stiffening", 2), ("tca.stop_stiffness", 1)):
        law[key] /= share**power
    heat = [
        {"steps": [[float(k), COLD + kelvin_per_watt * powers[i]] for k, powers in enumerate(_POWERS)]} for i in (0, 1)
    ]
    result = tca.run(
        {
            **ALONE,
            "stop_time": float(len(_POWERS)),
            "tca": {"offset": offset},
            "rod": {
                **STILL,
                **law,
                "body.radius": radius,
                "body.length": _MODULE_LENGTH,
                "body.E": _MODULE_E,
                "T": [*heat, COLD],
            },
        }
    )
    quaternions = result["rod.tip.quaternion"].to_numpy()[1:]
    tangent = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).apply([0.0, 0.0, 1.0])
    bend = np.degrees(np.arccos(np.clip(tangent[:, 2], -1.0, 1.0)))
    direction = 60.0 - np.degrees(np.arctan2(tangent[:, 1], tangent[:, 0]))  # from between both TCAs towards the first
    return bend.reshape(2, 5), ((direction + 180.0) % 360.0 - 180.0).reshape(2, 5)


def _draw_law(axes: Axes) -> None:
    temperatures, lengths = measured_lengths()
    fine = np.linspace(temperatures[0], temperatures[-1], 60)
    for k, grams in enumerate(range(50, -1, -10)):
        axes.plot(fine - 273.15, 1e3 * hanging_lengths(fine, 1e-3 * grams), color=series_colour(k), label=f"{grams} g")
        axes.plot(temperatures - 273.15, 1e3 * lengths[:, k], "o", color=series_colour(k), markersize=4)
    axes.set(xlabel="temperature [°C]", ylabel="length [mm]", title="One TCA under load; circles: measured")
    axes.legend(ncols=2, frameon=False)


def _shape(**settings: Any) -> tuple[np.ndarray, float]:
    """Centreline (21, 3) [mm] and twist of the tip about the body's axis [rad] at rest."""
    table = {**ALONE, "stop_time": 1.0, "rod": {**STILL, "order": 5, "T": COLD, **settings}}
    result = tca.run(table)
    return 1e3 * result["rod.shape.p"].to_numpy()[-1], abs(float(result["rod.tip.euler"][-1, 2]))


def _draw_holding(left: Axes, right: Axes) -> None:
    weight = {"gravity": [9.81, 0.0, 0.0]}
    for k, (contact, dash) in enumerate((("sliding", "-"), ("bonded", "--"))):
        p, _ = _shape(**weight, **{"tca.contact": contact})
        left.plot(p[:, 2], -p[:, 0], dash, color=series_colour(k), label=f"{contact}: {p[-1, 0]:.2f} mm")
    left.set(xlabel="z [mm]", ylabel="-x [mm]", title="Cold, under its weight")
    hot = {"T": [340.0, COLD, COLD]}
    cases = (("free", {}), ("tethered", {"tca.ends": "tethered"}))
    for k, (name, held) in enumerate(cases):
        p, twist = _shape(**hot, **held)
        right.plot(
            p[:, 0], p[:, 1], "--" if held else "-", color=series_colour(k), label=f"{name}: twist {twist:.2f} rad"
        )
    right.set(xlabel="x [mm]", ylabel="y [mm]", title="One TCA at 67 °C, seen from above")
    for axes in (left, right):
        axes.legend(frameon=False)
        axes.set_aspect("equal", adjustable="datalim")


def _draw_module(left: Axes, right: Axes) -> None:
    computed, measured = module_angles(**MODULE), module_measured()
    for axes, curves, samples, name in zip(
        (left, right), computed, measured, ("bending angle", "direction"), strict=True
    ):
        for k, power in enumerate((0.2, 0.4)):
            axes.plot(range(1, 6), curves[k], color=series_colour(k), label=f"{power} W in TCA 2")
            axes.errorbar(range(1, 6), samples[k], 4.5, fmt="o", color=series_colour(k), markersize=4, capsize=2)
        axes.set(xlabel="power of TCA 1 over that of TCA 2", ylabel=f"{name} [°]")
        axes.legend(frameon=False)


def main() -> None:
    """Write the figures."""
    figure = Figure(figsize=(5.6, 4.0), layout="constrained")
    _draw_law(figure.add_subplot())
    figure.savefig(FOLDER / "measured_law.png", dpi=110)
    for name, draw in (("holding", _draw_holding), ("module", _draw_module)):
        figure = Figure(figsize=(8.4, 3.4), layout="constrained")
        draw(*figure.subplots(1, 2))
        figure.savefig(FOLDER / f"{name}.png", dpi=110)


if __name__ == "__main__":
    main()
