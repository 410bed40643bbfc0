"""Scenes: what is run, as data."""

from .layers import find, load, parameter_sets, titles
from .members import Member
from .scene import KEYS, TABLES, Coupling, Scene, read

__all__ = ["KEYS", "TABLES", "Coupling", "Member", "Scene", "find", "load", "parameter_sets", "read", "titles"]
