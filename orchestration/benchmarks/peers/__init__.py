"""The rod beside other codes on one problem in one run: CPU time at equal error. The others come with the extra
`peers`."""

from .table import compare, show, summary, write

__all__ = ["compare", "show", "summary", "write"]
