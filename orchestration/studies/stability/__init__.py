"""Where coupling methods fail: maps over macro step and coupling strength, every point a short run, with the limits
that theory gives.

    save_figure(chart.draw(sweep(rod.study("plain", ["rod.dynamic=true"]))), Path("results"), "plain.stability")

verdict: how a run is judged; model_problems: analytic systems with known limits; theory: limits of the rod; rod,
oscillators: the two kinds of maps; study: a map's axes, panels and file; chart: the drawing."""

from . import chart, oscillators, rod
from .study import Panel, Row, Study, sweep
from .verdict import KINDS, Verdict

__all__ = [
    "KINDS",
    "Panel",
    "Row",
    "Study",
    "Verdict",
    "chart",
    "oscillators",
    "rod",
    "sweep",
]
