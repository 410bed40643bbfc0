"""Parameter sweeps: many runs of one scene with parameters from distributions or lists, as one labelled Dataset.

    plan = sweep.read_plan("scatter", runs=64)
    result = sweep.run_sweep(plan, Path("results/scatter.sweep.sqlite"))
    save_figure(chart.draw(result), Path("results"), "scatter.sweep")

Runs are spread over processes; completed runs are kept on disk and reused. plan: the file of a sweep; parameter: one
varied parameter; design: samples of the unit cube; task: one run; store: completed runs on disk; sensitivity: influence
of each parameter; study: the whole sweep; chart: the figure.
"""

from . import chart
from .plan import KEYS, OutputColumns, SweepPlan, SweepSettings, read_plan
from .study import SweepProgress, run_sweep
from .task import RunOutcome, SweepTask

__all__ = [
    "KEYS",
    "OutputColumns",
    "RunOutcome",
    "SweepPlan",
    "SweepProgress",
    "SweepSettings",
    "SweepTask",
    "chart",
    "read_plan",
    "run_sweep",
]
