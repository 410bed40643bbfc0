"""No more model than a scene needs: levels of both FMUs and of the coupling, chosen for what a scene asks.

Dimensionless numbers propose a level (screens, proposal), estimates against the next level climb from there and come
down again (ladder, climb), and the result says what was chosen and why (words)."""

from .selection import Selection, audit, run, select
from .study import Level, Study, study

__all__ = ["Level", "Selection", "Study", "audit", "run", "select", "study"]
