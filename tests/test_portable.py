"""The FMUs elsewhere: in a host in plain C, on Windows (under Wine), from a wheel on a machine without a compiler."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_host import ROOT

BUILD = ROOT / "build"
NAMES = ("thermal", "rod", "sum")
EACH = pytest.mark.parametrize("name", NAMES)
WINE = shutil.which("wine64") or "/usr/lib/wine/wine64"  # Debian's package has no command


def output_of(*command: str | Path, **settings) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True, **settings).stdout


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fmus")
    for name in NAMES:
        zipfile.ZipFile(ROOT / f"fmus/{name}.fmu").extractall(folder / name)
    return folder


@pytest.fixture(scope="module")
def wine():
    """The environment that Wine wants, with a Windows of its own in the build folder."""
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment |= {"WINEPREFIX": str(BUILD / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    subprocess.run([WINE, "wineboot"], env=environment, check=True, capture_output=True)
    yield environment
    server = shutil.which("wineserver") or "/usr/lib/wine/wineserver64"
    subprocess.run([server, "-k"], env=environment, check=False)


@pytest.fixture(scope="module")
def on_linux(unpacked: Path) -> np.ndarray:
    return rows(output_of(BUILD / "tests/embed/embed", "thermal", "rod", cwd=unpacked))


def rows(text: str) -> np.ndarray:
    """Time [s], T[1..3] [K], tip.p[1..3] [m], 300 rows."""
    return np.array([[float(word) for word in line.split()] for line in text.splitlines()])


@EACH
def test_windows_itself_has_all_that_its_binary_asks_for(name: str, unpacked: Path):
    headers = output_of("objdump", "-p", unpacked / name / f"binaries/win64/{name}.dll")
    assert set(re.findall(r"DLL Name: (\S+)", headers)) == {"KERNEL32.dll", "msvcrt.dll"}


@EACH
def test_both_binaries_export_the_same_functions(name: str, unpacked: Path):
    binaries = unpacked / name / "binaries"
    symbols = output_of("nm", "-D", "--defined-only", binaries / f"linux64/{name}.so").splitlines()
    headers = output_of("objdump", "-p", binaries / f"win64/{name}.dll")
    names = re.findall(r"^\s+\[ *\d+\] (?:\+base\[ *\d+\] +[\da-f]+ )?(\w+)$", headers, re.MULTILINE)
    assert set(names) == {symbol.split()[-1] for symbol in symbols}
    assert len(set(names) - {"tcaExport"}) == 44


def test_windows_and_linux_agree(unpacked: Path, wine: dict[str, str], on_linux: np.ndarray):
    on_windows = rows(output_of(WINE, BUILD / "win64/embed.exe", "thermal", "rod", cwd=unpacked, env=wine))
    np.testing.assert_allclose(on_windows[:, :4], on_linux[:, :4], rtol=1e-9)
    assert np.abs(on_windows[:, 4:] - on_linux[:, 4:]).max() <= 1e-9 * np.linalg.norm(on_linux[:, 4:], axis=1).max()


def test_the_host_in_c_agrees_with_the_master(on_linux: np.ndarray):
    """Through equilibria the shape follows the temperatures at once: held inputs cost no accuracy."""
    result = tca.run(tca.read("step", ["rod.closure=inside", "coupling.macro_step=0.1 s"]))
    at = np.searchsorted(result["time"].values, on_linux[:, 0] - 1e-6)
    assert np.abs(on_linux[:, 1:4] - result["thermal.T"].values[at]).max() < 1e-10
    assert np.abs(on_linux[:, 4:] - result["rod.tip.p"].values[at]).max() < 1e-12


@pytest.mark.parametrize("system", ["linux", "windows"])
def test_exceptions_end_as_a_status_and_a_message(system: str, unpacked: Path, request: pytest.FixtureRequest):
    host = [BUILD / "tests/embed/embed"] if system == "linux" else [WINE, BUILD / "win64/embed.exe"]
    environment = None if system == "linux" else request.getfixturevalue("wine")
    end = subprocess.run(
        [*host, "thermal", "rod", "body.length=-1"], cwd=unpacked, env=environment, capture_output=True, text=True
    )
    assert end.returncode == 1
    assert "body.length = -1 m refused; allowed: " in end.stderr
    assert "failed: fmi2SetReal" in end.stderr


def test_the_wheel_runs_where_there_is_no_compiler(tmp_path: Path):
    """In an environment of its own; what it depends on is lent by this one."""
    [wheel] = (BUILD / "wheel").glob("*.whl")
    assert wheel.name.endswith("-py3-none-manylinux2014_x86_64.whl")
    output_of(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    python = tmp_path / "venv/bin/python"
    output_of(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", wheel)
    [packages] = (tmp_path / "venv").glob("lib/python*/site-packages")
    (packages / "lent.pth").write_text("\n".join(path for path in sys.path if path.endswith("site-packages")))
    alone = {"PATH": str(tmp_path / "venv/bin"), "HOME": str(tmp_path), "LANG": "C.UTF-8"}
    actual = output_of(python, "-c", "import tca_cosim; print(tca_cosim.__file__)", cwd=tmp_path, env=alone)
    assert actual.startswith(str(packages))
    run = [tmp_path / "venv/bin/tca-cosim", "run", "step", "--set", "stop_time=1 s"]
    output_of(*run, cwd=tmp_path, env=alone)
    for name in NAMES:
        with zipfile.ZipFile(packages / f"tca_cosim/_fmus/{name}.fmu") as fmu:
            assert {f"binaries/linux64/{name}.so", f"binaries/win64/{name}.dll"} <= set(fmu.namelist())
