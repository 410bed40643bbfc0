"""What commands print: one line per mistake, progress, comparisons."""

from __future__ import annotations

import contextlib
import json
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import typer
import xarray as xr
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from ..errors import CosimError, FmuWarning
from ..fmi.log import Warned
from ..results.comparison import compare
from ..scene import Scene
from ..studies.model_selection import run_selected

__all__ = ["busy", "extra", "out", "partial_kept", "reported", "run", "show_gaps", "watched", "written"]

out = Console(markup=False)  # [s] and [m] are units here


@contextlib.contextmanager
def reported() -> Iterator[None]:
    """Turns an error a user can mend into one message and exit code 2."""
    try:
        yield
    except (CosimError, OSError) as error:
        Console(stderr=True).print("[bold red]error:[/] ", end="")
        Console(stderr=True, soft_wrap=True, highlight=False, markup=False).print(str(error))
        raise typer.Exit(2) from None


@contextlib.contextmanager
def extra(name: str, instead: str = "") -> Iterator[None]:
    """Around an import that needs the package's extra `name`; `instead` is what else a user can do."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise CosimError(f"{error}; run pip install 'tca-cosim[{name}]'{instead}") from error


@contextlib.contextmanager
def partial_kept(folder: Path, ending: str, write: Callable[[xr.Dataset, Path], object]) -> Iterator[None]:
    """Around a run: what it computed until it failed becomes NAME.partial.ending."""
    try:
        yield
    except CosimError as error:
        if error.partial is not None:
            path = folder / f"{error.partial.attrs['scene']}.partial.{ending}"
            write(error.partial, path)
            out.print(f"what was computed until then: {path}", highlight=False)
        raise


def written(*what: object) -> None:
    """Says which files there are now."""
    out.print("written: " + ", ".join(map(str, what)), highlight=False)


def run(scene: Scene) -> xr.Dataset:
    """Runs a scene and shows how far it is; where its models are to be chosen, which ones it is at.

    What FMUs warned of, and who ended the run, is shown at the end.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FmuWarning)  # shown below
        try:
            if scene.accuracy.level == "given":
                result = watched(scene, lambda progress: run_selected(scene, progress))
            else:
                with busy(scene.name) as tell:
                    result = run_selected(scene, status=tell)
        except CosimError as error:
            if error.partial is not None:
                _show_messages(error.partial)
            raise
    _show_messages(result)
    return result


def _show_messages(result: xr.Dataset) -> None:
    """Prints what FMUs warned of, and which of them ended the run."""
    for warning in json.loads(result.attrs.get("warnings", "[]")):
        out.print(f"warning: {Warned(**warning)}", highlight=False, soft_wrap=True, style="yellow")
    if result.attrs.get("ended"):
        out.print(result.attrs["ended"], highlight=False, soft_wrap=True)


@contextlib.contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """Shows for how long it has been at `what`, and what was told of it last."""
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=out, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda text: bar.update(task, description=f"{what}, {text}")


def watched(scene: Scene, solve: Callable[[Callable[[float], None]], xr.Dataset]) -> xr.Dataset:
    """`solve(progress)`, where progress(time) moves a bar."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f}/{task.total:g} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=out, transient=True) as bar:
        task = bar.add_task(scene.name, total=scene.stop_time)
        return solve(lambda time: bar.update(task, completed=time))


def show_gaps(a: xr.Dataset, b: xr.Dataset) -> None:
    """A table of how far two results are apart."""
    try:
        gaps = compare(a, b)
    except ValueError as error:
        raise CosimError(str(error)) from error
    table = Table("quantity", "unit", "largest difference", "at [s]", "rms difference", "its range")
    for gap in gaps:
        table.add_row(gap.name, gap.unit, f"{gap.most:.3g}", f"{gap.time:g}", f"{gap.rms:.3g}", f"{gap.span:.3g}")
    out.print(table)
