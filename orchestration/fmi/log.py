"""Messages of FMUs: what one instance logs, for the texts of exceptions and for the warnings of a run."""

from __future__ import annotations

import itertools
import re
import weakref
from collections import deque
from dataclasses import dataclass
from typing import ClassVar

from . import fmi2

__all__ = ["RECEIVER", "Log", "Warned"]

MAX_KINDS = 50  # warnings of different wording kept per instance; an FMU may write what it likes
MAX_TEXT = 2000  # characters kept of one message
_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")


@dataclass
class Warned:
    """A warning of one FMU: its first text, how often it came (also with other numbers in it), and when first."""

    member: str
    text: str
    count: int
    time: float  # of the first one [s]
    level: str = "warning"

    def __str__(self) -> str:
        often = f", {self.count} times in all" if self.count > 1 else ""
        return f"{self.member}: {self.text} (at t = {self.time:.6g} s{often})"


class Log:
    """Receives the messages of one instance.

    Parameters
    ----------
    name
        Name of the instance, by which messages without an environment are assigned.
    """

    _open: ClassVar[weakref.WeakValueDictionary[int, Log]] = weakref.WeakValueDictionary()
    _keys = itertools.count(1)
    _unassigned: ClassVar[deque[tuple[int, str]]] = deque(maxlen=MAX_KINDS)  # until a call fails, which takes them

    def __init__(self, name: str) -> None:
        self.name = name
        self.time = 0.0  # where the instance is [s]
        self.resting = False  # the instance is kept for a later run and says nothing
        self.messages: list[str] = []  # since the last call that failed
        self.warnings: dict[str, Warned] = {}
        self.key = next(self._keys)
        self._open[self.key] = self

    @classmethod
    def receive(
        cls, environment: int | None, instance: bytes | None, status: int, category: bytes | None, message: bytes | None
    ) -> None:
        """Take a message.

        fmpy's proxy keeps one receiver per process, so messages of other hosts' instances come here as well.
        """
        log = cls._open.get(environment or 0)
        if log is None:
            # Some FMUs hand over no environment. The newest instance of that name is meant, or the only one there is.
            running = [one for _, one in sorted(cls._open.items()) if not one.resting]
            named = [one for one in running if one.name.encode() == instance]
            if not named and instance is None and len(running) == 1:
                named = running
            log = named[-1] if named else None
        text = (message or b"").decode("utf-8", "replace").replace("##", "#")
        if log is not None:
            log.add(status, text)
        elif not environment and instance is None:
            cls._unassigned.append((status, text))
        else:
            print(f"[FMU, status {status}] {text}")

    def claim(self) -> None:
        """Take the messages that name no instance, after a call of this instance that was not OK."""
        while self._unassigned:
            self.add(*self._unassigned.popleft())

    def close(self) -> None:
        """Receive no more messages."""
        self._open.pop(self.key, None)

    def restart(self, time: float) -> None:
        """Forget everything, as at the start of a run at `time` [s]."""
        self.time, self.resting = time, False
        self.messages, self.warnings = [], {}

    def add(self, status: int, text: str) -> None:
        """Keep a message that says more than that all is well."""
        text = text.strip()[:MAX_TEXT]
        if status == fmi2.fmi2OK or not text:
            return
        if len(self.messages) < MAX_KINDS:
            self.messages.append(text)
        if status == fmi2.fmi2Warning:
            self.warn(text)

    def warn(self, text: str) -> None:
        """Count a warning; those that differ in numbers alone are one."""
        kind = _NUMBER.sub("0", text)
        if kind not in self.warnings and len(self.warnings) >= MAX_KINDS:
            kind = text = f"more than {MAX_KINDS} different warnings; the others are not shown"
        known = self.warnings.setdefault(kind, Warned(self.name, text, 0, self.time))
        known.count += 1

    def take(self) -> str:
        """Return the messages since the last call of this, as one text."""
        self.claim()
        text = "; ".join(dict.fromkeys(self.messages)) or "nothing was logged"
        self.messages.clear()
        return text


RECEIVER = fmi2.fmi2CallbackLoggerTYPE(Log.receive)
