"""Registration of the accessor ``result.tca`` as soon as xarray is there, without loading it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec
    from types import ModuleType

__all__ = ["register"]

NAME = "tca"


def register() -> None:
    """Register the accessor now where xarray is loaded already, else when it is imported."""
    if "xarray" in sys.modules:
        _register_with(sys.modules["xarray"])
    elif not any(isinstance(finder, _Watcher) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Watcher())  # type: ignore[arg-type]


def _register_with(xarray: Any) -> None:
    def accessor(result: Any) -> Any:
        from .accessor import ResultAccessor

        return ResultAccessor(result)

    if NAME not in vars(xarray.Dataset):
        xarray.register_dataset_accessor(NAME)(accessor)


class _Watcher:
    """Finder that lets the others find xarray, and follows its import; it is gone afterwards."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        if name != "xarray":
            return None
        from importlib.util import find_spec

        sys.meta_path.remove(self)  # type: ignore[arg-type]
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            spec.loader = _Followed(spec.loader)  # type: ignore[assignment]
        return spec


class _Followed:
    """Loader of xarray that registers the accessor after it."""

    def __init__(self, loader: Any) -> None:
        self._loader = loader

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)

    def create_module(self, spec: ModuleSpec) -> Any:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        module.__loader__ = self._loader
        if module.__spec__ is not None:
            module.__spec__.loader = self._loader
        self._loader.exec_module(module)
        _register_with(module)
