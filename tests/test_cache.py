"""What is kept of FMUs and units for the next process: by files, not by time."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tca_cosim
from tca_cosim import simulation
from tca_cosim.errors import SceneError
from tca_cosim.fmi import archive, cache, units
from tca_cosim.fmi.archive import Archive, find_fmu


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
