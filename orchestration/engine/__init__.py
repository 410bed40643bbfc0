"""The engine: scenes in C++, many runs in one call or one run in real time.

plan: a scene as plain arrays; binding: the C interface; batch: many runs; realtime: one run in step with the clock.
"""

from .batch import BatchResult, run_batch

__all__ = ["BatchResult", "run_batch"]
