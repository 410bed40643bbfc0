"""The timing adds up; how long things take is not tested."""

from __future__ import annotations

import tca_cosim as tca
from tca_cosim.benchmarks import profile


def test_shares_of_a_run() -> None:
    found = profile.profile_run(tca.read("step", ["stop_time=2"]), repeats=1)
    result = tca.run(tca.read("step", ["stop_time=2"]))
    assert found.steps == 20
    assert found.sweeps == float(result["coupling.sweeps"][1:].mean())
    assert found.load > 0.0
    assert 0.0 < found.fmus <= found.run
    assert found.overhead == (found.run - found.fmus) / 20
