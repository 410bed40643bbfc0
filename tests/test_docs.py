"""docs/reference.md and docs/campaigns.md: up to date, and everything in it once; the diagrams: up to date."""

from __future__ import annotations

import importlib.util
import itertools
import re
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import campaigns
import pytest
import typer
from tca_cosim import scene
from tca_cosim.cli import app
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.scene.schema import declared
from tca_cosim.studies import sweep
from test_layers import ORDER

DOCS = Path(__file__).parent.parent / "docs"


def load(name: str) -> ModuleType:
    """A script of docs/ as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


reference = load("reference")
PAGE = reference.FILE.read_text(encoding="utf-8")


def section(title: str) -> str:
    """From a heading to the next of its level."""
    level = title.split()[0]
    return re.split(rf"^{level} ", PAGE.split(f"{title}", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]


def entries(text: str) -> Counter[str]:
    """What the first columns of a section's tables name."""
    return Counter(re.findall(r"^\| `([^`]+)`", text, flags=re.MULTILINE))


def test_the_table_of_campaigns_is_that_of_their_records() -> None:
    assert campaigns.PAGE.read_text(encoding="utf-8") == campaigns.page(campaigns.read()), "python tests/campaigns.py"
    assert {each["campaign"] for each in campaigns.read()} == set(campaigns.CAMPAIGNS)


def test_the_reference_is_up_to_date() -> None:
    assert reference.text() == PAGE, "docs/reference.md is older than what it describes: run `make reference`"


def test_every_command_is_there_once_and_says_what_it_does() -> None:
    commands = {name: c for name, c in typer.main.get_command(app).commands.items() if not c.hidden}
    assert re.findall(r"^### `tca-cosim (\w+)", PAGE, flags=re.MULTILINE) == list(commands)
    for name, command in commands.items():
        assert command.help, name
        assert all(p.help for p in command.params), name


def test_every_key_is_there_once_with_its_meaning() -> None:
    for title, keys in {"## Scenes": scene.KEYS, "## Sweeps": sweep.KEYS}.items():
        actual = entries(section(title))
        assert all(actual[key] >= 1 and meaning for key, meaning in keys.items())
    tables = {f"### Table `[{name}]`": kind for name, kind in scene.TABLES.items()}
    for title, kind in tables.items():
        assert entries(section(title)) == Counter(list(declared(kind)))
        assert all(v.description for v in declared(kind).values())
    assert entries(section("## Sweeps")) == Counter([*sweep.KEYS, *declared(sweep.SweepSettings)])


@pytest.mark.parametrize("name", ["thermal", "rod"])
def test_every_variable_is_there_once(name: str) -> None:
    with Archive(find_fmu(f"{name}.fmu")) as archive:
        variables = archive.variables
    actual = entries(section(f"## {name}.fmu"))
    assert set(actual.values()) == {1}
    assert Counter(itertools.chain.from_iterable(map(expanded, actual))) == Counter(list(variables))
    assert all(v.description for v in variables.values())


def expanded(name: str) -> list[str]:
    """T[1..3] -> T[1], T[2], T[3]"""
    parts = re.split(r"(\d+\.\.\d+)", name)
    choices = [
        [str(k) for k in range(int(part.split("..")[0]), int(part.split("..")[1]) + 1)] if ".." in part else [part]
        for part in parts
    ]
    return ["".join(choice) for choice in itertools.product(*choices)]


def test_the_diagrams_are_up_to_date() -> None:
    diagrams = load("diagrams")
    for name, content in diagrams.diagrams().items():
        assert (DOCS / "figures" / name).read_text(encoding="utf-8") == content, "run python docs/diagrams.py"


def test_the_diagram_shows_the_layers() -> None:
    rows = [{name for name, _ in row} for row in load("diagrams").LAYERS]
    assert rows == [set(layer) for layer in reversed(ORDER)]
