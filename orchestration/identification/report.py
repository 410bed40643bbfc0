"""An estimate as a table, as warnings in words, and as a parameter set."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.table import Table

from ..scene import Scene
from ..scene.manipulator import is_element_of
from ..scene.toml_writer import base_settings, settings_of
from .estimate import Estimate
from .resampling import Bootstrap

__all__ = ["as_dict", "parameter_set", "table", "warnings_of"]

UNEXPLAINED = 1.0  # residuals over the standard deviation of the measurements from which on a fit says nothing
PRIOR_ALONE = 0.99  # deviation over that of the prior from which on the data add nothing
STRONG = 0.95  # correlation from which on it is named
PLACES = tuple(f"tca.{key}" for key in ("offset", "offset_end", "azimuth", "helix", "first_segment", "last_segment"))


def table(estimate: Estimate, resampled: Bootstrap | None = None) -> Table:
    """Return the estimates with their intervals as a table for the console."""
    result = Table()
    result.add_column("parameter", no_wrap=True, overflow="fold")  # a name that is cut cannot be told from others
    for head in ("unit", "estimate", "std. deviation", "95 % interval"):
        result.add_column(head)
    if resampled is not None:
        result.add_column("95 %, bootstrap")
    rows = zip(estimate.names, estimate.units, estimate.values, estimate.deviations, estimate.intervals, strict=True)
    for k, (name, unit, value, deviation, interval) in enumerate(rows):
        more = [] if resampled is None else [_between(resampled.intervals[k])]
        result.add_row(name, unit, f"{value:.6g}", f"{deviation:.3g}", _between(interval), *more)
    return result


def _between(interval: np.ndarray) -> str:
    return f"{interval[0]:.6g} to {interval[1]:.6g}"


def warnings_of(estimate: Estimate, resampled: Bootstrap | None = None) -> list[str]:
    """Return what the data cannot tell, strong correlations, bounds that are reached, and fits that failed."""
    texts = [] if estimate.converged else ["the fit has not converged; start elsewhere, or give bounds and priors"]
    texts += [
        f"the data do not tell {', '.join(names)}"
        + (" one by one, only a combination of them" if len(names) > 1 else "")
        + "; fix one, give a prior, or measure more"
        for names in dict.fromkeys(estimate.undetermined)
    ]
    texts += [
        f"the fit says nothing of {name}: its residuals ({rms:.3g} rms) are as large as the variation measured; check "
        "units, times and the scene"
        for name, rms in estimate.residuals.items()
        if rms > UNEXPLAINED * estimate.spread[name] > 0.0
    ]
    texts += [
        f"the data add nothing to the prior of {parameter.name}; measure what depends on it"
        for parameter, deviation in zip(estimate.free, estimate.deviations, strict=False)
        if parameter.prior is not None and deviation > PRIOR_ALONE * parameter.prior[1]
    ]
    named = {name for names in estimate.undetermined for name in names}
    for i, j in zip(*np.triu_indices(len(estimate.names), 1), strict=True):
        correlation = estimate.correlations[i, j]
        if abs(correlation) > STRONG and not {estimate.names[i], estimate.names[j]} <= named:
            texts.append(f"{estimate.names[i]} and {estimate.names[j]} have the correlation {correlation:.3f}")
    texts += [f"{name} ends at a bound, where its interval does not hold" for name in estimate.at_bounds]
    if resampled is not None and resampled.failed:
        total = resampled.failed + len(resampled.values)
        texts.append(f"{resampled.failed} of {total} fits to resampled measurements failed and are left out")
    return texts


def as_dict(estimate: Estimate, resampled: Bootstrap | None = None) -> dict[str, Any]:
    """Return the estimate as plain numbers and texts."""
    content = {
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
        "converged": estimate.converged,
    }
    if resampled is not None:
        content["bootstrap"] = {
            "repeats": len(resampled.values),
            "failed": resampled.failed,
            "deviations": resampled.deviations.tolist(),
            "intervals_95": resampled.intervals.tolist(),
        }
    return content


def parameter_set(scene: Scene, estimate: Estimate) -> dict[str, Any]:
    """Return a parameter set: the one that the scene builds on, what the scene says of the TCAs, and the estimates.

    An estimate of a TCA law means nothing without the rest of it: which law, chirality, reference temperature. Where
    the TCAs lie stays with the scene.
    """
    tables, own, values = base_settings(scene), settings_of(scene), estimate.parameters()
    of_tcas = {name.partition(".")[0] for name in values if name.partition(".")[2].startswith("tca.")}
    for table in ("tca", *of_tcas) if of_tcas else ():
        for key, value in own.get(table, {}).items():
            name = f"tca.{key}" if table == "tca" else key
            if name == "T_0" or (name.startswith("tca.") and name.partition("[")[0] not in PLACES):
                tables.setdefault(table, {})[key] = value
    for name, value in values.items():
        member, _, parameter = name.partition(".")
        for key in [k for k in tables.setdefault(member, {}) if is_element_of(k, parameter)]:
            del tables[member][key]
        tables[member][parameter] = value
    return tables
