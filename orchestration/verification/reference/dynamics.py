"""Dynamics of the rod in velocities and strains, by mixed spectral elements.

    xidot = eta' + ad_xi eta                                                at the Gauss points       (Eqs. 6 and 21)
    Gamma etadot = ad_eta^T Gamma eta + rho A [0; R^T g] + W' - ad_xi^T W   at the nodes, weakly      (Eq. 8)
    eta(0) = 0,  W(L) = W_tip                                                                         (Eqs. 15 and 16)
    Rdot = R w^ at the nodes (quaternions),  pdot = R v at the tip and on average

The weak form of the second line is the adjoint of the first, so without gravity the discrete energy is conserved or
dissipated exactly. The mean position gives the energy of gravity. State, with n nodes besides the clamp and g points:
eta (6, n), xi (6, g), quaternions x, y, z, w (4, n), tip (3), mean position (3). Time integrators are SciPy's Radau
where the body has damping and DOP853 where it has none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ...errors import SubsystemError
from .elements import elements
from .rod import Loads, RodData, actuators, cross, lengths, routing, transposed_ad
from .statics import Equilibrium

__all__ = ["DynamicRod", "Snapshot"]

_PERTURBATION = 1e-7  # of a state for the finite differences of the Jacobian, as a fraction of its scale


@dataclass(frozen=True)
class Snapshot:
    """Outputs of the rod at one time, SI units."""

    p: np.ndarray  # position of the tip (3,)
    quaternion: np.ndarray  # orientation of the tip: x, y, z, w
    delta: np.ndarray  # (N,)
    N: np.ndarray  # (N,)
    energy: dict[str, float]  # elastic, tca, kinetic, gravity [J]


class DynamicRod:
    """Rod with `count` elements of a given degree."""

    def __init__(self, data: RodData, count: int = 4, degree: int = 4) -> None:
        self.data, self.grid = data, elements(data.length, count, degree)
        self.evaluations = 0  # evaluations of `rate`, counted for each state
        grid = self.grid
        self._path, self._lengths = routing(data, grid.points), lengths(data)
        self._mean, self._slope = grid.mean[:, 1:], grid.slope[:, 1:]
        self._weights = grid.node_weights[1:]
        self._sizes = np.cumsum([6 * self._weights.size, 6 * grid.points.size, 4 * self._weights.size, 3])
        speed = np.sqrt((data.stiffness / data.inertia).max())
        self._crossing = float(np.diff(grid.nodes).min() / speed)  # travel time of the fastest wave between nodes [s]
        time = data.length**2 * np.sqrt(data.weight / data.stiffness[0])  # scale of the first bending period [s]
        bent, straight = np.full(3, 1 / data.length), np.ones(3)
        self._scale = np.concatenate(
            [
                np.repeat(np.concatenate([straight, data.length * straight]) / time, self._weights.size),
                np.repeat(np.concatenate([bent, straight]), grid.points.size),
                np.ones(4 * self._weights.size),
                np.full(6, data.length),
            ]
        )

    def stations(self) -> np.ndarray:
        """Stations (M,) [m] of the equilibrium that `state_at_rest` needs: nodes besides the clamp, and points."""
        return np.sort(np.concatenate([self.grid.nodes[1:], self.grid.points]))

    def state_at_rest(self, rest: Equilibrium) -> np.ndarray:
        """State at rest in the first equilibrium of a batch that was computed at `stations()`."""
        nodes = np.searchsorted(rest.s, self.grid.nodes[1:] - 1e-12)
        points = np.searchsorted(rest.s, self.grid.points - 1e-12)
        y = np.zeros(self._scale.size)
        _, xi, q, p, c = self._parts(y)
        xi[:] = rest.xi[:, points, 0]
        q[:] = Rotation.from_matrix(rest.R[:, :, nodes, 0].transpose(2, 0, 1)).as_quat().T
        p[:] = rest.p[:, -1, 0]
        c[:] = rest.p[:, nodes, 0] @ self._weights / self.data.length
        return y

    def run(self, y: np.ndarray, times: np.ndarray, loads: Callable[[float], Loads], rtol: float) -> np.ndarray:
        """Integrate from y over times whose first is the start; the loads are smooth in between.

        Returns
        -------
        ndarray
            States (size, len(times)).

        Raises
        ------
        SubsystemError
            The integrator fails.
        """
        damped = self.data.retardation > 0.0
        increment = np.diag(_PERTURBATION * self._scale)

        def jacobian(t: float, y: np.ndarray) -> np.ndarray:
            """SciPy's adaptive differences fail here: they choose wrong increments where the rod stays in a plane."""
            rates = self.rate(np.column_stack([y, y[:, None] + increment]), loads(t))
            return (rates[:, 1:] - rates[:, :1]) / increment.diagonal()

        result = solve_ivp(
            lambda t, y: self.rate(y, loads(t)),
            (times[0], times[-1]),
            y,
            "Radau" if damped else "DOP853",  # without damping the step is limited by accuracy
            times,
            max_step=np.inf
            if damped
            else 4.0 * self._crossing,  # twice the stability limit: SciPy's first step is too long
            rtol=rtol,
            atol=rtol * self._scale,
            **({"jac": jacobian} if damped else {}),
        )
        if not result.success:
            raise SubsystemError(
                f"reference: rod at t = {result.t[-1] if result.t.size else times[0]:.6g} s: "
                f"{result.message}; try a larger rtol or fewer elements"
            )
        return result.y

    def rate(self, y: np.ndarray, loads: Loads) -> np.ndarray:
        """Right-hand side dy/dt for y (size,) or (size, B)."""
        data, flat = self.data, y.reshape(y.shape[0], -1)
        self.evaluations += flat.shape[1]
        eta, xi, q, _, _ = self._parts(flat)
        out = np.empty_like(flat)
        d_eta, d_xi, d_q, d_p, d_c = self._parts(out)
        at_points = np.matmul(self._mean, eta)
        d_xi[:] = np.matmul(self._slope, eta)
        d_xi[:3] += cross(xi[:3], at_points[:3])
        d_xi[3:] += cross(xi[3:], at_points[:3]) + cross(xi[:3], at_points[3:])
        column = (slice(None), None, None)
        W = data.stiffness[column] * (xi - data.rest[column] + data.retardation * d_xi)
        _, N, gradient = self._tension(xi, loads.T)
        W += (N[:, None] * gradient).sum(axis=1)
        Ww = W * self.grid.point_weights[:, None]
        force = -np.matmul(self._slope.T, Ww) - np.matmul(self._mean.T, transposed_ad(xi, Ww))
        tip = q[:, -1:]
        force[:3, -1:] += _rotate_back(tip, loads.moment[column])
        force[3:, -1:] += _rotate_back(tip, loads.force[column])
        force /= self._weights[:, None]
        force[3:] += data.weight * _rotate_back(q, loads.gravity[column])
        gamma = data.inertia[column]
        d_eta[:] = (force + transposed_ad(eta, gamma * eta)) / gamma
        w, v = eta[:3], eta[3:]
        d_q[:3] = 0.5 * (q[3] * w + cross(q[:3], w))
        d_q[3] = -0.5 * (q[:3] * w).sum(axis=0)
        velocity = _rotate(q, v)
        d_p[:] = velocity[:, -1]
        d_c[:] = (velocity * self._weights[:, None]).sum(axis=1) / data.length
        return out.reshape(y.shape)

    def snapshot(self, y: np.ndarray, loads: Loads) -> Snapshot:
        """Evaluate the outputs at the state y (size,)."""
        data = self.data
        eta, xi, q, p, c = self._parts(y[:, None])
        delta, N, _ = self._tension(xi, loads.T)
        strain = xi[..., 0] - data.rest[:, None]
        stretch = delta[:, 0] - data.stroke(loads.T)
        energy = {
            "elastic": 0.5 * float(data.stiffness @ strain**2 @ self.grid.point_weights),
            "tca": 0.5 * float(data.tca_stiffness @ stretch**2),
            "kinetic": 0.5 * float(data.inertia @ eta[..., 0] ** 2 @ self._weights),
            "gravity": -data.weight * data.length * float(loads.gravity @ c[:, 0]),
        }
        tip = q[:, -1, 0] / np.linalg.norm(q[:, -1, 0])
        return Snapshot(p[:, 0], tip, delta[:, 0], N[:, 0], energy)

    def _parts(self, y: np.ndarray) -> tuple[np.ndarray, ...]:
        """Split states into views: eta (6, n, ...), xi (6, g, ...), q (4, n, ...), tip and mean position (3, ...)."""
        eta, xi, q, p, c = np.split(y, self._sizes)
        batch = y.shape[1:]
        return eta.reshape(6, -1, *batch), xi.reshape(6, -1, *batch), q.reshape(4, -1, *batch), p, c

    def _tension(self, xi: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement and tension (N, B) of every TCA and the gradient [r x t; t] (6, N, g, B) of its stretch."""
        size, gradient = actuators(self._path, xi)
        delta = np.matmul(self.grid.point_weights, size) - self._lengths[:, None]
        return delta, self.data.tensions(delta, np.repeat(T[:, None], delta.shape[1], axis=1)), gradient


def _rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rotate v: R v for quaternions (4, ...), which the integrator normalises only to its tolerance."""
    twice = 2.0 * cross(q[:3], v) / (q * q).sum(axis=0)
    return v + q[3] * twice + cross(q[:3], twice)


def _rotate_back(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rotate v back: R^T v; v (3, 1, 1) is the same at all nodes."""
    wide = np.broadcast_to(v, (3, *q.shape[1:]))
    twice = 2.0 * cross(q[:3], wide) / (q * q).sum(axis=0)
    return wide - q[3] * twice + cross(q[:3], twice)
