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

from ..api import read
from ..errors import SceneError
from ..planning import PlanLimits, workspace
from ..planning.manipulator import Manipulator
from ..scene.manipulator import VOLTAGE
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
MOST_TARGETS = 1000  # equilibria of the map from which targets are drawn: each takes about 0.3 ms
WIDEST = 10.0  # bound of observations: far outside of what a run reaches


class ReachEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """Reaching with a manipulator.

    Parameters
    ----------
    scene : str
        With one rod, heated by one thermal FMU or several; actions are the voltages of one after the other.
    voltage : float
        Largest voltage [V].
    temperature : float
        Limit of the mean temperatures [K], above that of the start; targets are equilibria below it.

    Raises
    ------
    SceneError
        The scene is no manipulator, or nothing is within the limits.
    """

    def __init__(self, scene: str = "step", voltage: float = 4.0, temperature: float = 353.15) -> None:
        self._limits = PlanLimits(voltage, temperature, temperature)
        described = read(scene)
        manipulator = Manipulator.of(described)
        self._rod = manipulator.rod.name
        self._sections = {m.name: len(m.archive.vectors[VOLTAGE]) for m in manipulator.sections}
        settings = {
            f"{self._rod}.closure": "inside",
            f"{self._rod}.order": 0,
            "coupling.macro_step": STEP,
            "stop_time": STEP * STEPS,
            **{f"{name}.V": 0.0 for name in self._sections},
        }
        self._sim = Simulation(described, settings)
        self._start = self._temperatures()
        if self._start.max() >= temperature:
            self._sim.close()
            raise SceneError(
                f"temperature = {temperature:g} K: the manipulator starts at {self._start.max():g} K; give a higher "
                "limit"
            )
        try:
            self._targets = workspace(self._sim.scene, self._limits, _powers_of_each(self._start.size)).tips[:, :2]
        except SceneError:
            self._sim.close()
            raise
        self._count = 0
        self._target = np.zeros(2)
        n = self._start.size
        self.action_space = spaces.Box(-1.0, 1.0, (n,), np.float32)
        self.observation_space = spaces.Box(-WIDEST, WIDEST, (n + 4,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode from rest.

        Parameters
        ----------
        seed : int, optional
        options : dict, optional
            {"target": (x, y)} [m], instead of a random equilibrium.

        Raises
        ------
        SceneError
            Another option, or a target that no observation can show; nothing was changed.
        """
        unknown = [key for key in options or {} if key != "target"]
        if unknown:
            raise SceneError(f"option {unknown[0]!r}: unknown; allowed: 'target'")
        target = None if not options else require_numbers("target", options["target"], 2)
        if target is not None and np.abs(target).max() > WIDEST * REACH:
            raise SceneError(
                f"target = {target.tolist()} m: out of what observations show; give coordinates of up to "
                f"{WIDEST * REACH:g} m"
            )
        super().reset(seed=seed)
        self._sim.restart()
        self._count = 0
        self._target = self._targets[self.np_random.integers(len(self._targets))] if target is None else target
        return self._observe()[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold voltages for one step.

        Parameters
        ----------
        action : array_like, shape (N,)
            Of each TCA, -1 for 0 V to 1 for the largest voltage; numbers beyond are taken as these.

        Raises
        ------
        SceneError
            Another shape, a number that is not finite, or the episode has ended; nothing was changed.
        """
        if self._count >= STEPS:
            raise SceneError(f"the episode has ended after {STEPS} steps; call reset()")
        shares = 0.5 * (np.clip(require_numbers("action", action, self._start.size), -1.0, 1.0) + 1.0)
        volts, begin = {}, 0
        for name, count in self._sections.items():
            volts[f"{name}.V"] = shares[begin : begin + count] * self._limits.voltage
            begin += count
        self._sim.step(STEP * (self._count + 1), volts)
        self._count += 1
        observation, distance, hottest = self._observe()
        reward = -distance / REACH - (OVERHEATED if hottest > self._limits.temperature else 0.0)
        return observation, float(reward), False, self._count >= STEPS, {"distance": distance}

    def close(self) -> None:
        """Release the FMUs."""
        self._sim.close()

    def _observe(self) -> tuple[np.ndarray, float, float]:
        T, tip = self._temperatures(), self._sim[f"{self._rod}.tip.p"][:2]
        rise = (T - self._start) / (self._limits.temperature - self._start)
        values = np.concatenate([rise, tip / REACH, self._target / REACH])
        distance = float(np.hypot(*(tip - self._target)))
        return np.clip(values, -WIDEST, WIDEST).astype(np.float32), distance, float(T.max())

    def _temperatures(self) -> np.ndarray:
        return np.concatenate([self._sim[f"{name}.T"] for name in self._sections])


def _powers_of_each(tcas: int) -> int:
    """Return how many powers of each TCA the map of targets has: 5, or as many as MOST_TARGETS allows."""
    return max(2, min(5, int(MOST_TARGETS ** (1.0 / tcas))))


def register() -> None:
    """Register tca/Reach-v0 with Gymnasium."""
    if "tca/Reach-v0" not in gymnasium.registry:
        gymnasium.register("tca/Reach-v0", entry_point=f"{__name__}:ReachEnv")


register()
