"""Heat of one cross-section as a linear system in the powers of its TCAs.

Without electrical feedback (alpha_T = beta = 0) the temperatures are linear in P_i = V_i^2/R_i. In modes x of the
thermal FMU,

    dx/dt = A x + B P + a,    T = T_start + C x,

with the surroundings in a.
"""

from __future__ import annotations

import contextlib

import numpy as np

from ..errors import SceneError
from ..fmi.derivatives import continuous_states, jacobian, real_values
from ..fmi.slave import Slave
from ..scene import Member
from ..scene.manipulator import AMBIENT, TEMPERATURE, VOLTAGE, ThermalParameters

__all__ = ["HOTTEST", "Section"]

HOTTEST = "T_max"  # output: highest temperature of TCAs and surface
_UNIT_VOLTAGE = 1.0  # [V] at which the derivatives by the powers are taken
_SETTLED = 60.0  # [s] after which the temperatures within a TCA differ no more than at rest


class Section:
    """A thermal FMU, linear; close() releases it.

    Parameters
    ----------
    member : Member
    start_time : float
        [s]; the surroundings stay as they are then.

    Attributes
    ----------
    A, B, C, offset : ndarray, shapes (n, n), (n, N), (N, n), (n,)
        See above; offset is a.
    T_start : ndarray, shape (N,)
        Temperatures at the start [K].

    Raises
    ------
    SceneError
        Its convection depends on the temperature.
    """

    def __init__(self, member: Member, start_time: float) -> None:
        archive = member.archive
        if "convection" in archive.variables and member.choice("convection") != "constant":
            raise SceneError(
                f"{member.name}.convection = {member.choice('convection')}: the heat is not linear in the powers; "
                "plan with convection = constant and a suitable h"
            )
        self.parameters = ThermalParameters.of(member)
        self._stack = contextlib.ExitStack()
        self._stack.callback(archive.close)
        voltages = archive.vectors[VOLTAGE]
        temperatures = archive.vectors[TEMPERATURE]
        feedback = [name for vector in ("tca.alpha_T", "tca.beta") for name in archive.vectors[vector]]
        plain = dict(member.parameters) | dict.fromkeys(feedback, 0.0)
        if member.choice("level") == "full":
            plain["level"] = archive.variables["level"].item_value("reduced")
        self._slave = Slave(archive, member.name, plain, [*voltages, AMBIENT], [*temperatures, HOTTEST])
        self._stack.enter_context(contextlib.closing(self._slave))
        ambient = member.signals.get(AMBIENT)
        outside = ambient.polynomial(start_time, 1.0)[0] if ambient else float(member.value(AMBIENT) or 0.0)
        self._inputs = np.zeros((4, len(voltages) + 1))
        self._inputs[0] = [*[_UNIT_VOLTAGE] * len(voltages), outside]
        self._slave.initialise(start_time, self._inputs[0])
        self._slave.begin()
        self._slave.set_inputs(self._inputs)
        pairs = continuous_states(archive)
        states, rates = [s for s, _ in pairs], [r for _, r in pairs]
        inputs, outputs = [archive.variables[v] for v in voltages], [archive.variables[t] for t in temperatures]
        J = jacobian(self._slave, [*rates, *outputs], [*states, *inputs])
        n, count = len(states), len(voltages)
        A, B = J[:n, :n], J[:n, n:] * np.array(self.parameters.resistance) / (2.0 * _UNIT_VOLTAGE)
        used = np.any(A != 0.0, axis=1)
        self._states = [s for s, moves in zip(states, used, strict=True) if moves]
        self.A, self.B, self.C = A[np.ix_(used, used)], B[used], J[n:, :n][:, used]
        power = _UNIT_VOLTAGE**2 / np.array(self.parameters.resistance)
        self.offset = real_values(self._slave, rates)[used] - self.B @ power
        self.T_start = self._slave.values()[:count]
        self._hottest = archive.variables[HOTTEST]
        self._start = self._slave.save()

    def close(self) -> None:
        """Release the FMU."""
        self._stack.close()

    def local_rise(self) -> np.ndarray:
        """Return how much hotter than its mean the hottest point of each TCA gets by its own power (N,) [K/W].

        It is that of a TCA heated alone, settled. It settles within about a second and never overshoots, so that a TCA
        whose mean temperature plus this rise stays below a limit has no point above it, but for the gradients that its
        neighbours make (0.15 K of 80 K in the default manipulator).
        """
        count = self.B.shape[1]
        rise = np.zeros(count)
        for i in range(count):
            self._slave.restore(self._start)
            T = self._stepped(np.eye(count)[i] * _UNIT_VOLTAGE, 0.0, _SETTLED)
            rise[i] = (T[-1] - T[i]) * self.parameters.resistance[i] / _UNIT_VOLTAGE**2
        return rise

    def hottest(self, voltages: np.ndarray, distance: float, limit: float) -> list[tuple[int, float, np.ndarray]]:
        """Return the knots at which the hottest point is above a limit [K], for voltages (K, N) [V] between them.

        Each with that temperature [K] and its derivatives by the modes (n,). distance: of the knots [s].
        """
        self._slave.restore(self._start)
        hottest = []
        for k, row in enumerate(voltages):
            value = float(self._stepped(row, k * distance, distance)[-1])
            if value > limit:
                hottest.append((k, value, jacobian(self._slave, [self._hottest], self._states)[0]))
        return hottest

    def _stepped(self, voltages: np.ndarray, time: float, duration: float) -> np.ndarray:
        self._inputs[0, :-1] = voltages
        self._slave.set_inputs(self._inputs)
        self._slave.step(time, duration)
        return self._slave.values()
