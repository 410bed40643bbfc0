"""The monolith: all FMUs of a scene as one system of differential equations, one state vector, one tight integrator.

Its difference to the co-simulation is the coupling error. Linearised, it gives natural frequencies and damping
ratios.
"""

from ...scene.loop_closure import closed_inside
from .integration import integrate, monolith_result, solve_monolith
from .modes import Mode, Modes, natural_modes
from .system import assembled

__all__ = [
    "Mode",
    "Modes",
    "assembled",
    "closed_inside",
    "integrate",
    "monolith_result",
    "natural_modes",
    "solve_monolith",
]
