"""Random parameters over the allowed ranges of the rod and of the heat model, with every method, closure and level.

What completes without a word is audited: the rod by its balance of energy and by finer runs, heat by its steady state,
which is known, by the second law and by steps of another length.

`python tests/wild_parameters.py COUNT [SEED [thermal] [mild]]` runs a long campaign by hand and prints its table;
test_wild_parameters.py runs a sample."""

from __future__ import annotations

import math
import random
import re
import sys
import time
from collections import Counter
from typing import Any

from wild_audits import audit_heat, audit_rod
from wild_runs import ROD, THERMAL, Draw, Fmu

# Typical size of what starts at 0.
SIZES = {"body.retardation": 1e-2, "body.curvature": 20.0, "tca.helix": 60.0}
HANG = 60.0  # [s] of CPU time that no draw may take, some hundred times the typical one
# Mild draws: most of them complete, so that there is something to audit.
MILD_WIDTH = 0.1  # decades to either side of the start value
RARE = 0.15  # share of choices other than the start value
# What makes most rods stiffer by orders, or bodies that none is, at random.
STIFF_OR_IMPOSSIBLE = ("tca.handedness", "tca.law", "body.profile", "tip_body.inertia", "tip_body.centre")
ACROSS = ("plane", "body.curvature", "tca.azimuth", "tca.helix")  # what takes a rod out of its plane


def _is_drawn(name: str) -> bool:
    """Whether a parameter is drawn: those of the whole body, not of single segments and TCAs, which nearly always
    contradict each other at random."""
    if re.fullmatch(r"tca\.(?!azimuth|helix|R\b).*\[\d+\]", name):
        return False
    if name.startswith(("segment.", "tip_body.")) or name in ("tca.contact", "tca.ends", "tca.handedness"):
        return False
    return "[" not in name or name.startswith(("body.", "tca.azimuth", "tca.helix", "tca.R"))


def drawn(fmu: Fmu, chance: random.Random) -> Draw:
    """Each parameter moved with a probability, by a width, that are drawn too: from nearly usual to wild."""
    share, width = chance.choice((0.1, 0.3, 1.0)), chance.choice((0.2, 1.0, 3.0, 6.0))
    values: dict[str, float] = {}
    for v in fmu.description.modelVariables:
        if v.causality != "parameter" or not _is_drawn(v.name):
            continue
        if v.type == "Enumeration":
            values[v.name] = chance.randint(1, len(v.declaredType.items))
        elif v.type == "Boolean":
            values[v.name] = chance.randint(0, 1)
        elif v.type == "Integer":
            values[v.name] = chance.randint(int(v.min), min(int(v.max), 50))
        elif v.name == "tolerance":  # tighter ones cost a hundred times as much and fail in no other way
            values[v.name] = 10.0 ** chance.uniform(-5.0, -1.0)
        elif chance.random() < share:
            values[v.name] = _real(v, chance, width)
    if fmu.name == "thermal":
        inputs = {f"V[{k}]": chance.choice((0.0, 10.0 ** chance.uniform(-2.0, 1.5))) for k in (1, 2, 3)}
        inputs["T_ambient"] = chance.choice((298.15, values.get("T_0", 298.15), chance.uniform(250.0, 400.0)))
        return Draw(values, inputs, 10.0 ** chance.uniform(-3.0, 4.0))
    inputs = {f"T[{k}]": 298.15 + chance.choice((0.0, 30.0, 200.0)) * chance.random() for k in (1, 2, 3)}
    weight = 10.0 ** chance.uniform(-4.0, -0.5)
    for k in (1, 2, 3):
        inputs[f"gravity[{k}]"] = chance.choice((0.0, chance.uniform(-10.0, 10.0)))
        inputs[f"tip_force[{k}]"] = chance.choice((0.0, weight * chance.uniform(-1.0, 1.0)))
        inputs[f"tip_moment[{k}]"] = chance.choice((0.0, 0.0, 0.02 * weight * chance.uniform(-1.0, 1.0)))
    return Draw(values, inputs, 10.0 ** chance.uniform(-5.0, -1.0))


def _real(v: Any, chance: random.Random, width: float) -> float:
    size = float(v.start) or SIZES.get(v.name.split("[")[0], 1.0)
    value = size * 10.0 ** chance.uniform(-width, width)
    if v.min is not None and float(v.min) < 0.0 and chance.random() < 0.3:
        value = -value
    return min(max(value, float(v.min)), float(v.max))


def drawn_mildly(fmu: Fmu, chance: random.Random) -> Draw:
    """Parameters about their start values, with a choice moved now and then."""
    values: dict[str, float] = {}
    for v in fmu.description.modelVariables:
        name = v.name
        if v.causality != "parameter" or re.fullmatch(r"(tca\.(?!azimuth|helix|R\b)|segment\.).*\[.*\]", name):
            continue
        is_moved = chance.random() < (0.5 if v.type == "Real" else RARE)
        if name == "tolerance":
            values[name] = 10.0 ** chance.uniform(-6.0, -3.0)
        elif not is_moved or name.startswith(STIFF_OR_IMPOSSIBLE):
            continue
        elif v.type == "Enumeration":
            values[name] = chance.randint(1, len(v.declaredType.items))
        elif v.type == "Boolean":
            values[name] = chance.randint(0, 1)
        elif v.type == "Integer":
            values[name] = chance.choice((-1, 1)) if name == "tca.chirality" else chance.randint(2, int(v.max))
        elif name.startswith("tca.azimuth"):
            values[name] = chance.uniform(-3.2, 3.2)
        else:
            values[name] = _real(v, chance, MILD_WIDTH)
    if fmu.name == "thermal":
        values.setdefault("level", chance.randint(1, 3))
        inputs = {f"V[{k}]": chance.uniform(0.0, 5.0) for k in (1, 2, 3)}
        return Draw(values, {**inputs, "T_ambient": chance.uniform(280.0, 310.0)}, 10.0 ** chance.uniform(-1.0, 2.0))
    if values.get("planar"):  # the body must have the plane, which few random ones have
        values = {n: x for n, x in values.items() if n.split("[")[0] not in ACROSS}
    values.setdefault("dynamic", chance.randint(0, 1))
    values.setdefault("order", chance.randint(3, 7))
    inputs = {f"T[{k}]": 298.15 + chance.uniform(0.0, 60.0) for k in (1, 2, 3)}
    moment = chance.choice((0.0, 0.0, 0.0, 1e-4))
    for k in (1, 2, 3):
        inputs[f"gravity[{k}]"] = chance.uniform(-10.0, 10.0)
        inputs[f"tip_force[{k}]"] = chance.uniform(-0.02, 0.02)
        inputs[f"tip_moment[{k}]"] = moment * chance.uniform(-1.0, 1.0)
    return Draw(values, inputs, 10.0 ** chance.uniform(-3.0, -1.0))


DRAWS = {"wild": drawn, "mild": drawn_mildly}


def campaign(fmu: Fmu, count: int, seed: int, kind: str = "wild") -> tuple[Counter[str], list[str]]:
    """Counts by outcome, and what is wrong without a word, by the seed of its draw. kind: of DRAWS."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    for number in range(seed, seed + count):
        draw = DRAWS[kind](fmu, random.Random(number))
        begin = time.process_time()
        run = fmu.run(draw)
        if time.process_time() - begin > HANG:
            wrong.append(f"{number}: takes more than {HANG:g} s")
        counts[f"{run.end}{', with a warning' if run.said and run.end == 'complete' else ''}"] += 1
        problems = [f"{name} = {value}" for row in run.rows for name, value in row.items() if not math.isfinite(value)]
        if run.end in ("refused", "error", "discard") and not run.message:
            problems.append(f"{run.end} without a message")
        if run.end == "complete" and not run.said:
            problems += (audit_heat if fmu.name == "thermal" else audit_rod)(fmu, draw, run, counts)
        wrong += [f"{number}: {problem}" for problem in problems[:2]]
    return counts, wrong


if __name__ == "__main__":
    path = THERMAL if "thermal" in sys.argv else ROD
    totals, actual = campaign(
        Fmu(path), int(sys.argv[1]), int((sys.argv[2:] or [0])[0]), "mild" if "mild" in sys.argv else "wild"
    )
    for what, often in sorted(totals.items()):
        print(f"{often:8} {what}")
    print(f"{len(actual):8} wrong without a word", *actual, sep="\n  ")
