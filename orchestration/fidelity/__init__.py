"""No more model than a scene needs: levels of both FMUs and of the coupling, chosen for what a scene asks.

Dimensionless numbers propose a level (screens, proposal), estimates against the next level climb from there and come
down again (ladder, climb), and the result says what was chosen and why (words)."""

from .fit import Fit, audit, fit, run
from .study import Level, Study, study

__all__ = ["Fit", "Level", "Study", "audit", "fit", "run", "study"]
