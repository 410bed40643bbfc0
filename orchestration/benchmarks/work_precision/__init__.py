"""Work-precision diagrams: CPU time against error, for every solver, integrator, coupling method and level of models.

All points give outputs at the same times. Errors are measured against a refined monolith whose own error is drawn;
times are those of warm runs in one thread, in rounds. The points are data: series.toml.

    from tca_cosim.benchmarks import work_precision
    table = work_precision.run_chart("step", repeats=7)
    save_figure(work_precision.plot.draw(table, "coupling"), folder, "chart_step_coupling")
"""

from __future__ import annotations

from . import plot
from .run import ReferenceSolution, reference_solutions, run_chart
from .step_halving import halve_steps
from .table import fastest_points, write_csv

__all__ = [
    "ReferenceSolution",
    "fastest_points",
    "halve_steps",
    "plot",
    "reference_solutions",
    "run_chart",
    "write_csv",
]
