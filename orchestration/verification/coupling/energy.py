"""Power bonds of a system and the energy that the coupling adds to them or takes from them.

Two members share a power bond where each gives the other one quantity and the product of both is a power: V and A, N
and m/s, K and W/K. Over a macro step, the power that one side gives, from its output and the input that it used, and
the power that the other side takes differ by what the coupling itself adds.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...cosim.topology import Connection
from ...fmi.variables import Variable
from ...scene import Scene
from ...simulation import recorded_variables
from .runs import CoupledRun

__all__ = ["PowerBond", "find_bonds", "power_bonds"]

_WATT = {"kg": 1, "m": 2, "s": -3}
_SHRINKS = 0.75  # largest ratio of the shares of two steps, one half of the other, that vanish; 0.5 at order 1


@dataclass(frozen=True)
class PowerBond:
    """A power bond and its balance.

    Parameters
    ----------
    forward, backward : Connection
        The two connections.
    shares : tuple of float
        Energy that the coupling adds or takes over that which the bond carries, for each run.
    closed : bool
        Whether the share is small or shrinks with the macro step.
    text : str
        The balance in words.
    """

    forward: Connection
    backward: Connection
    shares: tuple[float, ...]
    closed: bool
    text: str


def find_bonds(scene: Scene) -> list[tuple[Connection, Connection]]:
    """The pairs of connections whose units make them a power bond; each connection in one pair at most.

    Where units allow several pairs, the names of the ports decide: on each side of a bond both variables have one
    prefix and one number, as in port.v[2] and port.i[2]. Connections that can still be paired in several ways are in
    no pair.
    """
    candidates = [
        pair
        for pair in itertools.combinations([c for c in scene.connections if c.terms == 1], 2)
        if _opposite(*pair) and _product(*(_variable(scene, *c.source).dimension for c in pair)) == _WATT
    ]
    pairs, used = [], set[Connection]()
    for sides in (2, 1, 0):
        level = [pair for pair in candidates if _matching_sides(*pair) == sides and not used & set(pair)]
        often = Counter(itertools.chain(*level))
        pairs += [pair for pair in level if all(often[connection] == 1 for connection in pair)]
        used |= set(often)
    return sorted(pairs, key=candidates.index)


def power_bonds(scene: Scene, runs: Sequence[CoupledRun], tolerance: float) -> list[PowerBond]:
    """The power bonds of a scene with their balance in each complete run, the coarsest first."""
    bonds = []
    for forward, backward in find_bonds(scene):
        shares = tuple(_share(scene, run, forward, backward) for run in runs if run.complete)
        shrinking = len(shares) > 1 and shares[-1] <= _SHRINKS * shares[-2]
        closed = not shares or shares[-1] <= tolerance or shrinking
        listed = ", ".join(f"{100.0 * share:.2g} %" for share in shares) or "unknown"
        text = f"the coupling adds or takes {listed} of the energy carried as the step is halved"
        if not closed:
            text += ": it does not vanish with the step, so both sides do not mean the same quantities"
        bonds.append(PowerBond(forward, backward, shares, closed, text))
    return bonds


def _share(scene: Scene, run: CoupledRun, forward: Connection, backward: Connection) -> float:
    """The sum of |P_given - P_taken| over that of |P_given|, both in W."""
    delivered = _course(scene, run, *forward.source) * _course(scene, run, *backward.target)
    received = _course(scene, run, *forward.target) * _course(scene, run, *backward.source)
    lengths = np.diff(run.times)
    total = float(np.sum(np.abs(delivered[1:]) * lengths))
    off = float(np.sum(np.abs(delivered[1:] - received[1:]) * lengths))
    return off / total if total > 0.0 else 0.0 if off == 0.0 else np.inf


def _course(scene: Scene, run: CoupledRun, member: str, variable: str) -> np.ndarray:
    """Course (n,) of a variable in SI units."""
    names = [v.name for v in recorded_variables(scene.member(member))]
    declared = _variable(scene, member, variable)
    return declared.factor * run.records[member][:, names.index(variable)] + declared.offset


def _variable(scene: Scene, member: str, name: str) -> Variable:
    return scene.member(member).archive.variables[name]


def _product(a: Mapping[str, int] | None, b: Mapping[str, int] | None) -> dict[str, int] | None:
    """Dimension of a product; None where one is unknown."""
    if a is None or b is None:
        return None
    exponents = {unit: a.get(unit, 0) + b.get(unit, 0) for unit in {*a, *b} if unit != "rad"}
    return {unit: power for unit, power in exponents.items() if power}


def _opposite(forward: Connection, backward: Connection) -> bool:
    """Whether two connections lead from one member to another one and back."""
    there = (forward.source[0], forward.target[0])
    return there[0] != there[1] and there == (backward.target[0], backward.source[0])


def _matching_sides(forward: Connection, backward: Connection) -> int:
    """Number of members, 0 to 2, on which the names of both variables belong to one port."""
    sides = ((forward.source[1], backward.target[1]), (forward.target[1], backward.source[1]))
    return sum(_port(a) == _port(b) for a, b in sides)


def _port(name: str) -> tuple[str, tuple[str, ...]]:
    """What the variables of one port share: the name up to its last dot, and the numbers after it."""
    prefix, _, last = name.rpartition(".")
    return prefix, tuple(re.findall(r"\d+", last))
