"""Scenes of FMUs that another exporter made (PythonFMU; sources in tests/data/foreign), with and without state saving:
no units, no nominals, no derivatives, outputs that only a step computes."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pythonfmu
import pythonfmu3
import tca_cosim as tca
from tca_cosim.fmi.archive import Archive
from tca_cosim.fmi.slave import Slave

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "tests" / "data" / "foreign"
HELD = '[coupling]\nexchange = "held"\nwaveform = "held"\n'
LOOP = """stop_time = "1 s"
connections = ["one.y -> two.u", "two.y -> one.u"]
[fmus]
one = "saved/Gain.fmu"
two = "saved/Gain.fmu"
[one]
a = 1.0
g = 4.0
[two]
g = -1.0
"""
CONTROL = """stop_time = "20 s"
connections = [
"pi.u -> thermal.V[1]", "thermal.T[1] -> pi.measured", "thermal.T -> rod.T",
"rod.delta -> rod.delta_guess"]
[fmus]
pi = "saved/Controller.fmu"
thermal = "thermal.fmu"
rod = "rod.fmu"
[pi]
setpoint = { steps = [["0 s", 298.15], ["2.05 s", 330]] }
on = true
channel = 1
[thermal]
"V[2]" = 0.0
"V[3]" = 0.0
[rod]
closure = "exchanged"
dynamic = false
"""
OSCILLATOR = """stop_time = "2 s"
connections = ["mass.x -> spring.u", "spring.y -> mass.F"]
[fmus]
mass = "saved/Oscillator.fmu"
spring = "saved/Gain.fmu"
[spring]
g = -3.0
"""
EXIT = """
import sys
from pathlib import Path
import tca_cosim as tca
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.fmi.slave import Slave

closed, broken, refused = (Archive(Path(sys.argv[1])) for _ in range(3))
Slave(closed, "closed", {}, ["u"], ["y"]).close()
slave = Slave(broken, "broken", {"label": "broken"}, ["u"], ["y"])
slave.begin()
try:
    slave.step(0.0, 0.1)
except tca.SubsystemError as error:
    print(error)
slave.close()
sys.modules["foreign_gain"].Gain.__init__ = None
try:
    Slave(refused, "refused", {}, ["u"], ["y"])
except tca.SubsystemError as error:
    print(error)
ours = [Slave(Archive(find_fmu(f"{name}.fmu")), name, {}, [], []) for name in ("thermal", "rod", "rod")]
ours[1].close()  # the others are still there at exit
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """saved: with state saving; bare: without; curved: claims to interpolate inputs; rigid: equal steps only."""
    folder_of_fmus = tmp_path_factory.mktemp("foreign")
    kinds = {
        "saved": {"canGetAndSetFMUstate": True},
        "bare": {},
        "curved": {"canGetAndSetFMUstate": True, "canInterpolateInputs": True},
        "rigid": {"canGetAndSetFMUstate": True, "canHandleVariableCommunicationStepSize": False},
    }
    for kind, options in kinds.items():
        for name in ("gain", "controller", "oscillator"):
            pythonfmu.FmuBuilder.build_FMU(SOURCES / f"foreign_{name}.py", folder_of_fmus / kind, **options)
    return folder_of_fmus


@pytest.fixture
def scene(folder: Path) -> Callable[..., Any]:
    """Reads a text as a user's file beside the FMUs."""

    def read(text: str, *overrides: str, **swapped: str) -> tca.Scene:
        for old, new in swapped.items():
            text = text.replace(old, new)
        path = folder / "user.toml"
        path.write_text(text)
        return tca.read(path, overrides)

    return read


@pytest.mark.parametrize("method", ["iqn", "aitken", "relaxed", "broyden", "newton"])
def test_the_scalar_loop_of_gain_4_converges(scene: Callable[..., Any], method: str) -> None:
    result = tca.run(scene(LOOP + HELD, f"coupling.method={method}", "coupling.tolerance=1e-9", "coupling.omega=0.2"))
    np.testing.assert_allclose(result["one.y"][1:], 0.2, atol=1e-8)
    np.testing.assert_allclose(result["two.u"][1:], 0.2, atol=1e-8)
    assert result["coupling.sweeps"].max() <= 5


def test_plain_iteration_of_it_diverges(scene: Callable[..., Any]) -> None:
    with pytest.raises(tca.CouplingError, match="diverges") as caught:
        tca.run(scene(LOOP + HELD, "coupling.method=plain"))
    assert caught.value.gain == pytest.approx(4.0, rel=1e-6)


def test_without_state_saving_iteration_is_refused(scene: Callable[..., Any]) -> None:
    text = r"two cannot save and restore state .*export with it, or .*coupling.method = 'none'"
    with pytest.raises(tca.SubsystemError, match=text):
        tca.run(scene(LOOP.replace('two = "saved', 'two = "bare') + HELD))


def test_without_state_saving_it_is_coupled_explicitly_when_asked(scene: Callable[..., Any]) -> None:
    """Each step multiplies the error by the gain: it converges below 1, and says so above."""
    result = tca.run(scene(LOOP + HELD, "coupling.method=none", "one.g=0.5", saved="bare"))
    expected = 2 / 3 * (1 - (-0.5) ** np.arange(1, 11))
    np.testing.assert_allclose(result["one.y"][1:], expected, rtol=1e-12)
    assert (result["coupling.sweeps"][1:] == 1).all()
    with pytest.raises(tca.CouplingError, match=r"explicit coupling is off .*cannot be set back .*macro_step smaller"):
        tca.run(scene(LOOP + HELD, "coupling.method=none", saved="bare"))


def test_without_state_saving_steps_are_not_repeated(scene: Callable[..., Any]) -> None:
    settings = ("coupling.method=none", "coupling.control=doubling")
    with pytest.raises(tca.SubsystemError, match=r"one, two cannot save .*coupling.control = 'fixed'"):
        tca.run(scene(LOOP + HELD, *settings, saved="bare"))


def test_inputs_are_held_where_the_fmus_take_no_more(scene: Callable[..., Any]) -> None:
    """Also where they claim to interpolate; what is asked for and cannot be done is said once for each."""
    for kind in ("saved", "curved"):
        result = tca.run(scene(LOOP, saved=kind))
        np.testing.assert_allclose(result["one.y"][-1], 0.2, atol=1e-6)
        notes = json.loads(result.attrs["notes"])
        assert [sum(f"{name} takes no input derivatives" in note for note in notes) for name in ("one", "two")] == [
            1,
            1,
        ]
    assert not json.loads(tca.run(scene(LOOP + HELD, saved="curved")).attrs["notes"])


@pytest.mark.parametrize("kind", ["saved", "bare"])
def test_a_controller_beside_our_fmus(scene: Callable[..., Any], kind: str) -> None:
    """The heated TCA reaches its set point; the voltage is the controller's law of the temperatures recorded."""
    how = ("coupling.method=none", "rod.closure=inside") if kind == "bare" else ("coupling.tolerance=1e-9",)
    text = CONTROL.replace('"saved', f'"{kind}')
    if kind == "bare":
        text = text.replace('"rod.delta -> rod.delta_guess"', "")
    result = tca.run(scene(text + HELD, *how))
    T, V = result["thermal.T"][:, 0].to_numpy(), result["thermal.V"][:, 0].to_numpy()
    assert 2.05 in result["time"]
    assert abs(T[-1] - 330.0) < 1.0
    assert result["rod.delta"][-1, 0] > 1e-4
    seen = np.concatenate([[298.15], T[:-1]]) if kind == "bare" else T  # explicit: that of the step before
    integral, expected = 0.0, []
    for start, step, measured in zip(result["time"][:-1], result["coupling.step"][1:], seen[1:], strict=True):
        error = (330.0 if start >= 2.05 - 1e-9 else 298.15) - measured
        wanted = 0.05 * error + integral + float(step) * 0.05 * error / 4.0
        expected.append(min(max(wanted, 0.0), 3.0))
        integral += float(step) * 0.05 * error / 4.0 if expected[-1] == wanted else 0.0
    if kind == "saved":
        np.testing.assert_allclose(V[1:], expected, atol=1e-7)
    else:
        np.testing.assert_allclose(result["pi.u"][1:], expected, atol=1e-12)


def test_an_oscillator_converges_with_the_order_of_held_inputs(scene: Callable[..., Any]) -> None:
    frequency = math.sqrt(4.0 - 0.25)  # m = d = c = 1, spring 3
    exact = math.exp(-1.0) * (math.cos(2.0 * frequency) + 0.5 / frequency * math.sin(2.0 * frequency))
    steps = (0.02, 0.01, 0.005)
    ends = [tca.run(scene(OSCILLATOR + HELD, f"coupling.macro_step={h}"))["mass.x"][-1] for h in steps]
    errors = np.abs(np.array(ends) - exact)
    assert errors[-1] < 5e-3
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 1.0, atol=0.1)


def test_a_signal_is_held_at_its_end_value(scene: Callable[..., Any]) -> None:
    text = '[fmus]\none = "bare/Gain.fmu"\n[one]\nu = { ramps = [[0.0, 0.0], [1.0, 10.0]] }\n'
    result = tca.run(scene('stop_time = "1 s"\nconnections = []\n' + text))
    np.testing.assert_allclose(result["one.y"][1:], 10.0 * result["time"][1:], atol=1e-12)


def test_a_step_refused_is_halved_where_it_can_be_repeated(scene: Callable[..., Any]) -> None:
    result = tca.run(scene(LOOP + HELD, "one.label=short"))
    assert result["coupling.step"].max() <= 0.03
    np.testing.assert_allclose(result["one.y"][-1], 0.2, atol=1e-6)
    with pytest.raises(tca.CouplingError, match=r"one: step from t = 0 s by 0.1 s.*one cannot be set back"):
        tca.run(scene(LOOP + HELD, "one.label=short", "coupling.method=none", saved="bare"))


def test_a_fatal_error_ends_the_run_and_nothing_else(scene: Callable[..., Any]) -> None:
    with pytest.raises(tca.CosimError, match=r"(?s)a broken part.*a fatal error") as caught:
        tca.run(scene(LOOP + HELD, "one.label=broken"))
    assert caught.value.partial.sizes["time"] == 1
    assert tca.run(scene(LOOP + HELD)).attrs["status"] == "complete"


def test_exit_touches_no_freed_memory(folder: Path) -> None:
    """Valgrind sees no invalid access at exit, after FMUs that were closed, left open, refused or broken down."""
    check = ["valgrind", "--undef-value-errors=no", sys.executable, "-c", EXIT, str(folder / "saved" / "Gain.fmu")]
    done = subprocess.run(check, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert "a broken part" in done.stdout
    assert "refused: Failed to instantiate" in done.stdout
    # The loader's and Python's own findings are not ours.
    actual = [text for text in re.split(r"(?m)^==\d+== \n", done.stderr) if "Invalid" in text and "/binaries/" in text]
    assert not actual, actual[0]


def test_steps_of_one_length_only(scene: Callable[..., Any]) -> None:
    assert tca.run(scene(LOOP + HELD, saved="rigid")).attrs["status"] == "complete"
    text = '[fmus]\none = "rigid/Gain.fmu"\n[one]\nu = { steps = [[0.0, 0.0], [0.25, 1.0]] }\n'
    with pytest.raises(tca.CouplingError, match=r"one takes steps of one length only.*divides the stop time"):
        tca.run(scene('stop_time = "1 s"\nconnections = []\n' + text))


def test_saved_states_do_not_pile_up(folder: Path) -> None:
    """This exporter answers with another handle where it is given one to write over."""
    counts = {"fmi2GetFMUstate": 0, "fmi2FreeFMUstate": 0}

    class Watched:
        def __init__(self, library: Any) -> None:
            self.library = library

        def __getattr__(self, name: str) -> Any:
            if name in counts:
                counts[name] += 1
            return getattr(self.library, name)

    with Archive(folder / "saved" / "Gain.fmu") as archive:
        slave = Slave(archive, "one", {}, ["u"], ["y"])
        slave.watch_calls(Watched)
        slave.initialise(0.0, np.array([1.0]))
        slave.begin()  # tries whether states can be saved
        counts.update(dict.fromkeys(counts, 0))
        state = None
        for _ in range(20):
            state = slave.save(state)
        slave.step(0.0, 0.1)
        assert slave.values() == 1.0
        slave.restore(state)
        assert slave.values() == 0.0
        slave.close()
    assert counts["fmi2GetFMUstate"] == 20
    assert counts["fmi2FreeFMUstate"] >= 19


def test_wrong_values_of_texts_and_switches_are_refused(scene: Callable[..., Any]) -> None:
    with pytest.raises(tca.SceneError, match=r"one.label = 3: wrong type; give a text"):
        scene(LOOP, "one.label=3")
    with pytest.raises(tca.SceneError, match=r"pi.on = 3: wrong type; allowed: true, false"):
        scene(CONTROL, "pi.on=3")


def test_another_version_or_platform_is_named(folder: Path, scene: Callable[..., Any]) -> None:
    third = pythonfmu3.FmuBuilder.build_FMU(SOURCES / "foreign_third.py", folder)
    with pytest.raises(tca.SceneError, match=r"Third.fmu: made for FMI 3.0; export it for FMI 2.0"):
        scene(LOOP, f"fmus.one={third}")
    stripped = folder / "elsewhere.fmu"
    with zipfile.ZipFile(folder / "saved" / "Gain.fmu") as source, zipfile.ZipFile(stripped, "w") as target:
        for item in source.infolist():
            if not item.filename.startswith("binaries"):
                target.writestr(item, source.read(item))
    with pytest.raises(tca.SubsystemError, match=r"one: .*elsewhere.fmu cannot be loaded here"):
        tca.run(scene(LOOP + HELD, f"fmus.one={stripped}"))
