"""Output of commands: errors and warnings as one line each, progress, comparisons."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import CosimError, FmuWarning, Interrupted, SceneWarning

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console

    from ..results import ResultLike, ResultTable
    from ..scene import Scene

__all__ = [
    "busy",
    "extra",
    "out",
    "partial_kept",
    "reported",
    "run",
    "run_table",
    "say",
    "say_times",
    "show_gaps",
    "watched",
    "written",
]

for _stream in (sys.stdout, sys.stderr):
    if hasattr(_stream, "reconfigure"):  # what a terminal cannot show is replaced, and ends no run
        _stream.reconfigure(errors="replace")
PATIENCE = 0.3  # [s] of a run before a bar shows how far it is: shorter ones end before one can be read


class _Out:
    """Standard output; the console of rich is loaded where more than plain lines are printed."""

    def __init__(self) -> None:
        self._console: Console | None = None

    @property
    def console(self) -> Console:
        """The console, on which [s] and [m] are units and no markup, and :1: is a range and no picture."""
        from rich.console import Console

        if self._console is None:
            self._console = Console(markup=False, emoji=False)
        return self._console

    def print(self, *what: Any, **how: Any) -> None:
        """Print as rich does."""
        self.console.print(*what, **how)


out = _Out()


def say(*lines: object) -> None:
    """Print lines as they are, however long; one with line breaks inside is several."""
    print(*lines, sep="\n", flush=True)


T = TypeVar("T")
MENDABLE, UNEXPECTED, INTERRUPTED = 2, 70, 130  # exit codes
TRACEBACK = "TCA_COSIM_TRACEBACK"  # environment variable: unexpected errors with their traceback


@contextlib.contextmanager
def reported() -> Iterator[None]:
    """Turn errors into one message and an exit code, warnings about the scene into lines, SIGTERM into Ctrl-C."""
    before = _terminated_as_interrupted()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", SceneWarning)
            warnings.showwarning = _show_warning
            yield
    except KeyboardInterrupt as error:
        _say("interrupted", str(error) or "stopped by the user")
        raise SystemExit(INTERRUPTED) from None
    except (CosimError, OSError) as error:
        _say("error", _text(error))
        raise SystemExit(MENDABLE) from None
    except Exception as error:
        if os.environ.get(TRACEBACK):
            raise
        text = " ".join(str(error).split()) or "without a text"
        _say(
            "error",
            f"unexpected {type(error).__name__}: {text}; this is a fault of tca-cosim: please report it, with "
            f"what {TRACEBACK}=1 shows",
        )
        raise SystemExit(UNEXPECTED) from None
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)


def _terminated_as_interrupted() -> Any:
    """Let SIGTERM do what Ctrl-C does, so that results are kept.

    Returns the handler before; None outside the main thread.
    """

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    try:
        return signal.signal(signal.SIGTERM, interrupt)
    except ValueError:  # signals belong to the main thread
        return None


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    if issubclass(category, UserWarning):
        _say("warning", str(message), "bold yellow")


def _say(kind: str, text: str, style: str = "bold red") -> None:
    from rich.console import Console

    Console(stderr=True).print(f"[{style}]{kind}:[/] ", end="")
    Console(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False).print(text)


def _text(error: Exception) -> str:
    """Words of an error; those of the system with file and remedy."""
    if not isinstance(error, OSError) or error.errno is None:
        return str(error)
    remedies = {
        errno.ENOSPC: "free some space, or write to another folder with --out",
        errno.EDQUOT: "free some space, or write to another folder with --out",
        errno.EACCES: "change its permissions, or write to another folder with --out",
        errno.EPERM: "change its permissions, or write to another folder with --out",
        errno.EROFS: "write to another folder with --out",
        errno.ENOENT: "check the path",
        errno.EEXIST: "it is a file; give a folder",
        errno.ENOTDIR: "give a folder",
        errno.EISDIR: "give a file",
        errno.ENAMETOOLONG: "give a shorter name",
    }
    where = f"{error.filename}: " if error.filename else ""
    return f"{where}{(error.strerror or str(error)).lower()}; {remedies.get(error.errno, 'check the file system')}"


@contextlib.contextmanager
def extra(name: str, instead: str = "") -> Iterator[None]:
    """Import what an extra of the package brings; `instead`: what a user can do without it. Raises CosimError."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise CosimError(
            f"{error}; this command requires tca-cosim[{name}]: run pip install 'tca-cosim[{name}]'{instead}"
        ) from error


@contextlib.contextmanager
def partial_kept(folder: Path, ending: str, write: Callable[[Any, Path], object]) -> Iterator[None]:
    """Write what a run computed until it failed to NAME.partial.ending."""
    try:
        yield
    except (CosimError, Interrupted) as error:
        if error.partial is not None:
            path = folder / f"{error.partial.attrs['scene']}.partial.{ending}"
            write(error.partial, path)
            say(f"what was computed until then: {path}")
        raise


def say_times(scene: Scene, other: xr.Dataset) -> None:
    """Say that the times of another result hold, where they do not end at the stop time of the scene."""
    end = float(other["time"][-1])
    if end != scene.stop_time:
        out.print(
            f"solved at the times of --against, to {end:g} s, instead of stop_time = {scene.stop_time:g} s",
            highlight=False,
        )


def written(*what: object) -> None:
    """Print the files written."""
    say("written: " + ", ".join(map(str, what)))


def run(scene: Scene) -> xr.Dataset:
    """Run a scene as run_table() does, and return the result as a Dataset."""
    from ..simulation import partial_as_dataset

    with partial_as_dataset():
        return run_table(scene).to_xarray()


def run_table(scene: Scene) -> ResultTable:
    """Run a scene and show how far it is; where its models are to be chosen, which ones it is at.

    What FMUs warned of, and who ended the run, is shown at the end.
    """
    from .. import simulation
    from ..results.plausibility import doubtful

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FmuWarning)  # shown below
        try:
            if scene.accuracy.level == "given":
                result = watched(scene, partial(simulation.run_table, scene))
            else:
                from ..studies.model_selection import run_selected_table

                with busy(scene.name) as show:
                    result = run_selected_table(scene, status=show)
        except CosimError as error:
            if error.partial is not None:
                _show_messages(error.partial)
            raise
    _show_messages(result)
    for text in doubtful(scene, result):
        warnings.warn(text, SceneWarning, stacklevel=2)
    return result


def _show_messages(result: ResultLike) -> None:
    """Prints what FMUs warned of, how the run differs from what was asked for, and which FMU ended it."""
    from ..fmi.log import Warned

    for warning in json.loads(result.attrs.get("warnings", "[]")):
        out.print(f"warning: {Warned(**warning)}", highlight=False, soft_wrap=True, style="yellow")
    for note in json.loads(result.attrs.get("notes", "[]")):
        if note != result.attrs.get("ended"):
            say(f"note: {note}")
    if result.attrs.get("ended"):
        say(result.attrs["ended"])


@contextlib.contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """Show the time spent on `what`, and the last status given."""
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=out.console, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda text: bar.update(task, description=f"{what}, {text}")


def watched(scene: Scene, solve: Callable[[Callable[[float], None]], T]) -> T:
    """Return solve(progress), where progress(time) moves a bar once the run takes long enough to be watched."""
    begin = monotonic()
    with contextlib.ExitStack() as stack:
        move: Callable[[float], None] | None = None

        def progress(time: float) -> None:
            nonlocal move
            if move is None and monotonic() - begin > PATIENCE:
                move = stack.enter_context(_bar(scene))
            if move is not None:
                move(time)

        return solve(progress)


@contextlib.contextmanager
def _bar(scene: Scene) -> Iterator[Callable[[float], None]]:
    """Show a bar over the time of a scene; yield what moves it."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f}/{task.total:g} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=out.console, transient=True) as bar:
        task = bar.add_task(scene.name, total=scene.stop_time)
        yield lambda time: bar.update(task, completed=time)


def show_gaps(a: xr.Dataset, b: xr.Dataset) -> None:
    """Print a table of the differences between two results. Raises CosimError where they cannot be compared."""
    from rich.table import Table

    from ..results.comparison import compare

    try:
        gaps = compare(a, b)
    except ValueError as error:
        raise CosimError(str(error)) from error
    table = Table("quantity", "unit", "largest difference", "at [s]", "rms difference", "its range")
    for gap in gaps:
        table.add_row(gap.name, gap.unit, f"{gap.most:.3g}", f"{gap.time:g}", f"{gap.rms:.3g}", f"{gap.span:.3g}")
    out.print(table)
