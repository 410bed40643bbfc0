"""Imports go one way: errors and values, subsystems, coupling, scene, results, charts, command line."""

from __future__ import annotations

import ast
from pathlib import Path

import orchestration

FOLDER = Path(orchestration.__file__).parent
ORDER = (
    ("errors", "units", "signals", "subsystem", "whole", "described", "machine"),
    ("figures", "spread"),
    ("archive", "linear", "wiring"),
    ("instance",),
    ("slave",),
    ("resting",),
    ("exchange", "iteration", "failure"),
    ("network",),
    ("settle", "couple"),
    ("master",),
    ("stepping",),
    ("drive",),
    ("check",),
    ("settings", "ssp_reader"),
    ("asked",),
    ("scene",),
    ("closing", "results", "ssp"),
    ("simulate",),
    ("compare", "fidelity", "timing"),
    ("monolith",),
    ("reference", "paper"),
    ("peers", "stability", "sweep"),
    ("chart",),
    ("report",),
    ("accessor", "api"),
    ("cli",),
)
RANK = {name: rank for rank, layer in enumerate(ORDER) for name in layer}


def module_of(path: Path) -> str:
    parts = path.relative_to(FOLDER).with_suffix("").parts
    return parts[0]


def imported(path: Path) -> set[str]:
    """Top modules of the package that a file imports."""
    depth = len(path.relative_to(FOLDER).parts)  # 1: in the package's own folder
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level == depth:
            found |= {node.module.split(".")[0]} if node.module else {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level > depth:
            raise AssertionError(f"{path} imports from outside the package")
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [node.module] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
            assert not any(name and name.split(".")[0] == "orchestration" for name in names), (
                f"{path}: use relative imports"
            )
    return found


def test_nothing_later_is_imported_by_anything_earlier() -> None:
    files = [path for path in FOLDER.rglob("*.py") if path.name != "__init__.py" or path.parent != FOLDER]
    assert {module_of(path) for path in files} <= set(RANK)
    edges = [(module_of(path), other) for path in files for other in imported(path)]
    assert len(edges) > 40
    wrong = [f"{one} imports {other}" for one, other in edges if RANK[other] >= RANK[one] and other != one]
    assert not wrong
