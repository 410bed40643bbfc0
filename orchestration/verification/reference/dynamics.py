"""The rod in motion (the paper's Eqs. 5 to 16) in velocities and strains, by mixed spectral elements; in time
by SciPy's Radau where the body damps, by its DOP853 where it does not.

    xidot = eta' + ad_xi eta                                                              at the Gauss points
    Gamma etadot = ad_eta^T Gamma eta + rho A [0; R^T g] + (W' - ad_xi^T W, weakly)       at the nodes, eta(0) = 0
    Rdot = R w^ at the nodes (quaternions), pdot = R v at the tip and on average (for the energy of gravity)

The weak form is the adjoint of the first line, so that without gravity the discrete energy is exactly kept or
dissipated. State (n nodes but the clamp, g points): eta (6, n), xi (6, g), quaternion x, y, z, w (4, n), tip (3), mean
position (3)."""

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

_APART = 1e-7  # of the states for a difference, shares of their scales


@dataclass(frozen=True)
class Snapshot:
    """At one time. SI units."""

    p: np.ndarray  # tip (3,)
    quaternion: np.ndarray  # of the tip: x, y, z, w
    delta: np.ndarray  # (N,)
    N: np.ndarray  # (N,)
    energy: dict[str, float]  # elastic, tca, kinetic, gravity [J]


class DynamicRod:
    """count, degree: of the elements."""

    def __init__(self, data: RodData, count: int = 4, degree: int = 4) -> None:
        self.data, self.grid = data, elements(data.length, count, degree)
        self.evaluations = 0  # of rate, one state's each
        grid = self.grid
        self._path, self._lengths = routing(data, grid.points), lengths(data)
        self._mean, self._slope = grid.mean[:, 1:], grid.slope[:, 1:]
        self._weights = grid.node_weights[1:]
        self._sizes = np.cumsum([6 * self._weights.size, 6 * grid.points.size, 4 * self._weights.size, 3])
        speed = np.sqrt((data.stiffness / data.inertia).max())
        self._crossing = float(np.diff(grid.nodes).min() / speed)  # time of the fastest wave from node to node [s]
        time = data.length**2 * np.sqrt(data.weight / data.stiffness[0])  # about that of the first bending mode
        bent, straight = np.full(3, 1 / data.length), np.ones(3)
        self._scale = np.concatenate(
            [
                np.repeat(np.concatenate([straight, data.length * straight]) / time, self._weights.size),
                np.repeat(np.concatenate([bent, straight]), grid.points.size),
                np.ones(4 * self._weights.size),
                np.full(6, data.length),
            ]
        )

    def places(self) -> np.ndarray:
        """Where `resting` wants the equilibrium, (M,), the last of them L: nodes but the clamp, and points."""
        return np.sort(np.concatenate([self.grid.nodes[1:], self.grid.points]))

    def resting(self, found: Equilibrium) -> np.ndarray:
        """The state at rest in an equilibrium (the first of its batch) found at places()."""
        nodes = np.searchsorted(found.s, self.grid.nodes[1:] - 1e-12)
        points = np.searchsorted(found.s, self.grid.points - 1e-12)
        y = np.zeros(self._scale.size)
        _, xi, q, p, c = self._parts(y)
        xi[:] = found.xi[:, points, 0]
        q[:] = Rotation.from_matrix(found.R[:, :, nodes, 0].transpose(2, 0, 1)).as_quat().T
        p[:] = found.p[:, -1, 0]
        c[:] = found.p[:, nodes, 0] @ self._weights / self.data.length
        return y

    def run(self, y: np.ndarray, times: np.ndarray, loads: Callable[[float], Loads], rtol: float) -> np.ndarray:
        """States (size, len(times)) at the times, of which the first is the start; loads are smooth in between. Raises
        SubsystemError where the integrator gives up."""
        damped = self.data.retardation > 0.0
        apart = np.diag(_APART * self._scale)

        def jacobian(t: float, y: np.ndarray) -> np.ndarray:
            """SciPy's own learns its differences' lengths, and learns them wrong where the rod stays in a plane."""
            found = self.rate(np.column_stack([y, y[:, None] + apart]), loads(t))
            return (found[:, 1:] - found[:, :1]) / apart.diagonal()

        result = solve_ivp(
            lambda t, y: self.rate(y, loads(t)),
            (times[0], times[-1]),
            y,
            "Radau" if damped else "DOP853",  # undamped, every wave counts: nothing is stiff
            times,
            max_step=np.inf if damped else 4.0 * self._crossing,  # twice what is stable: the first guess is too long
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
        """dy/dt for y (size,) or (size, B)."""
        data, flat = self.data, y.reshape(y.shape[0], -1)
        self.evaluations += flat.shape[1]
        eta, xi, q, _, _ = self._parts(flat)
        out = np.empty_like(flat)
        d_eta, d_xi, d_q, d_p, d_c = self._parts(out)
        at = np.matmul(self._mean, eta)
        d_xi[:] = np.matmul(self._slope, eta)
        d_xi[:3] += cross(xi[:3], at[:3])
        d_xi[3:] += cross(xi[3:], at[:3]) + cross(xi[:3], at[3:])
        column = (slice(None), None, None)
        W = data.stiffness[column] * (xi - data.rest[column] + data.retardation * d_xi)
        _, N, gradient = self._tension(xi, loads.T)
        W += (N[:, None] * gradient).sum(axis=1)
        Ww = W * self.grid.point_weights[:, None]
        force = -np.matmul(self._slope.T, Ww) - np.matmul(self._mean.T, transposed_ad(xi, Ww))
        tip = q[:, -1:]
        force[:3, -1:] += _turned_back(tip, loads.moment[column])
        force[3:, -1:] += _turned_back(tip, loads.force[column])
        force /= self._weights[:, None]
        force[3:] += data.weight * _turned_back(q, loads.gravity[column])
        gamma = data.inertia[column]
        d_eta[:] = (force + transposed_ad(eta, gamma * eta)) / gamma
        w, v = eta[:3], eta[3:]
        d_q[:3] = 0.5 * (q[3] * w + cross(q[:3], w))
        d_q[3] = -0.5 * (q[:3] * w).sum(axis=0)
        moved = _turned(q, v)
        d_p[:] = moved[:, -1]
        d_c[:] = (moved * self._weights[:, None]).sum(axis=1) / data.length
        return out.reshape(y.shape)

    def snapshot(self, y: np.ndarray, loads: Loads) -> Snapshot:
        data = self.data
        eta, xi, q, p, c = self._parts(y[:, None])
        delta, N, _ = self._tension(xi, loads.T)
        strain = xi[..., 0] - data.rest[:, None]
        stretch = delta[:, 0] - data.stroke(loads.T)
        energy = {
            "elastic": 0.5 * float(data.stiffness @ strain**2 @ self.grid.point_weights),
            "tca": 0.5 * data.tca_stiffness * float(stretch @ stretch),
            "kinetic": 0.5 * float(data.inertia @ eta[..., 0] ** 2 @ self._weights),
            "gravity": -data.weight * data.length * float(loads.gravity @ c[:, 0]),
        }
        tip = q[:, -1, 0] / np.linalg.norm(q[:, -1, 0])
        return Snapshot(p[:, 0], tip, delta[:, 0], N[:, 0], energy)

    def _parts(self, y: np.ndarray) -> tuple[np.ndarray, ...]:
        """Views: eta (6, n, ...), xi (6, g, ...), q (4, n, ...), tip (3, ...), mean position (3, ...)."""
        eta, xi, q, p, c = np.split(y, self._sizes)
        rest = y.shape[1:]
        return eta.reshape(6, -1, *rest), xi.reshape(6, -1, *rest), q.reshape(4, -1, *rest), p, c

    def _tension(self, xi: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """delta, N (N, B) and the gradients [r x t; t] (6, N, g, B) of every TCA."""
        size, gradient = actuators(self._path, xi)
        delta = np.matmul(self.grid.point_weights, size) - self._lengths[:, None]
        return delta, self.data.tca_stiffness * (delta - self.data.stroke(T)[:, None]), gradient


def _turned(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """R v for quaternions (4, ...) whose length is 1 but for the integrator's error."""
    twice = 2.0 * cross(q[:3], v) / (q * q).sum(axis=0)
    return v + q[3] * twice + cross(q[:3], twice)


def _turned_back(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """R^T v; v (3, 1, 1) is the same everywhere."""
    wide = np.broadcast_to(v, (3, *q.shape[1:]))
    twice = 2.0 * cross(q[:3], wide) / (q * q).sum(axis=0)
    return wide - q[3] * twice + cross(q[:3], twice)
