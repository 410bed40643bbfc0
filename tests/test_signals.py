"""Sines and blows as cubics over a macro step: end values, mean and first moment are exact, all else is of fourth
order, and what is hit feels the whole blow."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import tca_cosim as tca
from scipy.special import spherical_jn
from tca_cosim import results
from tca_cosim.cosim.signals import Impulse, Ramps, Sine, Steps, _bessel
from tca_cosim.studies.stability.model_problems import couple, linear

PERIOD = 1.7
RATE = 2.0 * math.pi / PERIOD
SINE = Sine(0.5, 2.0, PERIOD, 0.3)


def exact(t: np.ndarray) -> np.ndarray:
    return 0.5 + 2.0 * np.sin(RATE * t + 0.3)


def value(c: tuple[float, ...], s: np.ndarray) -> np.ndarray:
    return c[0] + s * (c[1] + s * (c[2] / 2.0 + s * c[3] / 6.0))


@pytest.mark.parametrize("angle", [1e-6, 0.3, math.pi, 2.0 * math.pi, -0.3])
def test_ends_mean_and_first_moment_are_exact(angle: float) -> None:
    """Gauss's rule of 20 points, which is exact to rounding here; angle: omega h, negative towards the past."""
    h, t = angle / RATE, 0.4
    c = SINE.polynomial(t, h)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    s = 0.5 * h * (1.0 + nodes)
    for power in (0, 1):
        actual, wanted = (np.sum(weights * nodes**power * u) for u in (value(c, s), exact(t + s)))
        assert actual == pytest.approx(wanted, abs=1e-14)
    np.testing.assert_allclose(value(c, np.array([0.0, h])), exact(t + np.array([0.0, h])), rtol=0.0, atol=1e-14)


def test_short_steps_keep_the_derivatives() -> None:
    """At the start of a step of 1e-9 s, as behind an event, they are those of the sine: nothing cancels."""
    c = SINE.polynomial(0.4, 1e-9)
    phase = RATE * 0.4 + 0.3
    wanted = (math.cos(phase), -RATE * math.sin(phase), -(RATE**2) * math.cos(phase))
    np.testing.assert_allclose(c[1:], 2.0 * RATE * np.array(wanted), rtol=1e-7)


def test_the_course_is_of_fourth_order() -> None:
    """Largest error (omega h)^4/1920 of the amplitude."""
    s = np.linspace(0.0, 1.0, 201)
    for angle in (0.4, 0.2):
        h = angle / RATE
        error = max(np.abs(value(SINE.polynomial(t, h), h * s) - exact(t + h * s)).max() for t in np.arange(0, 2, 0.1))
        assert error == pytest.approx(2.0 * angle**4 / 1920.0, rel=0.02)


def test_bessel_functions() -> None:
    for x in (1e-9, 1e-3, 0.3, 0.999, 1.001, 3.0, 20.0):
        actual = _bessel(x)
        np.testing.assert_allclose(actual, spherical_jn([1, 2], x), rtol=1e-14)
        np.testing.assert_allclose(_bessel(-x), (-actual[0], actual[1]), rtol=1e-14)


@pytest.mark.parametrize("omega", [5.0, 50.0])
def test_an_oscillator_feels_the_whole_blow(omega: float) -> None:
    """x'' + omega^2 x = blow of 20 ms, one macro step. By convolution, behind it: x = 2 p cos(omega w/2) sin(omega (t -
    t0 - w/2))/(omega (p^2 - omega^2)) of the peak, with p = pi/w. A slow body feels mean and first moment; the second,
    of which 5e-3 (omega w/2)^2 of the swing comes, is not quite that of the blow."""
    blow, rate = Impulse(peak=3.0, width=0.02, start=0.05), math.pi / 0.02
    body = linear("body", [[0, 1], [-omega * omega, 0]], [[0], [1]], [1, 0], [0], [0, 0], "u", "y")
    _, log = couple([body], [], 0.2, 1.0 / 30.0, signals={"body": {"u": blow}}, breaks=blow.breaks)
    assert sum(0.05 < entry.time < 0.07 + 1e-9 for entry in log) == 1
    swing = 2.0 * 3.0 * rate * math.cos(0.01 * omega) / (omega * (rate**2 - omega**2))
    bound = 6e-3 * (0.01 * omega) ** 2 * swing
    assert body.values()[0] == pytest.approx(swing * math.sin(omega * 0.14), abs=bound)


def test_columns_of_one_file_drive_the_elements_of_a_vector(tmp_path: Path) -> None:
    (tmp_path / "volts.csv").write_text("t [s],V1 [V],V2 [mV],V3 [V]\n0,0,500,1\n2,4,500,3\n")
    path = tmp_path / "scene.toml"
    path.write_text(
        'stop_time = "2 s"\n[thermal]\nV = { file = "volts.csv", columns = ["V1", "V2", "V3"], hold = "held" }\n'
    )
    signals = tca.read(path).member("thermal").signals
    assert [signals[f"V[{i}]"] for i in (1, 2, 3)] == [
        Steps((0.0, 2.0), (0.0, 4.0)),
        Steps((0.0, 2.0), (0.5, 0.5)),
        Steps((0.0, 2.0), (1.0, 3.0)),
    ]
    one = tca.read(path, {"thermal.V[1]": {"file": str(tmp_path / "volts.csv"), "column": "V1", "hold": "linear"}})
    assert one.member("thermal").signals["V[1]"] == Ramps((0.0, 2.0), (0.0, 4.0))


def test_amplitudes_may_be_negative_where_values_may_not() -> None:
    sine = {"offset": "300 K", "amplitude": "-5 K", "period": "10 s"}
    signal = tca.read("step", {"thermal.T_ambient": {"sine": sine}}).member("thermal").signals["T_ambient"]
    assert signal.polynomial(2.5, 1.0)[0] == pytest.approx(295.0)


def test_shapes_are_tables() -> None:
    with pytest.raises(tca.SceneError, match=r"give sine as a table with offset, amplitude, period, phase"):
        tca.read("step", {"thermal.V[1]": {"sine": 5}})


def driven(folder: Path, **signal: object) -> Any:
    """The signal of V[1] of a scene in that folder."""
    path = folder / "driven.toml"
    path.write_text('stop_time = "2 s"\n')
    return tca.read(path, {"thermal.V[1]": {**signal, "file": str(folder / str(signal["file"]))}}).member("thermal")


def test_columns_of_netcdf_files_drive_inputs(tmp_path: Path) -> None:
    """A result of this package, by the names of its variables; units come from the file."""
    result = tca.run("step", {"stop_time": 1.0})
    results.write(result, tmp_path / "before.nc")
    signal = driven(tmp_path, file="before.nc", column="thermal.V[3]", hold="held").signals["V[1]"]
    assert isinstance(signal, Steps)
    assert signal.times == tuple(result["time"].to_numpy().tolist())
    assert set(signal.values) == {3.0}
    path = tmp_path / "again.toml"
    path.write_text(
        'stop_time = "1 s"\n[fmus]\nrod = "rod.fmu"\n[rod]\ndynamic = false\nclosure = "inside"\n'
        'T = { file = "before.nc", columns = ["thermal.T[1]", "thermal.T[2]", "thermal.T[3]"], hold = "linear" }\n'
    )
    again = tca.run(path)
    np.testing.assert_allclose(again["rod.T"].to_numpy()[-1], result["thermal.T"].to_numpy()[-1], rtol=1e-12)


def test_netcdf_files_of_others_are_read_by_their_own_names(tmp_path: Path) -> None:
    with netCDF4.Dataset(tmp_path / "own.nc", "w") as file:
        file.createDimension("sample", 3)
        for name, unit, values in (("when", "ms", [0, 500, 1000]), ("U", "mV", [0, 100, 200]), ("bad", "V", [0, 0, 0])):
            variable = file.createVariable(name, "f8", ("sample",), fill_value=-1.0)
            variable.units = unit
            variable[:] = values
        file["bad"][1] = -1.0
        file.createVariable("label", str, ("sample",))
    signal = driven(tmp_path, file="own.nc", column="U", time="when").signals["V[1]"]
    assert signal.times == (0.0, 0.5, 1.0)
    assert signal.values == pytest.approx((0.0, 0.1, 0.2))
    for entries, words in (
        ({"column": "bad", "time": "when"}, "row 2: 'bad' is not finite, or missing"),
        ({"column": "U"}, "no time"),
        ({"column": "W", "time": "when"}, "no such column"),
        ({"column": "U", "time": "label"}, "no time 'label'"),
    ):
        with pytest.raises(tca.SceneError, match=re.escape(words)):
            driven(tmp_path, file="own.nc", **entries)
    (tmp_path / "no.nc").write_text("text")
    with pytest.raises(tca.SceneError, match="not a readable NetCDF file"):
        driven(tmp_path, file="no.nc", column="U")
    with pytest.raises(tca.SceneError, match="check the path"):
        driven(tmp_path, file="none.nc", column="U")


def test_two_rows_of_one_time_are_a_jump(tmp_path: Path) -> None:
    """The heat of a voltage that rises, jumps and falls in straight lines is that of the same signal in parts."""
    (tmp_path / "v.csv").write_text("t,V\n0,0\n0.5,1\n0.5,3\n1,2\n")
    member = driven(tmp_path, file="v.csv", column="V", hold="linear")
    signal = member.signals["V[1]"]
    assert signal.polynomial(0.4, 0.1)[:2] == pytest.approx((0.8, 2.0))
    assert signal.polynomial(0.5, 0.1)[:2] == pytest.approx((3.0, -2.0))
    result = tca.run(tmp_path / "driven.toml", {"thermal.V[1]": {"file": str(tmp_path / "v.csv"), "column": "V"}})
    assert 0.5 in result["time"].to_numpy()
    P, times = result["thermal.P"].to_numpy()[:, 0], result["time"].to_numpy()
    at = int(np.searchsorted(times, 0.5))
    assert P[at] / P[at + 1] != pytest.approx(1.0, abs=0.1)
    for rows, hold, words in (
        ("0,0\n0.5,1\n0.5,3\n", "held", "times must increase"),
        ("0,0\n0.5,1\n0.5,3\n0.5,4\n", "linear", "three rows of one time"),
        ("0,0\n0.5,1\n0.4,3\n", "linear", "times must increase"),
    ):
        (tmp_path / "bad.csv").write_text(f"t,V\n{rows}")
        with pytest.raises(tca.SceneError, match=words):
            driven(tmp_path, file="bad.csv", column="V", hold=hold)
