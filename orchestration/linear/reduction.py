"""Order reduction of a stable linear model by balanced truncation.

Inputs, outputs and time keep their units; errors are weighed in nominal sizes of the outputs per nominal size of the
inputs. The largest gain of the error over all frequencies is at most twice the sum of the Hankel singular values that
are cut off (Antoulas, Approximation of Large-Scale Dynamical Systems, 2005, section 7.2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_lyapunov, svd

from ..errors import SceneError
from .model import LinearModel, Quantity

__all__ = ["balanced_truncation", "hankel_singular_values", "minimal_structure"]


def hankel_singular_values(model: LinearModel) -> np.ndarray:
    """Return the Hankel singular values (n,) in nominal units, decreasing. Raises SceneError as below."""
    model = minimal_structure(model)
    return _balance(model)[1] if len(model.A) else np.zeros(0)


def minimal_structure(model: LinearModel) -> LinearModel:
    """Return the model without states that no input reaches or that reach no output, as the zeros of A, B, C say."""
    acts = model.A != 0.0
    reached, seen = np.any(model.B != 0.0, axis=1), np.any(model.C != 0.0, axis=0)
    for _ in range(len(acts)):
        reached, seen = reached | (acts @ reached), seen | (acts.T @ seen)
    k = np.flatnonzero(reached & seen)
    return replace(
        model,
        A=model.A[np.ix_(k, k)],
        B=model.B[k],
        C=model.C[:, k],
        states=tuple(model.states[i] for i in k),
        x_0=model.x_0[k],
        drift=model.drift[k],
    )


def balanced_truncation(model: LinearModel, order: int | None = None, tolerance: float | None = None) -> LinearModel:
    """Return a model with fewer states.

    Parameters
    ----------
    model : LinearModel
        All poles of what connects inputs and outputs in the open left half plane.
    order : int, optional
        Number of states.
    tolerance : float, optional
        Bound of the error's gain as a share of the largest Hankel singular value, instead of `order`. Default: 1e-6.

    Returns
    -------
    LinearModel
        With states z[k] of unit 1; `notes` says the bound of the error.

    Raises
    ------
    SceneError
        The model has a pole on or right of the imaginary axis, `order` is not in 1..n, `tolerance` not between 0 and 1,
        or both are given.
    """
    if order is not None and tolerance is not None:
        raise SceneError(f"order = {order} and tolerance = {tolerance:g}: each decides alone; give one of them")
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise SceneError(f"tolerance = {tolerance:g}: give a share between 0 and 1, such as 1e-4")
    model = minimal_structure(model)
    n = len(model.A)
    if not n:
        raise SceneError("no state connects these inputs and outputs, so there is nothing to reduce; choose others")
    if order is not None and order not in range(1, n + 1):
        raise SceneError(f"order = {order}: the model has {n} states; give 1 to {n}")
    left, values, right = _balance(model)
    bounds = 2.0 * np.append(np.cumsum(values[::-1])[::-1][1:], 0.0)  # of k + 1 states
    positive = int(np.sum(values > np.finfo(float).eps * values[0])) if values[0] > 0.0 else 1
    if order is None:
        wanted = (1e-6 if tolerance is None else tolerance) * values[0]
        order = int(np.argmax(bounds <= wanted)) + 1
    order = min(order, positive)
    T, W = right[:, :order], left[:, :order].T
    return replace(
        model,
        A=W @ model.A @ T,
        B=W @ model.B,
        C=model.C @ T,
        states=tuple(Quantity(f"z[{k + 1}]", "1") for k in range(order)),
        x_0=W @ model.x_0,
        drift=W @ model.drift,
        notes=(
            *model.notes,
            f"balanced truncation from {n} to {order} states: the error's gain is at most {bounds[order - 1]:.3g} "
            "nominal outputs per nominal input",
        ),
    )


def _balance(model: LinearModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return W (n, n), Hankel singular values (n,) and T (n, n) with W^T T = 1 on those that are not 0.

    The square-root method: with the Gramians P = L L^T, Q = M M^T and M^T L = U S V^T, W = M U S^-1/2, T = L V S^-1/2.
    """
    poles = np.linalg.eigvals(model.A)
    integrators = np.flatnonzero(~np.any(model.A != 0.0, axis=0))
    if integrators.size:
        follow = np.any(model.C[:, integrators] != 0.0, axis=1)
        outputs = ", ".join(q.name for q, follows in zip(model.outputs, follow, strict=True) if follows)
        raise SceneError(
            f"{', '.join(model.states[k].name for k in integrators)}: an integral, which never settles, so the model "
            f"cannot be balanced; choose outputs (--output) without {outputs}"
        )
    if poles.real.max() >= 0.0:
        raise SceneError(
            f"a pole at {poles.real.max():.3g} 1/s is not stable, so the model cannot be balanced; give the rod "
            "damping (rod.body.retardation), or linearise it at a stable equilibrium"
        )
    scale = np.array([q.nominal for q in model.states])
    A = model.A * scale / scale[:, None]
    B = model.B * [q.nominal for q in model.inputs] / scale[:, None]
    C = model.C * scale / np.array([q.nominal for q in model.outputs])[:, None]
    L = _factor(solve_continuous_lyapunov(A, -B @ B.T))
    M = _factor(solve_continuous_lyapunov(A.T, -C.T @ C))
    U, values, Vt = svd(M.T @ L)
    safe = np.maximum(values, np.finfo(float).tiny)
    return (M @ U / np.sqrt(safe)) / scale[:, None], values, (L @ Vt.T / np.sqrt(safe)) * scale[:, None]


def _factor(gramian: np.ndarray) -> np.ndarray:
    """Return F with F F^T = gramian, up to rounding below 0."""
    try:
        values, vectors = np.linalg.eigh(0.5 * (gramian + gramian.T))
    except LinAlgError as error:
        raise SceneError(f"the Gramian of the model cannot be factored: {error}") from error
    return vectors * np.sqrt(np.maximum(values, 0.0))
