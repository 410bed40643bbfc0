"""A scene as TOML again: what its file and overrides say, in one table."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import SceneError
from .scene import Scene
from .validation import flat

__all__ = ["base_settings", "settings_of", "toml_text"]

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_FILES = ("fmus", "parameters", "ssp")  # keys whose values may be files


def settings_of(scene: Scene) -> dict[str, Any]:
    """Return the tables of a scene, later layers over earlier ones, with files as absolute paths."""
    tables: dict[str, Any] = {}
    for layer in scene.layers:
        folder = scene.folder if layer.overrides else layer.folder
        for key, value in flat(layer.raw):
            table, _, name = key.partition(".")
            located = _located(value, folder, table in _FILES)
            if name:
                tables.setdefault(table, {})[name] = located
            else:
                tables[table] = located
    return tables


def base_settings(scene: Scene) -> dict[str, Any]:
    """Return the tables of the parameter set that a scene builds on; empty where that is an SSP archive."""
    try:
        raw = tomllib.loads(scene.sources[0][1]) if scene.sources else {}
    except tomllib.TOMLDecodeError:
        return {}
    tables: dict[str, Any] = {}
    for key, value in flat(raw):
        table, _, name = key.partition(".")
        if name:
            tables.setdefault(table, {})[name] = value
    return tables


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as TOML.

    Raises
    ------
    SceneError
        A value that TOML cannot hold, or the package tomli-w is missing.
    """
    try:
        import tomli_w
    except ImportError as error:
        raise SceneError(
            "writing scenes needs tomli-w of the extra `control`: pip install 'tca-cosim[control]'"
        ) from error
    try:
        return tomli_w.dumps(tables)
    except (TypeError, ValueError) as error:
        raise SceneError(
            f"a value of the scene cannot be written as TOML ({error}); give numbers, texts, lists or tables"
        ) from error


def _located(value: Any, folder: Path, is_file: bool) -> Any:
    if isinstance(value, str):
        return str((folder / value).absolute()) if is_file and (folder / value).is_file() else value
    if isinstance(value, list):
        return [_located(item, folder, is_file) for item in value]
    if isinstance(value, Mapping):
        return {k: _located(v, folder, is_file or k == "file") for k, v in value.items()}
    return value
