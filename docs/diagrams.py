"""Draws the diagrams of the architecture page as SVG: the layers, and one macro step.

python docs/diagrams.py     writes docs/figures/layers.svg and docs/figures/macro_step.svg
"""

from __future__ import annotations

from html import escape
from pathlib import Path

__all__ = ["LAYERS", "diagrams"]

FOLDER = Path(__file__).parent / "figures"
FONT = "font-family='system-ui, sans-serif'"
HALO = "stroke='white' stroke-width='3' paint-order='stroke'"  # keeps labels readable where lines cross them

# Packages of orchestration/ from the command line down; a package imports only from rows below its own.
LAYERS: tuple[tuple[tuple[str, str], ...], ...] = (
    (("cli", "command tca-cosim"),),
    (("control", "observers, controllers, environment"),),
    (("planning", "voltages for a wanted path"), ("identification", "parameters from data")),
    (("linear", "linear models"),),
    (("stepping", "a scene stepped from outside"),),
    (("api", "import tca_cosim"),),
    (("visualization", "report, animation, plots"),),
    (("benchmarks", "speed against accuracy, profile"),),
    (("verification", "monolith, independent reference"), ("studies", "model selection, sweep, stability")),
    (("engine", "many runs in C++"),),
    (("simulation", "a scene, run"),),
    (("results", "dataset, comparison, provenance"),),
    (("scene", "TOML and SSP, checked"),),
    (("fmi", "archive, instance, slave, units"),),
    (("cosim", "master, loops, extrapolation, step control"),),
    (
        ("files", "atomic writes"),
        ("packages", "versions"),
        ("parallel", "processes"),
        ("plotting", "colours"),
    ),
    (("errors", "what, where, allowed, remedy"),),
)

ACTORS = ("time loop", "step control", "master", "algebraic loop", "acceleration", "FMUs")
# From, to, text; the bracketed ones are repeated in every sweep.
CALLS: tuple[tuple[int, int, str], ...] = (
    (0, 1, "attempt a step of length H"),
    (1, 2, "advance(t, H)"),
    (2, 5, "save the state of every FMU"),
    (2, 5, "step what lies before the loop, once"),
    (2, 3, "solve the loop"),
    (3, 5, "restore the state"),
    (3, 5, "set inputs as polynomials in time"),
    (3, 5, "step, in Gauss-Seidel order"),
    (5, 3, "outputs at t + H"),
    (3, 4, "guess x and residual r"),
    (4, 3, "next guess, or: converged"),
    (3, 2, "accepted, or: step error"),
    (2, 1, "log of the step, or rewind"),
    (1, 0, "accepted steps, next length"),
)
SWEEP = (5, 10)  # first and last call of one sweep


def _text(x: float, y: float, text: str, size: int = 13, anchor: str = "middle", weight: str = "normal") -> str:
    return (
        f"<text x='{x:g}' y='{y:g}' font-size='{size}' text-anchor='{anchor}' font-weight='{weight}' {FONT} "
        f"fill='#1b1f24' {HALO}>{escape(text)}</text>"
    )


def _box(x: float, y: float, width: float, height: float, fill: str) -> str:
    return f"<rect x='{x:g}' y='{y:g}' width='{width:g}' height='{height:g}' rx='6' fill='{fill}' stroke='#57606a'/>"


def _svg(width: float, height: float, title: str, parts: list[str]) -> str:
    head = (
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width:g} {height:g}' width='{width:g}' "
        f"height='{height:g}' role='img'>\n<title>{escape(title)}</title>\n"
        "<defs><marker id='tip' viewBox='0 0 8 8' refX='8' refY='4' markerWidth='7' markerHeight='7' "
        "orient='auto-start-reverse'><path d='M0 0L8 4L0 8z' fill='#1b1f24'/></marker></defs>\n"
        f"<rect width='{width:g}' height='{height:g}' fill='white'/>\n"
    )
    return head + "\n".join(parts) + "\n</svg>\n"


def layers() -> str:
    """Draws the packages as rows, the FMUs below."""
    width, row, gap, left = 720.0, 40.0, 8.0, 20.0
    parts, y = [], 16.0
    for packages in LAYERS:
        each = (width - 2 * left - gap * (len(packages) - 1)) / len(packages)
        for k, (name, duty) in enumerate(packages):
            x = left + k * (each + gap)
            fill = "#ddf4ff" if name in ("cosim", "fmi", "scene", "results", "simulation") else "#f6f8fa"
            parts += [_box(x, y, each, row, fill)]
            parts += [_text(x + each / 2, y + 17, name, 14, weight="bold"), _text(x + each / 2, y + 33, duty, 12)]
        y += row + gap
    parts += [_text(left, y + 14, "Imports point downwards only. Blue: what runs a scene.", 12, "start")]
    y += 26
    each = (width - 2 * left - 2 * gap) / 3
    for k, (name, duty) in enumerate(
        (("thermal_fmu", "heat equation"), ("rod_fmu", "Cosserat rod, TCA law"), ("fmus", "FMI 2.0, shared by both"))
    ):
        x = left + k * (each + gap)
        parts += [_box(x, y, each, row, "#fff8c5"), _text(x + each / 2, y + 17, name, 14, weight="bold")]
        parts += [_text(x + each / 2, y + 33, duty, 12)]
    y += row
    parts += [_text(left, y + 18, "C++, loaded through FMI at run time: no Python package imports them.", 12, "start")]
    return _svg(width, y + 32, "Layers of the project", parts)


def macro_step() -> str:
    """Draws the calls of one macro step as a sequence diagram."""
    width, column, top, row = 920.0, 156.0, 60.0, 36.0
    x = [70.0 + column * k for k in range(len(ACTORS))]
    bottom = top + row * (len(CALLS) + 0.6)
    parts = []
    for k, actor in enumerate(ACTORS):
        parts += [f"<line x1='{x[k]:g}' y1='{top - 16:g}' x2='{x[k]:g}' y2='{bottom:g}' stroke='#8c959f'/>"]
        parts += [_box(x[k] - 62, 14, 124, 30, "#ddf4ff"), _text(x[k], 34, actor, 13, weight="bold")]
    first, last = SWEEP
    parts += [
        f"<rect x='{x[3] - 22:g}' y='{top + row * first - 4:g}' width='{x[5] - x[3] + 44:g}' "
        f"height='{row * (last - first + 1) + 2:g}' fill='none' stroke='#bf8700' stroke-dasharray='5 4' rx='6'/>",
        _text(x[3] - 28, top + row * (first + 0.5), "sweep, repeated", 12, "end"),
        _text(x[3] - 28, top + row * (first + 0.5) + 15, "until converged", 12, "end"),
    ]
    for k, (one, other, text) in enumerate(CALLS):
        y = top + row * (k + 0.75)
        dash = " stroke-dasharray='4 3'" if other < one else ""
        parts += [
            f"<line x1='{x[one]:g}' y1='{y:g}' x2='{x[other]:g}' y2='{y:g}' stroke='#1b1f24' marker-end='url(#tip)'"
            f"{dash}/>"
        ]
        wide = abs(other - one) > 1
        middle = (x[one] + x[other]) / 2
        parts += [_text(middle, y - 6, text, 12 if wide else 11)]
    return _svg(width, bottom + 12, "One macro step", parts)


def diagrams() -> dict[str, str]:
    """File names and contents."""
    return {"layers.svg": layers(), "macro_step.svg": macro_step()}


if __name__ == "__main__":
    for name, content in diagrams().items():
        (FOLDER / name).write_text(content, encoding="utf-8")
        print(f"written: {FOLDER / name}")
