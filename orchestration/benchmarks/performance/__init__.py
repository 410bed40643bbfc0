"""What runs cost on this machine: start, parts of a run, many runs, scaling, memory, real time, other codes."""

from .page import Section, write_page
from .sections import SECTIONS, measure

__all__ = ["SECTIONS", "Section", "measure", "write_page"]
