"""Why a choice is what it is, in sentences with the numbers that decided it."""

from __future__ import annotations

from .climb import Found
from .ladder import Ladder
from .screens import Numbers

__all__ = ["reasons"]

_NOTHING = 1e-9  # share of the range
_STRAINS = ("bending alone", "bending and stretch", "bending, stretch and twist", "all six strains")


def reasons(ladder: Ladder, found: Found, numbers: Numbers) -> list[str]:
    """One sentence per axis, in the order of the ladder."""
    names = [axis.name for axis in ladder]
    return [_SENTENCES[name](found.choice[name], found, numbers) for name in names]


def _adds(found: Found, axis: str, what: str) -> str:
    gap = found.gaps[axis]
    return f"{what} would change nothing" if gap < _NOTHING else f"{what} would move the answer by {_share(gap)}"


def _share(gap: float) -> str:
    return f"{gap:.1e} of its range"


def _heat(rung: int, found: Found, n: Numbers) -> str:
    spread = f"Biot number {n.biot:.2g}: {'one temperature per section' if n.biot < 0.1 else 'no uniform section'}"
    model = "a network of few nodes" if rung == 0 else f"reduced model to {10.0**-rung:.0e}"
    return f"Heat: {model}. {spread}; {_adds(found, 'heat', 'the next finer one')}."


def _strains(rung: int, found: Found, n: Numbers) -> str:
    why = "nothing shears or twists it" if n.arc else f"shear number {n.shear:.2g}, extension number {n.extension:.2g}"
    more = "all there are" if rung == 3 else _adds(found, "strains", "all six")
    return f"Strains: {_STRAINS[rung]}. {why[0].upper()}{why[1:]}; {more}."


def _inertia(rung: int, found: Found, n: Numbers) -> str:
    grows = "at once" if n.ramp == 0.0 else "never" if n.ramp == float("inf") else f"over {n.ramp:.2g} s"
    why = (
        f"loads grow {grows} against a first period of {1.0 / n.frequency:.2g} s, which leaves a vibration of at most "
        f"{n.residual:.2g} of the deflection"
    )
    if rung == 0:
        return f"Quasi-static: {why}; {_adds(found, 'inertia', 'inertia')}."
    return f"Dynamic: {why}; without inertia the answer would be off by {_share(found.refused['inertia'])}."


def _order(rung: int, found: Found, n: Numbers) -> str:
    shape = "Constant strain (order 0)" if rung == 0 else f"Strains of degree {rung} along the rod"
    if n.arc:
        why = "no gravity, no load at the tip and parallel TCAs: equilibria are arcs exactly"
    else:
        why = f"gravity number {n.gravity:.2g}, tip load number {n.tip:.2g}" + (
            "" if n.parallel else ", TCAs not parallel"
        )
    return f"{shape}: {why}; {_adds(found, 'order', 'two orders more')}."


def _step(rung: int, found: Found, n: Numbers) -> str:
    return f"Rod solver: relative tolerance {10.0 ** -(rung + 1):.0e}; {_adds(found, 'step', 'a tenth of it')}."


def _macro(rung: int, found: Found, n: Numbers) -> str:
    step = "the scene's own" if rung == 0 else f"the scene's own over {2**rung}"
    return f"Macro step: {step}, the TCAs' loop closed inside the rod; {_adds(found, 'macro', 'half of it')}."


_SENTENCES = {
    "heat": _heat,
    "strains": _strains,
    "inertia": _inertia,
    "order": _order,
    "step": _step,
    "macro": _macro,
}
