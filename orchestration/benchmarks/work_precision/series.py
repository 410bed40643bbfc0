"""What a chart compares, as data (series.toml): named lists of overrides with a sweep."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ...errors import CosimError
from ...fmi.archive import similar
from ...scene import Scene
from .solvers import SOLVERS, moves
from .truth import LEVELS

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["Plan", "Series", "Trial", "plan"]

OWN = Path(__file__).with_name("series.toml")
KINDS = {"any": (False, True), "equilibrium": (False,), "motion": (True,)}  # of scenes: is the rod dynamic?


@dataclass(frozen=True)
class Trial:
    """One point: a solver with its settings, on a scene with overrides."""

    series: str
    panel: str
    solver: str
    overrides: tuple[str, ...]
    settings: Mapping[str, Any]

    @property
    def swept(self) -> str:
        """As text, for the table."""
        return ", ".join([*self.overrides, *(f"{name}={value}" for name, value in self.settings.items())])


@dataclass(frozen=True)
class Series:
    """name: of the legend; panel: key of the chart's panels; solver: key of SOLVERS; scenes: which, a key of KINDS;
    set: overrides of all its points; sweep: key of a scene (with a dot) or setting of the solver -> values, taken
    together."""

    name: str
    panel: str
    solver: str = "cosimulation"
    scenes: str = "any"
    set: tuple[str, ...] = ()
    sweep: Mapping[str, Sequence[Any]] | None = None

    def trials(self) -> list[Trial]:
        columns = self.sweep or {}
        count = len(next(iter(columns.values()), (None,)))
        found = []
        for k in range(count):
            row = {key: values[k] for key, values in columns.items()}
            swept = tuple(f"{key}={value}" for key, value in row.items() if "." in key)
            settings = {key: value for key, value in row.items() if "." not in key}
            found.append(Trial(self.name, self.panel, self.solver, (*self.set, *swept), settings))
        return found


@dataclass(frozen=True)
class Plan:
    """outputs: how many, evenly spaced; panels: key -> title, in order; truth: coarse and fine."""

    outputs: int
    panels: Mapping[str, str]
    truth: Mapping[str, Mapping[str, Any]]
    series: tuple[Series, ...]

    def of(self, scene: Scene, panels: Sequence[str] = ()) -> list[Trial]:
        """The points of a scene; of some panels only where named. Raises CosimError."""
        for name in panels:
            if name not in self.panels:
                raise CosimError(f"chart: no panel {name!r}; {similar(name, list(self.panels))}")
        kind = moves(scene)
        wanted = [s for s in self.series if kind in KINDS[s.scenes] and (not panels or s.panel in panels)]
        return [trial for s in wanted for trial in s.trials()]


def plan(path: Path = OWN) -> Plan:
    """Raises CosimError, which names file, series, key and remedy."""
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CosimError(f"{path}: cannot be read: {error}") from error
    for key in ("panels", "truth", "series"):
        if key not in raw:
            raise CosimError(f"{path}: {key} is missing; {OWN} shows how it is written")
    for level in LEVELS:
        if not {"set", "tolerance"} <= set(raw["truth"].get(level, {})):
            raise CosimError(f"{path}: truth.{level} wants set and tolerance; {OWN} shows how it is written")
    series = tuple(_series(path, table, raw["panels"]) for table in raw["series"])
    return Plan(int(raw.get("outputs", 30)), raw["panels"], raw["truth"], series)


def _series(path: Path, table: Mapping[str, Any], panels: Mapping[str, str]) -> Series:
    def refuse(problem: str) -> None:
        raise CosimError(f"{path}: series {table.get('name', '?')!r}: {problem}")

    known = [f.name for f in fields(Series)]
    for key in table:
        if key not in known:
            refuse(f"unknown key {key!r}; {similar(key, known)}")
    for key in ("name", "panel"):
        if key not in table:
            refuse(f"{key} is missing")
    series = Series(**{**table, "set": tuple(table.get("set", ()))})
    for key, value, allowed in (
        ("panel", series.panel, list(panels)),
        ("solver", series.solver, list(SOLVERS)),
        ("scenes", series.scenes, list(KINDS)),
    ):
        if value not in allowed:
            refuse(f"{key} = {value!r}; {similar(value, allowed)}")
    columns = series.sweep or {}
    if len({len(values) for values in columns.values()}) > 1 or not all(columns.values()):
        refuse("the lists of sweep are taken together; give them one length, at least 1")
    for key in columns:
        if "." not in key and key not in SOLVERS[series.solver].settings:
            refuse(f"sweep.{key}: no setting of {series.solver}; {similar(key, SOLVERS[series.solver].settings)}")
    return series
