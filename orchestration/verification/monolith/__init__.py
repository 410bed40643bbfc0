"""All FMUs of a scene as one system of differential equations: every state in one vector, one tight integrator.

What lies between it and the co-simulation is the error of the coupling. Linearised, it gives natural frequencies and
damping ratios."""

from ...scene.loop_closure import closed_inside
from .modes import Mode, Modes, modes
from .solve import logged, result, run
from .system import assembled

__all__ = ["Mode", "Modes", "assembled", "closed_inside", "logged", "modes", "result", "run"]
