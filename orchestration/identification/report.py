"""An estimate as a table, as warnings in words, and as a parameter set."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.table import Table

from ..scene import Scene
from ..scene.toml_writer import base_settings
from .estimate import Estimate

__all__ = ["as_dict", "parameter_set", "table", "warnings_of"]

STRONG = 0.95  # correlation from which on it is named


def table(estimate: Estimate) -> Table:
    """Return the estimates with their intervals as a table for the console."""
    result = Table("parameter", "unit", "estimate", "std. deviation", "95 % interval")
    rows = zip(estimate.names, estimate.units, estimate.values, estimate.deviations, estimate.intervals, strict=True)
    for name, unit, value, deviation, (low, high) in rows:
        result.add_row(name, unit, f"{value:.6g}", f"{deviation:.3g}", f"{low:.6g} to {high:.6g}")
    return result


def warnings_of(estimate: Estimate) -> list[str]:
    """Return what the data cannot tell, strong correlations, and bounds that are reached."""
    texts = [
        f"the data do not tell {', '.join(names)}"
        + (" one by one, only a combination of them" if len(names) > 1 else "")
        + "; fix one, give a prior, or measure more"
        for names in dict.fromkeys(estimate.undetermined)
    ]
    named = {name for names in estimate.undetermined for name in names}
    for i, j in zip(*np.triu_indices(len(estimate.names), 1), strict=True):
        correlation = estimate.correlations[i, j]
        if abs(correlation) > STRONG and not {estimate.names[i], estimate.names[j]} <= named:
            texts.append(f"{estimate.names[i]} and {estimate.names[j]} have the correlation {correlation:.3f}")
    texts += [f"{name} ends at a bound, where its interval does not hold" for name in estimate.at_bounds]
    return texts


def as_dict(estimate: Estimate) -> dict[str, Any]:
    """Return the estimate as plain numbers and texts."""
    return {
        "names": list(estimate.names),
        "units": list(estimate.units),
        "values": estimate.values.tolist(),
        "deviations": estimate.deviations.tolist(),
        "intervals_95": estimate.intervals.tolist(),
        "correlations": estimate.correlations.tolist(),
        "noise": dict(estimate.noise),
        "residuals_rms": dict(estimate.residuals),
        "undetermined": [list(names) for names in estimate.undetermined],
        "at_bounds": list(estimate.at_bounds),
        "samples": estimate.samples,
        "runs": estimate.runs,
    }


def parameter_set(scene: Scene, estimate: Estimate) -> dict[str, Any]:
    """Return the parameter set that the scene builds on, with the estimates in it."""
    tables = base_settings(scene)
    for name, value in estimate.parameters().items():
        member, _, parameter = name.partition(".")
        elements = scene.member(member).archive.vectors.get(parameter)
        tables.setdefault(member, {})[parameter] = [value] * len(elements) if elements else value
    return tables
