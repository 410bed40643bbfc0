"""How far two results lie apart in what a scene asks for: rms over the common times of the distance, share of the
quantity's range. The range is the diagonal of the box that the quantity moves in; one that hardly moves is measured
by a share of its nominal."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..errors import SceneError
from ..scene import Scene

__all__ = ["DEFAULT", "error", "quantities"]

DEFAULT = ("rod", "tip.p")  # model and output that a scene asks for where it does not say
_RESTING = 1e-3  # share of the nominal that counts as range, at least


def quantities(scene: Scene) -> dict[str, float]:
    """Names of what the scene asks for, and the least range of each. Raises SceneError."""
    names = scene.asked.quantities
    if not names:
        rod = scene.model(DEFAULT[0])
        if rod is None:
            raise SceneError(
                f"{scene.name}: asks for nothing, and has no {DEFAULT[0]}.fmu whose tip could be meant; "
                "set fidelity.quantities, such as ['thermal.T']"
            )
        names = (f"{rod.name}.{DEFAULT[1]}",)
    found = {}
    for name in names:
        member, _, output = name.partition(".")
        archive = scene.member(member).archive
        found[name] = _RESTING * archive.variables[archive.vectors.get(output, (output,))[0]].nominal
    return found


def error(result: xr.Dataset, better: xr.Dataset, asked: dict[str, float]) -> float:
    """The largest of all quantities asked for. asked: from quantities()."""
    a, b = result["time"].to_numpy(), better["time"].to_numpy()
    nearest = np.abs(np.subtract.outer(a, b)).argmin(axis=1)
    same = np.abs(a - b[nearest]) <= 1e-9 * b[-1]
    worst = 0.0
    for name, least in asked.items():
        one, other = (x[name].to_numpy().reshape(len(x["time"]), -1) for x in (result, better))
        span = float(np.linalg.norm(np.ptp(other, axis=0)))
        gap = one[same] - other[nearest[same]]
        if better[name].attrs.get("units") == "rad":
            gap = (gap + np.pi) % (2.0 * np.pi) - np.pi
        worst = max(worst, float(np.sqrt((gap**2).sum(axis=1).mean())) / max(span, least))
    return worst
