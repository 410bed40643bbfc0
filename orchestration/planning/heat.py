"""Heat of a scene as a linear system in the powers of the TCAs.

Without electrical feedback (alpha_T = beta = 0) the temperatures are linear in P_i = V_i^2/R_i. In modes x of the
thermal FMU,

    dx/dt = A x + B P + a,    T = T_start + C x,

with the surroundings in a. For powers that are constant between knots the solution there is exact:

    x_{k+1} = F x_k + G P_k + f.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..errors import SceneError
from ..fmi.derivatives import continuous_states, jacobian, real_values
from ..fmi.slave import Slave
from ..scene import Member, Scene
from ..scene.manipulator import AMBIENT, ROD, TEMPERATURE, THERMAL, VOLTAGE, ThermalParameters

__all__ = ["HOTTEST", "HeatModel", "Hottest", "KnotModel"]

HOTTEST = "T_max"  # output: highest temperature of TCAs and surface
_UNIT_VOLTAGE = 1.0  # [V] at which the derivatives by the powers are taken
_SETTLED = 60.0  # [s] after which the temperatures within a TCA differ no more than at rest


@dataclass(frozen=True)
class KnotModel:
    """The heat model between knots of equal distance.

    Attributes
    ----------
    F, G, f : ndarray, shapes (n, n), (n, N), (n,)
        Modes at the next knot from modes and powers [W] at this one.
    response : ndarray, shape (K, N, N)
        Temperature [K] of TCA i at the k+1-st knot after a power of 1 W in TCA j from one knot to the next.
    rest : ndarray, shape (K, N)
        Temperatures [K] at the K knots after the start without power.
    """

    F: np.ndarray
    G: np.ndarray
    f: np.ndarray
    response: np.ndarray
    rest: np.ndarray


class HeatModel:
    """Temperatures of a scene's TCAs as a linear system; use as a context manager.

    Parameters
    ----------
    scene : Scene
        With a thermal FMU of this project.

    Attributes
    ----------
    A, B, C, offset : ndarray, shapes (n, n), (n, N), (N, n), (n,)
        See above; offset is a.
    T_start : ndarray, shape (N,)
        Temperatures at the start [K].
    gain : ndarray, shape (N, N)
        Steady rise of temperature per power [K/W].
    T_rest : ndarray, shape (N,)
        Steady temperatures without power [K].

    Raises
    ------
    SceneError
        The scene has no thermal FMU with modes, its convection depends on the temperature, or the rod gets its
        temperatures from elsewhere too.
    """

    def __init__(self, scene: Scene) -> None:
        member = scene.model(THERMAL)
        if member is None:
            raise SceneError(f"{scene.name}: no FMU with the model {THERMAL!r}; planning needs one")
        archive = member.archive
        if "convection" in archive.variables and member.choice("convection") != "constant":
            raise SceneError(
                f"{member.name}.convection = {member.choice('convection')}: the heat is not linear in the powers; "
                "plan with convection = constant and a suitable h"
            )
        _require_own_heat(scene, member)
        self.parameters = ThermalParameters.of(member)
        self.member = member.name
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
        self.T_ambient = (
            ambient.polynomial(scene.start_time, 1.0)[0] if ambient else float(member.value(AMBIENT) or 0.0)
        )
        self._inputs = np.zeros((4, len(voltages) + 1))
        self._inputs[0] = [*[_UNIT_VOLTAGE] * len(voltages), self.T_ambient]
        self._slave.initialise(scene.start_time, self._inputs[0])
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
        self.gain = -self.C @ np.linalg.solve(self.A, self.B)
        self.T_rest = self.T_start - self.C @ np.linalg.solve(self.A, self.offset)
        self._hottest = archive.variables[HOTTEST]
        self._start = self._slave.save()

    def __enter__(self) -> HeatModel:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the FMU."""
        self._stack.close()

    def at_knots(self, distance: float, count: int) -> KnotModel:
        """Return the model for `count` knots of that distance [s] after the start."""
        n, powers = self.B.shape
        block = np.zeros((n + powers + 1,) * 2)
        block[:n, :n], block[:n, n:-1], block[:n, -1] = self.A, self.B, self.offset
        exact = expm(block * distance)
        F, G, f = exact[:n, :n], exact[:n, n:-1], exact[:n, -1]
        response, rest = np.zeros((count, powers, powers)), np.zeros((count, powers))
        x, z = G.copy(), np.zeros(n)
        for k in range(count):
            z = F @ z + f
            response[k], rest[k] = self.C @ x, self.T_start + self.C @ z
            x = F @ x
        return KnotModel(F, G, f, response, rest)

    def local_rise(self) -> np.ndarray:
        """Return how much hotter than its mean the hottest point of each TCA gets by its own power (N,) [K/W].

        It is that of a TCA heated alone, settled. It settles within about a second and never overshoots, so that a TCA
        whose mean temperature plus this rise stays below a limit has no point above it, but for the gradients that its
        neighbours make (0.15 K of 80 K in the default manipulator).
        """
        slave, count = self._slave, self.B.shape[1]
        rise = np.zeros(count)
        for i in range(count):
            slave.restore(self._start)
            self._inputs[0, :count] = 0.0
            self._inputs[0, i] = _UNIT_VOLTAGE
            slave.set_inputs(self._inputs)
            slave.step(0.0, _SETTLED)
            T = slave.values()
            rise[i] = (T[-1] - T[i]) * self.parameters.resistance[i] / _UNIT_VOLTAGE**2
        return rise

    def hottest(self, model: KnotModel, powers: np.ndarray, distance: float, limit: float) -> list[Hottest]:
        """Return the knots at which the hottest point of the section is above a limit.

        Parameters
        ----------
        model : KnotModel
        powers : ndarray, shape (K, N)
            [W]
        distance : float
            Of the knots [s].
        limit : float
            [K]
        """
        slave = self._slave
        slave.restore(self._start)
        hottest, T_max = [], self._hottest
        volts = np.sqrt(np.maximum(powers, 0.0) * np.array(self.parameters.resistance))
        for k, row in enumerate(volts):
            self._inputs[0, :-1] = row
            slave.set_inputs(self._inputs)
            slave.step(k * distance, distance)
            value = float(slave.values()[-1])
            if value > limit:
                hottest.append(Hottest(k, value, jacobian(slave, [T_max], self._states)[0]))
        return hottest


@dataclass(frozen=True)
class Hottest:
    """The hottest temperature at a knot [K] and its derivatives by the modes (n,)."""

    knot: int
    value: float
    gradient: np.ndarray


def _require_own_heat(scene: Scene, thermal: Member) -> None:
    """Raise SceneError unless the rod's T[i] is the thermal FMU's T[i] for every TCA."""
    rod = scene.model(ROD)
    if rod is None:
        return
    direct = {(c.source, c.target) for c in scene.connections if not c.transforms}
    elements = {m.name: m.archive.vectors[TEMPERATURE] for m in (thermal, rod)}
    wanted = {((thermal.name, element), (rod.name, element)) for element in elements[rod.name]}
    if not wanted <= direct or set(elements[thermal.name]) != set(elements[rod.name]):
        raise SceneError(
            f"{scene.name}: {rod.name}.{TEMPERATURE} is not {thermal.name}.{TEMPERATURE}, TCA by TCA; plans, maps and "
            "observers need one thermal FMU for all TCAs, connected one by one: 'thermal.T -> rod.T'"
        )
