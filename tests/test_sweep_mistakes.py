"""Mistakes in the file of a sweep."""

from __future__ import annotations

from pathlib import Path

import pytest
from sweep_plans import QUICK, TWO, plan
from tca_cosim import CosimError
from tca_cosim.studies import sweep

# -- mistakes


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('"thermal.hh" = [1]', "did you mean 'h'"),
        ('"thermic.h" = [1]', "did you mean 'thermal'"),
        ('"thermal.T" = [300]', "no parameter or input of thermal.fmu"),
        ('"coupling.macrostep" = [1]', "did you mean 'macro_step'"),
        ('"thermal.h" = ["20 W"]', "does not fit"),
        ('"thermal.h" = { uniform = { loc = "20 K", scale = 1 } }', "unit 'K' does not fit"),
        ('"thermal.h" = { unifrm = { loc = 1 } }', "did you mean 'uniform'"),
        ('"thermal.h" = { uniform = { low = 1 } }', "did you mean 'loc'"),
        ('"thermal.h" = { lognorm = { scale = 1 } }', "wants s as well"),
        ('"thermal.h" = { uniform = { loc = 1, scale = -1 } }', "does not allow"),
        ('"thermal.h" = { uniform = {}, norm = {} }', "wants one distribution"),
        ('"thermal.h" = 3', "wants a list of values or a distribution"),
        ('"thermal.h" = []', "empty list"),
        ('"thermal.h" = [0]', "out of range; allowed: 1e-09"),
        ('"thermal.h" = { uniform = {}, levels = 3 }', "levels are of design = 'grid'"),
        ('"rod.order" = { uniform = {} }', "discrete distribution"),
        ('"rod.strains" = { uniform = {} }', "list of values"),
        ('"thermal.h, rod.body.E" = [1]', "one type and unit"),
    ],
)
def test_mistakes_in_parameters_are_named(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(CosimError) as caught:
        plan(tmp_path, f"[parameters]\n{text}\n")
    assert said in str(caught.value)
    assert "mine.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("", "runs: missing; add for example"),
        ("runs = 8\ndesign = 'sobl'\n", "did you mean 'sobol'"),
        ("runs = 10\ndesign = 'saltelli'\n", "take 8 or 16"),
        ("design = 'grid'\n", "wants levels"),
        ("runs = 8\ninterval = '0.7 s'\n", "does not divide"),
        ("runs = 8\ninterval = '1 V'\n", "does not fit"),
        ("runs = 8\nquantiles = [2]\n", "between 0 and 1"),
        ("runs = 8\nquantile = [0.5]\n", "unknown"),
        ("runs = 1_000_001\n", "out of range"),
        ("runs = 8\nthermal.h = 3\n", "unknown"),
    ],
)
def test_mistakes_in_the_head_are_named(head: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(CosimError, match=said):
        plan(tmp_path, head=head)


def test_unknown_outputs_and_missing_keys_are_named(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("runs = 8\n" + QUICK.replace("thermal.T", "thermal.TT") + TWO)
    with pytest.raises(CosimError, match=r"did you mean 'thermal\.T'"):
        sweep.read_plan(tmp_path / "mine.toml")
    (tmp_path / "mine.toml").write_text("runs = 8\n")
    with pytest.raises(CosimError, match="scene: missing; add name of a scene"):
        sweep.read_plan(tmp_path / "mine.toml")
    (tmp_path / "mine.toml").write_text("runs = 8\n" + QUICK.replace("set = [", 'set = ["fidelity.level=auto", ') + TWO)
    with pytest.raises(CosimError, match="choose anew in every run; add to set"):
        sweep.read_plan(tmp_path / "mine.toml")
    with pytest.raises(CosimError, match="did you mean 'scatter'"):
        sweep.read_plan("scater")
