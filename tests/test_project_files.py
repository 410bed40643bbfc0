"""Files about the project agree: one version, the same linters everywhere, markers of modules that exist."""

from __future__ import annotations

import re
from pathlib import Path

from conftest import HOSTS, SLOW

ROOT = Path(__file__).parent.parent


def read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_one_version() -> None:
    version = re.search(r"project\(tca_cosim VERSION ([0-9.]+)", read("CMakeLists.txt"))[1]
    assert re.search(r"^version: (\S+)$", read("CITATION.cff"), re.MULTILINE)[1] == version
    assert re.search(r"^## ([0-9.]+)", read("CHANGELOG.md"), re.MULTILINE)[1] == version


def test_hooks_call_the_linters_of_make() -> None:
    """Options differ: a hook may mend what make only reports."""
    makefile = read("Makefile")
    lint = makefile.split("\nlint:\n", 1)[1].split("\n\n", 1)[0]
    hooks = re.findall(r"^ +entry: (.+)$", read(".pre-commit-config.yaml"), re.MULTILINE)
    named = {re.match(r"(python -m mypy|ruff \w+|clang-format)", line.strip())[1] for line in lint.splitlines()}
    assert {re.match(r"(python -m mypy|ruff \w+|clang-format)", hook)[1] for hook in hooks} == named


def test_marked_modules_exist() -> None:
    assert not [name for name in HOSTS | SLOW if not (ROOT / "tests" / f"{name}.py").exists()]


def test_every_test_has_a_time_limit() -> None:
    assert re.search(r"^timeout = \d+", read("pyproject.toml"), re.MULTILINE)
