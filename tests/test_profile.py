"""The timing adds up; how long things take is not tested."""

from __future__ import annotations

import tca_cosim as tca
from tca_cosim.benchmarks import profile


def test_shares_of_a_run() -> None:
    actual = profile.profile_run(tca.read("step", ["stop_time=2"]), repeats=1)
    result = tca.run(tca.read("step", ["stop_time=2"]))
    assert actual.steps == 20
    assert actual.sweeps == float(result["coupling.sweeps"][1:].mean())
    assert actual.load > 0.0
    assert 0.0 < actual.fmus <= actual.run
    assert actual.overhead == (actual.run - actual.fmus) / 20
