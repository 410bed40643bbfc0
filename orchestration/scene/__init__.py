"""Scenes: FMUs, parameters, inputs, connections and settings of a run, as data."""

from typing import TYPE_CHECKING

import lazy_loader as _lazy

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
    __getattr__, __dir__, _ = _lazy.attach(
        __name__,
        submod_attrs={
            "layers": ["find", "load", "parameter_sets", "titles"],
            "member": ["Member"],
            "scene": ["KEYS", "TABLES", "Coupling", "Scene", "changed", "read"],
        },
    )
