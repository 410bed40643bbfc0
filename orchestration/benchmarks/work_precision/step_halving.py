"""Coupling error: the co-simulation against the monolith of the same models, as macro steps are halved.

All other tolerances are tight, so that the difference decreases at the order of exchange and waveform until they are
reached.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from ... import results
from ...errors import CouplingError
from ...results.provenance import commit
from ...scene import read
from ...verification import monolith
from .norm import ErrorNorm
from .solvers import CoSimulation

__all__ = ["TIGHT", "halve_steps"]

TIGHT = ("coupling.tolerance=1e-12", "coupling.waveform=hermite", "rod.tolerance=1e-11", "thermal.tolerance=1e-4")
OUTPUTS = 10  # evenly spaced outputs; the longest macro step is one interval
INTEGRATOR = 1e-12  # relative tolerance of the monolith
ENOUGH = 1e-9  # difference, share of the range, at which halving ends


def halve_steps(
    source: str,
    overrides: Sequence[str] = (),
    halvings: int = 12,
    progress: Callable[[float], None] = lambda share: None,
) -> xr.Dataset:
    """Halve the macro step until the difference to the monolith is below ENOUGH.

    Parameters
    ----------
    source : str
        Name or file of the scene.
    overrides : sequence of str
        'key=value'; they win over TIGHT.
    halvings : int
        Largest number of halvings.
    progress : callable
        Called with the share done.

    Returns
    -------
    Dataset
        Over the macro step: difference, in the norm of a chart, nan where the loop cannot be solved over steps so long
        (failure says why); order, log2 of the ratio to the difference of the step before.

    Raises
    ------
    CouplingError
        Where no step is short enough.
    SceneError, CosimError
    """
    tight = (*TIGHT, *overrides)
    scene = read(source, tight)
    times = np.linspace(0.0, scene.stop_time, OUTPUTS + 1)
    norm = ErrorNorm.from_reference(monolith.solve_monolith(scene, INTEGRATOR, times), times)
    differences, failures = list[float](), list[str]()
    for k in range(halvings + 1):
        progress(k / (halvings + 1))
        try:
            with contextlib.closing(CoSimulation(source, tight, times, 2**k)) as solver:
                solver.run(np.inf)
                differences.append(norm.error(solver.result()))
                failures.append("")
        except CouplingError as failure:
            if k == halvings and not np.isfinite(differences).any():
                raise
            differences.append(np.nan)
            failures.append(str(failure))
        if differences[-1] <= ENOUGH and k:
            break
    difference = np.array(differences)
    steps = (times[1] - times[0]) / 2.0 ** np.arange(len(differences))
    order = np.append(np.nan, np.log2(difference[:-1] / difference[1:]))
    record = results.scene_record(scene, "complete")
    return xr.Dataset(
        {
            "difference": ("step", difference, {"units": "1", "long_name": norm.axis()}),
            "order": ("step", order, {"units": "1", "long_name": "log2 of the ratio to the step before"}),
            "failure": ("step", failures, {"long_name": "why it failed"}),
        },
        {"step": ("step", steps, {"units": "s", "long_name": "macro step"})},
        {**record, "ranges": json.dumps(norm.ranges), "integrator": INTEGRATOR, "commit": commit()},
    )
