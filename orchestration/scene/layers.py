"""Layers of a scene: files, of the package or a user's, and overrides; each wins over the one before."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from ..errors import SceneError, similar
from .layer import Layer

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["find", "load", "merged", "overriding", "parameter_sets", "titles"]

_PACKAGE = __package__.rpartition(".")[0]
_TOML, _SSP = ".toml", ".ssp"
_MAX_TEXT = 80  # characters of an override's value in titles and records
_MOST_BYTES = 100_000_000  # of a scene file; what is larger is not one


def titles(folder: str = "scenes") -> dict[str, tuple[str, Path]]:
    """Return title and file of every scene that comes with the package, by name; only the titles are read.

    folder: of the package, with other files that have titles, such as sweeps.
    """
    return {name: (str(load(path).raw.get("title", name)), path) for name, path in _shipped(folder).items()}


def parameter_sets() -> tuple[str, ...]:
    """Return the names of the parameter sets that come with the package."""
    return tuple(_shipped("parameters"))


def find(source: str | Path, folder: str, kind: str, near: Path | None = None) -> Path:
    """Return the file of that path, also from the folder `near`, or of that name in a folder of the package.

    Raises SceneError.
    """
    candidates = [Path(source), (near or Path()) / source]
    for candidate in candidates:
        if candidate.suffix.lower() in (_TOML, _SSP) and _is_file(candidate):
            return candidate
    known = _folder(folder) / f"{source}{_TOML}"
    if known.name == f"{source}{_TOML}" and _is_file(known):
        return known
    for candidate in candidates:
        if _is_file(candidate):
            raise SceneError(f"{candidate}: a file, but not a {kind}; allowed: {_TOML} or {_SSP} files, or a name")
        if candidate.is_dir():
            raise SceneError(f"{candidate}: a folder, not a {kind}; give a {_TOML} or {_SSP} file in it")
    remedy = similar(str(source), _shipped(folder))
    if Path(source).suffix.lower() in (_TOML, _SSP) or len(Path(source).parts) > 1:
        raise SceneError(
            f"no {kind} {str(source)!r}: no such file in {Path.cwd()}; check the path. {_sentence(remedy)}"
        )
    raise SceneError(f"no {kind} {str(source)!r}: no such file, and {remedy}")


def _sentence(text: str) -> str:
    return f"Names that come with the package: {text}"


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False


def load(path: Path) -> Layer:
    """Read a TOML file; an SSP archive alone is a scene that only names it. Raises SceneError."""
    if path.suffix.lower() == _SSP:
        return Layer(str(path), "", {"ssp": path.name})
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise SceneError(f"{path}: larger than {_MOST_BYTES} bytes, so not a scene; give a TOML file")
        content = path.read_bytes()
    except OSError as error:
        raise SceneError(
            f"{path}: cannot be read: {error.strerror or error}; check the path and its permissions"
        ) from error
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not a text in UTF-8 (byte {error.start}); save the file as UTF-8") from error
    return Layer(str(path), text, _parsed(text, str(path)), folder=path.parent)


def _parsed(text: str, origin: str) -> dict[str, Any]:
    """Parse TOML. Raises SceneError."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{origin}: not valid TOML: {error}; see https://toml.io for the syntax") from error
    except (RecursionError, ValueError) as error:  # nested too deeply; a date that does not exist
        raise SceneError(f"{origin}: not valid TOML: {error or 'nested too deeply'}; simplify it") from error


def overriding(overrides: Sequence[str] | Mapping[str, Any], origin: str = "--set") -> Layer:
    """Return the layer of overrides: texts key=value, with values in TOML, or keys and values. Raises SceneError."""
    raw: dict[str, Any] = {}
    items = overrides.items() if isinstance(overrides, Mapping) else [_item(text, origin) for text in overrides]
    for key, value in items:
        table, dot, name = str(key).partition(".")
        if table in raw and isinstance(raw[table], dict) != bool(dot):
            raise SceneError(f"{origin}: {key}: {table} is set as a whole as well; keep one of the two")
        if dot:
            raw.setdefault(table, {})[name] = value
        else:
            raw[table] = dict(value) if isinstance(value, Mapping) else value
    if isinstance(overrides, Mapping):
        lines = [f"{key}={_short(value)}" for key, value in overrides.items()]
    else:
        lines = list(overrides)
    return Layer(origin, "\n".join(lines), raw, numbered=False, overrides=True)


def _short(value: Any) -> str:
    """Text of a value; long ones, such as courses over time, by their beginning."""
    text = " ".join(str(value).split())
    return text if len(text) <= _MAX_TEXT else f"{text[:_MAX_TEXT]}..."


def _item(text: str, origin: str) -> tuple[str, Any]:
    """Key and value of an override. A value that is not TOML is a text: rod.closure=inside."""
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key:
        raise SceneError(f"{origin} {text!r}: not of the form key=value, such as rod.order=2")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return key, value


def merged(layers: Sequence[Layer]) -> dict[str, tuple[Any, Layer]]:
    """Return the value that holds under every top-level key, and the layer that has it."""
    return {key: (value, layer) for layer in layers for key, value in layer.raw.items()}


@lru_cache(maxsize=8)
def _folder(folder: str) -> Path:
    return Path(str(resources.files(_PACKAGE))) / folder


def _shipped(folder: str) -> dict[str, Path]:
    return {file.stem: file for file in sorted(_folder(folder).glob(f"*{_TOML}"))}
