"""A sweep spread over processes by dask.distributed: here, or on a cluster that runs already."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator, Sequence

from dask.distributed import Client, LocalCluster, as_completed

from ..errors import CosimError
from .study import Row
from .verdict import Verdict

__all__ = ["spread"]


def spread(
    rows: Sequence[Row],
    scheduler: str | None = None,
    workers: int | None = None,
) -> Iterator[tuple[int, list[Verdict]]]:
    """scheduler: address of a running one, such as tcp://host:8786, whose workers can import this package; without one
    a local cluster of `workers` processes, as many as there are cores unless told. Raises
    CosimError where no scheduler answers."""
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
        futures = {client.submit(row, pure=False): number for number, row in enumerate(rows)}
        for future in as_completed(futures):
            yield futures[future], future.result()
