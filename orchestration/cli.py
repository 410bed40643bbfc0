"""The command line: tca-cosim run | timing | monolith | modes | reference | stability | paper | export | list | peers.
An error a user can mend is one message and exit code 2."""

from __future__ import annotations

import contextlib
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
import xarray as xr
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from . import paper, peers, results, ssp, stability, timing
from .archive import find_fmu
from .compare import compare
from .errors import CosimError
from .paper import figure
from .scene import Scene, read, titles
from .simulate import run as run_scene

__all__ = ["app"]

app = typer.Typer(no_args_is_help=True, add_completion=False, help="Co-simulation of soft manipulators driven by TCAs.")
out = Console()

Overrides = Annotated[list[str], typer.Option("--set", help="key=value as in a scene: rod.order=2, thermal.V='1 V'")]
Folder = Annotated[Path, typer.Option("--out", help="Folder for what is written")]


@app.command("run")
def run_command(
    scene: Annotated[str, typer.Argument(help="Name of a scene (tca-cosim list) or a .toml file")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
) -> None:
    """Runs one scene; writes NAME.nc and NAME.csv."""
    with _reported():
        described = read(scene, override)
        try:
            result = _run(described)
        except CosimError as error:
            if error.partial is not None:
                path = folder / f"{described.name}.partial.nc"
                results.write(error.partial, path)
                out.print(f"what was computed until then: {path}", highlight=False)
            raise
        for ending in ("nc", "csv"):
            results.write(result, folder / f"{described.name}.{ending}")
        _summarise(described, result)
        out.print(f"written: {folder / described.name}.nc, .csv", highlight=False)


@app.command("reference")
def reference_command(
    scene: Annotated[str, typer.Argument(help="Name of a scene (tca-cosim list) or a .toml file")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    refined: Annotated[bool, typer.Option(help="Finer in space and time, as a check of itself")] = False,
    against: Annotated[Path | None, typer.Option(help="A result (.nc) to compare with, at its times")] = None,
) -> None:
    """Solves a scene independently of the FMUs (extra `reference`); writes NAME.reference.nc."""
    with _reported():
        try:
            from . import reference  # scikit-fem is an extra
        except ModuleNotFoundError as error:
            raise CosimError(f"{error}; run pip install 'tca-cosim[reference]'") from error
        described = read(scene, override)
        other = results.read(against) if against else None
        resolution = reference.Resolution().refined() if refined else reference.Resolution()
        solved = reference.run(described, resolution, None if other is None else other["time"].to_numpy())
        results.write(solved, folder / f"{described.name}.reference.nc")
        out.print(f"written: {folder / described.name}.reference.nc", highlight=False)
        if other is not None:
            _show_gaps(other, solved)


@app.command("monolith")
def monolith_command(
    scene: Annotated[str, typer.Argument(help="Name of a scene (tca-cosim list) or a .toml file")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    tolerance: Annotated[float, typer.Option(min=1e-13, max=1e-3, help="Relative, of the integrator")] = 1e-10,
    against: Annotated[Path | None, typer.Option(help="A result (.nc) to compare with, at its times")] = None,
) -> None:
    """Solves a scene's FMUs (model exchange) as one system with one tight integrator; writes NAME.monolith.nc."""
    from . import monolith  # its solver takes long to load

    with _reported():
        described = read(scene, override)
        other = results.read(against) if against else None
        times = None if other is None else other["time"].to_numpy()
        solved = _watched(described, lambda progress: monolith.run(described, tolerance, times, progress))
        results.write(solved, folder / f"{described.name}.monolith.nc")
        out.print(f"written: {folder / described.name}.monolith.nc", highlight=False)
        if other is not None:
            _show_gaps(other, solved)


@app.command("modes")
def modes_command(
    scene: Annotated[str, typer.Argument(help="Name of a scene (tca-cosim list) or a .toml file")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    at: Annotated[float, typer.Option("--time", min=0.0, help="When to linearise [s]")] = 0.0,
    count: Annotated[int, typer.Option(min=1, help="How many, from the lowest frequency on")] = 10,
) -> None:
    """Natural frequencies and damping ratios of a scene's small motions."""
    from . import monolith

    with _reported():
        found = monolith.modes(read(scene, override), at)
        table = Table("mode", "frequency [Hz]", "damping ratio")
        for k, mode in enumerate(found.modes[:count], 1):
            table.add_row(str(k), f"{mode.frequency:.6g}", f"{mode.damping:.3g}")
        out.print(table)
        out.print(f"{found.states} states; fastest growth {found.growing:.3g} 1/s", highlight=False)


@app.command("paper")
def paper_command(folder: Folder = Path("results")) -> None:
    """Runs the paper's three scenes; draws its Fig. 3 with the values read off the paper; prints how far apart they
    are."""
    with _reported():
        scenes = {name: read(name) for name in paper.SCENES}
        computed = {name: _run(scene) for name, scene in scenes.items()}
        table = Table("scene", "rms temperature [K]", "rms angle [rad]", "mean sweeps per macro step")
        for name, result in computed.items():
            temperature, angle = paper.deviations(result, name)
            table.add_row(
                name, f"{temperature:.3f}", f"{angle:.4f}", f"{float(result['coupling.sweeps'][1:].mean()):.2f}"
            )
        out.print(table)
        paths = figure.save(figure.draw(scenes, computed), folder)
        out.print("written: " + ", ".join(map(str, paths)), highlight=False)


@app.command("timing")
def timing_command(
    scene: Annotated[str, typer.Argument(help="Name of a scene or a .toml file")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    repeats: Annotated[int, typer.Option(min=1, help="Runs, of which the fastest counts")] = 5,
) -> None:
    """Where the time of a run goes: loading, the FMUs, the master."""
    with _reported():
        begin = time.thread_time()
        described = read(scene, override)
        table = Table("what", "time")
        table.add_row("reading the scene and the FMUs' XML", f"{1e3 * (time.thread_time() - begin):.1f} ms")
        found = timing.measure(described, repeats)
        table.add_row("loading the FMUs, to the first step", f"{1e3 * found.load:.1f} ms")
        table.add_row(f"run, {found.steps} macro steps of {found.sweeps:.2f} sweeps", f"{1e3 * found.run:.1f} ms")
        table.add_row("of that inside the FMUs", f"{1e3 * found.fmus:.1f} ms")
        table.add_row("master, per macro step", f"{1e6 * found.overhead:.0f} us")
        out.print(table)


@app.command("stability")
def stability_command(
    scene: Annotated[str, typer.Argument(help="Name of a scene, a .toml file, or `oscillators`: analytic systems")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    points: Annotated[int, typer.Option(min=2, max=200, help="Along each axis")] = 12,
    scheduler: Annotated[str | None, typer.Option(help="Address of a dask scheduler; default: processes here")] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="Processes here; 0: this one, without dask")] = None,
) -> None:
    """Maps where each coupling method fails over macro step and stiffness ratio, with the limits of theory (extra
    `sweep`); writes NAME.stability.nc, .png, .svg."""
    with _reported():
        if scene == "oscillators" and override:
            raise CosimError(f"--set {override[0]!r}: the analytic systems have nothing to set; leave it out")
        oscillators = scene == "oscillators"
        study = stability.oscillators.study(points) if oscillators else stability.rod.study(scene, override, points)
        with Progress(*Progress.get_default_columns(), console=out, transient=True) as bar:
            task = bar.add_task(study.name, total=len(study.panels) * points)
            found = stability.sweep(study, _worker(scheduler, workers, lambda: bar.advance(task)))
        results.write(found, folder / f"{study.name}.nc")
        stability.chart.save(stability.chart.draw(found), folder, study.name)
        out.print(f"written: {folder / study.name}.nc, .png, .svg", highlight=False)


def _worker(scheduler: str | None, workers: int | None, advance: Callable[[], None]) -> stability.Worker:
    if workers == 0 and scheduler is None:
        spread = stability.serial
    else:
        try:
            from .stability import cluster  # dask is an extra
        except ModuleNotFoundError as error:
            raise CosimError(f"{error}; run pip install 'tca-cosim[sweep]', or add --workers 0") from error
        spread = partial(cluster.spread, scheduler=scheduler, workers=workers)

    def watched(rows: Sequence[stability.Row]) -> Iterator[tuple[int, list[stability.Verdict]]]:
        for found in spread(rows):
            yield found
            advance()

    return watched


@app.command()
def export(
    folder: Annotated[Path | None, typer.Argument(help="Where to put the FMUs")] = None,
    system: Annotated[
        Path | None, typer.Option("--ssp", help="An SSP archive to write: FMUs, wiring, parameters")
    ] = None,
) -> None:
    """Copies thermal.fmu and rod.fmu, or writes them wired as scene `step`, to drop into another tool."""
    with _reported():
        if folder is None and system is None:
            raise CosimError("nothing to export: name a folder for the FMUs, or --ssp FILE.ssp, or both")
        if folder is not None:
            found = [find_fmu(name) for name in ("thermal.fmu", "rod.fmu")]
            folder.mkdir(parents=True, exist_ok=True)
            for path in found:
                shutil.copy2(path, folder)
                out.print(f"written: {folder / path.name}", highlight=False)
        if system is not None:
            ssp.write(system)
            out.print(f"written: {system}", highlight=False)


@app.command("list")
def list_command() -> None:
    """The scenes that come with the package."""
    with _reported():
        table = Table("scene", "title", "file")
        for name, (title, path) in titles().items():
            table.add_row(name, title, str(path))
        out.print(table)


@app.command("peers")
def peers_command(
    folder: Folder = Path("results"),
    repeats: Annotated[int, typer.Option(min=1, help="Timed rounds; the median counts")] = 5,
) -> None:
    """Runs the release of the bare rod beside PyElastica and Exudyn (extra `peers`): CPU time at equal error."""
    with _reported():
        rows, notes = peers.compare(repeats)
        out.print(peers.show(rows))
        out.print(*notes, sep="\n", highlight=False, markup=False, soft_wrap=True)
        peers.write(rows, notes, folder / "peers.csv")
        out.print(f"written: {folder / 'peers.csv'}", highlight=False)


@contextlib.contextmanager
def _reported() -> Iterator[None]:
    try:
        yield
    except (CosimError, OSError) as error:
        Console(stderr=True).print("[bold red]error:[/] ", end="")
        Console(stderr=True, soft_wrap=True, highlight=False, markup=False).print(str(error))
        raise typer.Exit(2) from None


def _show_gaps(a: xr.Dataset, b: xr.Dataset) -> None:
    try:
        gaps = compare(a, b)
    except ValueError as error:
        raise CosimError(str(error)) from error
    table = Table("quantity", "unit", "largest difference", "at [s]", "rms difference", "its range")
    for gap in gaps:
        table.add_row(gap.name, gap.unit, f"{gap.most:.3g}", f"{gap.time:g}", f"{gap.rms:.3g}", f"{gap.span:.3g}")
    out.print(table)


def _run(scene: Scene) -> xr.Dataset:
    return _watched(scene, lambda progress: run_scene(scene, progress))


def _watched(scene: Scene, solve: Callable[[Callable[[float], None]], xr.Dataset]) -> xr.Dataset:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f}/{task.total:g} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=out, transient=True) as bar:
        task = bar.add_task(scene.name, total=scene.stop_time)
        return solve(lambda time: bar.update(task, completed=time))


def _summarise(scene: Scene, result: xr.Dataset) -> None:
    steps = result.sizes["time"] - 1
    sweeps = float(result["coupling.sweeps"][1:].mean())
    out.print(
        f"{scene.title}: {steps} macro steps, {sweeps:.2f} sweeps each, gain {float(result['coupling.gain'][-1]):.3g}",
        highlight=False,
    )
