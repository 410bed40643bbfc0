"""tca-cosim export: the FMUs for other tools."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

from ..errors import CosimError
from ..fmi.archive import find_fmu
from ..scene import ssp_writer
from .console import reported, written

__all__ = ["command"]


def command(
    folder: Annotated[Path | None, typer.Argument(help="Where to put the FMUs")] = None,
    system: Annotated[
        Path | None, typer.Option("--ssp", help="An SSP archive to write: FMUs, wiring, parameters")
    ] = None,
) -> None:
    """Copies thermal.fmu and rod.fmu, or writes them wired as scene `step`, to drop into another tool."""
    with reported():
        if folder is None and system is None:
            raise CosimError("nothing to export: name a folder for the FMUs, or --ssp FILE.ssp, or both")
        if folder is not None:
            found = [find_fmu(name) for name in ("thermal.fmu", "rod.fmu")]
            folder.mkdir(parents=True, exist_ok=True)
            for path in found:
                shutil.copy2(path, folder)
                written(folder / path.name)
        if system is not None:
            ssp_writer.write(system)
            written(system)
