"""tca-cosim new: a scene to start from."""

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


def command(
    path: Annotated[Path, typer.Argument(metavar="FILE.toml", help="File to write, which must not exist")],
) -> None:
    """Writes a commented scene to start from: body, TCAs, inputs, coupling and accuracy."""
    with reported():
        if path.suffix.lower() != ".toml":
            raise CosimError(f"{path}: a scene is a .toml file; give {path.with_suffix('.toml')}")
        if path.exists():
            raise CosimError(f"{path}: exists already; give another name, or remove it first")
        with atomic_write(path) as draft:
            draft.write_text(TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
        written(path)
        out.print(f"run it: tca-cosim run {path}", highlight=False, soft_wrap=True)
