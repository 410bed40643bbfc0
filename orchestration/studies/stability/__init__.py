"""Stability maps of coupling methods over macro step and coupling strength, with the limits of theory.

    study = rod_study("plain", ["rod.dynamic=true"])
    save_figure(chart.draw(run_study(study)), Path("results"), "plain.stability")

Every cell of a map is a short run. verdict: classification of a run; model_problems: analytic systems with known
limits; theory: limits of the rod; rod, oscillators: the two kinds of maps; study: axes, panels and dataset of a map;
chart: the figure.
"""

from . import chart
from .oscillators import oscillator_study
from .rod import rod_study
from .study import Panel, RowTask, StabilityStudy, run_study
from .verdict import KINDS, Verdict

__all__ = [
    "KINDS",
    "Panel",
    "RowTask",
    "StabilityStudy",
    "Verdict",
    "chart",
    "oscillator_study",
    "rod_study",
    "run_study",
]
