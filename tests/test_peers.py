"""The comparison with other codes, none of which is needed here: our own rows against the reference, how rows are
rated, what is said of a code that is not installed."""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from tca_cosim.benchmarks.peers import compare_peers, ours, write
from tca_cosim.benchmarks.peers.release import ReleaseProblem
from tca_cosim.benchmarks.peers.table import OURS, PeerRow, summary, with_ratios
from tca_cosim.fmi.archive import Archive, find_fmu


def row(
    code: str,
    cpu: float,
    error: float,
    largest: float = math.inf,
    often: bool = True,
    damped: bool = False,
    dim: int = 3,
) -> PeerRow:
    return PeerRow(code, damped, dim, "", often, cpu, cpu, cpu, 1 / cpu, error, largest)


def test_ratio_is_to_our_fastest_row_that_is_as_good() -> None:
    rows = [
        row(OURS, 1.0, 50.0, 900.0, often=False),
        row(OURS, 4.0, 10.0, 20.0),
        row(OURS, 0.5, 15.0, dim=2),
        row(OURS, 0.1, 1.0, 1.0, damped=True),
        row("other", 8.0, 60.0, 100.0),
        row("other", 8.0, 20.0),
        row("other", 8.0, 9.0),
        row("other", 8.0, math.nan, math.nan),
    ]
    rated = with_ratios(rows)
    ratios = [(r.ratio, r.ratio_every_10_ms, r.ratio_largest, r.ratio_spatial) for r in rated if r.code == "other"]
    nothing = math.nan
    expected = [(16, 16, 2, 8), (16, 16, 16, 2), (nothing, nothing, 16, nothing), (nothing,) * 4]
    np.testing.assert_array_equal(ratios, expected)
    (line,) = summary(rated)
    assert line.startswith("other, spatial, undamped: CPU time at equal error")
    assert line.endswith("to ours 16 to 16, every 10 ms 16 to 16, in space 2 to 8 times")


@pytest.mark.parametrize(("damped", "allowed"), [(False, 12e-6), (True, 5e-6)])  # m; order and tolerance set them
def test_our_finest_rows_meet_the_reference(damped: bool, allowed: float) -> None:
    with Archive(find_fmu("rod.fmu")) as archive:
        release = ReleaseProblem(archive, damped)
        finest = [
            setting for setting in ours.settings(damped) if setting["order"] >= 4 and setting["tolerance"] <= 1e-3
        ]
        assert {(setting["dim"], setting["outputs"]) for setting in finest} == {
            (d, n) for d in (2, 3) for n in (5, 100)
        }
        for setting in finest:
            tip = ours.CODE.prepare(release, setting)()
            assert np.linalg.norm(tip - release.reference, axis=1).max() < allowed


def test_a_code_that_is_missing_is_named_with_the_remedy_and_the_rest_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("elastica", "exudyn", "soromox"):
        monkeypatch.setitem(sys.modules, name, None)
        monkeypatch.delitem(sys.modules, f"tca_cosim.benchmarks.peers.{name}", raising=False)
    rows, notes = compare_peers(repeats=1)
    assert {r.code for r in rows} == {OURS}
    for package in ("pyelastica", "exudyn"):
        (said,) = (note for note in notes if package in note)
        assert said.startswith(f"not run: {package} ")
        assert "pip install 'tca-cosim[peers]'" in said
    assert any(note.startswith("not run: soromox ") and note.endswith("; pip install soromox") for note in notes)
    # one row of ours for each setting, whole and consistent
    assert len(rows) == sum(len(ours.settings(damped)) for damped in (False, True))
    assert all(r.cpu > 0 and r.cpu_low == r.cpu == r.cpu_high and r.times_real_time == 1 / r.cpu for r in rows)
    assert all(r.error <= r.largest_error for r in rows)
    assert all(min(r.largest_error for r in rows if r.damped is damped) < 12.0 for damped in (False, True))

    write(rows, notes, tmp_path / "there" / "peers.csv")
    lines = (tmp_path / "there" / "peers.csv").read_text().splitlines()
    assert lines[: len(notes)] == [f"# {note}" for note in notes]
    table = list(csv.DictReader(lines[len(notes) :]))
    assert [float(r["error"]) for r in table] == [r.error for r in rows]
