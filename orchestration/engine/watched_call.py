"""Long calls of the engine that show how far they are, and that Ctrl-C ends."""

from __future__ import annotations

import contextlib
import ctypes
import threading
from collections.abc import Callable
from typing import Any

from .binding import Watch

__all__ = ["WatchedCall"]

INTERVAL = 0.2  # [s] between two looks at how far a call is


class WatchedCall:
    """A call in a thread of its own, since Python hears Ctrl-C between its own instructions alone.

    Parameters
    ----------
    function
        C function whose last argument is a TcaWatch and that returns an int.
    arguments
        Those before.
    """

    def __init__(self, function: Any, *arguments: object) -> None:
        self._watch = Watch()
        self._function, self._arguments = function, arguments
        self._answer = -1
        self._ended = threading.Event()  # an interrupted Thread.join() calls a thread ended that is not (Python < 3.13)

    def _call(self) -> None:
        try:
            self._answer = int(self._function(*self._arguments, ctypes.byref(self._watch)))
        finally:
            self._ended.set()

    @property
    def done(self) -> int:
        """Number of runs or steps that have ended."""
        return int(self._watch.done)

    @property
    def is_stopped(self) -> bool:
        """Whether the user ended the call."""
        return bool(self._watch.stop)

    def wait(self, progress: Callable[[int], None] = lambda done: None) -> int:
        """Make the call and return its answer; progress(done) is called from time to time.

        Where the user stops it, it ends before its next step and `is_stopped` tells so.
        """
        threading.Thread(target=self._call).start()
        try:
            while not self._ended.wait(INTERVAL):
                progress(self.done)
        except BaseException as error:
            self._watch.stop = 1
            while not self._ended.is_set():  # it writes to arrays of the caller
                with contextlib.suppress(KeyboardInterrupt):
                    self._ended.wait()
            if not isinstance(error, KeyboardInterrupt):
                raise
        return self._answer
