"""tca-cosim export: FMUs and an SSP archive for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import CosimError
from ..files import atomic_write
from ..fmi.archive import find_fmu
from ..scene import ssp_writer
from .console import reported, written

__all__ = ["command"]


def command(
    folder: Annotated[Path | None, typer.Argument(help="Folder for the FMUs")] = None,
    system: Annotated[
        Path | None, typer.Option("--ssp", help="SSP archive to write, with FMUs, wiring and parameters")
    ] = None,
) -> None:
    """Copies thermal.fmu and rod.fmu to a folder, or writes them wired as scene `step` into an SSP archive."""
    with reported():
        if folder is None and system is None:
            raise CosimError("nothing to export: name a folder for the FMUs, or --ssp FILE.ssp, or both")
        if folder is not None:
            files = [find_fmu(name) for name in ("thermal.fmu", "rod.fmu")]
            folder.mkdir(parents=True, exist_ok=True)
            for path in files:
                with atomic_write(folder / path.name) as draft:
                    draft.write_bytes(path.read_bytes())
                written(folder / path.name)
        if system is not None:
            ssp_writer.write(system)
            written(system)
