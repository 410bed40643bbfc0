"""What a process loads, and what is kept for the next one: by modules and files, not by time."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
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
from tca_cosim.errors import SceneError
from tca_cosim.fmi import archive, cache, units
from tca_cosim.fmi.archive import Archive, find_fmu
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


# -- what is kept


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache."""
    folder = tmp_path / "cache"
    monkeypatch.setenv(cache.VARIABLE, str(folder))
    units._kept_units.cache_clear()
    units._checked.cache_clear()
    monkeypatch.setattr("tca_cosim.fmi.archive._DESCRIPTIONS", {})
    yield folder
    units._kept_units.cache_clear()
    units._checked.cache_clear()


def test_a_kept_description_is_the_one_that_was_read(kept: Path) -> None:
    first = Archive(find_fmu("rod.fmu"))
    archive._DESCRIPTIONS.clear()  # as in the next process
    second = Archive(find_fmu("rod.fmu"))
    assert len(list((kept / "descriptions").glob("*.json"))) == 1
    assert first.description == second.description
    assert list(first.variables) == list(second.variables)
    for variable in second.variables.values():
        assert type(variable.start) is type(first.variables[variable.name].start)


@pytest.mark.parametrize("harm", ["cut", "emptied", "flipped", "other version", "a folder"])
def test_a_damaged_description_is_read_anew(kept: Path, harm: str) -> None:
    whole = Archive(find_fmu("rod.fmu")).description
    archive._DESCRIPTIONS.clear()  # as in the next process
    (path,) = (kept / "descriptions").glob("*.json")
    content = path.read_bytes()
    path.unlink()
    if harm == "a folder":
        path.mkdir()
    elif harm == "other version":
        cache.keep_bytes(f"descriptions/{path.name}", b'{"columns": ["name"]}')
    else:
        middle = len(content) // 2
        flipped = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
        path.write_bytes({"cut": content[:middle], "emptied": b"", "flipped": flipped}[harm])
    assert Archive(find_fmu("rod.fmu")).description == whole


def test_a_damaged_folder_is_extracted_anew(kept: Path) -> None:
    folder = Archive(find_fmu("rod.fmu")).extract()
    assert kept in folder.parents
    (library,) = folder.glob("binaries/*/rod.*")
    content = library.read_bytes()
    for harm in ("cut", "removed", "overwritten"):
        if harm == "removed":
            library.unlink()
        else:
            library.write_bytes(content[:1000] if harm == "cut" else bytes(len(content)))
        assert Archive(find_fmu("rod.fmu")).extract() == folder
        assert library.read_bytes() == content
    assert [path.name for path in folder.parent.iterdir() if path.name.startswith(".draft")] == []


def test_without_a_place_to_keep_things_all_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for cache_folder in ("", str(tmp_path / "file" / "cache")):
        (tmp_path / "file").write_text("no folder can be made here")
        monkeypatch.setenv(cache.VARIABLE, cache_folder)
        with Archive(find_fmu("rod.fmu")) as archive:
            folder = archive.extract()
            assert (folder / "modelDescription.xml").is_file()
        assert not folder.exists()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_place_is_left_alone(kept: Path) -> None:
    kept.mkdir()
    kept.chmod(stat.S_IRUSR | stat.S_IXUSR)
    with Archive(find_fmu("rod.fmu")) as archive:
        assert (archive.extract() / "modelDescription.xml").is_file()
    assert list(kept.iterdir()) == []


def _extract(path: str) -> str:
    archive = Archive(Path(path))
    folder = archive.extract()
    (library,) = folder.glob("binaries/*/rod.*")
    return f"{folder} {library.stat().st_size} {archive.guid}"


@pytest.mark.slow
def test_processes_that_start_at_once_share_one_folder(kept: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(4) as pool:
        actual = set(pool.map(_extract, [str(find_fmu("rod.fmu"))] * 8, chunksize=1))
    assert len(actual) == 1
    assert [p.name for p in (kept / "fmus").iterdir() if p.name.startswith(".draft")] == []


def test_what_is_old_is_removed_and_what_is_used_stays(kept: Path) -> None:
    used, old = Archive(find_fmu("rod.fmu")).extract(), Archive(find_fmu("thermal.fmu")).extract()
    draft = used.with_name(".draft-of-a-process-that-died")
    draft.mkdir()
    day = 86400.0
    now = used.stat().st_mtime + 20.0 * day
    os.utime(used, (now - 2.0 * day, now - 2.0 * day))
    cache.clean(used.parent, now + 15.0 * day)
    assert used.is_dir()
    assert not old.exists()
    assert not draft.exists()
    again = Archive(find_fmu("rod.fmu")).extract()  # a use is noted
    assert again.stat().st_mtime > now - 21.0 * day


def test_foreign_fmus_keep_folders_of_their_own(kept: Path, tmp_path: Path) -> None:
    """They may write to them, and their libraries may have global variables."""
    path = tmp_path / "foreign.fmu"
    shutil.copy(find_fmu("rod.fmu"), path)
    with Archive(path) as archive:
        archive.description = replace(archive.description, generation_tool="another tool")
        assert kept not in archive.extract().parents


def test_an_unreadable_fmu_is_named_whatever_is_kept(kept: Path, tmp_path: Path) -> None:
    (tmp_path / "no.fmu").write_bytes(b"no archive")
    with pytest.raises(SceneError, match="not a readable FMU"):
        Archive(tmp_path / "no.fmu")
    assert not (kept / "descriptions").exists()


@pytest.mark.parametrize("name", ["ms", "mm", "degC", "kPa", "N.mm", "W/(m2.K)", "deg", "1/K", "delta_degC"])
def test_kept_units_give_what_pint_gives(kept: Path, name: str) -> None:
    """To the last bit, also in the next process."""
    numbers = np.random.default_rng(1).normal(scale=50.0, size=100).tolist()
    expected = [units._by_pint(number, name) for number in numbers]
    units._in_base_units(1.0, name)
    units._kept_units.cache_clear()
    assert name in units._kept_units()
    assert [units._in_base_units(number, name) for number in numbers] == expected


def test_units_that_are_not_linear_are_left_to_pint(kept: Path) -> None:
    units._in_base_units(3.0, "dBm")
    assert "dBm" not in units._kept_units()
    with pytest.raises(ValueError, match="not known"):
        units._in_base_units(3.0, "nonsense")


def test_a_derived_heat_model_serves_the_next_instance() -> None:
    overrides = ["thermal.level=lumped", "thermal.tolerance=1e-5", "stop_time=1 s"]
    runs = []
    for _ in range(2):
        with pytest.warns(tca_cosim.FmuWarning, match="lumped is a network of few nodes"):
            runs.append(tca_cosim.run("step", overrides))
        simulation.release_instances()  # the next run has instances of its own, not reset ones
    for name, values in runs[0].data_vars.items():
        assert values.to_numpy().tobytes() == runs[1][name].to_numpy().tobytes(), name
