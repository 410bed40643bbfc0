"""What a process loads, by modules, not by time; results without xarray; the order of a macro step."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import tca_cosim
import typer
import xarray as xr
from tca_cosim import results, simulation
from tca_cosim.cli import application, plain
from tca_cosim.cosim.topology import Component, Connection, components
from typer.testing import CliRunner

PACKAGES = Path(tca_cosim.__file__).parents[1]
HEAVY = ("pandas", "xarray", "matplotlib", "netCDF4", "networkx", "pint", "scipy", "fmpy", "lxml", "dask", "typer")


def loaded(code: str, *arguments: str, folder: Path | None = None, **environment: str) -> set[str]:
    """Top-level modules that a new process has at the end of a piece of code."""
    show = "; import sys, json; print(json.dumps(sorted({m.split('.')[0] for m in sys.modules})))"
    done = subprocess.run(
        [sys.executable, "-c", code + show, *arguments],
        env={**os.environ, "PYTHONPATH": str(PACKAGES), **environment},
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


MAIN = "from tca_cosim.cli import main; main()"


def test_importing_and_listing_load_nothing_large() -> None:
    assert not loaded("import tca_cosim as tca; tca.__version__, tca.SceneError") & {*HEAVY, "numpy"}
    assert not loaded(MAIN, "list") & {*HEAVY, "numpy"}


def test_the_help_loads_typer_alone() -> None:
    code = "import sys; from tca_cosim.cli import application\ntry:\n    application.app()\nexcept SystemExit: pass\n"
    assert loaded(code + "pass", "--help") & set(HEAVY) == {"typer"}


def test_a_run_loads_what_it_writes_with(tmp_path: Path) -> None:
    arguments = ("run", "step", "--set", "stop_time=0.2", "--out", str(tmp_path))
    loaded(MAIN, *arguments)  # descriptions and units are kept from here on
    assert loaded(MAIN, *arguments) & set(HEAVY) == {"netCDF4"}
    assert sorted(file.name for file in tmp_path.iterdir()) == ["step.csv", "step.nc"]


@pytest.mark.slow
def test_a_plan_loads_no_xarray(tmp_path: Path) -> None:
    """What xarray looks for when it makes a Dataset (pandas, dask, pint) takes longer to load than the plan to find."""
    pytest.importorskip("piqp")
    (tmp_path / "reach.csv").write_text("time,tip.p[1]\n1,0\n2,-0.001\n", encoding="utf-8")
    arguments = ("plan", str(tmp_path / "reach.csv"), "--out", str(tmp_path))
    code = "from tca_cosim.cli import main\ntry:\n    main()\nexcept SystemExit as end: assert not end.code\npass"
    loaded(code, *arguments)  # descriptions and units are kept from here on
    assert not loaded(code, *arguments) & {"xarray", "pandas", "dask", "pint", "matplotlib"}
    assert (tmp_path / "reach.nc").is_file()


def test_the_accessor_is_there_whoever_imports_xarray() -> None:
    for code in ("import xarray, tca_cosim", "import tca_cosim, xarray"):
        loaded(f"{code}; assert xarray.Dataset().tca.plot; assert xarray.__spec__.loader.get_source('xarray')")


def test_the_public_names_are_those_that_are_there() -> None:
    for package in (tca_cosim, tca_cosim.scene, tca_cosim.results):
        assert all(getattr(package, name) is not None for name in package.__all__)
        assert set(package.__all__) <= set(dir(package))
    with pytest.raises(AttributeError, match="attribute titels"):
        tca_cosim.titels  # noqa: B018


# -- the command line


@pytest.mark.parametrize(
    "arguments",
    [
        ["step"],
        ["step", "--set", "rod.order=2", "--set=stop_time=3", "--out", "there", "--name", "mine"],
        ["--out=there", "s.toml"],
        ["step", "--set", "thermal.V=[0, 1, 2]"],
    ],
)
def test_plain_arguments_mean_what_typer_makes_of_them(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    taken: dict[str, object] = {}

    def note(scene: str, override: list[str], folder: Path, name: str | None) -> None:
        taken.update(scene=scene, override=list(override), folder=folder, name=name)

    monkeypatch.setattr("tca_cosim.cli.run.run_scene", note)
    application.app(["run", *arguments], standalone_mode=False)
    parsed = plain.parsed_run(arguments)
    assert parsed is not None
    assert {"folder": Path("results"), "name": None, **parsed} == taken


@pytest.mark.parametrize(
    "arguments", [[], ["--help"], ["a", "b"], ["step", "--sett", "x"], ["step", "--out"], ["step", "--set", "--out"]]
)
def test_what_is_not_plain_is_left_to_typer(arguments: list[str]) -> None:
    assert plain.parsed_run(arguments) is None
    assert CliRunner().invoke(application.app, ["run", *arguments]).exit_code in (0, 2)


def test_every_command_is_listed_under_its_heading_with_its_first_sentence() -> None:
    shown = " ".join(CliRunner().invoke(application.app, ["--help"]).output.split())
    commands = typer.main.get_command(application.app).commands
    for heading, modules in application.COMMANDS.items():
        assert f"{heading}:" in shown
        for name in modules:
            short = commands[name].get_short_help_str()
            assert short in shown
            assert " ".join(commands[name].help.split()).startswith(short)


# -- results without xarray


def test_a_table_is_written_as_xarray_writes_the_dataset(tmp_path: Path) -> None:
    table = simulation.run_table(tca_cosim.read("step", ["stop_time=0.3"]))
    rows = table.sizes["time"]
    extra = {
        "a.flag": np.arange(rows) % 2 == 0,
        "a.count": np.arange(rows, dtype=np.int32),
        "a.dy/dt": np.linspace(0.0, 1.0, rows),
        "a.text": np.array(["x", "", "é"] + ["y"] * (rows - 3), dtype=object),
    }
    for name, values in extra.items():
        table.data_vars[name] = results.LabelledArray(("time",), values, {"units": "1", "long_name": name})
    dataset = table.to_xarray()
    for ending in ("nc", "csv"):
        results.write(table, tmp_path / f"table.{ending}")
        results.write(dataset, tmp_path / f"dataset.{ending}")
    assert (tmp_path / "table.csv").read_bytes() == (tmp_path / "dataset.csv").read_bytes()
    xr.testing.assert_identical(results.read(tmp_path / "table.nc"), results.read(tmp_path / "dataset.nc"))
    ours, theirs = (xr.open_dataset(tmp_path / f"{n}.nc", decode_cf=False) for n in ("table", "dataset"))
    with ours, theirs:
        xr.testing.assert_identical(ours, theirs)


def test_numbers_of_a_csv_file_are_exact_in_any_number_of_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = simulation.run_table(tca_cosim.read("step", ["stop_time=0.5"]))
    results.write(table, tmp_path / "one.csv")
    monkeypatch.setattr("tca_cosim.results.storage.MAX_BLOCK", 50)
    results.write(table, tmp_path / "many.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "many.csv").read_bytes()
    lines = (tmp_path / "one.csv").read_text().splitlines()[-6:]
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    assert np.array_equal(values[:, 0], table["time"].to_numpy())
    assert np.array_equal(values[:, 1], table["thermal.V"].to_numpy()[:, 0])


# -- order of a macro step


def by_networkx(names: list[str], connections: list[Connection]) -> tuple[Component, ...]:
    graph = nx.DiGraph()
    graph.add_nodes_from(names)
    graph.add_edges_from((c.source[0], c.target[0]) for c in connections)
    condensed, rank = nx.condensation(graph), {name: k for k, name in enumerate(names)}
    ordered = []
    for node in nx.lexicographical_topological_sort(
        condensed, key=lambda n: min(rank[m] for m in condensed.nodes[n]["members"])
    ):
        members = condensed.nodes[node]["members"]
        inner = [c for c in connections if c.source[0] in members and c.target[0] in members]
        torn = frozenset(c for c in inner if rank[c.source[0]] >= rank[c.target[0]])
        ordered.append(Component(tuple(sorted(members, key=rank.__getitem__)), torn))
    return tuple(ordered)


def test_components_and_their_order_are_networkx() -> None:
    chance = random.Random(1)
    for _ in range(300):
        names = [f"m{k}" for k in range(chance.randint(1, 9))]
        chance.shuffle(names)
        wires = [
            Connection((chance.choice(names), "y"), (chance.choice(names), f"u{k}"))
            for k in range(chance.randint(0, 2 * len(names)))
        ]
        assert components(names, wires) == by_networkx(names, wires)
