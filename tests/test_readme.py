"""Every command and script in README.md runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
COMMANDS = [line for kind, text in BLOCKS if kind == "sh" for line in text.splitlines() if line]
INLINE = re.findall(r"`(tca-cosim [^`]+)`", (ROOT / "README.md").read_text())
SCRIPTS = [text for kind, text in BLOCKS if kind == "python"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a tca-cosim on its PATH that is this source tree's, and the exported FMUs."""
    folder = tmp_path_factory.mktemp("readme")
    command = folder / "bin" / "tca-cosim"
    command.parent.mkdir()
    command.write_text(f"#!{sys.executable}\nfrom tca_cosim.cli import app\n\napp()\n")
    command.chmod(0o755)
    run("tca-cosim export .", folder)
    return folder


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    return done


@pytest.mark.parametrize("command", [c for c in COMMANDS if not c.startswith("make")])
def test_commands(command: str, place: Path) -> None:
    done = run(command, place)
    assert done.returncode == 0, done.stderr


def test_make_commands() -> None:
    """make test is what runs this; make demo ends with the figure, which another of these tests draws."""
    made = [c for c in COMMANDS if c.startswith("make")]
    assert made == ["make demo", "make test"]
    dry = subprocess.run(
        ["make", "--no-print-directory", "-n", "demo"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert dry.stdout.splitlines()[-1].endswith("tca-cosim paper")
    assert "tca-cosim paper" in COMMANDS


def test_commands_in_the_text(place: Path) -> None:
    (place / "mine.toml").write_text('stop_time = "1 s"\n[rod]\ndynamic = false\n')
    expected = {
        "tca-cosim run mine.toml": 0,
        "tca-cosim run plain": 2,
        "tca-cosim export fmus-here": 0,
        "tca-cosim monolith step --set stop_time=5": 0,
        "tca-cosim modes step --time 20": 0,
        "tca-cosim export --ssp scene.ssp": 0,
        "tca-cosim run scene.ssp": 0,
    }
    assert set(INLINE) == set(expected)
    for command, code in expected.items():
        assert run(command, place).returncode == code


@pytest.mark.parametrize("script", SCRIPTS, ids=["master", "fmpy"])
def test_scripts(script: str, place: Path) -> None:
    done = run(f"{sys.executable} - <<'END'\n{script}\nEND", place)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_the_fmpy_script_has_about_ten_lines() -> None:
    assert len([line for line in SCRIPTS[1].splitlines() if line]) <= 12


def test_the_figure_is_there() -> None:
    assert (ROOT / "docs" / "figures" / "fig3.png").stat().st_size > 10_000
