"""rod.fmu, as a host written in C calls it: spatial with all six strains, and planar with the three of its plane.

It is written for one TCA, the least that it can have, which pulls with no force: the other codes have none.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable

import numpy as np

from ...fmi.archive import Archive
from ...fmi.compiled_steps import compiled_steps
from ...fmi.configuration import Configuration, configured_fmu
from ...fmi.slave import Slave
from .release import Code, ReleaseProblem, Setting

__all__ = ["CODE"]

# order, tolerance
_UNDAMPED = (
    *((2, 0.1), (2, 0.08), (2, 0.07), (2, 0.06), (3, 0.06), (3, 0.03), (3, 0.02)),
    *((4, 0.06), (4, 0.02), (5, 0.05), (5, 0.015), (5, 1e-3), (6, 5e-3), (7, 2e-3)),
)
_DAMPED = (
    *((1, 0.1), (2, 0.1), (2, 0.05), (2, 0.03), (2, 0.02), (2, 0.01), (2, 1e-3), (2, 1e-4)),
    *((3, 0.01), (3, 1e-4), (4, 1e-4)),
)


def settings(damped: bool) -> list[Setting]:
    """Settings that are measured.

    dim: 3 spatial, 2 planar; outputs: 5 at the reference's times only, else that many at equal intervals.
    """
    pairs = _DAMPED if damped else _UNDAMPED
    return [
        {"dim": dim, "outputs": count, "order": k, "tolerance": tol}
        for dim in (3, 2)
        for count in (5, 100)
        for k, tol in pairs
    ]


def prepare(release: ReleaseProblem, setting: Setting) -> Callable[[], np.ndarray]:
    """Set up one setting and return its simulation."""
    values = {
        "tca.law": release.archive.variables["tca.law"].items.index("measured") + 1,
        "tca.stiffness": 0.0,
        "body.rho": release.rho,
        "body.shear_factor": release.shear_factor,
        "body.retardation": release.retardation,
        "planar": setting["dim"] == 2,
        "order": int(setting["order"]),
        "tolerance": setting["tolerance"],
    }
    archive = Archive(configured_fmu(release.archive, Configuration(tcas=1)))
    rod = Slave(archive, "rod", values, ["gravity[1]"], [], ["tip.p[3]", "tip.p[1]"])
    rod.initialise(0.0, np.array([release.gravity]))
    rod.begin()
    count = int(setting["outputs"])
    stops = release.times if count == 5 else np.linspace(0.0, release.times[-1], count + 1)[1:]

    chosen = np.searchsorted(stops, release.times - 1e-9)
    compiled = compiled_steps(rod, stops)

    def simulate() -> np.ndarray:
        if compiled is not None:
            return compiled()[chosen]
        now, tips = 0.0, []
        for stop in stops.tolist():
            rod.step(now, stop - now)
            tips.append(rod.record())
            now = stop
        return np.array(tips)[chosen]

    weakref.finalize(simulate, archive.close)  # not while it is timed
    weakref.finalize(simulate, rod.close)
    return simulate


CODE = Code("rod.fmu", "dim 3: all six strains; dim 2: planar = true; stops for outputs only", settings, prepare)
