"""What coupling costs in accuracy: the co-simulation against the monolith of the same models, as macro steps are
halved. All else is tight, so that the difference falls at the order of exchange and waveform until the tolerances
are met."""

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
from .norm import Norm
from .solvers import CoSimulation

__all__ = ["TIGHT", "halving"]

TIGHT = ("coupling.tolerance=1e-12", "coupling.waveform=hermite", "rod.tolerance=1e-11", "thermal.tolerance=1e-4")
OUTPUTS = 10
INTEGRATOR = 1e-12
ENOUGH = 1e-9


def halving(
    source: str,
    overrides: Sequence[str] = (),
    halvings: int = 12,
    progress: Callable[[float], None] = lambda share: None,
) -> xr.Dataset:
    """difference (macro step): in the norm of a chart, nan where the loop cannot be solved over steps so long, and
    failure says why; order: log2 of the ratio to the difference of the step before. overrides win over TIGHT. Ends
    below ENOUGH. progress(share done). Raises CouplingError where no step is short enough, SceneError, CosimError."""
    tight = (*TIGHT, *overrides)
    scene = read(source, tight)
    times = np.linspace(0.0, scene.stop_time, OUTPUTS + 1)
    norm = Norm.of(monolith.solve_monolith(scene, INTEGRATOR, times), times)
    found, failures = list[float](), list[str]()
    for k in range(halvings + 1):
        progress(k / (halvings + 1))
        try:
            with contextlib.closing(CoSimulation(source, tight, times, 2**k)) as solver:
                solver.run(np.inf)
                found.append(norm.error(solver.result()))
                failures.append("")
        except CouplingError as failure:
            if k == halvings and not np.isfinite(found).any():
                raise
            found.append(np.nan)
            failures.append(str(failure))
        if found[-1] <= ENOUGH and k:
            break
    difference = np.array(found)
    steps = (times[1] - times[0]) / 2.0 ** np.arange(len(found))
    order = np.append(np.nan, np.log2(difference[:-1] / difference[1:]))
    about = results.scene_record(scene, "complete")
    return xr.Dataset(
        {
            "difference": ("step", difference, {"units": "1", "long_name": norm.axis()}),
            "order": ("step", order, {"units": "1", "long_name": "log2 of the ratio to the step before"}),
            "failure": ("step", failures, {"long_name": "why it failed"}),
        },
        {"step": ("step", steps, {"units": "s", "long_name": "macro step"})},
        {**about, "ranges": json.dumps(norm.ranges), "integrator": INTEGRATOR, "commit": commit()},
    )
