"""Colours that people with any kind of colour vision tell apart: Okabe and Ito's, "Color Universal Design" (2008).

Their yellow is left out: as a line it is too light on white. Failures differ by hatching as well, so that they are seen
in grey and beside any of the colours.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FAILURES", "MARKERS", "SERIES", "Failure", "series_colour"]

SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#000000")
MARKERS = "osD^vP*X"  # one for each colour


@dataclass(frozen=True)
class Failure:
    """Appearance of a kind of failure in a map or a chart."""

    face: str
    edge: str  # colour of the hatching
    hatch: str


FAILURES = {
    "diverged": Failure("#3a3a3a", "#ffffff", "xxx"),
    "unstable": Failure("#f0c9b0", "#8a3d00", "///"),
    "slow": Failure("#e3e3e3", "#6a6a6a", "..."),
}


def series_colour(number: int) -> str:
    """Colour of a series; after the last one they start again."""
    return SERIES[number % len(SERIES)]
