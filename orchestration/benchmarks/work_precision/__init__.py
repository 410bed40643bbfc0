"""Work-precision diagrams: what accuracy costs, for every solver, integrator, coupling and level, on one scene.

All points give outputs at the same times; errors are those against a refined monolith whose own error is drawn; times
are those of warm runs in one thread, in rounds. Which points there are is data: series.toml.

    from tca_cosim.benchmarks import work_precision
    table = work_precision.run("step", repeats=7)
    save_figure(work_precision.plot.draw(table), folder, "chart_step")
"""

from __future__ import annotations

from . import plot
from .run import Truth, run, truth
from .step_halving import halving
from .table import best, write_csv

__all__ = ["Truth", "best", "halving", "plot", "run", "truth", "write_csv"]
