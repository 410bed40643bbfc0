"""Imports go one way: ground modules, then packages from co-simulation to the command line."""

from __future__ import annotations

import ast
from pathlib import Path

import tca_cosim

FOLDER = Path(tca_cosim.__file__).parent
ORDER = (
    ("errors",),
    ("files", "packages", "parallel", "plotting"),
    ("cosim",),
    ("fmi",),
    ("scene",),
    ("results",),
    ("simulation",),
    ("engine",),
    ("verification", "studies"),
    ("benchmarks",),
    ("visualization",),
    ("api",),
    ("stepping",),
    ("linear",),
    ("planning", "identification"),
    ("control",),
    ("cli",),
)
RANK = {name: rank for rank, layer in enumerate(ORDER) for name in layer}


def imported(path: Path) -> set[str]:
    """Dotted names of the package's modules that a file imports, relative to the package: 'fmi.archive'."""
    parents = path.relative_to(FOLDER).parts[:-1]
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            assert node.level <= len(parents) + 1, f"{path} imports from outside the package"
            base = (*parents[: len(parents) + 1 - node.level], *(node.module or "").split("."))
            names |= {".".join(filter(None, (*base, alias.name))) for alias in node.names}
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            absolute = [node.module] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
            assert not any(name and name.split(".")[0] in ("orchestration", "tca_cosim") for name in absolute), (
                f"{path}: use relative imports"
            )
    return names


def files() -> list[Path]:
    """Modules of the package: not its top, nor FMUs written in Python, which are data of scenes."""
    return [
        path
        for path in FOLDER.rglob("*.py")
        if (path.parent != FOLDER or path.name != "__init__.py") and path.parent != FOLDER / "scenes"
    ]


def package_of(path: Path) -> str:
    return path.relative_to(FOLDER).with_suffix("").parts[0]


def test_the_root_holds_the_packages_and_little_else() -> None:
    assert {package_of(path) for path in files()} == set(RANK)
    modules = {path.stem for path in FOLDER.glob("*.py")}
    assert modules == {"__init__", "api", "errors", "files", "packages", "parallel", "simulation"}


def test_no_package_imports_one_above_it() -> None:
    edges = [(package_of(path), name.split(".")[0]) for path in files() for name in imported(path)]
    assert len(edges) > 40
    assert not [f"{one} imports {other}" for one, other in edges if other != one and RANK[other] >= RANK[one]]


def test_no_circle_among_the_modules() -> None:
    dotted = {path: ".".join(path.relative_to(FOLDER).with_suffix("").parts) for path in files()}
    names = {path: name.removesuffix(".__init__") for path, name in dotted.items()}
    modules = set(names.values())
    graph = {
        name: {m for used in imported(path) for m in (used, used.rpartition(".")[0]) if m in modules and m != name}
        for path, name in names.items()
        if path.name != "__init__.py"  # a package's front re-exports what lies behind it
    }
    done: set[str] = set()

    def visit(name: str, trail: tuple[str, ...]) -> None:
        assert name not in trail, " -> ".join((*trail, name))
        if name not in done:
            for other in sorted(graph.get(name, ())):
                visit(other, (*trail, name))
            done.add(name)

    for name in sorted(graph):
        visit(name, ())
