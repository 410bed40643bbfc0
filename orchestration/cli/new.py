"""tca-cosim new: a scene, or a sweep of a scene, to start from."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from ..errors import CosimError
from ..files import atomic_write
from .console import out, reported, written

__all__ = ["TEMPLATE", "command"]

TEMPLATE = Path(str(resources.files(__package__))) / "new.toml"
SWEEP_TEMPLATE = TEMPLATE.with_name("new_sweep.toml")
_SCENE = "SCENE"  # in the template of a sweep


def command(
    path: Annotated[Path, typer.Argument(metavar="FILE.toml", help="File to write, which must not exist")],
    scene: Annotated[
        str | None, typer.Option("--sweep", metavar="SCENE", help="Scene of which to write a sweep, 100 runs of it")
    ] = None,
) -> None:
    """Writes a commented scene to start from: body, TCAs, inputs, coupling and accuracy; with --sweep a sweep."""
    with reported():
        if scene is not None:
            from ..scene import find

            find(scene, "scenes", "scene")  # refuses a name that is none
        if path.suffix.lower() != ".toml":
            raise CosimError(f"{path}: a scene is a .toml file; give {path.with_suffix('.toml')}")
        if path.exists():
            raise CosimError(f"{path}: exists already; give another name, or remove it first")
        with atomic_write(path) as draft:
            text = (TEMPLATE if scene is None else SWEEP_TEMPLATE).read_text(encoding="utf-8")
            draft.write_text(text if scene is None else text.replace(_SCENE, scene), encoding="utf-8")
        written(path)
        verb = "run" if scene is None else "sweep"
        out.print(f"run it: tca-cosim {verb} {path}", highlight=False, soft_wrap=True)
