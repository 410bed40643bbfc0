"""The shared library of the engine (fmus/engine), beside the FMUs."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

from ..errors import CosimError
from .archive import shipped_folders
from .fmi2 import LIBRARY_ENDING

__all__ = ["load_engine"]

NAME = f"tca_engine{LIBRARY_ENDING}"


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
