"""rod.fmu against solutions that share no code with it, its loop gain, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
import tca_cosim as tca
from fmpy.fmi1 import FMICallException
from fmu_host import ROOT, FMU2Host
from scipy.linalg import expm
from scipy.optimize import root
from scipy.spatial.transform import Rotation

ROD = ROOT / "fmus/rod.fmu"
LENGTH, RADIUS, E, OFFSET = 0.04, 0.005, 37.8e3, 0.0025
STIFFNESS, STROKE_40 = 79.53784571, 7.95321637e-3  # of one TCA [N/m]; free stroke at +40 K [m]
POSITIONS = [OFFSET * np.array([math.cos(a), math.sin(a), 0.0]) for a in np.arange(3) * 2 * np.pi / 3]


def free_stroke(kelvin: float) -> float:
    """The stroke is proportional to 1 - d0/d with d = d0 (1 + rho_T dT)."""
    share = lambda dT: 6.5e-4 * dT / (1 + 6.5e-4 * dT)  # noqa: E731
    return STROKE_40 * share(kelvin) / share(40.0)


def constant_strain(kelvin: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacements [m], tip position [m] and rotation matrix of the unloaded rod: the six algebraic equations
    K (xi - xi*) + sum N [r x t; t] = 0, by scipy."""
    area, second = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4
    G = E / 3
    K = np.array([E * second, E * second, 2 * G * second, G * area, G * area, E * area])
    rest = np.array([0, 0, 0, 0, 0, 1.0])

    def displacement(xi: np.ndarray) -> np.ndarray:
        return np.array([LENGTH * (np.linalg.norm(xi[3:] + np.cross(xi[:3], r)) - 1) for r in POSITIONS])

    def balance(xi: np.ndarray) -> np.ndarray:
        total = K * (xi - rest)
        for r, delta, dT in zip(POSITIONS, displacement(xi), kelvin, strict=True):
            u = xi[3:] + np.cross(xi[:3], r)
            force = STIFFNESS * (delta - free_stroke(dT)) * u / np.linalg.norm(u)
            total += np.concatenate([np.cross(r, force), force])
        return total / K

    xi = root(balance, rest, tol=1e-12).x
    kappa, direction = xi[:3], xi[3:]
    hat = np.array([[0, -kappa[2], kappa[1]], [kappa[2], 0, -kappa[0]], [-kappa[1], kappa[0], 0]])
    pose = expm(LENGTH * np.block([[hat, direction[:, None]], [np.zeros((1, 4))]]))
    return displacement(xi), pose[:3, 3], pose[:3, :3]


def write(fmu: FMU2Host, values: dict[str, float | int | bool]) -> None:
    for name, value in values.items():
        variable = fmu.variables[name]
        if variable.type == "Boolean":
            fmu.setBoolean([variable.valueReference], [value])
        elif variable.type in ("Integer", "Enumeration"):
            fmu.setInteger([variable.valueReference], [value])
        else:
            fmu.write(name, value)


def start_with(fmu: FMU2Host, values: dict[str, float | int | bool]) -> None:
    write(fmu, values)
    fmu.start()


def vector(fmu: FMU2Host, name: str, count: int = 3) -> np.ndarray:
    return np.array(fmu.getReal(fmu.references([f"{name}[{i + 1}]" for i in range(count)])))


@pytest.mark.parametrize("order", [0, 4, 7])
@pytest.mark.parametrize("kelvin", [[10.0, 0.0, 0.0], [0.0, 20.0, 58.0], [35.0, 35.0, 35.0]])
def test_unloaded_shape_is_the_algebraic_solution(order: int, kelvin: list[float]):
    delta, position, rotation = constant_strain(kelvin)
    with FMU2Host(ROD) as fmu:
        write(fmu, {"order": order, "dynamic": False})
        write(fmu, {f"T[{i + 1}]": 298.15 + dT for i, dT in enumerate(kelvin)})
        fmu.start()
        np.testing.assert_allclose(vector(fmu, "delta"), delta, rtol=1e-9, atol=1e-9 * np.abs(delta).max())
        np.testing.assert_allclose(vector(fmu, "tip.p"), position, atol=1e-9 * LENGTH)
        alpha, beta, gamma = vector(fmu, "tip.euler")
        np.testing.assert_allclose(Rotation.from_euler("XYZ", [alpha, beta, gamma]).as_matrix(), rotation, atol=1e-9)
        w, x, y, z = vector(fmu, "tip.quaternion", 4)
        np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), rotation, atol=1e-9)


def answer(fmu: FMU2Host, start: object, guess: np.ndarray) -> np.ndarray:
    """One pass delta guess -> force -> shape -> delta from a saved state."""
    fmu.setFMUstate(start)
    write(fmu, {f"delta_guess[{i + 1}]": value for i, value in enumerate(guess)})
    fmu.step(0.0, 0.1)
    return vector(fmu, "delta")


def test_exchanged_loop_has_the_gain_that_makes_plain_iteration_diverge():
    with FMU2Host(ROD) as fmu:
        write(fmu, {"closure": 2, "dynamic": False})
        fmu.start()
        start, small = fmu.getFMUstate(), 1e-8
        columns = [(answer(fmu, start, small * e) - answer(fmu, start, -small * e)) / (2 * small) for e in np.eye(3)]
        gains = np.sort(np.linalg.eigvals(np.array(columns).T).real)
        fmu.freeFMUstate(start)
    np.testing.assert_allclose(gains, [-3.215, -1.607, -1.607], rtol=2e-3)


def test_exchanged_at_its_fixed_point_is_inside():
    heated = {"T[1]": 330.0, "T[2]": 310.0, "gravity[1]": 3.0, "dynamic": False}
    with FMU2Host(ROD) as inside, FMU2Host(ROD) as exchanged:
        write(inside, heated)
        inside.start()
        delta = vector(inside, "delta")
        write(exchanged, {**heated, "closure": 2})
        write(exchanged, {f"delta_guess[{i + 1}]": value for i, value in enumerate(delta)})
        exchanged.start()
        for name in ("delta", "N", "tip.p"):
            np.testing.assert_allclose(vector(exchanged, name), vector(inside, name), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("method", "planar"), [(k, False) for k in range(1, 6)] + [(k, True) for k in range(1, 5)])
def test_every_method_steps_bitwise_the_same_after_a_restore(method: int, planar: bool):
    with FMU2Host(ROD) as fmu:
        write(fmu, {"method": method, "planar": planar, "body.retardation": 5e-3, "gravity[1]": 5.0})
        fmu.start()
        fmu.step(0.0, 0.01)
        state, rows = fmu.getFMUstate(), []
        for kelvin in (310.0, 350.0, 310.0):  # the second try leads elsewhere
            fmu.setFMUstate(state)
            fmu.write("T[1]", kelvin)
            fmu.step(0.01, 0.01)
            fmu.step(0.02, 0.01)
            rows.append(fmu.read())
        fmu.freeFMUstate(state)
    assert rows[0] == rows[2] != rows[1]


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"body.length": -1.0}, ["body.length", "-1"]),
        ({"body.E": math.nan}, ["body.E", "nan"]),
        ({"order": 99}, ["order", "99", "7"]),
        ({"tca.offset": 0.006}, ["tca.offset", "0.006", "body.radius", "reduce"]),
        ({"tca.wire_length": 0.03}, ["tca.wire_length", "0.03", "longer"]),
        ({"tca.chirality": 0}, ["tca.chirality", "+1"]),
        ({"tip_force[1]": math.inf}, ["tip_force[1]", "inf"]),
        ({"planar": True, "plane": 0.5}, ["TCA 1", "plane = 0.5", "symmetry plane"]),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_refuses_with_name_value_and_remedy(bad: dict[str, float], words: list[str]):
    with FMU2Host(ROD) as fmu:
        with pytest.raises(FMICallException):
            start_with(fmu, bad)
        text = " ".join(fmu.messages)
        for word in words:
            assert word in text


@pytest.mark.parametrize("order", [3, 5])
def test_the_work_on_an_undamped_rod_grows_with_the_fifth_root_of_the_tolerance(order: int):
    """As for a method of order 5 whose steps only accuracy limits: by 10^(1/5) = 1.58 for each decade."""
    work = []
    for tolerance in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
        settings = {"rod.body.retardation": 0.0, "rod.order": order, "rod.tolerance": tolerance, "stop_time": "0.3 s"}
        work.append(float(tca.run("drop", settings)["rod.evaluations"][-1]))
    growth = np.array(work[1:]) / work[:-1]
    assert growth.max() < 1.75
    assert 1.35 < (work[-1] / work[0]) ** 0.2 < 1.65
