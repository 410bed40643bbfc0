"""Comparison of the rod with other codes on one problem in one run: CPU time at equal error.

The other codes require tca-cosim[peers].
"""

from .table import compare_peers, peer_table, summary, write

__all__ = ["compare_peers", "peer_table", "summary", "write"]
