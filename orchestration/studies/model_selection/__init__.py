"""Model selection: the cheapest levels of both FMUs and of the coupling whose estimated error meets a tolerance.

Dimensionless numbers of the scene propose levels (dimensionless_numbers, symmetry, proposal). Differences to the next
finer levels estimate the error of that choice; the search refines where the estimate is too large and coarsens where it
allows (hierarchy, search). The result says what was chosen and why (selection, explanation). Its true error and cost
can be audited (reference_level, cost_study).
"""

from .cost_study import CostStudy, RatedChoice, cost_study
from .selection import Selection, audit, run_selected_table, select

__all__ = [
    "CostStudy",
    "RatedChoice",
    "Selection",
    "audit",
    "cost_study",
    "run_selected_table",
    "select",
]
