"""The same scene gives the same bits in any process and with any number of threads, and across versions the numbers of
tests/data/golden.json within its tolerance.

`python tests/test_reproducible.py` writes the file anew, where a change of the numbers is wanted."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca

GOLDEN = Path(__file__).parent / "data" / "golden.json"
SCENES = {"step": ["stop_time=3 s"], "drop": ["stop_time=0.2 s"]}
WATCHED = ("thermal.T", "rod.delta", "rod.tip.p")
# Of the size of each variable. Processors differ in how they fuse multiplications, and the vibration of `drop` carries
# the rounding on; the tolerance of its integrator is 1e-4.
TOLERANCE = 1e-6


def ends(name: str) -> dict[str, list[float]]:
    """Last values of a scene's watched variables [SI units]."""
    result = tca.run(tca.read(name, SCENES[name]))
    return {each: np.asarray(result[each])[-1].ravel().tolist() for each in WATCHED if each in result}


def digest(name: str) -> str:
    """A checksum of all bits of a scene's result."""
    result = tca.run(tca.read(name, SCENES[name]))
    sum_ = hashlib.sha256()
    for each in sorted(result.data_vars):
        values = np.asarray(result[each])
        if values.dtype.kind == "f" and not each.startswith("coupling."):
            sum_.update(each.encode() + values.tobytes())
    return sum_.hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_other_processes_and_thread_counts_give_the_same_bits(name: str) -> None:
    here = digest(name)
    assert digest(name) == here, "again"
    for threads in ("1", "4"):
        env = {**os.environ, "OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads, "PYTHONHASHSEED": threads}
        code = f"import test_reproducible; print(test_reproducible.digest({name!r}))"
        there = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code],
            env=env,
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
        )
        assert there.stdout.strip() == here, f"{threads} threads"


@pytest.mark.parametrize("name", SCENES)
def test_results_are_those_of_earlier_versions(name: str) -> None:
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))[name]
    assert golden.keys() == ends(name).keys()
    for each, values in ends(name).items():
        expected = np.array(golden[each])
        size = max(np.abs(expected).max(), 1e-6)
        assert np.abs(np.array(values) - expected).max() <= TOLERANCE * size, each


if __name__ == "__main__":
    GOLDEN.write_text(json.dumps({name: ends(name) for name in SCENES}, indent=1) + "\n", encoding="utf-8")
