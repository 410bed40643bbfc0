"""Exceptions and warnings of the package.

All exceptions share one base. Every text says what, where, the likely cause and the remedy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

__all__ = [
    "CosimError",
    "CouplingError",
    "FmuWarning",
    "Interrupted",
    "SceneError",
    "SceneWarning",
    "SubsystemError",
    "TerminationRequest",
    "similar",
]


class CosimError(Exception):
    """Base of all errors that a user can mend. partial: the result until then, where a run had begun."""

    partial: Any = None


class FmuWarning(UserWarning):
    """What an FMU warned of in a run."""


class Interrupted(KeyboardInterrupt):
    """A run that the user stops, by Ctrl-C or SIGTERM.

    partial: the result until then.
    """

    partial: Any = None


class SceneError(CosimError):
    """A scene, parameter set or override that cannot be run as written."""


class SceneWarning(UserWarning):
    """A scene that runs, though part of what it says has no effect or may not be meant."""


class SubsystemError(CosimError):
    """A subsystem refused a value or a step; the text carries what it logged.

    Attributes
    ----------
    reached : float or None
        Time to which it came [s], where a smaller step may help.
    fatal : bool
        Whether nothing may be called any more.
    """

    def __init__(self, text: str, reached: float | None = None, fatal: bool = False) -> None:
        super().__init__(text)
        self.reached = reached
        self.fatal = fatal


class TerminationRequest(SubsystemError):  # noqa: N818 - no error
    """An FMU ends the simulation (fmi2Discard with fmi2Terminated = true): no failure; reached: when [s]."""

    reached: float

    def __init__(self, text: str, reached: float) -> None:
        super().__init__(text, reached)


@dataclass
class CouplingError(CosimError):
    """The master gave up on a macro step."""

    time: float  # start of the macro step [s]
    step: float  # its last length tried [s]
    sweeps: int  # sweeps of the last try
    residuals: tuple[float, ...]  # norm after each of them, in units of the nominals
    gain: float  # estimated spectral radius of one sweep's error map; nan if never estimated
    cause: str
    remedy: str

    def __str__(self) -> str:
        where = f"t = {self.time:.6g} s with macro step {self.step:.3g} s"
        iteration = f", iteration {self.sweeps}" if self.sweeps else ""
        sentences = [f"coupling failed at {where}{iteration}: {self.cause}"]
        if self.residuals:
            shown = ", ".join(f"{value:.3g}" for value in self.residuals[-6:])
            sentences.append(f"Last residuals (of nominal): {shown}")
        if not math.isnan(self.gain):
            sentences.append(f"Estimated loop gain {self.gain:.3g}")
        sentences.append(self.remedy)
        return ". ".join(sentences)


MAX_NAMES = 12  # that a message lists; more hide the one that is meant


def similar(word: str, known: Iterable[str]) -> str:
    """Return the remedy for a word that is not known: the name that is close, or the nearest of all names."""
    import difflib

    names = sorted(set(known))
    if not names:
        return "there is none"
    lower = {name.lower(): name for name in reversed(names)}
    close = difflib.get_close_matches(word.lower(), lower, n=1)
    if close:
        return f"did you mean {lower[close[0]]!r}?"
    if len(names) <= MAX_NAMES:
        return f"allowed: {', '.join(names)}"
    matcher = difflib.SequenceMatcher(b=word.lower(), autojunk=False)

    def closeness(name: str) -> float:
        matcher.set_seq1(name.lower())
        return matcher.ratio()

    nearest = sorted(names, key=closeness, reverse=True)[:MAX_NAMES]
    return f"nearest: {', '.join(nearest)} (of {len(names)})"
