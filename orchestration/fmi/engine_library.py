"""The shared library of the engine (fmus/engine), beside the FMUs."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..errors import CosimError
from . import block_interface as c
from .archive import shipped_folders
from .fmi2 import LIBRARY_ENDING

__all__ = ["has_layout", "load_block_engine", "load_engine"]

NAME = f"tca_engine{LIBRARY_ENDING}"
INTERFACE = 2  # TCA_INTERFACE of engine.h


@lru_cache(maxsize=1)
def load_engine() -> ctypes.CDLL:
    """Load the engine.

    Raises
    ------
    CosimError
        It is not there, or not for this machine.
    """
    path = next((folder / NAME for folder in shipped_folders() if (folder / NAME).is_file()), None)
    if path is None:
        raise CosimError(
            f"the engine {NAME} is not installed in {', '.join(map(str, shipped_folders()))}; run `make fmus`, or "
            "install the package again"
        )
    try:
        return ctypes.CDLL(str(Path(path).resolve()))
    except OSError as error:
        raise CosimError(
            f"{path} cannot be loaded here: {error}; build it for this machine with `make fmus`"
        ) from error


def has_layout(engine: Any, function: str, structures: Iterable[type[ctypes.Structure]]) -> bool:
    """Tell whether structures have the sizes that the engine's function of that name adds up, as in this version.

    It adds TCA_INTERFACE too, which is raised when the parameters of a function change.
    """
    try:
        size = getattr(engine, function)()
    except AttributeError:  # an earlier version
        return False
    return bool(size == (INTERFACE << 20) + sum(map(ctypes.sizeof, structures)))


def load_block_engine() -> ctypes.CDLL | None:
    """Load the engine for calls with the structures of block.h; None where it is missing or of another version."""
    try:
        engine = load_engine()
    except CosimError:
        return None
    structures = (c.Blas, c.Group, c.Node, c.Component, c.Block, c.Steps)
    return engine if has_layout(engine, "tca_layout", structures) else None
