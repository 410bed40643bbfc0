"""Voltages for a wanted path: optimisation on exact sensitivities, checked with the full models; workspace."""

from .limits import PlanLimits
from .plan import Plan, plan
from .problem import PathProblem, Solution
from .target import Target, read_target, target_of
from .workspace import Workspace, workspace

__all__ = [
    "PathProblem",
    "Plan",
    "PlanLimits",
    "Solution",
    "Target",
    "Workspace",
    "plan",
    "read_target",
    "target_of",
    "workspace",
]
