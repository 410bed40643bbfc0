"""A scene stepped from outside: by a controller, an optimiser, a learning environment."""

from .simulation import SavedState, Simulation

__all__ = ["SavedState", "Simulation"]
