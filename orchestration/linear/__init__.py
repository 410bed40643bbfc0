"""Linear models of a scene: linearisation by exact derivatives, order reduction, files."""

from .linearisation import linearise
from .model import LinearModel, Quantity
from .reduction import balanced_truncation
from .storage import load, save

__all__ = ["LinearModel", "Quantity", "balanced_truncation", "linearise", "load", "save"]
