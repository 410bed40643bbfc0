"""An FMU file: its variables as the XML declares them, and its binary, extracted once into a folder that is removed
again."""

from __future__ import annotations

import difflib
import hashlib
import io
import math
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable, read_model_description

from ..errors import SceneError

__all__ = ["Archive", "Variable", "find_fmu", "kept", "similar"]


@dataclass(frozen=True)
class Variable:
    """One row of modelDescription.xml; everything in the variable's own unit."""

    name: str
    reference: int
    type: str  # Real, Integer, Boolean, Enumeration, String
    causality: str
    variability: str
    description: str
    unit: str
    dimension: Mapping[str, int] = field(repr=False)  # exponents of SI base units, {} where unknown or 1
    nominal: float = 1.0
    least: float = -math.inf
    most: float = math.inf
    start: float | int | bool | str | None = None
    items: tuple[str, ...] = ()  # of an enumeration; item k has the value k + 1
    measured: bool = True  # whether the XML declares a unit; where it does not, unit is "1"
    factor: float = 1.0  # value in SI base units = factor * value + offset
    offset: float = 0.0


class Archive:
    """path: the .fmu file, or that of one inside another archive, system.ssp/resources/rod.fmu. Use as a context
    manager, or close()."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            # The schema is checked by whoever makes the FMU; a scene needs only what is read below.
            with _opened(path) as file:
                self.description: ModelDescription = read_model_description(file, validate=False)
        except Exception as error:
            raise SceneError(f"{path}: not a readable FMU ({error})") from error
        version = self.description.fmiVersion
        if self.description.fmiMajorVersion != 2:
            raise SceneError(f"{path}: made for FMI {version}; export it for FMI 2.0, as co-simulation")
        if self.description.coSimulation is None:
            raise SceneError(f"{path}: made for FMI {version} without co-simulation; export it as co-simulation")
        units = {unit.name: unit.baseUnit for unit in self.description.unitDefinitions}
        self.variables = {v.name: _variable(v, units) for v in self.description.modelVariables}
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    @property
    def guid(self) -> str:
        return self.description.guid

    @cached_property
    def digest(self) -> str:
        """Of the file's content."""
        with _opened(self.path) as file:
            return hashlib.sha256(file.read()).hexdigest()

    @cached_property
    def vectors(self) -> dict[str, tuple[str, ...]]:
        """Base name -> names of its elements in order, for structured names such as T[1], shape.p[2,3]."""
        found: dict[str, list[str]] = {}
        for name in self.variables:
            if name.endswith("]"):
                found.setdefault(name[: name.rindex("[")], []).append(name)
        return {base: tuple(names) for base, names in found.items()}

    def extract(self) -> Path:
        """The folder with the unpacked FMU."""
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix=f"{self.path.stem}-")
            with _opened(self.path) as file:
                fmpy.extract(file, unzipdir=self._folder.name)
        return Path(self._folder.name)

    def close(self) -> None:
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Kept(Archive):
    """Stays extracted until the process ends."""

    def close(self) -> None:
        pass


def kept(path: Path) -> Archive:
    """The archive of that file, read and extracted once per process and file content: for many runs."""
    about = _container(path).stat()
    return _kept(path, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=16)
def _kept(path: Path, changed: int, size: int) -> Archive:
    return _Kept(path)


def find_fmu(name: str, near: Path | None = None) -> Path:
    """The file of an FMU: a path (relative ones from the folder `near`; also into an SSP archive), or the name of one
    that comes with this package."""
    shipped = [Path(str(resources.files(__package__.rpartition(".")[0]))) / "_fmus", Path(__file__).parents[2] / "fmus"]
    places = [near or Path.cwd(), *shipped]
    for place in places:
        if _container(place / name).is_file():
            return (place / name).resolve()
    there = [file.name for place in places if place.is_dir() for file in place.glob("*.fmu")]
    hint = "run `make fmus` to build thermal.fmu and rod.fmu" if not there else similar(name, there)
    raise SceneError(f"no FMU {name!r} in {', '.join(str(place) for place in places)}; {hint}")


def similar(word: str, known: list[str] | tuple[str, ...]) -> str:
    """A remedy for a word that is not known."""
    close = difflib.get_close_matches(word, known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"allowed: {', '.join(sorted(known))}"


def _container(path: Path) -> Path:
    """The file on disk: the path itself, or the archive that it leads into."""
    return next((place for place in path.parents if place.is_file()), path)


def _opened(path: Path) -> BinaryIO:
    place = _container(path)
    if place == path:
        return path.open("rb")
    with zipfile.ZipFile(place) as archive:
        return io.BytesIO(archive.read(path.relative_to(place).as_posix()))


def dimension(base: Any) -> dict[str, int]:
    """Exponents of the SI base units in a BaseUnit of FMI or SSP; {} for 1 or nothing known."""
    if base is None:
        return {}
    return {unit: getattr(base, unit) for unit in ("kg", "m", "s", "A", "K", "mol", "cd", "rad") if getattr(base, unit)}


_READERS: dict[str, Callable[[str], float | int | bool | str]] = {
    "Real": float,
    "Integer": int,
    "Enumeration": int,
    "Boolean": lambda text: text in ("true", "1"),
}


def _variable(v: ModelVariable, units: Mapping[str, Any]) -> Variable:
    def attribute(name: str) -> str | None:
        own = getattr(v, name, None)
        return own if own is not None or v.declaredType is None else getattr(v.declaredType, name, None)

    start = None if v.start is None else _READERS.get(v.type, str)(v.start)
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=v.type,
        causality=v.causality,
        variability=v.variability,
        description=v.description or "",
        unit=attribute("unit") or "1",
        dimension=dimension(base := units.get(attribute("unit") or "")),
        factor=1.0 if base is None else float(base.factor),
        offset=0.0 if base is None else float(base.offset),
        nominal=abs(float(attribute("nominal") or 1.0)) or 1.0,  # some exporters write 0, which FMI does not allow
        least=float(attribute("min") or -math.inf),
        most=float(attribute("max") or math.inf),
        start=start,
        items=tuple(item.name for item in v.declaredType.items) if v.declaredType else (),
        measured=attribute("unit") is not None,
    )
