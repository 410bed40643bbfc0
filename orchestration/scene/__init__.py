"""Scenes: FMUs, parameters, inputs, connections and settings of a run, as data."""

from .layers import find, load, parameter_sets, titles
from .member import Member
from .scene import KEYS, TABLES, Coupling, Scene, changed, read

__all__ = [
    "KEYS",
    "TABLES",
    "Coupling",
    "Member",
    "Scene",
    "changed",
    "find",
    "load",
    "parameter_sets",
    "read",
    "titles",
]
