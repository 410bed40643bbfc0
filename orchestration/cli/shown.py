"""Arguments of commands that show a result: a scene to run, or the file of a result."""

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

__all__ = ["From", "MaybeScene", "require_models", "shown"]

MaybeScene = Annotated[str | None, typer.Argument(metavar="SCENE", help="Name or file of a scene to run")]
From = Annotated[Path | None, typer.Option("--from", metavar="RESULT.nc", help="Result to show instead of a run")]


def require_models(command: str, scene: str, overrides: Sequence[str], models: Sequence[str]) -> None:
    """Raise CosimError where a scene lacks an FMU of this package that a command needs."""
    described = read(scene, overrides)
    missing = [f"{model}.fmu" for model in models if not described.models(model)]
    if missing:
        raise CosimError(
            f"{described.name}: `tca-cosim {command}` varies settings of {' and '.join(missing)}, which the scene does "
            "not have; give a scene with them"
        )


def shown(scene: str | None, overrides: Sequence[str], source: Path | None) -> xr.Dataset:
    """Return the result of the scene, which is run, or of the file. Raises CosimError."""
    if (scene is None) == (source is None):
        raise CosimError("nothing to show, or two things: name a scene or --from RESULT.nc, not both")
    if source is None:
        return run(read(str(scene), overrides))
    if overrides:
        raise CosimError(
            f"--set {overrides[0]!r}: a result cannot be changed; name its scene instead of --from {source}"
        )
    result = results.read(source)
    if "time" not in result.coords or "members" not in result.attrs:
        raise CosimError(
            f"{source}: not a result of a run, since it has no time or no members; give a file that `run` wrote"
        )
    return result
