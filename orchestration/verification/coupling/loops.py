"""Loops of a system: which members depend on each other, and how strongly one sweep feeds an error back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ...cosim.topology import components
from ...scene import Scene
from .runs import CoupledRun, run_with_step

__all__ = ["LoopReport", "report_loops"]

_PROBED = 4  # macro steps of the run that estimates the gain where the scene's own method does not


@dataclass(frozen=True)
class LoopReport:
    """The loops of a system.

    members: names of each loop's members; gain: spectral radius of one sweep's error map, the largest of the run, nan
    where unknown; residual: largest at the end of a step, share of the nominals; text: in words.
    """

    members: tuple[tuple[str, ...], ...]
    gain: float
    residual: float
    text: str


def report_loops(scene: Scene, run: CoupledRun) -> LoopReport:
    """The loops of a scene with gain and residual of a run."""
    frozen = {m.name for m in scene.members if m.frozen}
    connections = [c for c in scene.connections if c.target[0] not in frozen]
    order = components([m.name for m in scene.members], connections, scene.coupling.schedule == "jacobi")
    loops = tuple(component.members for component in order if component.torn)
    if not loops:
        return LoopReport((), math.nan, 0.0, "no loops: every member is stepped once per macro step")
    gain = run.gain if math.isfinite(run.gain) else _probed_gain(scene, run.step)
    method = scene.coupling.method
    listed = "; ".join(" - ".join(members) for members in loops)
    text = f"{listed}: {'explicit' if method == 'none' else method}"
    if math.isfinite(gain):
        text += f", loop gain {gain:.3g}"
        if gain >= 1.0 and method in ("none", "plain"):
            text += ", so that an error grows from sweep to sweep; take coupling.method = 'iqn'"
    else:
        text += ", loop gain unknown"
    if math.isfinite(run.residual):
        text += f", largest residual {run.residual:.2g} of the nominals"
    return LoopReport(loops, gain, run.residual, text)


def _probed_gain(scene: Scene, step: float) -> float:
    """The gain that a quasi-Newton iteration sees over a few steps; nan where it cannot be run."""
    coupling = replace(scene.coupling, method="iqn")
    probe = replace(scene, coupling=coupling, stop_time=min(scene.stop_time, _PROBED * step))
    return run_with_step(probe, step).gain
