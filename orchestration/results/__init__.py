"""Results: the dataset of a run, its files, comparison of two results, provenance."""

from .dataset import arrays, collect, scalars, scene_record, versions
from .storage import read, write

__all__ = ["arrays", "collect", "read", "scalars", "scene_record", "versions", "write"]
