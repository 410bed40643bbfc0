"""The optimal-control problem of a path, and its solution by sequential quadratic programming.

Unknowns are the powers P of the TCAs between knots, as shares p of the largest power. Temperatures are linear in them
(heat.py), outputs y(T) are the rod's equilibria (rod.py). With the wanted path r and the size s of the path,

    minimise  1/2 sum_k w_k |y(T_k) - r_k|^2/s^2 + 1/2 e sum_k |p_{k+1} - p_k|^2
    so that   0 <= p <= 1,   T_k <= T_max,   hottest_k <= T_hottest,   |V_{k+1} - V_k| <= rate * distance.

Each iteration solves the quadratic program of the Gauss-Newton method; its step is halved until the cost falls. All
constraints but those on the hottest point and on rates are linear and hold exactly; the hottest point is a maximum of
linear functions, approached from below by its tangents.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..errors import SceneError
from .heat import HeatModel
from .limits import PlanLimits
from .rod import StaticRod

__all__ = ["SMOOTHING", "PathProblem", "Solution", "solve_quadratic_program"]

SMOOTHING = 1e-6  # e: weight of changes of the power, against chatter where the path does not decide
MAX_ITERATIONS = 30
STEP_TOLERANCE = 1e-4  # largest change of p at which the iteration ends
COST_TOLERANCE = 1e-4  # relative decrease of the cost at which it ends
MAX_HALVINGS = 12
NEAR_LIMIT = 3.0  # [K] below its limit from which on the hottest point is bounded by its tangents
PENALTY = 10.0  # of the hottest point's excess [1/K], in units of the cost
HOT_TOLERANCE = 5e-3  # [K] by which it may pass its limit
QP_TOLERANCE = 1e-9  # of the quadratic program, absolute and relative
NO_BOUND = 1e30  # what PIQP takes for infinity
FIRST_SHARE = 0.14  # of the largest voltage, in the first guess
LEAST_VOLTAGE = 0.05  # share of the largest: below, V = sqrt(P R) is not linearised at P itself


class Cut(NamedTuple):
    """A linear bound of the powers (K N,): row @ powers <= bound [K]."""

    row: np.ndarray
    bound: float


@dataclass(frozen=True)
class Solution:
    """A solution of the problem.

    Attributes
    ----------
    powers, voltages, temperatures : ndarray, shapes (K, N)
        Powers [W] and voltages [V] from knot k to k + 1; temperatures at knot k + 1 [K].
    outputs : ndarray, shape (K, p)
        Of the rod at rest at knot k + 1.
    cost : float
    iterations : int
    converged : bool
    """

    powers: np.ndarray
    voltages: np.ndarray
    temperatures: np.ndarray
    outputs: np.ndarray
    cost: float
    iterations: int
    converged: bool


@dataclass
class PathProblem:
    """The problem at K knots.

    Attributes
    ----------
    heat : HeatModel
    rod : StaticRod
        Its first p outputs are those of the path, the others the displacements of the TCAs.
    limits : PlanLimits
    distance : float
        Of the knots [s].
    path : ndarray, shape (K, p)
        Wanted outputs at the ends of the intervals.
    weights : ndarray, shape (K,)
        0 where no path is asked for.
    scale : float or ndarray, shape (p,)
        Size of the path.
    correction : ndarray, shape (K, p)
        What the full models add to the outputs of the rod at rest.
    warming : ndarray, shape (K, N)
        What they add to the temperatures [K].
    """

    heat: HeatModel
    rod: StaticRod
    limits: PlanLimits
    distance: float
    path: np.ndarray
    weights: np.ndarray
    scale: float | np.ndarray
    correction: np.ndarray = field(init=False)
    warming: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        K, N = len(self.path), self.heat.B.shape[1]
        self.model = self.heat.at_knots(self.distance, K)
        self.times = self.distance * np.arange(1, K + 1)
        self.correction, self.warming = np.zeros_like(self.path), np.zeros((K, N))
        # Phi (K N, K N): temperatures at the knots per power; Toeplitz in blocks.
        Phi = np.zeros((K, N, K, N))
        for k in range(K):
            Phi[k, :, : k + 1] = self.model.response[k::-1].transpose(1, 0, 2)
        self.Phi = Phi.reshape(K * N, K * N)
        self.shape = (K, N)
        self._modes = np.zeros((K, *self.model.G.shape))  # modes at knot j + 1 per power in the first interval
        x = self.model.G
        for k in range(K):
            self._modes[k] = x
            x = self.model.F @ x

    # ------------------------------------------------------------ models

    def temperatures(self, powers: np.ndarray) -> np.ndarray:
        """Return the temperatures (K, N) [K] at the knots for powers (K, N) [W]."""
        rise = (self.Phi @ powers.ravel()).reshape(self.shape)
        return np.asarray(self.model.rest + rise + self.warming)

    def resistances(self, temperatures: np.ndarray, displacements: np.ndarray) -> np.ndarray:
        """Return the resistances (K, N) [ohm] in the intervals, at the mean of the values at their ends."""
        T = 0.5 * (np.vstack([self.heat.T_start, temperatures[:-1]]) + temperatures)
        delta = 0.5 * (np.vstack([np.zeros(displacements.shape[1]), displacements[:-1]]) + displacements)
        return self.heat.electrics.at(T, delta)

    def cost(self, powers: np.ndarray, outputs: np.ndarray) -> float:
        """Return the cost of powers (K, N) [W] whose path has the outputs (K, p)."""
        error = (outputs + self.correction - self.path) / self.scale
        changes = np.diff(powers / self._largest, axis=0)
        return float(0.5 * self.weights @ (error**2).sum(axis=1) + 0.5 * SMOOTHING * (changes**2).sum())

    def gradient(self, voltages: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the cost of voltages (K, N) [V] and its derivatives by each of them (K, N), exact.

        One pass over the equilibria with their derivatives, whatever the number of voltages. The resistances are those
        without feedback, as in the heat model.
        """
        R = self.heat.electrics.R
        powers = voltages**2 / R
        self._largest = self.limits.voltage**2 / R
        outputs, tangents = self._linear(self.temperatures(powers))
        error = (outputs + self.correction - self.path) / self.scale**2 * self.weights[:, None]
        by_temperature = np.einsum("kp,kpn->kn", error, tangents)
        by_power = (self.Phi.T @ by_temperature.ravel()).reshape(self.shape)
        share = powers / self._largest
        by_power += SMOOTHING * (self._smoothing() @ share.ravel()).reshape(self.shape) / self._largest
        return self.cost(powers, outputs), by_power * 2.0 * voltages / R

    # ------------------------------------------------------------ solution

    def solve(self, powers: np.ndarray | None = None) -> Solution:
        """Return the solution, from powers (K, N) [W] on if there are any.

        Raises
        ------
        SceneError
            The quadratic program has no solution: the limits contradict each other.
        """
        R = self.heat.electrics.R * np.ones(self.shape)
        self._largest = self.limits.voltage**2 / R
        P = self._first_guess() if powers is None else np.minimum(powers, self._largest)
        outputs, tangents = self._linear(self.temperatures(P))
        cost, converged, iterations = self.cost(P, outputs), False, 0
        cuts, excess = self._cuts(P)
        while iterations < MAX_ITERATIONS and not converged:
            iterations += 1
            if self.heat.electrics.has_feedback:
                R = self.resistances(self.temperatures(P), self._displacements)
                self._largest = self.limits.voltage**2 / R
                P = np.minimum(P, self._largest)
            share = P / self._largest
            step = self._quadratic_step(share, outputs, tangents, cuts.values())
            length, merit = 1.0, cost + PENALTY * excess
            for _ in range(MAX_HALVINGS):
                trial = np.clip(share + length * step, 0.0, 1.0) * self._largest
                outputs = self._outputs(self.temperatures(trial))
                cost = self.cost(trial, outputs)
                fresh, excess = self._cuts(trial)
                cuts |= fresh
                if cost + PENALTY * excess <= merit or length * np.abs(step).max() < STEP_TOLERANCE:
                    break
                length *= 0.5
            P, decrease = trial, merit - cost - PENALTY * excess
            settled = length * np.abs(step).max() < STEP_TOLERANCE or decrease < COST_TOLERANCE * merit
            converged = bool(settled and excess <= HOT_TOLERANCE)
            if not converged:
                outputs, tangents = self._linear(self.temperatures(P))
        if np.isfinite(self.limits.voltage_rate):
            P = self._slowed(np.sqrt(P * R)) ** 2 / R
            outputs = self._outputs(self.temperatures(P))
            cost = self.cost(P, outputs)
        return Solution(P, np.sqrt(np.maximum(P * R, 0.0)), self.temperatures(P), outputs, cost, iterations, converged)

    def _first_guess(self) -> np.ndarray:
        """Return powers (K, N) [W] of a small voltage, reached as fast as its rate may be; within the temperatures."""
        ramp = np.minimum(FIRST_SHARE, self.limits.voltage_rate * self.times / self.limits.voltage)
        guess = np.asarray(ramp[:, None] ** 2 * self._largest)
        cold = self.temperatures(np.zeros(self.shape))
        room, rise = self.limits.temperature - cold, self.temperatures(guess) - cold
        kept = np.min(room[rise > 0.0] / rise[rise > 0.0], initial=1.0)
        return guess * max(0.0, kept)

    def _slowed(self, voltages: np.ndarray) -> np.ndarray:
        """Return voltages (K, N) [V] whose changes keep the rate, where the linearised limit left an excess."""
        most, before = self.limits.voltage_rate * self.distance, np.zeros(self.shape[1])
        slowed = np.empty_like(voltages)
        for k, row in enumerate(voltages):
            before = slowed[k] = np.clip(row, before - most, before + most)
        return slowed

    def _linear(self, temperatures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, tangents = self.rod.linear(temperatures, self.times, self.weights > 0.0)
        p = self.path.shape[1]
        self._displacements = values[:, p:]
        return values[:, :p], tangents[:, :p]

    def _outputs(self, temperatures: np.ndarray) -> np.ndarray:
        values = self.rod.outputs(temperatures, self.times)
        p = self.path.shape[1]
        self._displacements = values[:, p:]
        return values[:, :p]

    def _cuts(self, powers: np.ndarray) -> tuple[dict[tuple[int, int], Cut], float]:
        """Return tangents of the hottest point at the knots where it is near its limit, and how far it is above [K]."""
        limit = self.limits.hottest - self.warming.max(initial=0.0)
        cuts, excess = {}, 0.0
        for point in self.heat.hottest(powers, self.distance, limit - NEAR_LIMIT):
            row = np.zeros(self.shape)
            row[: point.knot + 1] = np.einsum("n,knm->km", point.gradient, self._modes[point.knot :: -1])
            flat, excess = row.ravel(), max(excess, point.value - limit)
            key = (point.knot, int(np.argmax(row[point.knot])))  # one of each TCA: where it is hottest moves
            cuts[key] = Cut(flat, float(flat @ powers.ravel() + limit - point.value))
        return cuts, excess

    def _smoothing(self) -> np.ndarray:
        """Return the matrix (K N, K N) of 1/2 sum |p_{k+1} - p_k|^2."""
        K, N = self.shape
        D = np.diff(np.eye(K), axis=0)
        return np.kron(D.T @ D, np.eye(N))

    def _quadratic_step(
        self, share: np.ndarray, outputs: np.ndarray, tangents: np.ndarray, cuts: Iterable[Cut]
    ) -> np.ndarray:
        """Return the Gauss-Newton step (K, N) of the shares."""
        K, N = self.shape
        size = K * N
        largest = self._largest.ravel()
        Phi = self.Phi * largest
        tangents = tangents / np.broadcast_to(self.scale, tangents.shape[1:2])[:, None]
        M = np.einsum("kpn,knm->kpm", tangents, Phi.reshape(K, N, size)).reshape(-1, size)
        w = np.repeat(self.weights, self.path.shape[1])
        error = ((outputs + self.correction - self.path) / self.scale).ravel()
        S = SMOOTHING * self._smoothing()
        H = M.T @ (w[:, None] * M) + S
        g = M.T @ (w * error) + S @ share.ravel()
        T = self.temperatures(share * self._largest).ravel()
        reach = T - (Phi * share.ravel()).sum(axis=1) + np.maximum(Phi, 0.0).sum(axis=1)
        near = reach > self.limits.temperature  # all others cannot be reached with full power
        rows, bounds = [Phi[near]], [self.limits.temperature - T[near]]
        for cut in cuts:
            rows.append((cut.row * largest)[None])
            bounds.append(np.array([cut.bound - cut.row @ (share.ravel() * largest)]))
        rates = self._rate_rows(share) if np.isfinite(self.limits.voltage_rate) else []
        x = solve_quadratic_program(H, g, share.ravel(), rows + [r for r, _ in rates], bounds + [b for _, b in rates])
        if x is None and rates:
            # An excess that the linearisation left need not be made up at once, see _slowed.
            x = solve_quadratic_program(
                H, g, share.ravel(), rows + [r for r, _ in rates], bounds + [np.maximum(b, 0.0) for _, b in rates]
            )
        if x is None:
            raise SceneError(
                "the limits cannot be kept from the start on: the manipulator is hotter than a limit allows; raise "
                "the limits temperature and hottest (--temperature, --hottest)"
            )
        return x.reshape(K, N)

    def _rate_rows(self, share: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return rows and bounds of |V_{k+1} - V_k| <= rate * distance, with V = V_max sqrt(p) linearised."""
        K, N = self.shape
        V_max = self.limits.voltage
        root = np.sqrt(np.maximum(share, 0.0)).ravel()
        slope = V_max / (2.0 * np.maximum(root, LEAST_VOLTAGE))
        change = np.kron(np.eye(K, k=0) - np.eye(K, k=-1), np.eye(N))  # the voltage before the first knot is 0
        most, now = self.limits.voltage_rate * self.distance, V_max * change @ root
        return [(sign * change * slope, most - sign * now) for sign in (1.0, -1.0)]


def solve_quadratic_program(
    H: np.ndarray, g: np.ndarray, share: np.ndarray, rows: list[np.ndarray], bounds: list[np.ndarray]
) -> np.ndarray | None:
    """Return x of min 1/2 x H x + g x with rows x <= bounds and 0 <= share + x <= 1; None where there is none."""
    piqp = import_piqp()
    G, h = np.vstack(rows), np.concatenate(bounds)
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = QP_TOLERANCE
    inequalities = {"G": np.asfortranarray(G), "h_u": h, "h_l": np.full(len(h), -NO_BOUND)} if len(h) else {}
    solver.setup(np.asfortranarray(H), g, x_l=-share, x_u=1.0 - share, **inequalities)
    solved = solver.solve() in (piqp.PIQP_SOLVED, piqp.PIQP_MAX_ITER_REACHED)
    return np.asarray(solver.result.x).copy() if solved else None


def import_piqp() -> Any:
    """Return the module piqp. Raises SceneError where it is missing."""
    try:
        import piqp
    except ImportError as error:
        raise SceneError(
            "planning needs the solver PIQP of the extra `control`: pip install 'tca-cosim[control]'"
        ) from error
    return piqp
