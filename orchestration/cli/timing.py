"""tca-cosim timing: CPU time of the parts of a run."""

from __future__ import annotations

import time
from typing import Annotated

import typer
from rich.table import Table

from ..benchmarks import profile
from ..scene import read
from .console import out, reported
from .options import Overrides, SceneName

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    repeats: Annotated[int, typer.Option(min=1, help="Number of runs; the fastest is reported")] = 5,
) -> None:
    """Measures the CPU time of loading, of the FMUs and of the master."""
    with reported():
        begin = time.thread_time()
        described = read(scene, override)
        table = Table("what", "time")
        table.add_row("reading the scene and the FMUs' XML", f"{1e3 * (time.thread_time() - begin):.1f} ms")
        profiled = profile.profile_run(described, repeats)
        table.add_row("loading the FMUs, to the first step", f"{1e3 * profiled.load:.1f} ms")
        table.add_row(
            f"run, {profiled.steps} macro steps of {profiled.sweeps:.2f} sweeps", f"{1e3 * profiled.run:.1f} ms"
        )
        table.add_row("of that inside the FMUs", f"{1e3 * profiled.fmus:.1f} ms")
        table.add_row("master, per macro step", f"{1e6 * profiled.overhead:.0f} us")
        out.print(table)
