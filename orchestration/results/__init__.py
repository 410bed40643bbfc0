"""Results: the dataset of a run and its files, comparison of two results, provenance."""

from .dataset import about, arrays, collect, read, scalars, versions, write

__all__ = ["about", "arrays", "collect", "read", "scalars", "versions", "write"]
