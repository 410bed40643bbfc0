"""FMUs of any size from one binary: export, scenes that say what body they have, states and start values as wanted."""

import concurrent.futures
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim import scene as scenes
from tca_cosim.cli import app
from tca_cosim.errors import SceneError
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.fmi.configuration import Configuration, can_configure, configured_fmu, write_configured
from typer.testing import CliRunner

HEAT_ALONE = {"stop_time": 2.0, "fmus": {"thermal": "thermal.fmu"}, "connections": []}


def exported(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["export", *map(str, arguments)])
    return f"{result.exit_code}: {result.output}"


def states(path: Path) -> list[str]:
    description = fmpy.read_model_description(str(path))
    return [unknown.variable.derivative.name for unknown in description.derivatives]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6, 12])
@pytest.mark.slow
def test_every_size_validates_and_runs_in_a_foreign_host(count: int, tmp_path: Path) -> None:
    assert exported(tmp_path, "--tcas", count, "--fmu", "thermal").startswith("0:")
    path = tmp_path / "thermal.fmu"
    assert fmpy.validation.validate_fmu(str(path)) == []
    names = {v.name for v in fmpy.read_model_description(str(path)).modelVariables}
    for vector in ("V", "T", "P", "delta", "tca.azimuth", "tca.outer_radius", "tca.R", "tca.beta"):
        assert f"{vector}[{count}]" in names
        assert f"{vector}[{count + 1}]" not in names
    if count > 6:  # reduction takes seconds
        return
    starts = {"level": 1, f"V[{count}]": 2.0}
    result = fmpy.simulate_fmu(
        str(path),
        stop_time=1.0,
        output_interval=0.5,
        start_values=starts,
        output=[f"T[{count}]"],
        fmi_type="CoSimulation",
    )
    assert result[f"T[{count}]"][-1] > 299.0


def test_the_default_size_is_the_shipped_fmu(tmp_path: Path) -> None:
    exported(tmp_path / "plain")
    exported(tmp_path / "sized", "--tcas", 3, "--segments", 1)
    for name in ("thermal", "rod"):
        shipped = Archive(find_fmu(f"{name}.fmu"))
        plain, sized = (Archive(tmp_path / folder / f"{name}.fmu") for folder in ("plain", "sized"))
        assert plain.digest == shipped.digest
        assert sized.guid == shipped.guid
        with zipfile.ZipFile(sized.path) as one, zipfile.ZipFile(plain.path) as other:
            assert set(one.namelist()) - {"resources/configuration.txt"} == {
                n for n in other.namelist() if not n.endswith("/")
            }
            for part in ("modelDescription.xml", "documentation/index.html", "model.png"):
                assert one.read(part) == other.read(part)


def test_export_is_reproducible_and_describes_itself(tmp_path: Path) -> None:
    source = Archive(find_fmu("thermal.fmu"))
    for name in ("a.fmu", "b.fmu"):
        write_configured(source, Configuration(tcas=5), tmp_path / name)
    assert (tmp_path / "a.fmu").read_bytes() == (tmp_path / "b.fmu").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.fmu") as archive:
        assert archive.read("resources/configuration.txt").splitlines()[0] == b"tcas 5"
        page = archive.read("documentation/index.html").decode()
        assert "<h2>Equations</h2>" in page
        assert "tca.outer_radius[5]" in page
    again = Archive(configured_fmu(Archive(tmp_path / "a.fmu"), Configuration(tcas=2)))  # an exported one as the source
    assert again.guid == Archive(configured_fmu(source, Configuration(tcas=2))).guid


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tcas", "13"], "--tcas"),
        (["--segments", "0"], "--segments"),
        (["--fmu", "heat"], "no such FMU; allowed: rod, thermal"),
        (["--like", "step", "--tcas", "4"], "--set body.tcas=4"),
        (["--scene", "step"], "--like"),
        (["--set", "rod.order=2"], "--like"),
        (["--like", "step", "--fmu", "heat"], "no such FMU"),
        (["--like", "nosuch"], "no scene"),
        (["-o", "elsewhere"], "name one"),
    ],
)
def test_refusals_of_the_command(arguments: list[str], words: str, tmp_path: Path) -> None:
    answer = exported(tmp_path, *arguments)
    assert not answer.startswith("0:")
    assert words in " ".join(answer.split())


def test_scene_says_its_size() -> None:
    table = {**HEAT_ALONE, "body": {"tcas": 4}, "thermal": {"V": [0, 1, 2, 3], "level": "lumped", "tolerance": 0.1}}
    scene = scenes.read(table)
    heat = scene.member("thermal")
    assert heat.archive.vectors["T"] == ("T[1]", "T[2]", "T[3]", "T[4]")
    assert heat.archive.path.name == "thermal.fmu"
    result = tca.run(scene)
    assert result["thermal.T"].shape[1] == 4
    assert result["thermal.T"][-1, 3] > result["thermal.T"][-1, 2]
    again = scenes.changed(scenes.read({**HEAT_ALONE, "body": {"tcas": 4}, "thermal": {"V": 1.0}}), ["body.tcas=2"])
    assert len(again.member("thermal").archive.vectors["T"]) == 2
    own = scenes.read({**HEAT_ALONE, "body": {"tcas": 4}, "thermal": {"body": {"tcas": 5}}})
    assert len(own.member("thermal").archive.vectors["T"]) == 5
    apart = scenes.read({"stop_time": 1.0, "connections": [], "thermal": {"body": {"tcas": 2}}})
    assert [len(apart.member(name).archive.vectors["T"]) for name in ("thermal", "rod")] == [2, 3]


def test_scenes_without_a_size_use_the_fmus_as_they_are() -> None:
    assert scenes.read("step").member("thermal").archive.path == find_fmu("thermal.fmu")


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("body.tcas=13", "whole number from 1 to 12"),
        ("body.tcas=true", "whole number"),
        ("body.segments=7", "1 to 6"),
        ("thermal.body.tcas=0", "thermal.body.tcas"),
        ("body.tca=4", "body.tca"),
    ],
)
def test_refusals_of_sizes(override: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        scenes.read("step", [override])


def test_a_value_for_all_tcas_and_values_one_by_one() -> None:
    base = {**HEAT_ALONE, "body": {"tcas": 2}}
    alike = scenes.read({**base, "tca": {"R": "7 ohm"}}).member("thermal")
    assert alike.reals("tca.R") == (7.0, 7.0)
    each = scenes.read({**base, "tca": {"R": ["7 ohm", "8 ohm"]}, "thermal": {"tca.R[1]": "6 ohm"}}).member("thermal")
    assert each.reals("tca.R") == (6.0, 8.0)


def test_fmus_are_made_once_by_many_processes(tmp_path: Path) -> None:
    program = (
        "from tca_cosim.fmi.archive import Archive, find_fmu\n"
        "from tca_cosim.fmi.configuration import Configuration, configured_fmu\n"
        "print(Archive(configured_fmu(Archive(find_fmu('thermal.fmu')), Configuration(tcas=7))).digest)\n"
    )
    environment = {"TCA_COSIM_CACHE": str(tmp_path), "PYTHONPATH": ":".join(sys.path)}

    def digest(_: int) -> str:
        return subprocess.run(
            [sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True
        ).stdout

    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        actual = set(pool.map(digest, range(3)))
    assert len(actual) == 1
    kept = [path for path in (tmp_path / "configured").iterdir() if not path.name.startswith(".")]
    assert len(kept) == 1


def test_without_a_cache_fmus_are_made_for_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TCA_COSIM_CACHE", "")
    path = configured_fmu(Archive(find_fmu("thermal.fmu")), Configuration(tcas=2))
    assert path.is_file()
    assert path == configured_fmu(Archive(find_fmu("thermal.fmu")), Configuration(tcas=2))


def test_a_stale_description_does_not_load(tmp_path: Path) -> None:
    four, five = (configured_fmu(Archive(find_fmu("thermal.fmu")), Configuration(tcas=n)) for n in (4, 5))
    mixed = tmp_path / "mixed.fmu"
    with zipfile.ZipFile(four) as one, zipfile.ZipFile(five) as other, zipfile.ZipFile(mixed, "w") as target:
        for name in one.namelist():
            target.writestr(name, (other if name == "modelDescription.xml" else one).read(name))
    with pytest.raises(tca.CosimError, match=r"for the configuration in its resources.*build the FMU again"):
        tca.run({**HEAT_ALONE, "fmus": {"thermal": str(mixed)}})


def _moving_count(member: scenes.Member) -> int:
    """Number of states of the level that a scene chooses."""
    if member.archive.description.model_name == "thermal":
        reduced = {2: 22, 3: 30}[len(member.archive.vectors["T"])]  # at the default tolerance
        return {"lumped": 4, "reduced": reduced, "full": 0}[member.choice("level")]  # full: its own steps alone
    if not member.value("dynamic") or member.choice("method") == "pade_euler":
        return 0
    strains = {"bending": 2, "extensible": 3, "kirchhoff": 4, "cosserat": 6}[member.choice("strains")]
    segments = len(member.archive.vectors["segment.length"])
    return 2 * segments * (int(member.real("order")) + 1) * strains + 1


SAMPLE = ("step", "stiff")
ALL = tuple(sorted(scenes.titles()))
BY_FMPY = [*SAMPLE, *(pytest.param(n, marks=pytest.mark.slow) for n in ALL if n not in SAMPLE)]
BY_LIBCOSIM = [pytest.param(n, marks=[pytest.mark.hosts, *([] if n == "step" else [pytest.mark.slow])]) for n in ALL]


def _own(name: str, folder: Path) -> Iterator[tuple[scenes.Member, Path, float, float]]:
    """The members of a scene that this package made, their FMUs as exported, stop time and step [s]."""
    assert exported(folder, "--like", name).startswith("0:")
    scene = scenes.read(name)
    stop, step = min(scene.stop_time, 0.3), min(scene.coupling.macro_step, 0.05)
    for member in scene.members:
        if can_configure(member.archive):
            yield member, folder / f"{member.name}.fmu", stop, step


def _alone(member: scenes.Member, stop: float, step: float) -> np.ndarray:
    """Outputs of a member's own FMU with the scene's values, by FMPy."""
    starts = {**member.parameters, **{n: s.polynomial(0.0, 1e-9)[0] for n, s in member.signals.items()}}
    settings = {"stop_time": stop, "output_interval": step, "output": _outputs(member), "fmi_type": "CoSimulation"}
    return fmpy.simulate_fmu(str(member.archive.path), start_values=starts, **settings)


def _outputs(member: scenes.Member) -> list[str]:
    variables = member.archive.variables.values()
    return [v.name for v in variables if v.causality == "output" and v.type == "Real"]


@pytest.mark.parametrize("name", BY_FMPY)
def test_like_a_scene_is_the_same_alone(name: str, tmp_path: Path) -> None:
    for member, path, stop, step in _own(name, tmp_path):
        assert fmpy.validation.validate_fmu(str(path)) == []
        offers_exchange = fmpy.read_model_description(str(path)).modelExchange is not None
        assert offers_exchange == (len(states(path)) > 0), "a host must not be offered what is refused"
        original = _alone(member, stop, step)
        if not member.value("planar"):
            assert len(states(path)) == _moving_count(member), member.name
        settings = {"stop_time": stop, "output_interval": step, "output": _outputs(member), "fmi_type": "CoSimulation"}
        alone = fmpy.simulate_fmu(str(path), **settings)
        for output in _outputs(member):
            scale = np.abs(original[output]).max()
            np.testing.assert_allclose(alone[output], original[output], rtol=0, atol=1e-9 * scale, err_msg=output)


@pytest.mark.parametrize("name", BY_LIBCOSIM)
def test_like_a_scene_is_the_same_in_another_host(name: str, tmp_path: Path) -> None:
    """libcosim, of the Open Simulation Platform, steps each exported FMU alone, with nothing set."""
    from libcosimpy.CosimEnums import CosimErrorCode
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.ERROR)
    for member, path, stop, step in _own(name, tmp_path):
        execution = CosimExecution.from_step_size(step * 1e9)
        slave = execution.add_local_slave(CosimLocalSlave(str(path), member.name))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        original, outputs = _alone(member, stop, step), _outputs(member)
        references = [member.archive.variables[output].reference for output in outputs]
        for row in original[1:]:
            execution.step()
            assert execution.status().error_code == CosimErrorCode.SUCCESS.value, f"{member.name} at {row['time']} s"
            actual = observer.last_real_values(slave, references)
            for output, value in zip(outputs, actual, strict=True):
                scale = float(np.abs(original[output]).max())
                assert abs(value - float(row[output])) <= 1e-9 * scale + 1e-15, f"{member.name}.{output}"


def test_an_integrator_sees_the_moving_states_alone(tmp_path: Path) -> None:
    exported(
        tmp_path,
        "--like",
        "step",
        "--fmu",
        "rod",
        "--set",
        "rod.order=0",
        "--set",
        "rod.closure=inside",
        "--set",
        "rod.dynamic=true",
    )
    path = tmp_path / "rod.fmu"
    assert len(states(path)) == 13
    settings = {"stop_time": 0.2, "output_interval": 0.02, "start_values": {"T[1]": 310.0}, "output": ["tip.p[1]"]}
    exchanged = fmpy.simulate_fmu(str(path), fmi_type="ModelExchange", relative_tolerance=1e-9, **settings)
    shipped = {"order": 0, **settings["start_values"]}
    whole = fmpy.simulate_fmu(
        str(find_fmu("rod.fmu")),
        fmi_type="ModelExchange",
        relative_tolerance=1e-9,
        **{**settings, "start_values": {**shipped, **_parameters("step")}},
    )
    np.testing.assert_allclose(exchanged["tip.p[1]"], whole["tip.p[1]"], atol=1e-8)


def _parameters(name: str) -> dict[str, object]:
    rod = scenes.read(name, ["rod.order=0", "rod.closure=inside", "rod.dynamic=true"]).member("rod")
    return dict(rod.parameters)


def test_a_body_of_four_tcas_and_two_segments_in_one_scene() -> None:
    table = {"stop_time": 0.4, "body": {"tcas": 4, "segments": 2}, "tca": {"offset": "2.4 mm"}}
    scene = scenes.read({**table, "thermal": {"V": [0, 0, 3, 0]}, "rod": {"dynamic": False}})
    assert [scene.member(name).reals("tca.offset") for name in ("thermal", "rod")] == [(0.0024,) * 4] * 2
    result = tca.run(scene)
    assert result["rod.delta"].shape[1] == 4
    np.testing.assert_allclose(result["rod.T"], result["thermal.T"])
    assert result["rod.tip.p"][-1, 0] > 1e-4  # away from the third TCA, at 180 degrees
    segments = {"rod.order": 0}
    one, two = (tca.run(scenes.changed(scene, {**segments, "body.segments": n})) for n in (1, 2))
    np.testing.assert_allclose(two["rod.tip.p"], one["rod.tip.p"], atol=1e-9)  # constant strain


def test_a_value_for_all_tcas_sets_each_and_the_last_one_given_wins() -> None:
    base = {"stop_time": "1 s", "rod": {"tca.E": "500 MPa", "tca.E[2]": "600 MPa", "dynamic": False}}
    scene = tca.read(base)
    rod = scene.member("rod")
    assert [rod.value(f"tca.E[{i}]") for i in (1, 2, 3)] == [5e8, 6e8, 5e8]
    again = tca.read(base, {"rod.tca.E": "700 MPa"})
    rod = again.member("rod")
    assert {rod.value(f"tca.E[{i}]") for i in (1, 2, 3)} == {7e8}


def test_scenes_of_other_bodies_bend_the_way_they_must() -> None:
    tip = {name: tca.run(name, {"stop_time": "4 s"})["rod.tip.p"][-1].to_numpy() for name in ("antagonist", "serial")}
    assert tip["antagonist"][0] < -2e-3  # both bend towards -x
    assert tip["serial"][0] < 0.0
    assert max(abs(each[1]) for each in tip.values()) < 1e-9
    taper = tca.run("taper", {"stop_time": "1 s"})
    assert taper.attrs["status"] == "complete"


def test_ports_give_the_reaction_of_the_clamp() -> None:
    result = tca.run(
        {
            "stop_time": "0.1 s",
            "fmus": {"rod": "rod.fmu"},
            "connections": [],
            "body": {"ports": True},
            "rod": {"gravity": [9.81, 0, 0], "dynamic": False, "shape.f[1,2]": "1 N/m"},
        }
    )
    weight = 1040 * np.pi * 5e-3**2 * 40e-3 * 9.81
    force = result["rod.base.force"][-1].to_numpy()
    assert force[0] == pytest.approx(-weight, rel=1e-9)
    assert force[1] == pytest.approx(-1.0 * 0.5 * 2e-3, rel=1e-9)  # half a spacing of 2 mm at the clamp
    with pytest.raises(tca.SceneError, match="give true or false"):
        tca.read({"body": {"ports": "yes"}})


def _at_once(path: Path, output: str) -> set[str]:
    """Inputs and states that the description declares to act on an output at once."""
    outputs = {unknown.variable.name: unknown for unknown in fmpy.read_model_description(str(path)).outputs}
    return {variable.name for variable in outputs[output].dependencies}


def test_a_rod_at_rest_declares_that_its_shape_follows_the_inputs(tmp_path: Path) -> None:
    exported(tmp_path, "--like", "step", "--fmu", "rod", "--set", "rod.dynamic=false", "--set", "rod.closure=inside")
    resting = _at_once(tmp_path / "rod.fmu", "tip.p[1]")
    assert {"T[1]", "T[3]", "gravity[2]", "tip_force[1]", "tip_moment[3]"} <= resting
    moving = _at_once(find_fmu("rod.fmu"), "tip.p[1]")
    assert moving
    assert all(name.startswith("strain") for name in moving)  # as rod_fmu/fmu/notes.md says
