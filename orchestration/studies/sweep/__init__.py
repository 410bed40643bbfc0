"""Many runs of one scene: parameters drawn from distributions or taken from lists, runs spread over processes, what is
finished kept on disk, one labelled Dataset.

    plan = sweep.read("scatter", runs=64)
    result = sweep.run(plan, Path("results/scatter.sweep.sqlite"))
    save_figure(chart.draw(result), Path("results"), "scatter.sweep")

plan: the file; parameter: one of them; design: points of the unit cube; task: one run; store: finished runs on disk;
sensitivity: which parameter does what; study: all of it; chart: the drawing."""

from . import chart
from .plan import KEYS, Plan, Settings, read
from .study import Progress, run

__all__ = ["KEYS", "Plan", "Progress", "Settings", "chart", "read", "run"]
