"""SoRoMoX: planar rod of segments with constant strain in JAX, explicit Runge-Kutta 5(4) (Tsit5) at constant steps.

As in its own benchmarks; compiled before it is timed. Steps are the largest of 1, 0.5, 0.25 ms that are stable.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
from diffrax import Tsit5
from soromox.systems import PlanarPCS, PlanarPCSParams, SystemState
from soromox.systems.components.cross_sections import CrossSectionParams
from soromox.systems.components.links import ContinuumLinkParams

from .release import Code, ReleaseProblem, Setting

__all__ = ["CODE"]

_STEPS = {1: 1e-3, 2: 5e-4, 3: 5e-4, 4: 2.5e-4}  # segments: step [s]

jax.config.update("jax_enable_x64", True)


def settings(damped: bool) -> list[Setting]:
    """Settings that are measured; none with damping."""
    return [] if damped else [{"dim": 2, "segments": n, "step": step} for n, step in _STEPS.items()]


def prepare(release: ReleaseProblem, setting: Setting) -> Callable[[], np.ndarray]:
    """Set up one setting and return its simulation."""
    return _compiled(release, int(setting["segments"]), setting["step"])


@lru_cache(maxsize=16)
def _compiled(release: ReleaseProblem, segments: int, step: float) -> Callable[[], np.ndarray]:
    ones, length = jnp.ones(segments), release.length / segments
    shear = release.shear_factor * release.G * release.area
    stiffness = length * jnp.diag(jnp.array([release.E * release.second_moment, release.E * release.area, shear]))
    link = ContinuumLinkParams(
        length=length * ones,
        density=release.rho * ones,
        reference_strain=jnp.tile(jnp.array([0.0, 1.0, 0.0]), (segments, 1)),
        cross_section=CrossSectionParams(coefficients=release.radius * ones[:, None]),
        stiffness=jnp.tile(stiffness, (segments, 1, 1)),
        damping=jnp.tile(0.0 * stiffness, (segments, 1, 1)),
    )
    params = PlanarPCSParams(gravity=jnp.array([0.0, -release.gravity]), link=link)
    rod = PlanarPCS(params=params, base_pose=jnp.zeros(3))
    times = jnp.concatenate([jnp.zeros(1), jnp.array(release.times)])

    @jax.jit  # type: ignore[untyped-decorator]
    def tips(start: jax.Array) -> jax.Array:
        course = rod.rollout_to(
            initial_state=SystemState(t=0.0, y=start),
            u=jnp.zeros(3 * segments),
            t1=float(release.times[-1]),
            solver_dt=step,
            save_dt=None,
            save_ts=times,
            solver=Tsit5(),
            max_steps=math.ceil(float(release.times[-1]) / step) + 8,
        )
        along = jnp.sum(rod.L)
        return jax.vmap(lambda state: rod.forward_kinematics(state[: 3 * segments], s=along))(course.y)

    rest = jnp.zeros(6 * segments)
    tips(rest).block_until_ready()
    return lambda: np.asarray(tips(rest))[1:, 1:3] * (1, -1)


_REMARK = "planar, piecewise constant strain; on the processor, compiled before it is timed"
CODE = Code("SoRoMoX", _REMARK, settings, prepare)
