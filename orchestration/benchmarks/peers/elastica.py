"""PyElastica: discrete Cosserat rod, position Verlet, steps close to the largest stable ones.

Its material law divides stress by stretch, so it converges to another solution (0.8 % away); it is measured against
that one, extrapolated from fine grids.
"""

from __future__ import annotations

from collections.abc import Callable

import elastica as ea
import numpy as np

from .release import PROBE, Code, ReleaseProblem, Setting

__all__ = ["CODE"]

_STEPS = {10: 5e-4, 20: 3.125e-4, 40: 1.25e-4, 80: 7.8125e-5}  # elements: step [s]; a quarter longer is unstable
_FINE = {
    160: 3.90625e-5,
    320: 1.953125e-5,
}  # elements: step [s], of the grids that its own solution is extrapolated from


class _System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):
    """PyElastica's simulator with the features needed."""


def settings(damped: bool) -> list[Setting]:
    """Settings that are measured; none with damping."""
    return [] if damped else [{"elements": n, "step": step} for n, step in _STEPS.items()]


def prepare(release: ReleaseProblem, setting: Setting) -> Callable[[], np.ndarray]:
    """Set up one setting and return its simulation."""
    return _simulation(release, int(setting["elements"]), setting["step"], release.times)


def reference(release: ReleaseProblem) -> np.ndarray:
    """Its own converged tip, at PROBE alone: undamped fine grids become unstable later. The clamp is of first order."""
    at = np.isclose(release.times, PROBE)
    coarse, fine = (_simulation(release, *grid, release.times[at])() for grid in _FINE.items())
    return np.where(at[:, None], 2 * fine - coarse, np.nan)


def _simulation(release: ReleaseProblem, elements: int, step: float, times: np.ndarray) -> Callable[[], np.ndarray]:
    across, _, axis = np.eye(3)
    shape = (elements, np.zeros(3), axis, across, release.length, release.radius, release.rho)
    rod = ea.CosseratRod.straight_rod(*shape, youngs_modulus=release.E, shear_modulus=release.G)
    system, stepper = _System(), ea.PositionVerlet()
    system.append(rod)
    system.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    system.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=release.gravity * across)
    system.finalize()

    def simulate() -> np.ndarray:
        now, tips = 0.0, []
        for steps in np.diff(np.rint(times / step).astype(int), prepend=0):
            for _ in range(steps):
                now = stepper.step(system, now, step)
            tips.append(rod.position_collection[[2, 0], -1])
        return np.array(tips)

    return simulate


_REMARK = (
    "undamped only: it damps velocities, not rates of strain; errors against its own refined answer, at 0.1 s only"
)
CODE = Code("PyElastica", _REMARK, settings, prepare, reference)
