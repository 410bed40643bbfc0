"""Equilibrium by shooting.

    g' = g xi^                                               (Eq. 5)
    W' = ad_xi^T W - rho A [0; R^T g],  W(L) = W_tip         (Eq. 8 without inertia, Eqs. 15 and 16)
    d delta_i/ds = |u_i| - |u_i*|                            (Eq. 17)
    N_i = k (delta_i - chi f2 tau_i)                         (Eqs. 4 and 18 to 20)

Pose and wrench are integrated from s = 0 to L by DOP853; the strain at every s follows from the wrench. The unknowns
are the wrench at the clamp and the tensions of the TCAs. Lengths are divided by L, forces by EI/L^2. Many independent
equilibria are computed at once.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from ...errors import SubsystemError
from .rod import Loads, RodData, actuators, cross, lengths, routing, transposed_ad

__all__ = ["Equilibrium", "equilibrium"]

_TOLERANCE = 1e-10  # smallest tolerance of the residual [1], scaled
_RTOL_FRACTION = 1e-2  # tolerance of the residual as a fraction of the integrator's rtol
_PERTURBATION = 1e-6  # of a scaled unknown, for the finite differences of the Jacobian
_DIVERGED = 1e5  # scaled residual, or change of the strain, above which Newton's method does not recover
_MAX_EVALUATIONS = 500  # of the derivatives along s in one shot; a hundred is usual


@dataclass(frozen=True)
class Equilibrium:
    """B equilibria of a rod with N TCAs at M stations."""

    s: np.ndarray  # stations (M,) [m], the last of them L
    p: np.ndarray  # position (3, M, B) [m]
    R: np.ndarray  # orientation (3, 3, M, B)
    xi: np.ndarray  # strain (6, M, B)
    delta: np.ndarray  # displacements of the TCAs (N, B) [m]
    N: np.ndarray  # tensions of the TCAs (N, B) [N]
    evaluations: int  # integrations along the rod, counted for each equilibrium


def equilibrium(
    data: RodData,
    loads: Loads,
    stations: np.ndarray | None = None,
    rtol: float = 1e-9,
    observe: Callable[[], None] = lambda: None,
) -> Equilibrium:
    """Solve for the equilibria under B loads.

    The loads are applied in equal increments, whose number is doubled while Newton's method fails.

    Parameters
    ----------
    loads : Loads
        The last axis of its arrays is B.
    stations : ndarray, optional
        Positions (M,) [m] of the output, the last of them L; by default L alone.
    rtol : float
        Relative tolerance of the integration along s.
    observe : callable
        Called before every integration along the rod; an exception that it raises ends the search.

    Raises
    ------
    SubsystemError
        No equilibrium was found with 64 increments.
    """
    loads = Loads(*(np.atleast_2d(np.asarray(x, dtype=float).T).T for x in vars(loads).values()))
    shoot = _Shooting(data, loads, rtol, observe)
    for increments in (1, 2, 4, 8, 16, 32, 64):
        z = np.zeros((6 + len(data.azimuth), loads.T.shape[1]))
        for share in np.arange(1, increments + 1) / increments:
            z, residual = _newton(shoot, z, float(share))
            if not residual <= shoot.tolerance:
                break
        else:
            return shoot.profile(z, np.array([data.length]) if stations is None else stations)
    raise SubsystemError(
        f"reference: no equilibrium found in {increments} load increments (residual {residual:.3g}): the rod may "
        "buckle; lower gravity, tip loads or temperatures"
    )


def _newton(shoot: _Shooting, z: np.ndarray, share: float) -> tuple[np.ndarray, float]:
    """Newton's method from z (6 + N, B): the last iterate and its largest residual."""
    count, batch = z.shape
    worst = np.inf
    for _ in range(12):
        tried = z[:, None, :] + _PERTURBATION * np.eye(count, count + 1, 1)[:, :, None]  # the first column is z itself
        residual = shoot.residual(tried.reshape(count, -1), share).reshape(count, count + 1, batch)
        worst = float(np.abs(residual[:, 0]).max())
        if not shoot.tolerance < worst < _DIVERGED:
            break
        jacobian = (residual[:, 1:] - residual[:, :1]) / _PERTURBATION
        z = z - np.linalg.solve(jacobian.transpose(2, 0, 1), residual[:, 0].T[:, :, None])[:, :, 0].T
    return z, worst


class _DivergedError(Exception):
    """The integration along the rod does not end: the strain grows without bound."""


class _Shooting:
    """Boundary-value problem of one rod under B loads, in scaled units."""

    def __init__(self, data: RodData, loads: Loads, rtol: float, observe: Callable[[], None]) -> None:
        self._data, self._loads, self._rtol, self._observe = data, loads, rtol, observe
        self.tolerance = max(_TOLERANCE, _RTOL_FRACTION * rtol)
        self._shots = 0
        self._force = data.stiffness[0] / data.length**2  # unit of force
        self._units = self._force * np.array([data.length] * 3 + [1.0] * 3)[:, None]

    def residual(self, z: np.ndarray, share: float) -> np.ndarray:
        """Evaluate the boundary conditions at the tip and the law of the TCAs, (6 + N, M).

        z (6 + N, M): scaled wrench at the clamp and tensions; M is a multiple of B, whose index runs fastest.
        """
        self._observe()
        self._shots += z.shape[1]
        data, repeat = self._data, z.shape[1] // self._loads.T.shape[1]
        force, moment = (np.tile(share * x, repeat) for x in (self._loads.force, self._loads.moment))
        cold = data.T_0 + share * (self._loads.T - data.T_0)
        end = self._integrate(z, share)[:, -1]
        R, W = end[3:12].reshape(3, 3, -1), end[12:18]
        pulled = np.concatenate([np.einsum("jib,jb->ib", R, moment), np.einsum("jib,jb->ib", R, force)]) / self._units
        delta = end[18:] * data.length - lengths(data)[:, None]
        tension = data.tensions(delta, np.tile(cold, repeat)) / self._force
        return np.concatenate([W - pulled, z[6:] - tension])

    def profile(self, z: np.ndarray, stations: np.ndarray) -> Equilibrium:
        """Evaluate the equilibria z at stations [m]."""
        path = self._integrate(z, 1.0, stations / self._data.length)
        p, R, W = path[:3], path[3:12], path[12:18]
        N = z[6:] * self._force
        xi = np.stack([self._strain(W[:, k], N, routing(self._data, s)) for k, s in enumerate(stations)], axis=1)
        delta = path[18:, -1] * self._data.length - lengths(self._data)[:, None]
        return Equilibrium(stations, p * self._data.length, R.reshape(3, 3, *R.shape[1:]), xi, delta, N, self._shots)

    def _integrate(self, z: np.ndarray, share: float, stations: np.ndarray | None = None) -> np.ndarray:
        """Integrate along the rod: p/L, R, W (scaled), int |u_i|/L at stations s/L or at the tip, (18 + N, M, B)."""
        data, batch = self._data, z.shape[1]
        gravity = share * np.tile(self._loads.gravity, batch // self._loads.gravity.shape[1])
        weight = data.weight * data.length / self._force
        N = z[6:] * self._force

        calls = itertools.count()

        def slope(x: float, flat: np.ndarray) -> np.ndarray:
            if next(calls) > _MAX_EVALUATIONS:
                raise _DivergedError
            y = flat.reshape(-1, batch)
            R, W = y[3:12].reshape(3, 3, batch), y[12:18]
            path = routing(data, x * data.length)
            xi = self._strain(W, N, path)
            pulled = weight * np.einsum("jib,jb->ib", R, gravity)
            bent = np.concatenate([xi[:3] * data.length, xi[3:]])  # scaled: d/dx with x = s/L
            turned = np.stack([cross(R[i], bent[:3]) for i in range(3)])  # rows of R kappa^
            change = transposed_ad(bent, W)
            change[3:] -= pulled
            sizes, _ = actuators(path, xi)
            return np.concatenate(
                [np.einsum("ijb,jb->ib", R, xi[3:]), turned.reshape(9, batch), change, sizes]
            ).reshape(-1)

        start = np.zeros((18 + len(data.azimuth), batch))
        start[[3, 7, 11]] = 1.0
        start[12:18] = z[:6]
        at = np.array([1.0]) if stations is None else stations
        try:
            solution = solve_ivp(
                slope, (0.0, 1.0), start.reshape(-1), "DOP853", at, rtol=self._rtol, atol=0.1 * self._rtol
            )
        except _DivergedError:
            return np.full((18 + len(data.azimuth), len(at), batch), np.inf)
        return solution.y.reshape(-1, batch, len(at)).transpose(0, 2, 1)

    def _strain(self, W: np.ndarray, N: np.ndarray, path: np.ndarray) -> np.ndarray:
        """Solve K (xi - xi*) + sum N_i [r_i x t_i; t_i] = W (scaled) for xi (6, B) by the chord method."""
        data = self._data
        K, rest, wanted = data.stiffness[:, None], data.rest[:, None], W * self._units
        _, gradient = actuators(path, np.repeat(rest, W.shape[1], axis=1))
        xi = rest + (wanted - (N * gradient).sum(axis=1)) / K
        size, gradient = actuators(path, xi)
        # The chord method suffices: the contribution of the tensions to the matrix hardly depends on the strain.
        inverse = np.linalg.inv(np.diag(data.stiffness) + _hessians(N / size, gradient[3:], path[0]))
        for _ in range(40):
            excess = K * (xi - rest) - wanted + (N * gradient).sum(axis=1)
            step = np.matmul(inverse, excess.T[:, :, None])[:, :, 0].T
            xi = xi - step
            change = np.abs(step[:3]).max() * data.length + np.abs(step[3:]).max()
            if change < 1e-3 * self.tolerance:
                break
            if not change < _DIVERGED:
                raise _DivergedError
            _, gradient = actuators(path, xi)
        return xi


def _hessians(shares: np.ndarray, t: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Matrix sum_i share_i B_i^T (1 - t_i t_i^T) B_i with B_i = [-r_i^, 1], (B, 6, 6).

    shares (N, B), t (3, N, B), r (3, N).
    """
    lever = np.zeros((r.shape[1], 3, 6))
    x, y, z = r
    lever[:, 0, 1], lever[:, 0, 2] = z, -y
    lever[:, 1, 0], lever[:, 1, 2] = -z, x
    lever[:, 2, 0], lever[:, 2, 1] = y, -x
    lever[:, [0, 1, 2], [3, 4, 5]] = 1.0
    along = np.matmul(t.transpose(1, 2, 0), lever)  # t^T B (N, B, 6)
    square = (lever.transpose(0, 2, 1) @ lever)[:, None]
    return (shares[:, :, None, None] * (square - along[..., :, None] * along[..., None, :])).sum(axis=0)
