"""Style that all matplotlib figures share: palette, axes, legends."""

from .labels import DisplayUnit, display_unit, element_labels
from .palette import FAILURES, MARKERS, SERIES, Failure, series_colour
from .style import grid, legend_above, readable_log_ticks

__all__ = [
    "FAILURES",
    "MARKERS",
    "SERIES",
    "DisplayUnit",
    "Failure",
    "display_unit",
    "element_labels",
    "grid",
    "legend_above",
    "readable_log_ticks",
    "series_colour",
]
