"""Statistics of a run: steps, rollbacks, sweeps and where the time went."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .master import Master, StepLog
from .step_logs import StepLogs

__all__ = ["summarize"]


def summarize(master: Master, logs: Sequence[StepLog]) -> dict[str, Any]:
    """Return the statistics of a run as plain numbers.

    Parameters
    ----------
    master : Master
        With its counters since it was made.
    logs : sequence of StepLog
        Accepted steps.

    Returns
    -------
    dict
        steps, rejected_steps (failed, or too inaccurate, and taken back), rollbacks (restored states of single
        subsystems), sweeps (in accepted steps, loops only), sweeps_per_step and most_sweeps, smallest_step_s and
        largest_step_s, seconds: wall time in every subsystem, in recording and in the master itself.
    """
    steps = StepLogs.of(logs)
    sweeps, lengths = steps.column("sweeps"), steps.column("step")
    total = int(sweeps.sum())
    own = {node.subsystem.name: node.seconds for node in master.nodes}
    rest = max(0.0, master.seconds - sum(own.values()) - master.recording_seconds)
    return {
        "steps": len(logs),
        "rejected_steps": master.rejected,
        "rollbacks": sum(node.restores for node in master.nodes),
        "sweeps": total,
        "sweeps_per_step": total / len(logs) if logs else 0.0,
        "most_sweeps": int(sweeps.max(initial=0)),
        "smallest_step_s": float(lengths.min()) if logs else 0.0,
        "largest_step_s": float(lengths.max(initial=0.0)),
        "seconds": {
            "subsystems": {name: round(seconds, 6) for name, seconds in own.items()},
            "recording": round(master.recording_seconds, 6),
            "master": round(rest, 6),
        },
    }
