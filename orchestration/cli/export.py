"""tca-cosim export: FMUs and an SSP archive for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import CosimError
from ..files import atomic_write
from ..fmi.archive import find_fmu
from ..scene import read, ssp_writer
from .console import reported, written
from .options import Overrides

__all__ = ["command"]


def command(
    folder: Annotated[Path | None, typer.Argument(help="Folder for the FMUs")] = None,
    system: Annotated[
        Path | None, typer.Option("--ssp", help="SSP archive to write, with FMUs, wiring and parameters")
    ] = None,
    scene: Annotated[
        str | None, typer.Option("--scene", help="Name or file of the scene to write as SSP; default: step, all sets")
    ] = None,
    override: Overrides = [],  # noqa: B006 (typer copies it)
) -> None:
    """Copies thermal.fmu and rod.fmu to a folder, or writes a scene with its FMUs as an SSP archive; by default `step`,
    with all parameter sets and its loop closed inside the rod."""
    with reported():
        if folder is None and system is None:
            raise CosimError("nothing to export: name a folder for the FMUs, or --ssp FILE.ssp, or both")
        if system is None and (scene is not None or override):
            raise CosimError("--scene and --set hold for an SSP archive; add --ssp FILE.ssp")
        if folder is not None:
            files = [find_fmu(name) for name in ("thermal.fmu", "rod.fmu")]
            folder.mkdir(parents=True, exist_ok=True)
            for path in files:
                with atomic_write(folder / path.name) as draft:
                    draft.write_bytes(path.read_bytes())
                written(folder / path.name)
        if system is not None:
            if scene is None and not override:
                ssp_writer.write(system)
            else:
                ssp_writer.write_scene(system, read(scene or "step", override))
            written(system)
