"""Dead forces of random size and direction at the tip: every equilibrium that the quasi-static rod accepts must be one
of the moving rod too, stable, and where damped motion from the unloaded shape comes to rest.

`python tests/random_loads.py COUNT [SEED]` runs a campaign by hand; test_random_loads.py runs a sample. Both judges are
independent of the solver: the equations of motion as model exchange, linearised by their exact derivatives, and the
moving rod with much damping."""

from __future__ import annotations

import random
import sys
from collections import Counter

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu_host import SUBJECTS, FMU2Host, FMU2Model

ROD = next(subject.path for subject in SUBJECTS if subject.name == "rod")
LARGEST = 0.3  # force [N]; the cold rod buckles at 0.053
GROWTH = 1e-3  # rate [1/s] up to which a deviation is taken not to grow: a buckled round rod turns at no cost
MOVED = 1e-6  # distance [1] of a strain coefficient to the equilibrium of the moving rod, by one Newton step
RETARDATION = 0.05  # of the damped motion [s]: ten times that of silicone, so that inertia moves it little
DURATION = 150.0  # of the damped motion [s]; near buckling it takes some hundred times the retardation
APART = 1e-6  # distance [m] of the tip and of points of the centreline to the end of the damped motion
FORCE = [f"tip_force[{k}]" for k in (1, 2, 3)]


def drawn(seed: int) -> tuple[int, np.ndarray]:
    """Order of the strain polynomials, 2 to 7, and force [N], (3,)."""
    chance = random.Random(seed)
    order, size = chance.randint(2, 7), LARGEST * chance.random()
    direction = np.array([chance.gauss(0.0, 1.0) for _ in range(3)])
    return order, size * direction / np.linalg.norm(direction)


def write(
    fmu: FMU2Host | FMU2Model, order: int, force: np.ndarray, dynamic: bool, retardation: float | None = None
) -> None:
    """From a new instance to a rod under the force."""
    fmu.reset()
    if retardation is not None:
        fmu.write("body.retardation", retardation)
    fmu.setInteger(fmu.references(["order"]), [order])
    fmu.setBoolean(fmu.references(["dynamic"]), [dynamic])
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.setReal(fmu.references(FORCE), list(force))


def judged(model: FMU2Model, order: int, force: np.ndarray, strains: list[str], values: list[float]) -> list[str]:
    """What is wrong with strains as a stable equilibrium of the moving rod."""
    write(model, order, force, dynamic=True)
    model.newDiscreteStates()
    model.enterContinuousTimeMode()
    names = [row.derivative.name for row in model.derivative_rows]
    position = [names.index(name) for name in strains]
    velocity = [names.index(name.replace("strain[", "strain_rate[")) for name in strains]
    states = np.zeros(len(names))
    states[position] = values
    model.put(states)
    used = 6 * (order + 1)
    rates = [model.rate_references[k] for k in velocity[:used]]

    def slopes(columns: list[int]) -> np.ndarray:
        known = [model.state_references[k] for k in columns]
        return np.array([model.getDirectionalDerivative(rates, [each], [1.0]) for each in known]).T

    stiffness, damping = slopes(position[:used]), slopes(velocity[:used])
    growth = np.linalg.eigvals(np.block([[np.zeros((used, used)), np.eye(used)], [stiffness, damping]])).real.max()
    moved = np.abs(np.linalg.solve(stiffness, model.rates()[velocity[:used]])).max()
    wrong = []
    if growth > GROWTH:
        wrong.append(f"unstable: a deviation grows at {growth:.3g} 1/s")
    if moved > MOVED:
        wrong.append(f"no equilibrium: a strain is {moved:.2g} away")
    return wrong


def distance_to_damped_motion(still: FMU2Host, moving: FMU2Host, order: int, force: np.ndarray) -> float:
    """Largest distance [m] of tip and centreline between the equilibrium of `still` and the end of damped motion."""
    write(moving, order, force, dynamic=True, retardation=RETARDATION)
    moving.step(0.0, DURATION)
    points = [name for name in still.outputs if name.startswith(("tip.p[", "shape.p["))]
    ends = [np.array(fmu.getReal(fmu.references(points))).reshape(-1, 3) for fmu in (still, moving)]
    return float(np.linalg.norm(ends[0] - ends[1], axis=1).max())


def campaign(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Counts by outcome, and what is wrong, by the seed of its draw."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    with FMU2Host(ROD) as still, FMU2Host(ROD) as moving, FMU2Model(ROD) as model:
        strains = [n for row in model.derivative_rows if (n := row.derivative.name).startswith("strain[")]
        for number in range(seed, seed + count):
            order, force = drawn(number)
            write(still, order, force, dynamic=False)
            still.messages.clear()
            still.worst = 0
            try:
                still.step(0.0, 0.1)
            except FMICallException:
                counts["refused"] += 1
                continue
            counts["accepted with a warning" if still.worst else "accepted"] += 1
            values = still.getReal(still.references(strains))
            wrong += [f"{number}: {problem}" for problem in judged(model, order, force, strains, values)]
            if (apart := distance_to_damped_motion(still, moving, order, force)) > APART:
                wrong.append(f"{number}: damped motion ends {apart:.2g} m away")
    return counts, wrong


if __name__ == "__main__":
    totals, actual = campaign(int(sys.argv[1]), int((sys.argv[2:] or [0])[0]))
    for what, often in sorted(totals.items()):
        print(f"{often:8} {what}")
    print(f"{len(actual):8} wrong", *actual, sep="\n  ")
