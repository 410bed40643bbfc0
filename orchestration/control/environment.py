"""An environment of Gymnasium: bring the tip to a point and hold it there.

    import gymnasium, tca_cosim.control.environment
    env = gymnasium.make("tca/Reach-v0")

Actions are the voltages of the TCAs, from -1 for 0 V to 1 for the largest. Observations are the rises of the mean
temperatures over that of the limit, then tip and target across the axis in units of the reach. The reward is minus the
distance in units of the reach, less a penalty while a TCA is hotter than the limit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import SceneError
from ..planning import PlanLimits, workspace
from ..stepping import Simulation
from .checks import require_numbers

try:
    import gymnasium
    from gymnasium import spaces
except ImportError as error:
    raise SceneError(
        "the environment needs gymnasium of the extra `control`: pip install 'tca-cosim[control]'"
    ) from error

__all__ = ["ReachEnv", "register"]

STEP = 0.2  # [s] of one action
STEPS = 150  # of an episode: 30 s
REACH = 0.02  # [m] unit of length of observations and rewards
OVERHEATED = 1.0  # penalty per step, in units of the reward
WIDEST = 10.0  # bound of observations: far outside of what a run reaches


class ReachEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """Reaching with the default manipulator.

    Parameters
    ----------
    scene : str
        The manipulator.
    voltage : float
        Largest voltage [V].
    temperature : float
        Limit of the mean temperatures [K]; targets are equilibria below it.
    """

    def __init__(self, scene: str = "step", voltage: float = 4.0, temperature: float = 353.15) -> None:
        self._limits = PlanLimits(voltage, temperature, temperature)
        settings = {
            "rod.closure": "inside",
            "rod.order": 0,
            "coupling.macro_step": STEP,
            "stop_time": STEP * STEPS,
            "thermal.V": 0.0,
        }
        self._sim = Simulation(scene, settings)
        self._targets = workspace(self._sim.scene, self._limits, 5).tips[:, :2]
        self._start = float(self._sim["thermal.T[1]"])
        self._count = 0
        self._target = np.zeros(2)
        n = len(self._sim["thermal.T"])
        self.action_space = spaces.Box(-1.0, 1.0, (n,), np.float32)
        self.observation_space = spaces.Box(-WIDEST, WIDEST, (n + 4,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode from rest; options: {"target": (x, y)} [m] instead of a random equilibrium."""
        super().reset(seed=seed)
        self._sim.restart()
        self._count = 0
        if options and "target" in options:
            self._target = require_numbers("target", options["target"], 2)
        else:
            self._target = self._targets[self.np_random.integers(len(self._targets))]
        return self._observe()[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold voltages for one step."""
        self._count += 1
        shares = 0.5 * (np.clip(np.asarray(action, dtype=float), -1.0, 1.0) + 1.0)
        self._sim.step(STEP * self._count, {"thermal.V": shares * self._limits.voltage})
        observation, distance, hottest = self._observe()
        reward = -distance / REACH - (OVERHEATED if hottest > self._limits.temperature else 0.0)
        return observation, float(reward), False, self._count >= STEPS, {"distance": distance}

    def close(self) -> None:
        """Release the FMUs."""
        self._sim.close()

    def _observe(self) -> tuple[np.ndarray, float, float]:
        T, tip = self._sim["thermal.T"], self._sim["rod.tip.p"][:2]
        rise = (T - self._start) / (self._limits.temperature - self._start)
        values = np.concatenate([rise, tip / REACH, self._target / REACH])
        distance = float(np.hypot(*(tip - self._target)))
        return np.clip(values, -WIDEST, WIDEST).astype(np.float32), distance, float(T.max())


def register() -> None:
    """Register tca/Reach-v0 with Gymnasium."""
    if "tca/Reach-v0" not in gymnasium.registry:
        gymnasium.register("tca/Reach-v0", entry_point=f"{__name__}:ReachEnv")


register()
