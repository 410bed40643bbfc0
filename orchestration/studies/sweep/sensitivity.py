"""Sensitivity of outputs to parameters: Spearman's rank correlation from any design, Sobol' indices from `saltelli`."""

from __future__ import annotations

import warnings

import numpy as np
from scipy import stats

from .design import saltelli_base

__all__ = ["rank_correlation", "sobol_indices"]


def rank_correlation(settings: np.ndarray, outputs: np.ndarray) -> np.ndarray:
    """Spearman's rank correlation (parameters, columns), nan where nothing varies.

    settings: (runs, parameters); outputs: (runs, columns).
    """
    parameters, columns = settings.shape[1], outputs.shape[1]
    if len(settings) < 3:
        return np.full((parameters, columns), np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", stats.ConstantInputWarning)
        ranks = [stats.rankdata(values, axis=0) for values in (settings, outputs)]
        x, y = (rank - rank.mean(axis=0) for rank in ranks)
        with np.errstate(invalid="ignore", divide="ignore"):
            return (x.T @ y) / np.sqrt(np.outer((x * x).sum(axis=0), (y * y).sum(axis=0)))


def sobol_indices(parameters: int, outputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sobol' indices of first and total order, (parameters, columns) each; nan where nothing varies or a run failed.

    outputs: (n (parameters + 2), columns) in the order of the design `saltelli`.
    """
    n = saltelli_base(len(outputs), parameters)
    blocks = outputs.reshape(parameters + 2, n, -1)
    first, total = (np.full((parameters, outputs.shape[1]), np.nan) for _ in range(2))
    good = np.isfinite(outputs).all(axis=0) & (np.ptp(outputs, axis=0) > 0.0)
    if good.any():
        f_A, f_B, *f_AB = (block[:, good].T for block in blocks)
        indices = stats.sobol_indices(func={"f_A": f_A, "f_B": f_B, "f_AB": np.array(f_AB)}, n=n)
        first[:, good] = indices.first_order.reshape(-1, parameters).T  # scipy leaves out the dimension of one output
        total[:, good] = indices.total_order.reshape(-1, parameters).T
    return first, total
