"""Connections by weighted sums: reading, values that arrive, loops, other ways to run a scene."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from fmu_host import FMU2Host
from fmu_maker import make_fmu, real
from tca_cosim.cosim.converted_inputs import convert_inputs
from tca_cosim.cosim.topology import Connection
from tca_cosim.errors import SceneError
from tca_cosim.fmi.archive import cached_archive, find_fmu
from tca_cosim.scene import read, ssp_writer
from test_connections import CELSIUS, KELVIN

SHORT = ["stop_time=0.5"]


def scene(folder: Path, connections: list[Any], **members: Path) -> tca.Scene:
    described = {"stop_time": 1.0, "connections": connections, "coupling": {"macro_step": 0.5}}
    described["fmus"] = {name: str(path) for name, path in members.items()}
    return read(described, (), cached_archive)


@pytest.fixture
def members(tmp_path: Path) -> dict[str, Path]:
    """Sources of 300 K, 20 degC, a velocity, and two targets."""
    kelvin, both = {"unit": "K"}, KELVIN + CELSIUS
    speed = '<Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>'
    return {
        "a": make_fmu(tmp_path / "a.fmu", [real("T", **kelvin)], output="real[0] = 300.0;", units=both),
        "c": make_fmu(tmp_path / "c.fmu", [real("T", unit="degC")], output="real[0] = 20.0;", units=both),
        "v-1": make_fmu(tmp_path / "v.fmu", [real("v", unit="m/s")], output="real[0] = 2.0;", units=speed),
        "to": make_fmu(
            tmp_path / "to.fmu",
            [real("T", "input", start=0, **kelvin), real("y")],
            output="real[1] = real[0];",
            units=both,
        ),
    }


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("0.5*a.T + 0.5*c.T", 0.5 * 300.0 + 0.5 * 293.15),
        ("0.25 * a.T + 0.75 * c.T", 0.25 * 300.0 + 0.75 * 293.15),
        ("2*a.T - 1*c.T", 600.0 - 293.15),
        ("2*a.T - c.T", 600.0 - 293.15),
        ("-1e0*c.T + 2*a.T", 600.0 - 293.15),
        ("0.5*a.T", 150.0),
        ("a.T + a.T", 600.0),
        ("0.5*a.T + 0.5*a.T", 300.0),
    ],
)
def test_values_arrive(source: str, expected: float, members: dict[str, Path], tmp_path: Path) -> None:
    result = tca.run(scene(tmp_path, [f"{source} -> to.T"], **members))
    assert result["to.y"].to_numpy() == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("connections", "words"),
    [
        (["0.5*a.T + 0.5*v-1.v -> to.T"], "do not measure the same quantity"),
        (["0.5*a.T + 0.6*c.T -> to.T"], r"sum to 1\.1; let them sum to 1"),
        (["0.5*a.T + 0.5*b.T -> to.T"], "no FMU 'b'"),
        (["0.5*a.T + 0.5*c.x -> to.T"], "'c.x' is not an output"),
        (["0*a.T + 1*c.T -> to.T"], "a weight is 0"),
        (["a.T - a.T -> to.T"], "a weight is 0"),
        (["0.5*a.T +  -> to.T"], "not"),
        (["0.5*a.T + 0.5*c.T -> to.T", "a.T -> to.T"], "fed twice"),
        (["a.T -> to.T", "0.5*a.T + 0.5*c.T -> to.T"], "fed twice"),
    ],
)
def test_refusals(connections: list[str], words: str, members: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=words):
        scene(tmp_path, connections, **members)


def serial(closure: str = "exchanged", **more: Any) -> dict[str, Any]:
    """A rod whose TCAs cross two sections, each with a heat model of its own; what it does acts on both."""
    return {
        "stop_time": 1.0,
        "fmus": {"lower": "thermal.fmu", "upper": "thermal.fmu", "rod": "rod.fmu"},
        "connections": [
            "0.5*lower.T + 0.5*upper.T -> rod.T",
            "0.5*rod.delta -> lower.delta",
            "0.5*rod.delta -> upper.delta",
            *(["rod.delta -> rod.delta_guess"] if closure == "exchanged" else []),
        ],
        "lower": {"V": [3.0, 0.0, 0.0], "tca.beta": 5.0},
        "upper": {"V": [3.0, 1.0, 0.0], "tca.beta": 5.0},
        "rod": {"closure": closure, "dynamic": False},
        **more,
    }


@pytest.mark.parametrize("method", ["newton", "iqn"])
def test_loops_through_sums_converge(method: str) -> None:
    table = serial(coupling={"macro_step": 0.1, "method": method, "tolerance": 1e-9})
    result = tca.run(table)
    expected = 0.5 * result["lower.T"].to_numpy() + 0.5 * result["upper.T"].to_numpy()
    np.testing.assert_allclose(result["rod.T"].to_numpy(), expected, atol=1e-6)
    np.testing.assert_allclose(result["lower.delta"].to_numpy(), 0.5 * result["rod.delta"].to_numpy(), atol=1e-10)
    plain = tca.run(serial("inside", coupling={"macro_step": 0.1, "tolerance": 1e-9}))
    np.testing.assert_allclose(result["rod.tip.p"].to_numpy()[-1], plain["rod.tip.p"].to_numpy()[-1], atol=1e-6)


def test_equal_terms_are_one_source() -> None:
    """A section cut into two equal ones gives what one gives."""
    whole = {"stop_time": 1.0, "thermal": {"V": [3.0, 1.0, 0.0]}}
    halves = {
        "stop_time": 1.0,
        "fmus": {"lower": "thermal.fmu", "upper": "thermal.fmu", "rod": "rod.fmu"},
        "connections": ["0.5*lower.T + 0.5*upper.T -> rod.T"],
        "lower": {"V": [3.0, 1.0, 0.0]},
        "upper": {"V": [3.0, 1.0, 0.0]},
    }
    one, two = tca.run(whole), tca.run(halves)
    np.testing.assert_allclose(two["rod.tip.p"].to_numpy(), one["rod.tip.p"].to_numpy(), atol=1e-12)


def test_the_monolith_and_linear_models_know_sums() -> None:
    from tca_cosim.verification.monolith import solve_monolith

    table = serial("inside", coupling={"macro_step": 0.02, "tolerance": 1e-10})
    table["rod"] |= {"order": 0, "dynamic": True, "body.retardation": "50 ms"}
    whole, coupled = solve_monolith(read(table)), tca.run(table)
    np.testing.assert_allclose(coupled["rod.tip.p"].to_numpy()[-1], whole["rod.tip.p"].to_numpy()[-1], atol=2e-5)


def two_sections() -> dict[str, Any]:
    """A rod whose TCAs cross two sections; nothing acts back on these."""
    table = serial("inside", coupling={"macro_step": 0.1})
    table["connections"] = ["0.25*lower.T + 0.75*upper.T -> rod.T"]
    for heat in ("lower", "upper"):
        table[heat]["tca.beta"] = 0.0
    return table


def from_ssp(scene: tca.Scene, path: Path) -> tca.Scene:
    ssp_writer.write_scene(path, scene)
    return tca.read(path)


def test_sums_come_back_from_ssp(tmp_path: Path) -> None:
    first = read(two_sections())
    back = from_ssp(first, tmp_path / "s.ssp")
    assert {str(c) for c in back.connections} == {str(c) for c in first.connections}
    assert [member.name for member in back.members] == ["lower", "upper", "rod"]
    again = from_ssp(back, tmp_path / "again.ssp")
    assert {str(c) for c in again.connections} == {str(c) for c in first.connections}
    one, other = tca.run(first), tca.run(again)
    np.testing.assert_allclose(other["rod.tip.p"].to_numpy(), one["rod.tip.p"].to_numpy(), rtol=0.0, atol=1e-12)


def test_sums_with_offsets_and_many_terms_come_back_from_ssp(members: dict[str, Path], tmp_path: Path) -> None:
    """Units have different zeros, and outputs are more than one sum.fmu takes."""
    mean = scene(tmp_path, ["0.5*a.T + 0.5*c.T -> to.T"], **members)
    assert tca.run(from_ssp(mean, tmp_path / "mean.ssp"))["to.y"].to_numpy() == pytest.approx(296.575, rel=1e-14)
    many = [real(f"x[{k}]") for k in range(1, 31)]
    source = make_fmu(tmp_path / "many.fmu", many, output="for (int k = 0; k < 30; ++k) real[k] = k + 1;")
    target = make_fmu(tmp_path / "w.fmu", [real("u", "input", start=0), real("y")], output="real[1] = real[0];")
    text = " + ".join(f"{k}*m.x[{k}]" for k in range(1, 31))
    wide = scene(tmp_path, [f"{text} -> to.u"], m=source, to=target)
    back = from_ssp(wide, tmp_path / "wide.ssp")
    assert {str(c.source) + str(c.factor) for c in back.connections} == {
        str(c.source) + str(c.factor) for c in wide.connections
    }
    assert tca.run(back)["to.y"].to_numpy() == pytest.approx(sum(k * k for k in range(1, 31)), rel=1e-14)
    with zipfile.ZipFile(tmp_path / "wide.ssp") as archive:
        assert archive.read("SystemStructure.ssd").count(b"resources/sum.fmu") == 3


def test_sums_that_no_weighted_sum_replaces_stay_fmus(tmp_path: Path) -> None:
    """One of constants alone, and its successor."""
    sums = {"a": find_fmu("sum.fmu"), "b": find_fmu("sum.fmu")}
    constants = tca.read(
        {
            "stop_time": 1.0,
            "fmus": {name: str(path) for name, path in sums.items()},
            "connections": ["a.y -> b.u[1]"],
            "a": {"gain": [2.0] + [0.0] * 11, "u[1]": 3.0, "offset": 1.0},
            "b": {"gain": [10.0] + [0.0] * 11},
            "coupling": {"macro_step": 0.5},
        }
    )
    back = from_ssp(constants, tmp_path / "c.ssp")
    assert [member.name for member in back.members] == ["a", "b"]
    assert tca.run(back)["b.y"].to_numpy() == pytest.approx(70.0, rel=1e-15)


def test_the_sum_follows_its_inputs_at_once() -> None:
    """It is valid, and exact in values and derivatives, in co-simulation and model exchange."""
    path = find_fmu("sum.fmu")
    assert validate_fmu(str(path)) == []
    start = {"gain[1]": 0.5, "gain[2]": -2.0, "u[1]": 4.0, "u[2]": 1.0, "offset": 3.0}
    for kind in ("CoSimulation", "ModelExchange"):
        rows = simulate_fmu(str(path), start_values=start, stop_time=1.0, fmi_type=kind, solver="Euler", step_size=0.5)
        assert rows["y"][-1] == 3.0
    with FMU2Host(path) as fmu:
        fmu.write("gain[1]", 0.5)
        fmu.write("gain[2]", -2.0)
        fmu.start()
        slopes = fmu.getDirectionalDerivative(fmu.references(["y"]), fmu.references(["u[1]", "u[2]"]), [1.0, 10.0])
        assert slopes == pytest.approx([0.5 - 20.0], rel=1e-12)
        fmu.apply({"u[1]": (4.0, 3.0)})
        fmu.step(0.0, 0.5)
        assert fmu.read() == pytest.approx([0.5 * (4.0 + 1.5)], rel=1e-14)


@pytest.mark.slow
def test_another_host_forms_the_sums_of_an_archive(tmp_path: Path) -> None:
    """libcosim hands on every value one step late: twice, since the sum stands between heat and rod."""
    first = read(two_sections())
    ssp_writer.write_scene(tmp_path / "s.ssp", first)
    script = Path(__file__).parent / "hosts" / "sums_with_libcosim.py"
    subprocess.run([sys.executable, str(script), str(tmp_path / "s.ssp"), str(tmp_path / "rows.csv")], check=True)
    rows, ours = np.loadtxt(tmp_path / "rows.csv", delimiter=","), tca.run(first)
    T = 0.25 * ours["lower.T"].to_numpy() + 0.75 * ours["upper.T"].to_numpy()
    assert np.ptp(T, axis=0).max() > 1.0
    np.testing.assert_allclose(rows[2:, 1:4], T[1:-2], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(rows[2:, 4:], ours["rod.tip.p"].to_numpy()[1:-2], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"terms": [{"from": "a.T"}], "to": "to.T"}, "two terms or more"),
        ({"terms": [{"from": "a.T"}, {"from": "c.T"}]}, "two terms or more"),
        ({"terms": [{"from": "a.T"}, "c.T"], "to": "to.T"}, "give a term as a table"),
        ({"terms": [{"from": "a.T"}, {"from": "a.T"}], "to": "to.T"}, "add their factors"),
        ({"terms": [{"from": "a.T"}, {"from": "v-1.v"}], "to": "to.T"}, "do not measure the same quantity"),
    ],
)
def test_tables_of_terms_are_checked(
    entry: dict[str, Any], words: str, members: dict[str, Path], tmp_path: Path
) -> None:
    with pytest.raises(SceneError, match=words):
        scene(tmp_path, [entry], **members)


def test_tables_of_terms_are_sums(members: dict[str, Path], tmp_path: Path) -> None:
    terms = [{"from": "a.T", "factor": 0.5}, {"from": "c.T", "factor": 0.5, "offset": 1.0}]
    result = tca.run(scene(tmp_path, [{"terms": terms, "to": "to.T"}], **members))
    assert result["to.y"].to_numpy() == pytest.approx(297.575, rel=1e-14)


class _Recorder:
    """A subsystem of two inputs that keeps what it is given."""

    def __init__(self) -> None:
        from tca_cosim.cosim.subsystem import Port

        self.inputs = tuple(Port(name, start=10.0, nominal=4.0) for name in ("u", "w"))
        self.given = np.zeros((4, 2))

    def set_inputs(self, polynomials: np.ndarray) -> None:
        self.given = polynomials.copy()

    def tangent(self, columns: np.ndarray) -> np.ndarray:
        return np.array([[2.0, 3.0]])[:, columns]


def test_ports_are_the_terms() -> None:
    terms = [Connection(("a", "y"), ("s", "u"), 0.5, 1.0, 0, 2), Connection(("b", "y"), ("s", "u"), 0.25, 0.0, 1, 2)]
    inner: Any = _Recorder()
    summed = convert_inputs(inner, [*terms, Connection(("c", "y"), ("s", "w"), 10.0)])
    assert [port.name for port in summed.inputs] == ["u (term 1 of 2)", "u (term 2 of 2)", "w"]
    assert [port.start for port in summed.inputs] == [12.0, 12.0, 1.0]  # 0.75 * 12 + 1 = 10
    assert [port.nominal for port in summed.inputs] == [8.0, 16.0, 0.4]
    values = np.array([[4.0, 8.0, 0.3], [1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    summed.set_inputs(values)
    np.testing.assert_array_equal(inner.given[0], [0.5 * 4 + 0.25 * 8 + 1, 3.0])
    np.testing.assert_array_equal(inner.given[1], [1.0, 30.0])
    np.testing.assert_array_equal(summed.tangent(np.array([2, 0])), [[30.0, 1.0]])
    np.testing.assert_array_equal(summed.tangent(np.array([0, 1])), [[1.0, 0.5]])
