"""A stability study: panels, one per method, over macro steps and coupling strengths, as one Dataset."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from ...parallel import Worker, serial
from ...results.software import versions
from .verdict import KINDS, Verdict

__all__ = ["Panel", "RowTask", "StabilityStudy", "run_study"]

RowTask = Callable[[], list[Verdict]]  # verdicts for all strengths at one macro step


@dataclass(frozen=True)
class Panel:
    """One method of a map.

    Parameters
    ----------
    title : str
        Title of the panel.
    judge : callable
        (macro step [s], strength) -> Verdict; can be pickled.
    limit : callable, optional
        Macro steps (n,) [s] -> strength (n,) above which the method fails by theory, nan where it does not.
    marks : tuple of (float, float)
        Single known limits (macro step, strength).
    settings : mapping
        Recorded with the dataset.
    """

    title: str
    judge: Callable[[float, float], Verdict]
    limit: Callable[[np.ndarray], np.ndarray] | None = None
    marks: tuple[tuple[float, float], ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class StabilityStudy:
    """A map to be computed."""

    name: str
    title: str
    steps: np.ndarray  # (n,) [s]
    strengths: np.ndarray  # (m,) [1]
    strength_label: str
    panels: tuple[Panel, ...]
    settings: Mapping[str, Any]


def run_study(study: StabilityStudy, worker: Worker[list[Verdict]] = serial) -> xr.Dataset:
    """Judge a run for every cell of every panel.

    Returns a Dataset with verdict (a flag), sweeps, gain and growth over (panel, step, strength), and the limit of
    theory over (panel, step). worker executes the rows: here, or spread over processes.
    """
    shape = len(study.panels), len(study.steps), len(study.strengths)
    rows = [partial(_row, panel.judge, float(h), study.strengths) for panel in study.panels for h in study.steps]
    judged: list[list[Verdict]] = [[] for _ in rows]
    for number, verdicts in worker(rows):
        judged[number] = verdicts
    flat = [verdict for row in judged for verdict in row]
    dims = ("panel", "step", "strength")
    dataset = xr.Dataset(
        coords={
            "panel": ("panel", [panel.title for panel in study.panels]),
            "step": ("step", study.steps, {"units": "s", "long_name": "macro step H"}),
            "strength": ("strength", study.strengths, {"units": "1", "long_name": study.strength_label}),
        }
    )
    flags = {"flag_values": np.arange(len(KINDS), dtype=np.int8), "flag_meanings": " ".join(KINDS)}
    kinds = np.array([KINDS.index(verdict.kind) for verdict in flat], dtype=np.int8).reshape(shape)
    dataset["verdict"] = dims, kinds, {"units": "1", "long_name": "how the run ended", **flags}
    for name, text in (
        ("sweeps", "mean sweeps per macro step; of the failed one where a run failed"),
        ("gain", "estimated loop gain of the last macro step"),
        ("growth", "factor of the motion per macro step, where it was measured"),
    ):
        values = np.array([getattr(verdict, name) for verdict in flat]).reshape(shape)
        dataset[name] = dims, values, {"units": "1", "long_name": text}
    limits = [np.full(len(study.steps), np.nan) if p.limit is None else p.limit(study.steps) for p in study.panels]
    dataset["limit"] = dims[:2], np.array(limits), {"units": "1", "long_name": "strength above which theory says no"}
    dataset.attrs = {
        "title": study.title,
        "study": study.name,
        "settings": json.dumps(study.settings),
        "panels": json.dumps([{"title": p.title, "marks": p.marks, **p.settings} for p in study.panels]),
        "versions": json.dumps(versions()),
    }
    return dataset


def _row(judge: Callable[[float, float], Verdict], step: float, strengths: np.ndarray) -> list[Verdict]:
    return [judge(step, float(strength)) for strength in strengths]
