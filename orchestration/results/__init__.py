"""Results: tables and datasets of a run, their files, comparison of two results, provenance."""

from typing import TYPE_CHECKING

import lazy_loader as _lazy

if TYPE_CHECKING:
    from .dataset import arrays, collect, scalars, scene_record
    from .software import versions
    from .storage import read, write
    from .table import LabelledArray, ResultLike, ResultTable

__all__ = [
    "LabelledArray",
    "ResultLike",
    "ResultTable",
    "arrays",
    "collect",
    "read",
    "scalars",
    "scene_record",
    "versions",
    "write",
]

if not TYPE_CHECKING:
    __getattr__, __dir__, _ = _lazy.attach(
        __name__,
        submod_attrs={
            "dataset": ["arrays", "collect", "scalars", "scene_record"],
            "software": ["versions"],
            "storage": ["read", "write"],
            "table": ["LabelledArray", "ResultLike", "ResultTable"],
        },
    )
