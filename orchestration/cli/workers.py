"""Options for running many tasks in parallel, and a progress bar over them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Annotated, TypeVar

import typer

from ..parallel import Worker, serial, spread
from .console import extra

__all__ = ["Scheduler", "Workers", "worker"]

T = TypeVar("T")
Scheduler = Annotated[str | None, typer.Option(help="Address of a dask scheduler; default: processes here")]
Workers = Annotated[int | None, typer.Option(min=0, help="Number of processes; 0: this one, without dask")]


def worker(scheduler: str | None, workers: int | None, advance: Callable[[T], None] = lambda result: None) -> Worker[T]:
    """Return a worker for many tasks; advance: called with every result."""
    here = workers == 0 and scheduler is None

    def watched(tasks: Sequence[Callable[[], T]]) -> Iterator[tuple[int, T]]:
        with extra("sweep", ", or add --workers 0"):
            for number, result in (serial if here else partial(spread, scheduler=scheduler, workers=workers))(tasks):
                yield number, result
                advance(result)

    return watched
