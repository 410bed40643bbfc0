"""The measurements of the page: CPU times of this process, the smallest of several, unless a note says else."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ... import scene, simulation
from ...engine.batch import cores, run_batch
from ...engine.realtime import run_realtime
from ...fmi.archive import cached_archive
from ...scene import Scene
from ..profile import profile_run
from .page import Section

__all__ = ["SECTIONS", "measure"]

SCENES = ("step", "drop", "tap", "feedback")  # quasi-static with a loop, dynamic, short and stiff, a loop of both FMUs
COMMANDS = ("list", "--help", "run step")
LOOSE = ("rod.tolerance=1e-3", "thermal.tolerance=1e-3")  # settings of many runs
ORDERS = range(8)
MAX_TCAS, MAX_SEGMENTS = 6, 4  # sizes of bodies measured
SHARES = (50.0, 99.0, 99.99)  # [%] of the steps in real time
RUNS, INSTANCES = (1000, 100_000), 1000  # after which memory is read
NEIGHBOURS, PARAMETERS = 100, 8  # runs beside one another; parameters of a gradient by central differences


def measure(names: Mapping[str, Callable[[int], Section]], repeats: int) -> Iterator[Section]:
    """Yield the sections of these names, each from `repeats` measurements."""
    for section in names.values():
        yield section(repeats)


def _fastest(function: Callable[[], Any], repeats: int, clock: Callable[[], float] = time.process_time) -> float:
    """Return the smallest time [s] of several calls, after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        begin = clock()
        function()
        times.append(clock() - begin)
    return min(times)


def _read(name: str, *overrides: str) -> Scene:
    return scene.read(name, list(overrides), cached_archive)


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"


def start(repeats: int) -> Section:
    """Measure commands as a user waits for them, in processes of their own."""
    package = __package__.partition(".")[0]
    program = [sys.executable, "-c", f"from {package}.cli import app; app()"]

    def call(words: str, folder: str) -> None:
        subprocess.run([*program, *words.split()], cwd=folder, capture_output=True, check=True)

    with TemporaryDirectory() as folder:
        rows = [
            (f"`tca-cosim {words}`", f"{_fastest(partial(call, words, folder), repeats, time.perf_counter):.3f} s")
            for words in COMMANDS
        ]
    return Section("Start", ("command", "time"), rows, "By the clock, with what earlier processes keep.")


def parts(repeats: int) -> Section:
    """Measure where the time of a warm run goes."""
    rows = []
    for name in SCENES:
        described = _read(name)
        profile = profile_run(described, repeats)
        table = simulation.run_table(described)
        rows.append(
            (
                name,
                _ms(_fastest(partial(scene.read, name), repeats)),
                _ms(profile.load),
                f"{profile.steps} x {profile.sweeps:.2f}",
                _ms(profile.fmus),
                _ms(profile.run - profile.fmus),
                _ms(_fastest(table.to_xarray, repeats)),
                _ms(_fastest(partial(simulation.run, described), repeats)),
            )
        )
    columns = ("scene", "reading it", "opening FMUs", "steps x sweeps", "FMUs", "master", "Dataset", "`tca.run` in all")
    return Section("Parts of a warm run", columns, rows)


def many_runs(repeats: int) -> Section:
    """Measure runs in one call of the engine, over threads, beside one instance that is stepped alone."""
    rows = []
    values = np.linspace(30e3, 45e3, NEIGHBOURS)
    for name, overrides in (("drop", LOOSE), ("step", (*LOOSE, "rod.closure=inside", "coupling.macro_step=1 s"))):
        described = _read(name, *overrides)
        alone = min(float(run_realtime(described, 0.0).durations.sum()) for _ in range(repeats))
        for threads in range(1, cores() + 1):
            batch = partial(run_batch, described, {"rod.body.E": values}, threads=threads)
            took = _fastest(batch, repeats, time.perf_counter)
            share = NEIGHBOURS * alone / took / threads
            rows.append((name, str(threads), f"{NEIGHBOURS / took:.0f}", f"{share:.2f}", _ms(took)))
        gradient = partial(run_batch, described, {"rod.body.E": values[: 2 * PARAMETERS]})
        took = _fastest(gradient, repeats, time.perf_counter)
        rows.append((name, f"{cores()}, gradient by {PARAMETERS} parameters", "", "", _ms(took)))
    note = (
        f"{NEIGHBOURS} runs with another `rod.body.E` each, by the clock. Share of steps: what one instance alone "
        "takes for the steps of a run, over what a run takes in one thread, with its reset and start."
    )
    return Section("Many runs", ("scene", "threads", "runs/s", "share of steps", "in all"), rows, note)


def new_heat(repeats: int) -> Section:
    """Measure runs whose heat model is the same, and runs that need a new one."""
    described = _read("step", *LOOSE, "rod.closure=inside", "rod.order=0", "coupling.macro_step=1 s")
    tables = {"rod.body.E": np.linspace(30e3, 45e3, 40), "thermal.h": np.linspace(15.0, 25.0, 40)}
    rows = []
    for name, values in tables.items():
        took = _fastest(partial(run_batch, described, {name: values}, threads=1), repeats)
        rows.append((f"`{name}`", f"{len(values) / took:.0f}"))
    columns = ("varied", "runs per CPU second")
    return Section("Parameters of the heat model", columns, rows, "Settings of sweep `scatter`.")


def orders(repeats: int) -> Section:
    """Measure macro steps over the order of the strain polynomials."""
    return _scaling("Order", "rod.order", {str(n): (f"rod.order={n}",) for n in ORDERS}, repeats)


def sizes(repeats: int) -> Section:
    """Measure macro steps over the numbers of TCAs and segments."""
    bodies: dict[str, tuple[str, ...]] = {f"{n} TCAs": (f"body.tcas={n}",) for n in range(1, MAX_TCAS + 1)}
    bodies |= {f"{n} segments": (f"body.segments={n}", "body.length=20 mm") for n in range(1, MAX_SEGMENTS + 1)}
    return _scaling("TCAs and segments", "body", bodies, repeats)


def _scaling(title: str, what: str, variants: Mapping[str, tuple[str, ...]], repeats: int) -> Section:
    rows: list[list[str]] = []
    for label, overrides in variants.items():
        cells = [label]
        for dynamic in ("true", "false"):
            described = _read(
                "drop", "stop_time=0.2 s", "coupling.macro_step=1 ms", f"rod.dynamic={dynamic}", *overrides
            )
            medians = [float(np.median(run_realtime(described, 0.0).durations)) for _ in range(repeats)]
            cells.append(f"{1e6 * min(medians):.1f} us")
        rows.append(cells)
    note = "A macro step of 1 ms of scene `drop`, both FMUs, in C++: the median."
    return Section(title, (what, "dynamic", "quasi-static"), rows, note)


def memory(repeats: int) -> Section:
    """Measure the memory of the process over runs, and of instances."""
    described = _read("drop", *LOOSE, "stop_time=0.02 s")
    rows, values = [], np.linspace(30e3, 45e3, 100)
    for _ in range(3):
        run_batch(described, {"rod.body.E": values}, threads=1)
    before = _resident()
    for total in RUNS:
        for _ in range(total // 100):
            run_batch(described, {"rod.body.E": values}, threads=1)
        rows.append((f"{total} more runs", f"{(_resident() - before) / 2**20:+.2f} MiB"))
    for member in described.members:
        instances = [simulation.load_member(described, member) for _ in range(100)]
        before = _resident()
        instances += [simulation.load_member(described, member) for _ in range(INSTANCES)]
        each = (_resident() - before) / 2**20 / INSTANCES
        rows.append((f"{INSTANCES} more instances of {member.archive.path.name}, per instance", f"{each:.3f} MiB"))
        for instance in instances:
            instance.close()
    return Section("Memory", ("", "resident memory"), rows)


def _resident() -> int:
    """Return the resident memory of this process [bytes]; 0 where the system does not tell."""
    file = Path("/proc/self/statm")
    return int(file.read_text().split()[1]) * 4096 if file.is_file() else 0


def real_time(repeats: int) -> Section:
    """Measure 1 kHz in step with the clock, for `repeats` seconds each.

    The same steps are run without a clock too, `repeats` times: the least that a step took in them is its own cost,
    without what the host takes.
    """
    rows = []
    for label, overrides in {
        "dynamic, order 3": ("rod.order=3",),
        "dynamic, order 4": (),
        "quasi-static, order 3": ("rod.order=3", "rod.dynamic=false"),
    }.items():
        described = _read("drop", f"stop_time={repeats} s", "coupling.macro_step=1 ms", *overrides)
        result = run_realtime(described, 1e-3)
        least = np.min([run_realtime(described, 0.0).durations for _ in range(repeats)], axis=0)
        rows.append(
            (
                label,
                *(_percentile(result.durations, share) for share in (*SHARES, 100.0)),
                *(_percentile(least, share) for share in (SHARES[-1], 100.0)),
                _percentile(result.busy, 100.0),
                str(result.misses),
                str(result.own_misses),
            )
        )
    shares = (f"{share:g} %" for share in SHARES)
    own = (f"{SHARES[-1]:g} %, own cost", "worst, own cost")
    columns = ("scene `drop`", *shares, "worst", *own, "worst processor time", "missed", "by processor time")
    note = f"Durations of the steps of {repeats} s. Own cost: the least of each step in {repeats} runs without a clock."
    return Section("Real time at 1 kHz", columns, rows, note)


def _percentile(durations: np.ndarray, share: float) -> str:
    """Return the duration that `share` [%] of the steps do not exceed, with its unit."""
    return f"{1e6 * float(np.percentile(durations, share, method='higher')):.0f} us"


def scipy(repeats: int) -> Section:
    """Measure the independent solution in scipy beside the FMUs."""
    from ...verification import reference  # requires tca-cosim[reference]

    rows = []
    for name in ("step", "drop"):
        described = _read(name)
        ours = _fastest(partial(simulation.run_table, described), repeats)
        begin = time.process_time()
        reference.run(described, reference.Resolution(), None)
        took = time.process_time() - begin
        rows.append((name, _ms(ours), _ms(took), f"{took / ours:.0f}"))
    return Section("Beside scipy", ("scene", "ours, as the scene is", "scipy", "ratio"), rows)


SECTIONS: dict[str, Callable[[int], Section]] = {
    "start": start,
    "parts": parts,
    "runs": many_runs,
    "heat": new_heat,
    "orders": orders,
    "sizes": sizes,
    "memory": memory,
    "realtime": real_time,
    "scipy": scipy,
}
