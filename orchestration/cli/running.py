"""What `tca-cosim run` does: run, write, describe."""

from __future__ import annotations

import contextlib
import itertools
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import SceneError
from .console import partial_kept, reported, run_table, say, written

if TYPE_CHECKING:
    from ..results import ResultLike

__all__ = ["run_scene"]

_SETTINGS = ("stop_time_s", "coupling", "connections", "members")  # attributes that two runs of one scene share
_UNSAFE = set('/\\:*?"<>|\0')  # characters that a file name cannot have everywhere


def run_scene(
    scene: str, override: Sequence[str] = (), folder: Path = Path("results"), name: str | None = None
) -> None:
    """Run a scene and write NAME.nc and NAME.csv."""
    from .. import results
    from ..scene import read
    from .outcome import describe

    with reported():
        described = read(scene, override)
        if name is not None:
            if not name.strip() or _UNSAFE & set(name):
                raise SceneError(f"--name {name!r}: not the name of a file; give letters, digits, - and _")
            described = replace(described, name=name)
        with partial_kept(folder, "nc", results.write):
            result = run_table(described)
        kept = _keep(folder / described.name, result)
        for ending in ("nc", "csv"):
            results.write(result, folder / f"{described.name}.{ending}")
        say(described.title, *describe(result))
        if "fidelity" in result.attrs:
            say(*json.loads(result.attrs["fidelity"])["reasons"])
        if kept:
            say(f"kept, since its settings differ: {kept}")
        written(folder / f"{described.name}.nc", ".csv")


def _keep(stem: Path, result: ResultLike) -> Path | None:
    """Rename an older result of other settings, so that it is not overwritten; return its new name."""
    older = stem.with_name(f"{stem.name}.nc")
    if not older.is_file():
        return None
    import netCDF4

    try:
        with netCDF4.Dataset(older) as file:
            same = all(vars(file).get(key) == result.attrs.get(key) for key in _SETTINGS)
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
