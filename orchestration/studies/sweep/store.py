"""Completed runs on disk, so that an interrupted sweep resumes and reuses them.

An SQLite file; a run is identified by its overrides, and a block of runs is one transaction.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ...errors import CosimError
from .task import RunOutcome

__all__ = ["Store"]

_TABLES = """
CREATE TABLE IF NOT EXISTS identity (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS outcomes (point TEXT PRIMARY KEY, failure TEXT NOT NULL, warning TEXT NOT NULL, series BLOB);
"""


class Store:
    """The file of one sweep; one process at a time writes. Use as a context manager, or close().

    path: of the file; identity: SweepPlan.identity(), a file of another sweep is refused; rows: number of times kept.
    Raises CosimError.
    """

    def __init__(self, path: Path, identity: Mapping[str, str], rows: int) -> None:
        self.path, self._rows = path, rows
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = sqlite3.connect(path, timeout=1.0)
        try:
            self._file.execute("PRAGMA locking_mode = EXCLUSIVE")
            # With both a commit survives the process without waiting for the disk; a computer that loses power loses
            # the last commits, not the file.
            self._file.execute("PRAGMA synchronous = NORMAL")
            self._file.execute("PRAGMA journal_mode = WAL")
            self._file.executescript(_TABLES)
            self._claim(identity)
        except sqlite3.DatabaseError as error:
            self.close()
            locked = isinstance(error, sqlite3.OperationalError) and "locked" in str(error)
            remedy = "another process works on it; wait for it" if locked else "remove it to start anew"
            raise CosimError(f"{path}: {error}; {remedy}") from error
        except CosimError:
            self.close()
            raise

    def outcomes(self) -> dict[tuple[str, ...], RunOutcome]:
        """Completed runs by their overrides."""
        outcomes = {}
        for text, failure, warning, blob in self._file.execute("SELECT point, failure, warning, series FROM outcomes"):
            overrides = tuple(json.loads(text))
            series = None if blob is None else np.frombuffer(blob, "<f8").reshape(self._rows, -1)
            outcomes[overrides] = RunOutcome(overrides, series, failure, warning)
        return outcomes

    def add(self, outcomes: Iterable[RunOutcome]) -> None:
        """Write runs, all or none of them; they survive this process when this returns."""
        rows = [
            (
                json.dumps(o.overrides),
                o.failure,
                o.warning,
                None if o.series is None else o.series.astype("<f8").tobytes(),
            )
            for o in outcomes
        ]
        with self._file:
            self._file.executemany("INSERT INTO outcomes VALUES (?, ?, ?, ?)", rows)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _claim(self, identity: Mapping[str, str]) -> None:
        known = dict(self._file.execute("SELECT key, value FROM identity"))
        if not known:
            with self._file:
                self._file.executemany("INSERT INTO identity VALUES (?, ?)", identity.items())
        elif different := [key for key in {**known, **identity} if known.get(key) != identity.get(key)]:
            raise CosimError(
                f"{self.path} holds runs of a sweep that differs in {', '.join(different)}; remove it to start anew, "
                "or give another folder with --out"
            )
