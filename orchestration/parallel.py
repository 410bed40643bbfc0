"""Many tasks: one after the other in this process, or spread over processes by dask.distributed, here or on a cluster
that runs already."""

from __future__ import annotations

import contextlib
import itertools
import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

from .errors import CosimError

__all__ = ["Worker", "serial", "spread"]

T = TypeVar("T")
Worker = Callable[[Sequence[Callable[[], T]]], Iterable[tuple[int, T]]]  # (number of the task, its result), any order


@runtime_checkable
class _Replaceable(Protocol):
    def lost(self, why: str) -> Any:
        """What stands for the result of a task whose process dies."""


_DEATH = "the process that ran it died, every time that it was tried"
AHEAD = 4  # tasks handed out per thread: enough to keep it busy, few enough that a long list costs no memory


def serial(tasks: Sequence[Callable[[], T]]) -> Iterator[tuple[int, T]]:
    """In this process, in the order given."""
    for number, task in enumerate(tasks):
        yield number, task()


def spread(
    tasks: Sequence[Callable[[], T]],
    scheduler: str | None = None,
    workers: int | None = None,
) -> Iterator[tuple[int, T]]:
    """tasks: to be pickled. scheduler: address of a running one, such as tcp://host:8786, whose workers can import
    this package and see the same files; without one a local cluster of `workers` processes, as many as there are
    cores unless told. Where processes die in one task again and again, its method lost(why) gives what stands for its
    result. Raises CosimError where it has none, and where no scheduler answers; ModuleNotFoundError without dask."""
    from dask.distributed import Client, KilledWorker, LocalCluster, as_completed  # an extra, and slow to load

    with contextlib.ExitStack() as stack:
        place: str | LocalCluster | None = scheduler
        if place is None:
            # One thread each, since a run computes all the time. Failures come as exceptions with the results; what
            # dask logs besides is of slow goodbyes.
            local = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
            )
            place = stack.enter_context(local)
        try:
            client = stack.enter_context(Client(place))
        except (OSError, ValueError) as error:
            raise CosimError(f"no dask scheduler at {scheduler}: {error}; start one with `dask scheduler`") from error
        numbers: dict[Any, int] = {}
        waiting = enumerate(tasks)

        def submit(count: int) -> list:
            futures = {client.submit(task, pure=False): number for number, task in itertools.islice(waiting, count)}
            numbers.update(futures)
            return list(futures)

        running = as_completed(submit(AHEAD * max(1, sum(client.nthreads().values()))))
        suspects = []
        for future in running:
            running.update(submit(1))
            number = numbers.pop(future)
            try:
                found = future.result()
            except KilledWorker:
                suspects.append(number)  # it, or another task that waited in the same process
                continue
            yield number, found
        for number in suspects:  # each alone, so that none dies of another
            try:
                found = client.submit(tasks[number], pure=False).result()
            except KilledWorker as error:
                task = tasks[number]
                if not isinstance(task, _Replaceable):
                    raise CosimError(f"{_DEATH}: {error}") from error
                found = task.lost(_DEATH)
            yield number, found
