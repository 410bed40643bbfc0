"""Style that all matplotlib figures share: palette, axes, legends."""

from .palette import FAILURES, MARKERS, SERIES, Failure, series_colour
from .style import grid, legend_above, readable_log_ticks

__all__ = [
    "FAILURES",
    "MARKERS",
    "SERIES",
    "Failure",
    "grid",
    "legend_above",
    "readable_log_ticks",
    "series_colour",
]
