"""Power bonds that verification finds in the units of connections, and whether they close."""

from __future__ import annotations

from pathlib import Path

import pytest
import tca_cosim as tca
from coupled_systems import EXPLICIT, PAIR, VOLT, circuit, healthy_circuit, scene
from fmu_maker import make_fmu, real
from tca_cosim.verification import coupling
from tca_cosim.verification.coupling.energy import find_bonds


def test_the_circuit_has_a_power_bond_that_closes(tmp_path: Path) -> None:
    actual = coupling.verify(tca.read(healthy_circuit(tmp_path)))
    (bond,) = actual.bonds
    assert (str(bond.forward), str(bond.backward)) == ("one.x -> two.u", "two.x -> one.u")
    assert bond.closed
    assert bond.shares[0] > bond.shares[1] > bond.shares[2]
    assert actual.monolith.agrees is True
    orders = {signal.name: signal.order for signal in actual.signals}
    assert orders["one.x"] == pytest.approx(2.0, abs=0.3)  # linear waveform


def test_a_bond_that_stays_open_is_a_hidden_error(tmp_path: Path) -> None:
    """Voltage doubled on its way, the current as it is: the coupling creates as much energy as it carries."""
    circuit(tmp_path)
    wires = [{"from": "one.x", "to": "two.u", "factor": 2.0}, "two.x -> one.u"]
    path = scene(tmp_path, wires, PAIR[1], 4.0, 0.05)
    actual = coupling.verify(tca.read(path))
    (bond,) = actual.bonds
    assert not bond.closed
    assert bond.shares[2] == pytest.approx(1.0, abs=0.1)
    assert (actual.verdict, actual.trusted) == ("hidden error", False)
    assert any(reason.startswith("one.x * 2 -> two.u, two.x -> one.u: ") for reason in actual.reasons)


def test_a_transformer_closes(tmp_path: Path) -> None:
    """v2 = 2 v1 and i1 = 2 i2, so that v1 i1 = v2 i2."""
    circuit(tmp_path)
    wires = [{"from": "one.x", "to": "two.u", "factor": 2.0}, {"from": "two.x", "to": "one.u", "factor": 2.0}]
    actual = coupling.verify(tca.read(scene(tmp_path, wires, PAIR[1], 4.0, 0.05)))
    (bond,) = actual.bonds
    assert bond.closed
    assert actual.verdict == "healthy", actual.reasons


def test_a_bond_that_the_step_leaves_open_is_not_one_that_stays_open(tmp_path: Path) -> None:
    """Held values: the share shrinks with the step, which makes the step too long and no hidden error."""
    circuit(tmp_path)
    actual = coupling.verify(tca.read(scene(tmp_path, *PAIR, 4.0, 0.2, **EXPLICIT)))
    (bond,) = actual.bonds
    assert bond.closed
    assert bond.shares[2] > actual.tolerance
    assert actual.verdict == "step too long"


@pytest.mark.parametrize(
    ("voltages", "currents", "pairs"),
    [
        ("V -> v", "I -> i", ["V I"]),
        ("V[1] -> v[1], V[2] -> v[2]", "I[2] -> i[2], I[1] -> i[1]", ["V[1] I[1]", "V[2] I[2]"]),
        # crossed: the second port of the other member belongs to the first of this one
        ("V[1] -> v[2], V[2] -> v[1]", "I[1] -> i[2], I[2] -> i[1]", ["V[1] I[2]", "V[2] I[1]"]),
        ("V[1] -> v[1]", "I[2] -> i[2]", ["V[1] I[2]"]),  # nothing else that it could be
        ("V[1] -> v[1], V[2] -> v[2]", "I[2] -> i[2]", ["V[2] I[2]"]),
        ("p.V -> p.v, q.V -> q.v", "q.I -> q.i, p.I -> p.i", ["p.V p.I", "q.V q.I"]),
        ("V1 -> v1, V2 -> v2", "I2 -> i2, I1 -> i1", ["V1 I1", "V2 I2"]),
        ("Va -> va, Vb -> vb", "Ib -> ib, Ia -> ia", []),  # names that decide nothing
    ],
)  # fmt: skip
def test_names_of_ports_decide_which_connections_make_a_bond(
    voltages: str, currents: str, pairs: list[str], tmp_path: Path
) -> None:
    there, back = ([wire.split(" -> ") for wire in text.split(", ")] for text in (voltages, currents))
    for member, gives, takes, units in (("one", there, back, ("V", "A")), ("two", back, there, ("A", "V"))):
        variables = [real(source, unit=units[0]) for source, _ in gives]
        variables += [real(target, "input", start=0.0, unit=units[1]) for _, target in takes]
        make_fmu(tmp_path / f"{member}.fmu", variables, units=VOLT)
    wires = [f"one.{a} -> two.{b}" for a, b in there] + [f"two.{a} -> one.{b}" for a, b in back]
    actual = find_bonds(tca.read(scene(tmp_path, wires, ["one", "two"], 1.0, 0.1)))
    assert [f"{forward.source[1]} {backward.source[1]}" for forward, backward in actual] == pairs
