"""tca-cosim export: FMUs, of any size, and an SSP archive for other tools."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import CosimError, similar
from .console import reported, say, written
from .options import Overrides

if TYPE_CHECKING:
    from ..fmi.configuration import Configuration
    from ..scene import Member, Scene

__all__ = ["command"]


def command(
    folder: Annotated[Path | None, typer.Argument(help="Folder for the FMUs")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder for the FMUs, as FOLDER")] = None,
    tcas: Annotated[int | None, typer.Option(min=1, max=12, help="Number of TCAs; default: 3")] = None,
    segments: Annotated[int | None, typer.Option(min=1, max=6, help="Number of the rod's segments; default: 1")] = None,
    ports: Annotated[
        bool, typer.Option("--ports", help="With the rod's ports: forces along the body, velocities, clamp reaction")
    ] = False,
    creep: Annotated[
        bool, typer.Option("--creep", help="With creep of TCAs whose law is measured: its parameters and outputs")
    ] = False,
    fmu: Annotated[list[str] | None, typer.Option("--fmu", help="thermal or rod; default: both")] = None,
    like: Annotated[
        str | None,
        typer.Option(
            "--like",
            help="Name or file of a scene: its FMUs at its size, its values as start values, only states that move",
        ),
    ] = None,
    system: Annotated[
        Path | None, typer.Option("--ssp", help="SSP archive to write, with FMUs, wiring and parameters")
    ] = None,
    scene: Annotated[
        str | None, typer.Option("--scene", help="Name or file of the scene to write as SSP; default: step, all sets")
    ] = None,
    override: Overrides = [],  # noqa: B006 (typer copies it)
) -> None:
    """Writes thermal.fmu and rod.fmu to a folder, or a scene with its FMUs as an SSP archive.

    FMUs have any number of TCAs and segments, or those that a scene needs. The archive is by default that of `step`,
    with all parameter sets and its loop closed inside the rod. No compiler is needed.
    """
    with reported():
        if folder is not None and output is not None and folder != output:
            raise CosimError(f"two folders for the FMUs: {folder} and {output}; name one")
        folder = folder or output
        if folder is None and system is None:
            raise CosimError("nothing to export: name a folder for the FMUs, or --ssp FILE.ssp, or both")
        if system is None and scene is not None:
            raise CosimError("--scene holds for an SSP archive; add --ssp FILE.ssp, or say --like for FMUs")
        if system is None and like is None and override:
            raise CosimError("--set holds for an SSP archive or --like SCENE; add one of them")
        if folder is None and (like is not None or tcas or segments or ports or creep or fmu):
            raise CosimError(
                "--like, --tcas, --segments, --ports, --creep and --fmu hold for FMUs; name a folder for them"
            )
        if like is not None and (tcas or segments or ports or creep):
            size = " ".join(
                f"--set body.{key}={str(value).lower()}"
                for key, value in (("tcas", tcas), ("segments", segments), ("ports", ports), ("creep", creep))
                if value
            )
            raise CosimError(f"--like takes the size from the scene; set it there, or with {size}")
        if folder is not None:
            from ..fmi.configuration import Configuration

            paths = (
                _like(folder, like, fmu, override)
                if like is not None
                else _sized(folder, Configuration(tcas, segments, ports or None, creep or None), fmu)
            )
            for path in paths:
                written(path)
        if system is not None:
            from ..scene import read, ssp_writer

            if scene is None and (not override or like is not None):
                ssp_writer.write(system)
            else:
                ssp_writer.write_scene(system, read(scene or "step", override))
            written(system)


def _chosen(chosen: Sequence[str] | None, known: Sequence[str]) -> list[str]:
    """Names of the FMUs to write. Raises CosimError for one that is not known."""
    for name in chosen or ():
        if name not in known:
            raise CosimError(f"--fmu {name}: no such FMU; {similar(name, known)}")
    return list(chosen or known)


def _sized(folder: Path, configuration: Configuration, fmu: Sequence[str] | None) -> list[Path]:
    """Write the package's FMUs at a size; copies where none is asked for."""
    from ..files import atomic_write
    from ..fmi.archive import Archive, find_fmu
    from ..fmi.configuration import Configuration, write_configured

    paths = []
    for name in _chosen(fmu, ("thermal", "rod")):
        source, path = find_fmu(f"{name}.fmu", Path("/")), folder / f"{name}.fmu"
        if configuration == Configuration():
            with atomic_write(path) as draft:
                draft.write_bytes(source.read_bytes())
        else:
            with Archive(source) as archive:
                write_configured(archive, configuration, path)
        paths.append(path)
    return paths


def _like(folder: Path, like: str, fmu: Sequence[str] | None, override: Sequence[str]) -> list[Path]:
    """Write the FMUs of a scene with its values as start values."""
    from ..fmi.configuration import can_configure, write_configured
    from ..scene import read
    from ..scene.standalone import configuration_of

    scene: Scene = read(like, override)
    own = {member.name: member for member in scene.members if can_configure(member.archive)}
    if not own:
        raise CosimError(f"--like {like}: no FMU of the scene was made by this package; copy its files instead")
    paths = []
    for name in _chosen(fmu, list(own)):
        path = folder / f"{name}.fmu"
        write_configured(own[name].archive, configuration_of(own[name], scene), path)
        paths.append(path)
        _note_interface(path, own[name])
    return paths


def _note_interface(path: Path, member: Member) -> None:
    """Say where an FMU has nothing that a host of model exchange could integrate, and how it gets it."""
    from ..fmi.archive import Archive
    from ..fmi.derivatives import continuous_states

    with Archive(path) as archive:
        if continuous_states(archive):
            return
    variables = member.archive.variables
    if "dynamic" in variables and not member.value("dynamic"):
        present, wanted = "dynamic = false", "dynamic=true"
    elif "level" in variables and member.choice("level") == "full":
        present, wanted = "level = full", "level=reduced"
    else:
        return
    say(
        f"note: {path.name} is for co-simulation only: with {present} it has no continuous states; for model exchange, "
        f"which CasADi uses, add --set {member.name}.{wanted}"
    )
