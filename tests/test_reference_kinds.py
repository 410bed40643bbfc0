"""FMUs of the kinds that the FMI project publishes for tests of hosts, alone, against their closed forms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from fmu_maker import boolean, enumeration, integer, make_fmu, real, string

GRAVITY, BOUNCE = 9.81, 0.7
EACH = pytest.mark.parametrize("kind", ["co-simulation", "model exchange"])


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., xr.Dataset]:
    """Runs one FMU in one of its interfaces."""
    monkeypatch.chdir(tmp_path)

    def run_alone(
        kind: str, variables: list, macro_step: float, stop: float, inputs: dict | None = None, **more: object
    ) -> xr.Dataset:
        if kind == "model exchange":
            more = {**more, "cs": False, "model_exchange": {}}
        make_fmu(tmp_path / "alone.fmu", variables, **more)
        table = {
            "stop_time": stop,
            "connections": [],
            "fmus": {"a": "alone.fmu"},
            "coupling": {"macro_step": macro_step},
        }
        return tca.run(tca.read({**table, "a": inputs or {}}))

    return run_alone


def test_decay_converges_with_the_order_of_its_own_step(run: Callable) -> None:
    """der(x) = -x by one step of fourth order per communication step."""
    variables = [real("x", start=1.0), real("der(x)", "local")]
    errors = []
    for h in (0.1, 0.05):
        result = run(
            "co-simulation", variables, h, 1.0, states={"x": "der(x)"}, output="real[1] = -real[0];", substeps=1
        )
        errors.append(np.abs(result["a.x"] - np.exp(-result["time"])).max().item())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


def test_decay_as_model_exchange(run: Callable) -> None:
    variables = [real("x", start=1.0), real("der(x)", "local")]
    result = run("model exchange", variables, 0.5, 2.0, states={"x": "der(x)"}, output="real[1] = -real[0];")
    np.testing.assert_allclose(result["a.x"], np.exp(-result["time"]), atol=1e-5)


def bounced(times: np.ndarray) -> np.ndarray:
    """Height of a ball dropped from 1 m that keeps BOUNCE of its speed at each impact."""
    heights = []
    for t in times:
        impact = np.sqrt(2.0 / GRAVITY)
        speed = GRAVITY * impact
        if t <= impact:
            heights.append(1.0 - 0.5 * GRAVITY * t**2)
            continue
        while True:
            speed *= BOUNCE
            flight = 2.0 * speed / GRAVITY
            if t <= impact + flight:
                break
            impact += flight
        heights.append(speed * (t - impact) - 0.5 * GRAVITY * (t - impact) ** 2)
    return np.array(heights)


@EACH
def test_state_events_of_a_bouncing_ball(run: Callable, kind: str) -> None:
    """The model locates impacts within its own steps of 0.1 ms as co-simulation; as model exchange the host does."""
    variables = [real("h", start=1.0), real("v", start=0.0), real("der(h)", "local"), real("der(v)", "local")]
    result = run(
        kind, variables, 0.1, 1.5, states={"h": "der(h)", "v": "der(v)"}, indicators=1, substeps=1000,
        output=f"real[2] = real[1]; real[3] = -{GRAVITY}; indicator[0] = real[0];",
        event=f"if (real[0] <= 1e-9 && real[1] < 0) {{ real[0] = 0; real[1] *= -{BOUNCE}; }}",
    )  # fmt: skip
    np.testing.assert_allclose(result["a.h"], bounced(result["time"].values), atol=3e-3)


@EACH
def test_time_events_of_a_stair_that_ends_the_run(run: Callable, kind: str) -> None:
    """A counter that rises each second from 1 on, and ends the simulation at 5."""
    # the event comes at t = 1, 2, ...; the first call, at the start, only sets the time of the next one
    event = """
    if (memory[0] > 0.0 && t >= memory[0] - 1e-9) integer[0]++;
    if (t >= memory[0] - 1e-9) memory[0] = floor(t + 1e-9) + 1.0;
    m->next_event = memory[0];
    m->terminated = integer[0] >= 5;
    """
    step = """
    double end = t + h;
    while (m->next_event <= end + 1e-12) { m->time = m->next_event; handle_event(m); }
    if (m->terminated) { m->reached = m->time; return fmi2Discard; }
    m->time = t;
    """
    more = {"step": step} if kind == "co-simulation" else {"states": {}}
    result = run(kind, [integer("counter", start=1)], 0.25, 10.0, event=event, **more)
    assert result.attrs["status"] == "complete"
    assert result["time"].values[-1] == pytest.approx(4.0)
    assert "ended the simulation" in result.attrs["ended"]
    times, counter = result["time"].values, result["a.counter"].values
    np.testing.assert_array_equal(counter[:-1], np.floor(times[:-1] + 1e-9) + 1)


def test_all_types_are_fed_through(run: Callable) -> None:
    items = '<Item name="one" value="1"/><Item name="two" value="2"/>'
    types = f'<SimpleType name="Option"><Enumeration>{items}</Enumeration></SimpleType>'
    variables = [
        real("x", "input", start=0.0),
        real("d", "input", start=0.0, variability="discrete"),
        real("y"),
        real("e", variability="discrete"),
        integer("n", "input", start=0),
        enumeration("o", "input", start=1, declaredType="Option"),
        integer("m"),
        enumeration("p", declaredType="Option"),
        boolean("b", "input", start="false"),
        boolean("c"),
        string("s", "input", start="a"),
        string("t"),
    ]
    output = (
        "real[2] = real[0]; real[3] = real[1]; integer[2] = integer[0]; integer[3] = integer[1]; "
        "boolean[1] = boolean[0]; strcpy(string[1], string[0]);"
    )
    signals = {
        "x": {"sine": {"amplitude": 1.0, "period": 1.0}},
        "d": {"steps": [[0, 0], [0.5, 2]]},
        "n": {"steps": [[0, 3], [0.5, -7]]},
        "o": {"steps": [[0, "one"], [0.5, "two"]]},
        "b": {"steps": [[0, False], [0.5, True]]},
        "s": "Grüße",
    }
    result = run("co-simulation", variables, 0.125, 1.0, signals, output=output, types=types)
    late = result["time"].values > 0.5
    early = (result["time"].values > 0.0) & (result["time"].values <= 0.5)
    np.testing.assert_allclose(result["a.y"], np.sin(2 * np.pi * result["time"]), atol=1e-12)
    for name, before, after in (("e", 0.0, 2.0), ("m", 3, -7), ("p", 1, 2), ("c", False, True)):
        assert (result[f"a.{name}"].values[early] == before).all(), name
        assert (result[f"a.{name}"].values[late] == after).all(), name
    assert set(result["a.t"].values) == {"Grüße"}
