"""Scenes: FMUs, parameters, inputs, connections and settings of a run, as data."""

from typing import TYPE_CHECKING

from ..lazy import importer as _importer

if TYPE_CHECKING:
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

if not TYPE_CHECKING:
    __getattr__ = _importer(
        __name__,
        {
            **dict.fromkeys(("find", "load", "parameter_sets", "titles"), "layers"),
            **dict.fromkeys(("KEYS", "TABLES", "Coupling", "Scene", "changed", "read"), "scene"),
            "Member": "member",
        },
    )
