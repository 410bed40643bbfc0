"""Other makers' hosts run scene `step` with our FMUs and agree with our master to their own coupling order; other
makers' checkers find nothing. tests/hosts has a script for each host; .ci/hosts installs what is no dependency."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmpy import read_model_description
from fmu_host import ROOT
from tca_cosim.benchmarks.peers import cofmupy
from tca_cosim.scene import ssp_writer

HOSTS = ROOT / "tests" / "hosts"
INSTALLED = ROOT / "build" / "hosts"
STEPS = (0.1, 0.05)  # s
SHIPPED = pytest.mark.parametrize("name", ["thermal", "rod"])


def run(*command: str | Path, **environment: str) -> str:
    """What it says; checked, with its words in the failure."""
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{command}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout + done.stderr


@pytest.fixture(scope="session")
def installed() -> Path:
    assert (INSTALLED / "vdmcheck").is_dir(), f"{INSTALLED} is not there; run: .ci/hosts build/hosts {sys.executable}"
    return INSTALLED


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ssp") / "scene.ssp"
    ssp_writer.write(path)
    return path


@pytest.fixture(scope="module")
def ours() -> dict[float, tuple[np.ndarray, np.ndarray]]:
    """By macro step: T [K] and tip [m] at the ends of the macro steps."""
    actual = {}
    for h in STEPS:
        result = tca.run(tca.read("step", ["rod.closure=inside", f"coupling.macro_step={h}"]))
        actual[h] = result["thermal.T"].to_numpy()[1:], result["rod.tip.p"].to_numpy()[1:]
    return actual


# Order of the error of the rod, which is at equilibrium with the temperature that the host gives it: that of the step
# before (1), or that at the end of the step (none is left).
@pytest.mark.parametrize(
    ("script", "packed", "order"),
    [
        ("with_fmpy.py", False, 1),
        ("with_fmpy_ssp.py", True, 1),
        ("with_libcosim.py", False, 1),
        ("with_libcosim.py", True, 1),
        ("with_ecos.py", False, 1),
        ("with_ecos.py", True, 1),
        ("with_cofmupy.py", False, None),
        ("with_maestro.py", False, 1),
        ("with_fmucontainer.py", False, None),
    ],
    ids=["fmpy", "fmpy-ssp", "libcosim", "libcosim-ssp", "ecos", "ecos-ssp", "cofmupy", "maestro", "fmucontainer"],
)
def test_it_runs_scene_step_and_agrees(
    script: str,
    packed: bool,
    order: int | None,
    archive: Path,
    ours: dict[float, tuple[np.ndarray, np.ndarray]],
    installed: Path,
    tmp_path: Path,
) -> None:
    needs = {"MAESTRO": str(installed / "java")}
    if script == "with_cofmupy.py":
        needs["PYTHONPATH"] = str(installed / "cofmupy")
    apart = []  # [m], the largest of all macro steps
    for h in STEPS:
        table = tmp_path / "table.csv"
        run(sys.executable, HOSTS / script, archive if packed else ROOT / "fmus", str(h), table, **needs)
        rows = np.loadtxt(table, delimiter=",", skiprows=1)
        T, tip = ours[h]
        assert rows.shape == (len(T), 7)
        np.testing.assert_allclose(rows[:, 0], h * np.arange(1, len(T) + 1), rtol=1e-12)
        np.testing.assert_allclose(rows[:, 1:4], T, rtol=0.0, atol=1e-9)  # nothing is coupled into it
        apart.append(np.abs(rows[:, 4:] - tip).max())
        if order == 1:
            late = rows[1:, 4:] - tip[:-1]
            assert np.abs(late).max() < 1e-9, "more than the step's delay is between the two"
    if order is None:
        assert max(apart) < 1e-9
    else:
        assert apart[0] < 1e-3
        assert np.log2(apart[0] / apart[1]) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize(
    ("settings", "verdict"), [(["parameters=measured"], "converges"), ([], "ends at step 1 of 20")], ids=["0.4", "3.2"]
)
def test_cofmupys_rollback_iterates_where_the_gain_is_below_1(
    settings: list[str], verdict: str, installed: Path, tmp_path: Path
) -> None:
    """Its plain iteration multiplies an error by the gain of the loop and stops at 1e-3; ours needs no gain below 1."""
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nPYTHONPATH={installed / "cofmupy"} exec {sys.executable} "$@"\n')
    python.chmod(0o755)
    settings = [*settings, "stop_time=2"]
    exact = tca.run(tca.read("step", [*settings, "rod.closure=inside"]))["rod.delta"].to_numpy()[1:]
    scene = tca.read("step", [*settings, f"connections={cofmupy.WIRES}"])
    watch = [("rod", f"delta[{k}]") for k in (1, 2, 3)]
    said, error = cofmupy.rate(cofmupy.run_theirs(python, scene, watch, tmp_path), exact)
    assert said.startswith(verdict)
    assert error < 0.03 or verdict != "converges"
    said, error = cofmupy.rate(cofmupy.run_ours(scene, watch), exact)
    assert (said, error < 1e-5) == ("converges", True)


@SHIPPED
def test_fmpys_commands_validate_and_simulate(name: str, tmp_path: Path) -> None:
    fmu = ROOT / "fmus" / f"{name}.fmu"
    assert "No problems found" in run(sys.executable, "-m", "fmpy", "validate", fmu)
    table = tmp_path / "table.csv"
    options = ["--stop-time", "2", "--output-interval", "0.5", "--output-file", table]
    run(sys.executable, "-m", "fmpy", "simulate", fmu, *options)
    with table.open() as file:
        heads, *rows = csv.reader(file)
    assert [float(row[heads.index("time")]) for row in rows] == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])
    outputs = {
        variable.name for variable in read_model_description(str(fmu)).modelVariables if variable.causality == "output"
    }
    assert set(heads) == {"time"} | outputs


def vdmcheck(installed: Path, subject: Path) -> str:
    """What it says; it leaves a file where it runs."""
    command = ["java", "-jar", "vdmcheck2.jar", subject]
    done = subprocess.run(command, cwd=installed / "vdmcheck", capture_output=True, text=True, timeout=300, check=False)
    return done.stdout + done.stderr


@SHIPPED
def test_the_fmu_manipulation_toolbox_finds_no_error(name: str) -> None:
    command = Path(sys.executable).with_name("fmutool")
    said = run(command, "-input", ROOT / "fmus" / f"{name}.fmu", "-check")
    assert "No semantic error against the FMI-2 standard" in said
    assert "seems to be compliant with FMI-2.0" in said
    assert not {"ERROR", "WARNING"} & set(said.split())


@SHIPPED
def test_vdmcheck_finds_no_error(name: str, installed: Path) -> None:
    assert vdmcheck(installed, ROOT / "fmus" / f"{name}.fmu").strip() == "No errors found."


def test_vdmcheck_finds_what_is_wrong(installed: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(ROOT / "fmus" / "thermal.fmu") as opened:
        xml = opened.read("modelDescription.xml").decode()
    bad = tmp_path / "modelDescription.xml"
    bad.write_text(xml.replace('initial="calculated"', 'initial="exact"'))
    said = vdmcheck(installed, bad)
    assert 'Variable "T[1]" initial/variability/start <exact>/<continuous>/nil invalid' in said
    assert said.strip().endswith("Errors found.")
