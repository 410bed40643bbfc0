"""tca-cosim run: one scene."""

from __future__ import annotations

import json
from pathlib import Path

import xarray as xr

from .. import results
from ..errors import CosimError
from ..scene import Scene, read
from .console import out, reported, written
from .console import run as run_scene
from .fit import explain
from .options import Folder, Overrides, SceneName

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
) -> None:
    """Runs one scene; writes NAME.nc and NAME.csv."""
    with reported():
        described = read(scene, override)
        try:
            result = run_scene(described)
        except CosimError as error:
            if error.partial is not None:
                path = folder / f"{described.name}.partial.nc"
                results.write(error.partial, path)
                out.print(f"what was computed until then: {path}", highlight=False)
            raise
        for ending in ("nc", "csv"):
            results.write(result, folder / f"{described.name}.{ending}")
        _summarise(described, result)
        if "fidelity" in result.attrs:
            explain(json.loads(result.attrs["fidelity"]))
        written(folder / f"{described.name}.nc", ".csv")


def _summarise(scene: Scene, result: xr.Dataset) -> None:
    steps = result.sizes["time"] - 1
    sweeps = float(result["coupling.sweeps"][1:].mean())
    out.print(
        f"{scene.title}: {steps} macro steps, {sweeps:.2f} sweeps each, gain {float(result['coupling.gain'][-1]):.3g}",
        highlight=False,
    )
