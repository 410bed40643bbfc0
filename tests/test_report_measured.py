"""Measured samples beside the computed curves of a report."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim import results
from tca_cosim.cli import app
from tca_cosim.visualization.measured import read_measured
from tca_cosim.visualization.report import page
from typer.testing import CliRunner


def samples_of(result: xr.Dataset, folder: Path) -> Path:
    """A file of samples: a temperature in degrees Celsius with gaps, a tip in millimetres, a quantity that is zero."""
    rows = ["t [ms],thermal.T[2] [degC],rod.tip.p[3] [mm],rod.gravity[1]"]
    for k in range(0, 48, 4):
        T, z = float(result["thermal.T"][k, 1]) - 273.15 + 0.5, 1e3 * float(result["rod.tip.p"][k, 2]) - 0.25
        rows.append(f"{1e3 * float(result['time'][k])},{'' if k == 8 else T},{z},0")
    file = folder / "bench.csv"
    file.write_text("# a comment\n" + "\n".join(rows) + "\n")
    return file


@pytest.mark.slow
def test_measured_samples_are_shown_beside_the_curves(step_result: xr.Dataset, tmp_path: Path) -> None:
    measured = read_measured(samples_of(step_result, tmp_path), step_result)
    actual = {one.name: one for one in measured.deviations(step_result)}
    T, z = actual["thermal.T[2]"], actual["rod.tip.p[3]"]
    assert (T.samples, z.samples, T.unit, z.unit) == (11, 12, "K", "m")
    assert (T.rms, T.most) == pytest.approx((0.5, 0.5), abs=1e-9)
    assert (z.rms, z.most) == pytest.approx((0.25e-3, 0.25e-3), abs=1e-12)
    page.write(step_result, tmp_path / "with.html", measured=measured)
    shown, plain = (tmp_path / "with.html").read_text(), page.html(step_result)
    assert "circles: measured, bench.csv" in shown
    assert "<h2>Measured</h2>" in shown
    assert "0.25 mm" in shown
    assert "Gravity" in shown.partition("<h2>Settings")[0]  # a quantity that is measured has a chart, though it is zero
    assert "<h2>Measured</h2>" not in plain
    circle = re.compile(r"<use [^>]*stroke: var\(--c\d\)")
    assert len(circle.findall(shown)) - len(circle.findall(plain)) >= 11 + 12 + 12


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("t,rod.tip.q[1]\n0,1\n", "column 'rod.tip.q[1]': not in the result; "),
        ("t,rod.tip.p[1] [N]\n0,1\n", "give a unit that converts to 'm'"),
        ("t,rod.tip.p[1]\n1,1\n0,1\n", "times must increase"),
        ("t,rod.tip.p[1]\n,1\n0,1\n", "times must increase"),
        ("t,rod.tip.p[1]\n0,x\n", "give numbers with a point"),
        ("t,rod.tip.p[1]\n0,1,2\n", "3 cells for 2 names"),
        ("t,rod.tip.p[1]\n99,1\n", "no sample from t = 0 s to 12 s"),
        ("t,rod.tip.p[1],rod.tip.p[1]\n0,1,1\n", "two columns 'rod.tip.p[1]'; keep one of them"),
        ("t\n0\n", "no column beside the time"),
        ("", "no rows"),
    ],
)
def test_samples_that_do_not_fit_are_refused(step_result: xr.Dataset, content: str, named: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(content)
    with pytest.raises(tca.CosimError, match=re.escape(named)):
        read_measured(file, step_result)


@pytest.mark.slow
def test_the_command_shows_samples(step_result: xr.Dataset, tmp_path: Path) -> None:
    results.write(step_result, tmp_path / "step.nc")
    arguments = ["report", "--from", str(tmp_path / "step.nc"), "--out", str(tmp_path), "--measured"]
    done = CliRunner().invoke(app, [*arguments, str(samples_of(step_result, tmp_path))])
    assert done.exit_code == 0, done.output
    assert "bench.csv" in (tmp_path / "step.html").read_text()
    missing = CliRunner().invoke(app, [*arguments, str(tmp_path / "none.csv")])
    assert missing.exit_code == 2
    assert "none.csv: no such file" in missing.output.replace("\n", "")
