"""Results: tables and datasets of a run, their files, comparison of two results, provenance."""

from typing import TYPE_CHECKING

from ..lazy import importer as _importer

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
    __getattr__ = _importer(
        __name__,
        {
            **dict.fromkeys(("arrays", "collect", "scalars", "scene_record"), "dataset"),
            **dict.fromkeys(("read", "write"), "storage"),
            "versions": "software",
            **dict.fromkeys(("LabelledArray", "ResultLike", "ResultTable"), "table"),
        },
    )
