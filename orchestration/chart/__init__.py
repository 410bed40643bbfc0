"""Work-precision diagrams: what accuracy costs, for every solver, integrator, coupling and level, on one scene.

All points give outputs at the same times; errors are those against a refined monolith whose own error is drawn; times
are those of warm runs in one thread, in rounds. Which points there are is data: series.toml.

    from orchestration import chart
    table = chart.run("step", repeats=7)
    figures.save(chart.picture.draw(table), folder, "chart_step")
"""

from __future__ import annotations

from . import picture
from .halving import halving
from .run import Truth, run, truth
from .table import best, write_csv

__all__ = ["Truth", "best", "halving", "picture", "run", "truth", "write_csv"]
