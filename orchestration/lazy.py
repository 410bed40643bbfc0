"""Packages that import what they offer when it is first asked for, so that a command loads what it needs alone."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

__all__ = ["importer"]


def importer(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the function __getattr__ of a package.

    Parameters
    ----------
    package
        Its __name__.
    homes
        Public name -> module of the package that defines it. Modules of the package are found without being listed.
    """

    def getattribute(name: str) -> Any:
        if name in homes:
            value = getattr(import_module(f".{homes[name]}", package), name)
        elif not name.startswith("_") and _is_module(f"{package}.{name}"):
            value = import_module(f".{name}", package)
        else:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        setattr(sys.modules[package], name, value)
        return value

    return getattribute


def _is_module(name: str) -> bool:
    from importlib.util import find_spec

    return find_spec(name) is not None
