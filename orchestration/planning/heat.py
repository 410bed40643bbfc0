"""Heat of a manipulator's cross-sections (section.py) together, with exact steps between knots.

For powers that are constant between knots the solution there is exact:

    x_{k+1} = F x_k + G P_k + f.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, expm

from ..scene import Scene
from .manipulator import Manipulator
from .section import HOTTEST, Section

__all__ = ["HOTTEST", "Electrics", "HeatModel", "Hottest", "KnotModel"]


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


@dataclass(frozen=True)
class Electrics:
    """Resistances R(T, delta) of N TCAs.

    Attributes
    ----------
    R : ndarray, shape (N,)
        At T_ref [ohm].
    alpha : ndarray, shape (N,)
        Derivatives by the temperature, relative [1/K].
    strain : ndarray, shape (N, n)
        Derivatives by the displacements of the rod's TCAs, relative [1/m].
    T_ref : ndarray, shape (N,)
        [K]
    """

    R: np.ndarray
    alpha: np.ndarray
    strain: np.ndarray
    T_ref: np.ndarray

    @property
    def has_feedback(self) -> bool:
        """Whether the resistances change."""
        return bool(self.alpha.any() or self.strain.any())

    def at(self, temperatures: np.ndarray, displacements: np.ndarray) -> np.ndarray:
        """Return the resistances (..., N) at temperatures (..., N) [K] and displacements (..., n) [m]."""
        relative = self.alpha * (temperatures - self.T_ref) + displacements @ self.strain.T
        return np.asarray(self.R * (1.0 + relative))


class HeatModel:
    """Temperatures of a manipulator's N TCAs as a linear system; use as a context manager.

    Parameters
    ----------
    scene : Scene
        With a rod and thermal FMUs of this project.

    Attributes
    ----------
    A, B, C, offset : ndarray, shapes (n, n), (n, N), (N, n), (n,)
        Of all sections one after the other, see section.py; offset is a.
    T_start : ndarray, shape (N,)
        Temperatures at the start [K].
    gain : ndarray, shape (N, N)
        Steady rise of temperature per power [K/W].
    T_rest : ndarray, shape (N,)
        Steady temperatures without power [K].
    electrics : Electrics

    Raises
    ------
    SceneError
        The scene is no manipulator, see Manipulator.of, or its convection depends on the temperature.
    """

    def __init__(self, scene: Scene) -> None:
        manipulator = Manipulator.of(scene)
        self._stack = contextlib.ExitStack()
        self._sections = []
        with contextlib.ExitStack() as opened:
            for member in manipulator.sections:
                self._sections.append(Section(member, scene.start_time))
                opened.callback(self._sections[-1].close)
            self._stack = opened.pop_all()
        self.A, self.B, self.C = (block_diag(*(getattr(s, key) for s in self._sections)) for key in "ABC")
        self.offset = np.concatenate([s.offset for s in self._sections])
        self.T_start = np.concatenate([s.T_start for s in self._sections])
        self.gain = -self.C @ np.linalg.solve(self.A, self.B)
        self.T_rest = self.T_start - self.C @ np.linalg.solve(self.A, self.offset)
        parameters = [s.parameters for s in self._sections]
        beta = np.concatenate([np.array(p.beta) / p.geometry.length for p in parameters])
        self.electrics = Electrics(
            R=np.concatenate([p.resistance for p in parameters]),
            alpha=np.concatenate([p.alpha for p in parameters]),
            strain=beta[:, None] * manipulator.straining,
            T_ref=np.repeat([p.T_ref for p in parameters], [len(p.resistance) for p in parameters]),
        )
        self._columns = np.split(np.arange(len(self.T_start)), np.cumsum([len(s.T_start) for s in self._sections])[:-1])
        self._modes = np.split(np.arange(len(self.A)), np.cumsum([len(s.A) for s in self._sections])[:-1])

    def __enter__(self) -> HeatModel:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the FMUs."""
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
        """Return how much hotter than its mean the hottest point of each TCA gets by its own power (N,) [K/W]."""
        return np.concatenate([section.local_rise() for section in self._sections])

    def hottest(self, powers: np.ndarray, distance: float, limit: float) -> list[Hottest]:
        """Return the knots at which the hottest point of a section is above a limit.

        Parameters
        ----------
        powers : ndarray, shape (K, N)
            [W]
        distance : float
            Of the knots [s].
        limit : float
            [K]
        """
        volts = np.sqrt(np.maximum(powers, 0.0) * self.electrics.R)
        hottest = []
        for section, columns, modes in zip(self._sections, self._columns, self._modes, strict=True):
            for knot, value, slopes in section.hottest(volts[:, columns], distance, limit):
                gradient = np.zeros(len(self.A))
                gradient[modes] = slopes
                hottest.append(Hottest(knot, value, gradient))
        return hottest


@dataclass(frozen=True)
class Hottest:
    """The hottest temperature of a section at a knot [K] and its derivatives by the modes (n,)."""

    knot: int
    value: float
    gradient: np.ndarray
