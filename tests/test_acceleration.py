"""Iteration methods on loops with known answers: x = b + S x, eigenvalues of -S given, and the same with a cubic
term."""

from __future__ import annotations

import numpy as np
import pytest
from tca_cosim.cosim.acceleration import METHODS, IterationHistory, create, solve
from tca_cosim.cosim.acceleration.history import first_step

TOLERANCE = 1e-8


class Loop:
    """G(x) = b + S x - cubic x^3, S = -Q diag(gains) Q^T, with b that excites all eigenvectors alike; counts its
    evaluations."""

    def __init__(self, gains: list[float], cubic: float = 0.0) -> None:
        n = len(gains)
        q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(n, n)))
        self.matrix, self.cubic, self.b = -q @ np.diag(gains) @ q.T, cubic, q.sum(axis=1) / np.sqrt(n)
        self.count = 0
        self.last = np.zeros(n)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        self.count += 1
        self.last = x
        return self.b + self.matrix @ x - self.cubic * x**3

    def tangent(self) -> np.ndarray:
        """Return the Jacobian of the residual G(x) - x where it was evaluated last."""
        return self.matrix - np.eye(self.b.size) - np.diag(3.0 * self.cubic * self.last**2)


def run(loop: Loop, method: object, history: IterationHistory | None = None, limit: int = 200):
    n = loop.b.size
    history = history or IterationHistory(n)
    with np.errstate(over="ignore", invalid="ignore"):  # what diverges may do so to infinity
        return solve(loop, np.zeros(n), np.ones(n), method, history, TOLERANCE, limit, loop.tangent)


# Evaluations to 1e-8, the last one included, by the estimated true error. None: does not converge. relaxed: with the
# best omega, 2/(2 + least gain + largest gain); tangent: Newton with the Jacobian known.
COUNTS = [
    (
        "scalar 4",
        [4.0],
        0.0,
        {"plain": None, "relaxed": 2, "iqn": 3, "broyden": 3, "newton": 3, "tangent": 2},
    ),
    (
        "4, 4, 0.1",
        [4.0, 4.0, 0.1],
        0.0,
        {"plain": None, "relaxed": 43, "iqn": 4, "broyden": 5, "newton": 5, "tangent": 2},
    ),
    (
        "the same with a cubic",
        [4.0, 4.0, 0.1],
        0.4,
        {"plain": None, "iqn": 11, "broyden": 10, "newton": 17, "tangent": 10},
    ),
    (
        "weak",
        [0.25, 0.25, 0.01],
        0.0,
        {"plain": 14, "relaxed": 10, "iqn": 4, "broyden": 5, "newton": 5, "tangent": 2},
    ),
]


@pytest.mark.parametrize(
    ("gains", "cubic", "method", "most"),
    [(gains, cubic, *item) for _, gains, cubic, counts in COUNTS for item in counts.items()],
    ids=[f"{name}-{method}" for name, _, _, counts in COUNTS for method in counts],
)
def test_evaluations(gains: list[float], cubic: float, method: str, most: int | None) -> None:
    loop = Loop(gains, cubic)
    best = create("relaxed", 2.0 / (2.0 + min(gains) + max(gains)))
    outcome = run(loop, best if method == "relaxed" else create(method))
    if most is None:
        assert not outcome.converged
        return
    assert outcome.converged
    assert loop.count <= most
    assert np.abs(loop(outcome.x) - outcome.x).max() < 10.0 * TOLERANCE


@pytest.mark.parametrize(
    ("gains", "cubic", "most"),
    [([4.0], 0.0, 3), ([4.0, 4.0, 0.1], 0.0, 11), ([4.0, 4.0, 0.1], 0.4, 16), ([0.25, 0.25, 0.01], 0.0, 8)],
    ids=["scalar 4", "4, 4, 0.1", "the same with a cubic", "weak"],
)
def test_evaluations_of_aitken(gains: list[float], cubic: float, most: int) -> None:
    """Its steps swing with the mixture of eigenvectors: the median over right-hand sides of length 1 counts."""
    counts = []
    for seed in range(21):
        loop = Loop(gains, cubic)
        b = np.random.default_rng(seed).normal(size=len(gains))
        loop.b = b / np.linalg.norm(b)
        assert run(loop, create("aitken")).converged
        counts.append(loop.count)
    assert np.median(counts) <= most


def test_tangents_that_are_not_those_of_a_step_give_way_to_differences() -> None:
    """A loop with a past: its outputs do not follow at once, so the derivative at an instant is 0."""
    history, loop = IterationHistory(3), Loop([4.0, 4.0, 0.1])
    loop.tangent = lambda: -np.eye(3)
    assert run(loop, create("tangent"), history).converged
    assert loop.count <= 7  # one more than of Newton with differences
    loop.b, loop.count = -1.7 * loop.b, 0
    assert run(loop, create("tangent"), history).converged
    assert loop.count == 2


@pytest.mark.parametrize("contraction", [0.3, 0.5])
def test_tangents_that_halve_the_residual_are_kept(contraction: float) -> None:
    """Residual -x, Jacobian given too steep: each Newton step leaves a share of the residual, from 16 downwards."""
    history, method = IterationHistory(1), create("tangent")
    history.start_step(lambda: np.array([[-1.0 / (1.0 - contraction)]]))
    x = np.array([16.0])
    for _ in range(6):
        history.x.append(x)
        history.r.append(-x)
        x = x + method.update(history)
    assert x == pytest.approx(16.0 * contraction**6, rel=1e-12)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "plain"])
def test_scalar_loop_has_the_answer_b_over_1_plus_g(method: str) -> None:
    outcome = run(Loop([4.0]), create(method) if method != "relaxed" else create("relaxed", 0.3))
    assert outcome.x[0] == pytest.approx(1.0 / 5.0, abs=TOLERANCE)


@pytest.mark.parametrize("gain", [1.5, 4.0, 10.0])
def test_relaxation_converges_up_to_the_edge(gain: float) -> None:
    edge = 2.0 / (1.0 + gain)
    assert run(Loop([gain]), create("relaxed", 0.99 * edge), limit=3000).converged
    assert not run(Loop([gain]), create("relaxed", 1.01 * edge), limit=3000).converged
    assert len(run(Loop([gain]), create("relaxed", 1.0 / (1.0 + gain))).residuals) == 2


@pytest.mark.parametrize("method", ["iqn", "newton", "tangent", "broyden"])
def test_the_next_step_starts_from_what_was_learnt(method: str) -> None:
    history, loop = IterationHistory(1), Loop([4.0])
    run(loop, create(method), history)
    loop.b, loop.count = -1.7 * loop.b, 0
    assert run(loop, create(method), history).converged
    assert loop.count == 2


def test_the_error_estimated_is_the_true_error() -> None:
    """For a gain of -4 the error of the guess is a fifth of the residual, and four fifths are left in what the sweep
    gave."""
    history, loop = IterationHistory(1), Loop([4.0])
    run(loop, create("iqn"), history)
    np.testing.assert_allclose(history.secants.error(np.array([1.0])), 0.2, rtol=1e-10)
    assert history.secants.gain == pytest.approx(4.0)


def test_the_error_told_is_the_larger_of_guess_and_sweep() -> None:
    """For a gain of -4 what the sweep gave is off by four fifths of the residual."""
    outcome = run(Loop([4.0]), create("iqn"), limit=2)
    assert outcome.error == pytest.approx(0.8 * outcome.residuals[-1], rel=1e-6)


def test_a_first_step_is_no_longer_than_what_is_needed_to_learn() -> None:
    assert np.linalg.norm(first_step(0.5, np.array([30.0, 40.0]))) == pytest.approx(0.02)
    assert first_step(0.5, np.array([0.03, 0.0])) == pytest.approx([0.015, 0.0])


def test_gain_is_found_while_diverging() -> None:
    history = IterationHistory(3)
    outcome = run(Loop([3.2, 1.6, 1.6]), create("plain"), history)
    assert not outcome.converged
    assert history.secants.gain == pytest.approx(3.2, rel=1e-3)


def test_at_most_n_columns_and_none_dependent() -> None:
    history, loop = IterationHistory(3), Loop([4.0, 4.0, 0.1], cubic=0.4)
    for _ in range(5):
        run(loop, create("iqn"), history)
        loop.b = loop.b * 1.05
    v = np.array([column[: history.secants.size] for column in history.secants.columns])
    assert 1 <= len(v) <= 3
    assert np.linalg.svd(v, compute_uv=False)[-1] > 1e-4


def test_a_column_is_kept_where_it_adds_a_direction() -> None:
    """The filter lies between a hundredth and a thousandth of a column's length."""
    for tilt, columns in ((1e-2, 2), (1e-3, 1)):
        secants = IterationHistory(2).secants
        for dr in (np.array([1.0, 0.0]), np.array([1.0, tilt])):
            secants.add(dr, dr)
        assert len(secants.columns) == columns


def test_not_a_number_ends_at_once() -> None:
    outcome = solve(lambda x: x * np.nan, np.zeros(2), np.ones(2), create("iqn"), IterationHistory(2), TOLERANCE, 50)
    assert not outcome.converged
    assert len(outcome.residuals) == 1
