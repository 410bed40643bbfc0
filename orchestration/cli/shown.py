"""What commands that show a result take: a scene to run, or the file of a result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
import xarray as xr

from .. import results
from ..errors import CosimError
from ..scene import read
from .console import run

__all__ = ["From", "MaybeScene", "shown"]

MaybeScene = Annotated[str | None, typer.Argument(metavar="SCENE", help="Name or file of a scene, which is run")]
From = Annotated[Path | None, typer.Option("--from", metavar="RESULT.nc", help="Shows this result instead")]


def shown(scene: str | None, overrides: Sequence[str], source: Path | None) -> xr.Dataset:
    """The result of the scene, run now, or of the file."""
    if (scene is None) == (source is None):
        raise CosimError("what to show? Name a scene, or --from RESULT.nc, not both")
    if source is None:
        return run(read(str(scene), overrides))
    if overrides:
        raise CosimError(f"--set {overrides[0]!r}: a result is as it is; name its scene instead of --from {source}")
    result = results.read(source)
    if "time" not in result.coords or "members" not in result.attrs:
        raise CosimError(f"{source} is no result of a run: no time or no members in it; allowed: what `run` wrote")
    return result
