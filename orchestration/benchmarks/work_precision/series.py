"""The series of a chart, read from TOML (series.toml): solvers with overrides of the scene and swept settings."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ...errors import CosimError
from ...fmi.archive import similar
from ...scene import Scene
from .reference_solution import LEVELS
from .solvers import SOLVERS, has_inertia

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["ChartPlan", "Series", "Trial", "read_series"]

OWN = Path(__file__).with_name("series.toml")
KINDS = {"any": (False, True), "equilibrium": (False,), "motion": (True,)}  # kind of scene -> values of rod.dynamic


@dataclass(frozen=True)
class Trial:
    """One point of a chart: a solver with its settings on a scene with overrides."""

    series: str
    panel: str
    solver: str
    overrides: tuple[str, ...]
    settings: Mapping[str, Any]

    @property
    def swept(self) -> str:
        """Overrides and settings as text, for the table."""
        return ", ".join([*self.overrides, *(f"{name}={value}" for name, value in self.settings.items())])


@dataclass(frozen=True)
class Series:
    """Points that are drawn as one line.

    Parameters
    ----------
    name : str
        Name in the legend.
    panel : str
        Key of the panel.
    solver : str
        Key of SOLVERS.
    scenes : str
        Kind of scene, a key of KINDS.
    set : tuple of str
        Overrides of all points.
    sweep : mapping, optional
        Key of a scene (with a dot) or setting of the solver -> values; all lists are taken together.
    """

    name: str
    panel: str
    solver: str = "cosimulation"
    scenes: str = "any"
    set: tuple[str, ...] = ()
    sweep: Mapping[str, Sequence[Any]] | None = None

    def trials(self) -> list[Trial]:
        """The points of the series."""
        columns = self.sweep or {}
        count = len(next(iter(columns.values()), (None,)))
        trials = []
        for k in range(count):
            row = {key: values[k] for key, values in columns.items()}
            swept = tuple(f"{key}={value}" for key, value in row.items() if "." in key)
            settings = {key: value for key, value in row.items() if "." not in key}
            trials.append(Trial(self.name, self.panel, self.solver, (*self.set, *swept), settings))
        return trials


@dataclass(frozen=True)
class ChartPlan:
    """All series of a chart.

    outputs: number of evenly spaced outputs; panels: key -> title, in order; reference: settings of its two levels,
    coarse and fine.
    """

    outputs: int
    panels: Mapping[str, str]
    reference: Mapping[str, Mapping[str, Any]]
    series: tuple[Series, ...]

    def trials(self, scene: Scene, panels: Sequence[str] = ()) -> list[Trial]:
        """The points of a scene, of all panels by default. Raises CosimError where a panel is unknown."""
        for name in panels:
            if name not in self.panels:
                raise CosimError(f"chart: no panel {name!r}; {similar(name, list(self.panels))}")
        kind = has_inertia(scene)
        wanted = [s for s in self.series if kind in KINDS[s.scenes] and (not panels or s.panel in panels)]
        return [trial for s in wanted for trial in s.trials()]


def read_series(path: Path = OWN) -> ChartPlan:
    """Read a file of series. Raises CosimError, which names file, series, key and remedy."""
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CosimError(f"{path}: cannot be read: {error}") from error
    for key in ("panels", "reference", "series"):
        if key not in raw:
            raise CosimError(f"{path}: {key} is missing; {OWN} shows how it is written")
    for level in LEVELS:
        if not {"set", "tolerance"} <= set(raw["reference"].get(level, {})):
            raise CosimError(f"{path}: reference.{level} wants set and tolerance; {OWN} shows how it is written")
    series = tuple(_series(path, table, raw["panels"]) for table in raw["series"])
    return ChartPlan(int(raw.get("outputs", 30)), raw["panels"], raw["reference"], series)


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
