"""tca-cosim realtime: a run in step with the clock."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import Interrupted, SceneError
from .console import out, reported, say, watched, written
from .options import Folder, Overrides, SceneName

if TYPE_CHECKING:
    from ..engine.realtime import RealtimeResult
    from ..scene import Scene

__all__ = ["command", "count_allocations"]

SHARES = (50.0, 99.0, 99.9, 99.99)  # [%] of the steps that take no longer than what is printed


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    period: Annotated[
        str, typer.Option(help="Time between two steps, with a unit; also the macro step. 0: the scene's, unpaced")
    ] = "1 ms",
    folder: Folder = Path("results"),
) -> None:
    """Runs a scene in step with the clock and shows how long its steps take; writes NAME.realtime.csv.

    Memory is locked and the thread gets a real-time priority where the system allows both; allocations in steps are
    counted. Exit code 1: a step missed its deadline. Ctrl-C ends the run; what was measured is shown and written.
    """
    with reported():
        from ..engine.realtime import run_realtime
        from ..scene import read
        from ..scene.layer import Layer
        from ..scene.validation import TIME, number

        count_allocations()
        seconds = number(Layer("--period", "", {}, numbered=False), "period", period, TIME)
        if seconds < 0.0:
            raise SceneError(f"--period {period}: before the last step; give a time above 0, or 0 for no pacing")
        steps = [f"coupling.macro_step={seconds!r}"] if seconds > 0.0 else []
        described = read(scene, [*override, *steps])
        try:
            result = watched(described, lambda progress: run_realtime(described, seconds, progress=progress))
        except Interrupted as error:
            if error.partial.durations.size:
                _show(described, error.partial, folder)
            raise
        _show(described, result, folder)
    if result.misses:
        raise SystemExit(1)


def _show(described: Scene, result: RealtimeResult, folder: Path) -> None:
    """Print the distribution of the times of steps, and write them."""
    import numpy as np
    from rich.table import Table

    from ..files import atomic_write

    fixed = result.fixed[np.isfinite(result.fixed)]
    columns = {"take at most": result.durations}
    if np.isfinite(result.busy).all():
        columns["processor time at most"] = result.busy
    if fixed.size:
        columns["fixed work takes at most"] = fixed
    table = Table("of the steps", *columns)
    for share in (*SHARES, 100.0):
        longest = [float(np.percentile(column, share, method="higher")) for column in columns.values()]
        table.add_row("all" if share == 100.0 else f"{share:g} %", *(f"{1e6 * one:.1f} us" for one in longest))
    out.print(table)
    if fixed.size:
        least = float(fixed.min())
        say(
            f"fixed work of {1e6 * least:.0f} us behind every step: what exceeds that is the host's doing, "
            f"{1e6 * (float(fixed.max()) - least):.0f} us at worst"
        )
    allocations = "not counted" if result.allocations is None else str(result.allocations)
    loop = f", at most {result.sweeps} sweeps of its loop in a step" if result.sweeps > 1 else ""
    say(
        f"{described.title}: {result.durations.size} steps, {result.misses} missed their deadline, "
        f"{result.own_misses} of them by their own processor time, "
        f"latest start {1e6 * result.worst_lateness:.1f} us after its time{loop}",
        f"allocations in steps: {allocations}; memory locked: {'yes' if result.locked else 'no'}; "
        f"real-time priority: {'yes' if result.scheduled else 'no'}; "
        f"core: {'any' if result.core is None else result.core}",
    )
    path = folder / f"{described.name}.realtime.csv"
    with atomic_write(path) as draft:
        triples = zip(result.times[:-1].tolist(), result.durations.tolist(), result.busy.tolist(), strict=True)
        lines = [f"{time!r},{spent!r},{busy!r}" for time, spent, busy in triples]
        draft.write_text("\n".join(["time [s],duration [s],processor time [s]", *lines, ""]), encoding="utf-8")
    written(path)


def count_allocations() -> None:
    """Start this process anew with the library that counts allocations, where it is there and not loaded yet."""
    from ..engine.realtime import counting_library

    counting = counting_library()
    if counting is None or "tca_counting" in os.environ.get("LD_PRELOAD", ""):
        return
    before = os.environ.get("LD_PRELOAD")
    os.environ["LD_PRELOAD"] = f"{counting}:{before}" if before else str(counting)
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
