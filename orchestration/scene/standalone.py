"""An FMU that behaves alone as it does in a scene: the scene's values are its start values."""

from __future__ import annotations

from ..fmi.configuration import Configuration
from .member import Member, Value
from .scene import Scene

__all__ = ["configuration_of"]

_INSTANT = 1e-9  # [s] over which a signal is looked at: less than any step


def configuration_of(member: Member, scene: Scene) -> Configuration:
    """Return what makes an FMU alone behave as a member of a scene: its values as start values, its moving states.

    Signals are there with their values at the start.
    """
    starts: dict[str, Value] = dict(member.parameters)
    for name, signal in member.signals.items():
        starts[name] = float(signal.polynomial(scene.start_time, _INSTANT)[0])
    tolerance = member.archive.variables.get("tolerance")
    if scene.tolerance is not None and tolerance is not None and "tolerance" not in starts:
        starts["tolerance"] = min(max(scene.tolerance, tolerance.least), tolerance.most)
    return Configuration(only_moving_states=True, starts=starts)
