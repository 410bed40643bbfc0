"""Equilibrium by shooting (Eqs. 5 to 16 without inertia): from s = 0 the pose and the wrench are integrated to s = L by
DOP853, the strain at every s found from the wrench; unknown are the wrench at the clamp and the TCAs' tensions.

    g' = g xi^,  W' = ad_xi^T W - rho A [0; R^T g],  delta_i' = |u_i|;  W(L) = W_tip,  N_i = k (delta_i - chi stroke_i)

Lengths are divided by L, forces by EI/L^2. Many equilibria are found at once; each is independent of the others."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from ...errors import SubsystemError
from .rod import Loads, RodData, actuators, cross, lengths, routing, transposed_ad

__all__ = ["Equilibrium", "equilibrium"]

_TOLERANCE = 1e-10  # of the residual, in the scaled units; at least
_SHARE = 1e-2  # of rtol, likewise
_PERTURBATION = 1e-6
_WILD = 1e5  # a residual, or a change of the strain, from which Newton will not come back
_LIMIT = 500  # slopes along s of one shot; a hundred is usual


@dataclass(frozen=True)
class Equilibrium:
    """B equilibria at M places s (M,) [m], the last of them L: p (3, M, B) [m], R (3, 3, M, B), xi (6, M, B); delta (N,
    B) [m], N (N, B) [N]."""

    s: np.ndarray
    p: np.ndarray
    R: np.ndarray
    xi: np.ndarray
    delta: np.ndarray
    N: np.ndarray
    evaluations: int  # shots through the rod, one equilibrium's each


def equilibrium(
    data: RodData,
    loads: Loads,
    places: np.ndarray | None = None,
    rtol: float = 1e-9,
    watch: Callable[[], None] = lambda: None,
) -> Equilibrium:
    """loads with a last axis of B; the loads are put on in shares, ever smaller while Newton's method fails. watch is
    called at every shot. Raises SubsystemError where it fails still."""
    loads = Loads(*(np.atleast_2d(np.asarray(x, dtype=float).T).T for x in vars(loads).values()))
    shoot = _Shooting(data, loads, rtol, watch)
    for shares in (1, 2, 4, 8, 16, 32, 64):
        z = np.zeros((6 + len(data.azimuth), loads.T.shape[1]))
        for share in np.arange(1, shares + 1) / shares:
            z, residual = _newton(shoot, z, float(share))
            if not residual <= shoot.tolerance:
                break
        else:
            return shoot.profile(z, np.array([data.length]) if places is None else places)
    raise SubsystemError(
        f"reference: no equilibrium found in {shares} shares of the loads (residual {residual:.3g}): the rod may "
        "buckle; lower gravity, tip loads or temperatures"
    )


def _newton(shoot: _Shooting, z: np.ndarray, share: float) -> tuple[np.ndarray, float]:
    """z (6 + N, B) after it, and the largest residual."""
    count, batch = z.shape
    worst = np.inf
    for _ in range(12):
        tried = z[:, None, :] + _PERTURBATION * np.eye(count, count + 1, 1)[:, :, None]  # the first is z itself
        residual = shoot.residual(tried.reshape(count, -1), share).reshape(count, count + 1, batch)
        worst = float(np.abs(residual[:, 0]).max())
        if not shoot.tolerance < worst < _WILD:
            break
        jacobian = (residual[:, 1:] - residual[:, :1]) / _PERTURBATION
        z = z - np.linalg.solve(jacobian.transpose(2, 0, 1), residual[:, 0].T[:, :, None])[:, :, 0].T
    return z, worst


class _WildError(Exception):
    """The rod curls up without end: no wrench to go on from."""


class _Shooting:
    def __init__(self, data: RodData, loads: Loads, rtol: float, watch: Callable[[], None]) -> None:
        self._data, self._loads, self._rtol, self._watch = data, loads, rtol, watch
        self.tolerance = max(_TOLERANCE, _SHARE * rtol)
        self._shots = 0
        self._force = data.stiffness[0] / data.length**2  # unit of force
        self._units = self._force * np.array([data.length] * 3 + [1.0] * 3)[:, None]

    def residual(self, z: np.ndarray, share: float) -> np.ndarray:
        """z (6 + N, M): scaled wrench at the clamp and tensions; M is a multiple of the number of loads, whose index
        runs fastest. (6 + N, M)"""
        self._watch()
        self._shots += z.shape[1]
        data, repeat = self._data, z.shape[1] // self._loads.T.shape[1]
        force, moment = (np.tile(share * x, repeat) for x in (self._loads.force, self._loads.moment))
        cold = data.T_0 + share * (self._loads.T - data.T_0)
        end = self._integrate(z, share)[:, -1]
        R, W = end[3:12].reshape(3, 3, -1), end[12:18]
        pulled = np.concatenate([np.einsum("jib,jb->ib", R, moment), np.einsum("jib,jb->ib", R, force)]) / self._units
        delta = end[18:] * data.length - lengths(data)[:, None]
        tension = data.tca_stiffness * (delta - np.tile(data.stroke(cold), repeat)) / self._force
        return np.concatenate([W - pulled, z[6:] - tension])

    def profile(self, z: np.ndarray, places: np.ndarray) -> Equilibrium:
        path = self._integrate(z, 1.0, places / self._data.length)
        p, R, W = path[:3], path[3:12], path[12:18]
        N = z[6:] * self._force
        xi = np.stack([self._strain(W[:, k], N, routing(self._data, s)) for k, s in enumerate(places)], axis=1)
        delta = path[18:, -1] * self._data.length - lengths(self._data)[:, None]
        return Equilibrium(places, p * self._data.length, R.reshape(3, 3, *R.shape[1:]), xi, delta, N, self._shots)

    def _integrate(self, z: np.ndarray, share: float, places: np.ndarray | None = None) -> np.ndarray:
        """Rows p/L, R, W (scaled), sum |u_i|/L at the places or at the end: (18 + N, M, columns)."""
        data, batch = self._data, z.shape[1]
        gravity = share * np.tile(self._loads.gravity, batch // self._loads.gravity.shape[1])
        weight = data.weight * data.length / self._force
        N = z[6:] * self._force

        calls = itertools.count()

        def slope(x: float, flat: np.ndarray) -> np.ndarray:
            if next(calls) > _LIMIT:
                raise _WildError
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
        at = np.array([1.0]) if places is None else places
        try:
            found = solve_ivp(
                slope, (0.0, 1.0), start.reshape(-1), "DOP853", at, rtol=self._rtol, atol=0.1 * self._rtol
            )
        except _WildError:
            return np.full((18 + len(data.azimuth), len(at), batch), np.inf)
        return found.y.reshape(-1, batch, len(at)).transpose(0, 2, 1)

    def _strain(self, W: np.ndarray, N: np.ndarray, path: np.ndarray) -> np.ndarray:
        """xi (6, B) with K (xi - xi*) + sum N_i [r_i x t_i; t_i] = W (scaled), by a chord method."""
        data = self._data
        K, rest, wanted = data.stiffness[:, None], data.rest[:, None], W * self._units
        _, gradient = actuators(path, np.repeat(rest, W.shape[1], axis=1))
        xi = rest + (wanted - (N * gradient).sum(axis=1)) / K
        size, gradient = actuators(path, xi)
        # The tensions' share of the matrix hardly changes with the strain.
        inverse = np.linalg.inv(np.diag(data.stiffness) + _hessians(N / size, gradient[3:], path[0]))
        for _ in range(40):
            excess = K * (xi - rest) - wanted + (N * gradient).sum(axis=1)
            step = np.matmul(inverse, excess.T[:, :, None])[:, :, 0].T
            xi = xi - step
            change = np.abs(step[:3]).max() * data.length + np.abs(step[3:]).max()
            if change < 1e-3 * self.tolerance:
                break
            if not change < _WILD:
                raise _WildError
            _, gradient = actuators(path, xi)
        return xi


def _hessians(shares: np.ndarray, t: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Sum of share_i B_i^T (1 - t_i t_i^T) B_i, B_i = [-r_i^, 1]: of shares (N, B), t (3, N, B), r (3, N); (B, 6, 6)"""
    lever = np.zeros((r.shape[1], 3, 6))
    x, y, z = r
    lever[:, 0, 1], lever[:, 0, 2] = z, -y
    lever[:, 1, 0], lever[:, 1, 2] = -z, x
    lever[:, 2, 0], lever[:, 2, 1] = y, -x
    lever[:, [0, 1, 2], [3, 4, 5]] = 1.0
    along = np.matmul(t.transpose(1, 2, 0), lever)  # t^T B (N, B, 6)
    square = (lever.transpose(0, 2, 1) @ lever)[:, None]
    return (shares[:, :, None, None] * (square - along[..., :, None] * along[..., None, :])).sum(axis=0)
