"""CasADi's DaeBuilder loads the FMUs as they are exported: functions, Jacobians, and a problem solved by IPOPT."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import tca_cosim.cli
from tca_cosim.fmi.archive import find_fmu
from typer.testing import CliRunner

ca = pytest.importorskip("casadi")

Function = Callable[[np.ndarray], np.ndarray]


def load(name: str, folder: Path) -> Any:
    fmpy.extract(str(find_fmu(f"{name}.fmu")), str(folder))
    return ca.DaeBuilder(name, str(folder))


def differences(function: Function, x: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Central differences of order 4 (n_y, n_x)."""
    columns = []
    for k, h in enumerate(steps):
        e = h * np.eye(len(x))[k]
        near, far = function(x + e) - function(x - e), function(x + 2.0 * e) - function(x - 2.0 * e)
        columns.append((8.0 * near - far) / (12.0 * h))
    return np.array(columns).T


def operating_point(dae: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, inputs and tunable parameters, away from all symmetries and limits."""
    random = np.random.default_rng(1)
    x, u, p = (np.array(dae.start(names)) for names in (dae.x(), dae.u(), dae.p()))
    for k, name in enumerate(dae.x()):
        if name.startswith("mode"):
            x[k] = 3.0 * random.standard_normal()
        elif name.startswith("strain["):
            x[k] = 0.05 * random.standard_normal()
        elif name.startswith("strain_rate["):
            x[k] = 0.3 * random.standard_normal()
    for k, name in enumerate(dae.u()):
        u[k] += {"V": 1.0, "T": 15.0, "delta": 1e-3, "gravity": 3.0, "tip_force": 1e-3}.get(name.partition("[")[0], 0.0)
    for k, name in enumerate(dae.p()):
        values = {
            "segment.nu": 0.45,
            "segment.retardation": 5e-3,
            "tip_body.mass": 1e-3,
            "tip_body.inertia": 1e-7,
            "tca.stop_stiffness": 10.0,
            "tca.alpha_T": 1e-3,
            "tca.beta": 0.1,
        }
        p[k] = values.get(name.partition("[")[0], p[k])
    return x, u, p


@pytest.mark.parametrize("name", ["thermal", "rod"])
@pytest.mark.parametrize("known", ["x", "u", "p"])
def test_jacobians_are_those_of_differences(name: str, known: str, tmp_path: Path, at_most) -> None:
    dae = load(name, tmp_path)
    point = dict(zip("xup", operating_point(dae), strict=True))
    f = dae.create("f", ["x", "u", "p"], ["ode", "y"])
    exact = dae.create("jacobians", ["x", "u", "p"], [f"jac_ode_{known}", f"jac_y_{known}"])(*point.values())
    smooth = [k for k, y in enumerate(dae.y()) if y not in ("spatial_error", "out_of_plane", "T_max")]  # have maxima
    # Of curvature the differences resolve less: its start value says nothing of its size.
    names = getattr(dae, known)()
    nominal = np.array([10.0 if n.startswith("body.curvature") else dae.nominal(n) for n in names])
    steps = 2.0**-11 * np.maximum(np.abs(point[known]), nominal)
    for k, rows in enumerate([slice(None), smooth]):

        def values(at: np.ndarray, k: int = k, rows: Any = rows) -> np.ndarray:
            return f(*(point | {known: at}).values())[k].full().ravel()[rows]

        expected, jacobian = differences(values, point[known], steps), exact[k].full()[rows]
        # Errors in units of the largest derivative of the same row, each per nominal change of its variable.
        weight = steps * 2.0**11
        scale = np.abs(jacobian * weight).max(axis=1)
        error = np.abs((jacobian - expected) * weight).max(axis=1)
        assert (error[scale == 0.0] == 0.0).all()
        relative = error[scale > 0.0] / scale[scale > 0.0]
        at_most(f"{name}: derivatives of {('states', 'outputs')[k]} by {known}, relative error", relative.max(), 1e-8)


SIZES = {
    "four TCAs, two segments": ["--tcas", "4", "--segments", "2"],
    "like drop": ["--like", "drop"],
    "like step, with states": ["--like", "step", "--set", "rod.dynamic=true", "--set", "rod.order=0"],
}


@pytest.mark.parametrize("name", ["thermal", "rod"])
@pytest.mark.parametrize("options", list(SIZES.values()), ids=list(SIZES))
@pytest.mark.slow
def test_fmus_of_other_sizes_are_read_as_they_are_exported(
    options: list[str], name: str, tmp_path: Path, at_most
) -> None:
    outcome = CliRunner().invoke(tca_cosim.cli.app, ["export", str(tmp_path), *options, "--fmu", name])
    assert outcome.exit_code == 0, outcome.output
    assert "for co-simulation only" not in outcome.output
    fmpy.extract(str(tmp_path / f"{name}.fmu"), str(tmp_path / name))
    dae = ca.DaeBuilder(name, str(tmp_path / name))
    x, u, p = operating_point(dae)
    function = dae.create("f", ["x", "u", "p"], ["ode", "y"])
    by_inputs = function.jacobian()(x, u, p, *function(x, u, p))[1]  # of the states' derivatives
    nominal = np.array([dae.nominal(known) for known in dae.u()])
    computed = np.array(by_inputs) * nominal
    expected = differences(lambda u: np.array(function(x, u, p)[0]).ravel(), u, 1e-3 * nominal) * nominal
    size = np.maximum(np.abs(computed).max(axis=1, keepdims=True), 1e-9)
    at_most("deviation of the Jacobian by the inputs", float(np.abs((computed - expected) / size).max()), 1e-8)


def test_an_export_without_states_says_so_and_the_remedy_works(tmp_path: Path) -> None:
    for scene, remedy in (("step", "rod.dynamic=true"), ("fan", "thermal.level=reduced")):
        outcome = CliRunner().invoke(tca_cosim.cli.app, ["export", str(tmp_path), "--like", scene])
        name = remedy.partition(".")[0]
        assert f"note: {name}.fmu is for co-simulation only" in outcome.output
        assert f"add --set {remedy}" in outcome.output
        more = ["--set", remedy, "--set", "thermal.convection=constant", "--fmu", name]
        outcome = CliRunner().invoke(tca_cosim.cli.app, ["export", str(tmp_path), "--like", scene, *more])
        assert "note:" not in outcome.output
        fmpy.extract(str(tmp_path / f"{name}.fmu"), str(tmp_path / scene))
        assert ca.DaeBuilder(name, str(tmp_path / scene)).x()


def test_the_static_inverse_is_solved(tmp_path: Path, at_most) -> None:
    """Which temperatures from 25 to 100 degC bring the tip to (-12, 10) mm with the least heating?"""
    dae = load("rod", tmp_path)
    dae.set("order", 0.0)  # exact without loads: the strains are constant along the rod
    f = dae.create("f", ["x", "u", "p"], ["ode", "y"])
    T, strain = ca.MX.sym("T", 3), ca.MX.sym("strain", 6)
    x = ca.MX.zeros(dae.nx())
    for k in range(6):
        x[dae.x().index(f"strain[1,{k + 1}]")] = strain[k]
    rate, y = f(x, ca.vertcat(T, ca.DM(dae.start(dae.u()))[3:]), dae.start(dae.p()))
    acceleration = rate[[dae.x().index(f"strain_rate[1,{k + 1}]") for k in range(6)]]
    tip = y[[dae.y().index(f"tip.p[{k}]") for k in (1, 2)]]
    problem = {
        "x": ca.vertcat(T, strain),
        "f": ca.sumsqr((T - 298.15) / 100.0),
        "g": ca.vertcat(acceleration * ca.DM([1e-4] * 3 + [1e-6] * 3), 1e3 * tip - ca.DM([-12, 10])),
    }
    options = {"ipopt.hessian_approximation": "limited-memory", "ipopt.print_level": 0, "ipopt.sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", problem, {**options, "print_time": False})
    actual = solver(
        x0=[310.0] * 3 + [0.0] * 6,
        lbx=[298.15] * 3 + [-3.0] * 3 + [-0.3] * 3,
        ubx=[373.15] * 3 + [3.0] * 3 + [0.5] * 3,
        lbg=0.0,
        ubg=0.0,
    )
    assert solver.stats()["return_status"] == "Solve_Succeeded"
    degrees = np.array(actual["x"]).ravel()[:3] - 273.15
    for value, expected in zip(degrees, [51.8466, 25.0, 42.3356], strict=True):
        at_most(f"temperature {value:.4f} degC, error [K]", abs(value - expected), 1e-3)


@pytest.mark.slow
def test_cvodes_integrates_the_default_rod_for_30_s_with_500_steps_per_call(tmp_path: Path) -> None:
    dae = load("rod", tmp_path)
    x, u, p = (np.array(dae.start(names)) for names in (dae.x(), dae.u(), dae.p()))
    u[dae.u().index("T[1]")] = 330.0
    state = ca.MX.sym("x", len(x))
    problem = {"x": state, "ode": dae.create("f", ["x", "u", "p"], ["ode"])(state, u, p)}
    how = {"max_num_steps": 500, "reltol": 1e-4, "abstol": 1e-6}
    ends = ca.integrator("rod", "cvodes", problem, 0.0, list(np.linspace(0.1, 30.0, 300)), how)(x0=x)["xf"].full()
    assert np.abs(ends[: len(x) // 2, -1]).max() > 0.5, "a strain of the bent rod"
    assert np.abs(ends[:, -1] - ends[:, -20]).max() < 1e-3, "at rest"
