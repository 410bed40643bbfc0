"""tca-cosim run: one scene."""

from __future__ import annotations

import json
import math
from pathlib import Path

import xarray as xr

from .. import results
from ..scene import Scene, read
from .console import out, partial_kept, reported, written
from .console import run as run_scene
from .options import Folder, Overrides, SceneName
from .select import explain

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
) -> None:
    """Runs one scene; writes NAME.nc and NAME.csv."""
    with reported():
        described = read(scene, override)
        with partial_kept(folder, "nc", results.write):
            result = run_scene(described)
        for ending in ("nc", "csv"):
            results.write(result, folder / f"{described.name}.{ending}")
        _summarise(described, result)
        if "fidelity" in result.attrs:
            explain(json.loads(result.attrs["fidelity"]))
        written(folder / f"{described.name}.nc", ".csv")


def _summarise(scene: Scene, result: xr.Dataset) -> None:
    steps = result.sizes["time"] - 1
    sweeps = float(result["coupling.sweeps"][1:].mean())
    gain = float(result["coupling.gain"][-1])
    about = "" if math.isnan(gain) else f", loop gain {gain:.3g}"  # nan: nothing was iterated
    out.print(f"{scene.title}: {steps} macro steps, {sweeps:.2f} sweeps each{about}", highlight=False)
