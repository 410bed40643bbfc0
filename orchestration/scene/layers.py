"""Where the keys of a scene come from: files, of the package or a user's, and overrides, each a layer over the one
before."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from ..errors import SceneError
from ..fmi.archive import similar
from .validation import Layer

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["find", "load", "merged", "overriding", "parameter_sets", "titles"]

_PACKAGE = __package__.rpartition(".")[0]


def titles(folder: str = "scenes") -> dict[str, tuple[str, Path]]:
    """Title and file of every scene that comes with the package, by name; nothing else in them is looked at. folder:
    of the package, with other files that have titles."""
    return {name: (str(load(path).raw.get("title", name)), path) for name, path in _shipped(folder).items()}


def parameter_sets() -> tuple[str, ...]:
    """The names of the parameter sets that come with the package."""
    return tuple(_shipped("parameters"))


def find(source: str | Path, folder: str, kind: str, near: Path | None = None) -> Path:
    """The file of that path (also from the folder `near`), or of that name in a folder of the package. Raises
    SceneError."""
    shipped = _shipped(folder)
    for candidate in (Path(source), (near or Path()) / source):
        if candidate.suffix in (".toml", ".ssp") and candidate.is_file():
            return candidate
    if str(source) in shipped:
        return shipped[str(source)]
    raise SceneError(f"no {kind} {str(source)!r}: no such file, and {similar(str(source), list(shipped))}")


def load(path: Path) -> Layer:
    """A TOML file; an SSP archive alone is a scene that names no more than it. Raises SceneError."""
    if path.suffix == ".ssp":
        return Layer(str(path), "", {"ssp": path.name})
    try:
        text = path.read_text(encoding="utf-8")
        return Layer(str(path), text, tomllib.loads(text))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SceneError(f"{path}: cannot be read: {error}") from error


def overriding(overrides: Sequence[str]) -> Layer:
    """The layer of texts key=value. Raises SceneError."""
    raw: dict[str, Any] = {}
    for text in overrides:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not key:
            raise SceneError(f"--set {text!r}: not of the form key=value, such as rod.order=2")
        try:
            parsed = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            parsed = value
        table, dot, name = key.partition(".")
        if not isinstance(raw.get(table, {}), dict if dot else object):
            raise SceneError(f"--set {text!r}: {table} is set as a whole as well; keep one of the two")
        if dot:
            raw.setdefault(table, {})[name] = parsed
        else:
            raw[table] = parsed
    return Layer("--set", "\n".join(overrides), raw, numbered=False)


def merged(layers: Sequence[Layer]) -> dict[str, tuple[Any, Layer]]:
    """What holds under every key of the top, and which layer says so."""
    return {key: (value, layer) for layer in layers for key, value in layer.raw.items()}


def _shipped(folder: str) -> dict[str, Path]:
    place = Path(str(resources.files(_PACKAGE))) / folder
    return {file.stem: file for file in sorted(place.glob("*.toml"))}
