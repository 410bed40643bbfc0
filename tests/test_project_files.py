"""Files about the project agree: one version, the same linters everywhere, markers of modules that exist."""

from __future__ import annotations

import ast
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


VAGUE = {"place", "found", "about", "told"}  # words that mean too much to name code
PYTHON = [path for folder in ("orchestration", "docs") for path in sorted((ROOT / folder).rglob("*.py"))]
CXX = [
    path
    for folder in ("rod_fmu", "thermal_fmu", "fmus", "orchestration")
    for ending in ("c", "h", "cpp", "hpp")
    for path in sorted((ROOT / folder).rglob(f"*.{ending}"))
]
COMMENT_OR_TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)


def names(node: ast.AST) -> set[str]:
    """Identifiers that a node introduces or uses."""
    fields = (getattr(node, field, None) for field in ("id", "arg", "attr", "name", "asname"))
    return {name for name in fields if isinstance(name, str) and not name.startswith("test_")}


def is_vague(name: str) -> bool:
    return not VAGUE.isdisjoint(name.split("_"))


def test_python_names_are_terms_of_the_field() -> None:
    word = re.compile(rf"(?<![^\W_])({'|'.join(VAGUE)})(?![^\W_])")
    candidates = {path: text for path in PYTHON if word.search(text := path.read_text(encoding="utf-8"))}
    nodes = ((path, node) for path, text in candidates.items() for node in ast.walk(ast.parse(text)))
    assert not {(path.name, name) for path, node in nodes for name in names(node) if is_vague(name)}


def test_docstrings_start_with_a_verb_or_a_noun() -> None:
    start = re.compile(r'"""(Of|About|Told|Found)\b.*')
    assert not [(path.name, text[0]) for path in PYTHON if (text := start.search(path.read_text(encoding="utf-8")))]


def test_cxx_names_are_terms_of_the_field() -> None:
    assert CXX
    code = {path: COMMENT_OR_TEXT.sub("", path.read_text(encoding="utf-8")) for path in CXX}
    wrong = {(path.name, name) for path, text in code.items() for name in re.findall(r"[A-Za-z_]\w*", text)}
    assert not {(path, name) for path, name in wrong if is_vague(name)}
