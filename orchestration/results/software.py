"""Versions of the software that makes a result."""

from __future__ import annotations

import platform
from functools import lru_cache

from ..packages import version

__all__ = ["__version__", "versions"]


@lru_cache(maxsize=1)
def _own() -> str:
    try:
        return version("tca-cosim")
    except ModuleNotFoundError:  # run from a source tree that is not installed
        return "not installed"


@lru_cache(maxsize=1)
def _others() -> dict[str, str]:
    return {"fmpy": version("fmpy"), "python": platform.python_version(), "numpy": version("numpy")}


def versions() -> dict[str, str]:
    """Return the versions of this package, fmpy, Python and numpy."""
    return {"tca-cosim": _own(), **_others()}


__version__ = _own()
