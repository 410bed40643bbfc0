"""Draws how the models converge from what bench_thermal and bench_rod print: charts.py BUILD_FOLDER PICTURE.

Heat against its mesh, its number of states with the published bound, its steps with electrical feedback, and the
integrators of level full; rod against its order and its time step."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure


def study(build: Path, program: str, name: str) -> pd.DataFrame:
    """One section of a benchmark's output, which is CSV with comments."""
    done = subprocess.run([build / "tests" / program, name], capture_output=True, text=True, check=True)
    return pd.read_csv(io.StringIO(done.stdout), comment="#")


def slope(axes: Axes, x: pd.Series, y: pd.Series, order: int) -> None:
    """A dashed line of the designed order through the finest point."""
    axes.loglog(x, y.iloc[-1] * (x / x.iloc[-1]) ** order, "k--", lw=0.7)
    axes.annotate(f"order {order}", (x.iloc[0], y.iloc[-1] * (x.iloc[0] / x.iloc[-1]) ** order), fontsize=7)


def mesh(axes: Axes, rows: pd.DataFrame) -> None:
    axes.semilogy(rows["unknowns"], rows["error_to_order_10_K"], "o-", label="to elements of order 10, all times")
    axes.semilogy(rows["unknowns"], rows["error_to_reference_K"], "s-", label="to the independent FEM, t >= 1 s")
    axes.axhline(1e-4, color="grey", ls=":", lw=1, label="uncertainty of that FEM")
    for _, row in rows.iterrows():
        axes.annotate(f"p={row['order']:.0f}", (row["unknowns"], row["error_to_order_10_K"]), fontsize=7)
    axes.set(title="heat: mesh (spectral in p)", xlabel="unknowns", ylabel="error of T [K]")


def reduction(axes: Axes, rows: pd.DataFrame) -> None:
    axes.semilogy(rows["states"], rows["bound_K"], "v-", label="published bound")
    axes.semilogy(rows["states"], rows["error_K"], "o-", label="true error")
    axes.set(title="heat: level reduced, 75 K rise", xlabel="states", ylabel="error of T [K]")


def feedback(axes: Axes, rows: pd.DataFrame) -> None:
    for level, line in rows.groupby("level"):
        axes.loglog(line["step_s"], line["error_K"], "o-", label=level)
    seen = rows[(rows["level"] == "reduced") & (rows["error_K"] > 1e-10)]  # below: rounding
    slope(axes, seen["step_s"], seen["error_K"], 8)
    axes.set(title="heat: electrical feedback, one collocation per step", xlabel="step [s]", ylabel="error of T [K]")
    axes.tick_params(which="minor", labelbottom=False)


def integrators(axes: Axes, rows: pd.DataFrame) -> None:
    for (name, macro), line in rows.groupby(["integrator", "macro_step_s"]):
        style = "-" if macro == 0.1 else "--"
        axes.loglog(line["time_ms"], line["error_K"], f"o{style}", label=f"{name}, macro steps of {macro} s")
    axes.set(title="heat: integrators of level full, 10 s", xlabel="time [ms]", ylabel="error of T [K]")
    axes.set_ylim(top=10.0)  # room for the legend
    axes.tick_params(which="minor", labelbottom=False)


def space(axes: Axes, rows: pd.DataFrame) -> None:
    axes.semilogy(rows["order"], rows["error_to_reference_m"], "s-", label="to the independent minimisation")
    axes.semilogy(rows["order"][:-1], rows["error_to_order_7_m"][:-1], "o-", label="to order 7")
    axes.axhline(1e-7, color="grey", ls=":", lw=1, label="uncertainty of the minimisation")
    axes.set(title="rod: equilibria (spectral in the order)", xlabel="order of the strains", ylabel="error [m]")


def time(axes: Axes, rows: pd.DataFrame) -> None:
    for method, line in rows.groupby("method"):
        axes.loglog(line["step_s"], line["error_m"], "o-", label=method)
        if method != "rosenbrock":  # which reaches the rounding of its reference before its slope
            slope(axes, line["step_s"], line["error_m"], {"backward_euler": 1, "midpoint": 2}[method])
    axes.set(title="rod: damped release, tip at 0.1 s", xlabel="time step [s]", ylabel="error [m]")


def main(build: Path, picture: Path) -> None:
    figure = Figure(figsize=(14, 7.5), layout="constrained")
    heat, rod = ("bench_thermal", "bench_rod")
    panels = ((heat, mesh), (heat, reduction), (heat, feedback), (heat, integrators), (rod, space), (rod, time))
    for axes, (program, draw) in zip(figure.subplots(2, 3).flat, panels, strict=True):
        draw(axes, study(build, program, draw.__name__))
        axes.legend(fontsize=7)
        axes.grid(alpha=0.3)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
