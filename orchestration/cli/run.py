"""tca-cosim run: run a scene."""

from __future__ import annotations

import contextlib
import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
import xarray as xr

from .. import results
from ..errors import SceneError
from ..scene import read
from .console import out, partial_kept, reported, written
from .console import run as run_scene
from .options import Folder, Overrides, SceneName
from .outcome import describe
from .select import explain

__all__ = ["command"]

_SETTINGS = ("stop_time_s", "coupling", "connections", "members")  # attributes that two runs of one scene share
_UNSAFE = set('/\\:*?"<>|\0')  # characters that a file name cannot have everywhere


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    name: Annotated[str | None, typer.Option("--name", help="Name of the files; default: that of the scene")] = None,
) -> None:
    """Runs a scene; writes NAME.nc and NAME.csv. A result of other settings that has the name is kept as
    NAME.previous."""
    with reported():
        described = read(scene, override)
        if name is not None:
            if not name.strip() or _UNSAFE & set(name):
                raise SceneError(f"--name {name!r}: not the name of a file; give letters, digits, - and _")
            described = replace(described, name=name)
        with partial_kept(folder, "nc", results.write):
            result = run_scene(described)
        kept = _keep(folder / described.name, result)
        for ending in ("nc", "csv"):
            results.write(result, folder / f"{described.name}.{ending}")
        out.print(described.title, *describe(result), sep="\n", highlight=False, soft_wrap=True)
        if "fidelity" in result.attrs:
            explain(json.loads(result.attrs["fidelity"]))
        if kept:
            out.print(f"kept, since its settings differ: {kept}", highlight=False, soft_wrap=True)
        written(folder / f"{described.name}.nc", ".csv")


def _keep(stem: Path, result: xr.Dataset) -> Path | None:
    """Rename an older result of other settings, so that it is not overwritten; return its new name."""
    older = stem.with_name(f"{stem.name}.nc")
    if not older.is_file():
        return None
    try:
        with xr.open_dataset(older, engine="netcdf4") as dataset:
            same = all(dataset.attrs.get(key) == result.attrs.get(key) for key in _SETTINGS)
    except (OSError, ValueError, RuntimeError):  # not a result at all
        same = False
    if same:
        return None
    names = (f"{stem.name}.previous{'' if k == 1 else f'-{k}'}" for k in itertools.count(1))
    free = next(name for name in names if not stem.with_name(f"{name}.nc").exists())
    for ending in ("nc", "csv"):
        with contextlib.suppress(FileNotFoundError):
            stem.with_name(f"{stem.name}.{ending}").replace(stem.with_name(f"{free}.{ending}"))
    return stem.with_name(f"{free}.nc")
