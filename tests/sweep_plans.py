"""Plans of quick sweeps."""

from __future__ import annotations

from pathlib import Path

from tca_cosim.studies import sweep

QUICK = """
scene = "step"
set = ["stop_time=3", "rod.closure=inside", "rod.order=0", "coupling.macro_step=1"]
outputs = ["thermal.T", "rod.tip.p"]
"""
TWO = """
[parameters]
"thermal.h" = { uniform = { loc = "15 W/(m2.K)", scale = "10 W/(m2.K)" } }
"rod.body.E" = { lognorm = { s = 0.1, scale = "37.8 kPa" } }
"""


def plan(folder: Path, text: str = TWO, head: str = "runs = 8\n", **options: object) -> sweep.SweepPlan:
    (folder / "mine.toml").write_text(head + QUICK + text)
    return sweep.read_plan(folder / "mine.toml", **options)
