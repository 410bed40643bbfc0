"""Execution of many tasks.

One after the other in this process, or spread over processes by dask.distributed, here or on a cluster that runs
already.
"""

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
AHEAD = 4  # tasks handed out per thread: enough to keep it busy, few enough that a long list costs no memory
_DEATH = "the process that ran it died, every time that it was tried"


@runtime_checkable
class _Replaceable(Protocol):
    def lost(self, why: str) -> Any:
        """Return what stands for the result of a task whose process dies."""


def serial(tasks: Sequence[Callable[[], T]]) -> Iterator[tuple[int, T]]:
    """Run tasks in this process, in the order given; yield the number and the result of each."""
    for number, task in enumerate(tasks):
        yield number, task()


def spread(
    tasks: Sequence[Callable[[], T]],
    scheduler: str | None = None,
    workers: int | None = None,
) -> Iterator[tuple[int, T]]:
    """Run tasks in many processes; yield the number and the result of each as it finishes.

    Parameters
    ----------
    tasks
        Tasks that can be pickled. Where processes die in one task again and again, its method lost(why), if it has
        one, gives its result.
    scheduler
        Address of a running scheduler, such as tcp://host:8786, whose workers can import this package and see the
        same files; None: a local cluster.
    workers
        Number of processes of the local cluster; default: one for each core.

    Raises
    ------
    CosimError
        No scheduler answers, or a process dies in a task that cannot be replaced.
    ModuleNotFoundError
        The extra `sweep` (dask) is not installed.
    """
    from dask.distributed import Client, KilledWorker, LocalCluster, as_completed  # an extra, and slow to load

    with contextlib.ExitStack() as stack:
        address: str | LocalCluster | None = scheduler
        if address is None:
            # One thread each, since a run computes all the time. Failures come as exceptions with the results; what
            # dask logs besides is of slow goodbyes.
            local = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
            )
            address = stack.enter_context(local)
        try:
            client = stack.enter_context(Client(address))
        except (OSError, ValueError) as error:
            raise CosimError(f"no dask scheduler at {scheduler}: {error}; start one with `dask scheduler`") from error
        numbers: dict[Any, int] = {}
        waiting = enumerate(tasks)

        def submit(count: int) -> list:
            futures = {client.submit(task, pure=False): number for number, task in itertools.islice(waiting, count)}
            numbers.update(futures)
            return list(futures)

        running = as_completed(submit(AHEAD * max(1, sum(client.nthreads().values()))))
        suspects = []  # tasks whose process died: by them, or by another task in the same process
        for future in running:
            running.update(submit(1))
            number = numbers.pop(future)
            try:
                result = future.result()
            except KilledWorker:
                suspects.append(number)
                continue
            yield number, result
        for number in suspects:  # each alone, so that none dies of another
            try:
                result = client.submit(tasks[number], pure=False).result()
            except KilledWorker as error:
                task = tasks[number]
                if not isinstance(task, _Replaceable):
                    raise CosimError(f"{_DEATH}: {error}") from error
                result = task.lost(_DEATH)
            yield number, result
