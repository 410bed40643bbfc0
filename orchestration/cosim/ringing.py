"""Whether a loop rings: unknowns that turn back in macro step after macro step, which no converged iteration shows.

Where macro steps do not resolve how a loop swings, its coupling may be unstable though every step is solved
(docs/theory/coupling.md): the unknowns then alternate from step to step. A vibration that is resolved turns back twice
a period.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .graph import WiredComponent

__all__ = ["ringing_notes", "turning_share"]

_LARGE = 0.1  # change in a step, share of the range of all steps, that is not what is left of errors
_OFTEN = 0.1  # share of the steps that turn back by so much, from which on a loop rings: five times that of any scene
_FEWEST = 10  # steps that turn back, at least: a few may follow an event


def turning_share(values: np.ndarray) -> np.ndarray:
    """Return the shares (m,) of steps in which values (steps + 1, m) turn back by a tenth of their range or more."""
    if len(values) < _FEWEST:
        return np.zeros(values.shape[1])
    changes = np.diff(values, axis=0)
    large = np.abs(changes) > _LARGE * np.ptp(values, axis=0)
    turns = (changes[1:] * changes[:-1] < 0.0) & large[1:] & large[:-1]
    count = turns.sum(axis=0)
    return np.where(count >= _FEWEST, count / len(changes), 0.0)


def ringing_notes(components: Sequence[WiredComponent], record: Callable[[str, list[str]], np.ndarray]) -> list[str]:
    """Return a note on each subsystem whose torn outputs ring.

    Parameters
    ----------
    components : sequence of WiredComponent
        Of the master.
    record : callable
        Returns the values (steps + 1, m) of outputs of a subsystem, given its name and theirs.
    """
    notes = []
    for torn in (torn for component in components for torn in component.interface.outputs):
        subsystem = torn.node.subsystem
        names = [subsystem.outputs[k].name for k in torn.columns]
        shares = turning_share(record(subsystem.name, names))
        worst = int(shares.argmax())
        if shares[worst] > _OFTEN:
            unknown = f"{subsystem.name}.{names[worst]}"
            notes.append(
                f"{unknown} turns back by more than a tenth of its range in {shares[worst]:.0%} of "
                "the macro steps: they do not resolve how this loop swings, so the result may be far off; make "
                "coupling.macro_step shorter, or try coupling.waveform = 'held', which takes energy out of such loops"
            )
    return notes
