"""Long campaigns of random input, and the table of their counts in docs/campaigns.md.

`python tests/campaigns.py NAME COUNT [SEED]` runs a campaign, adds its counts to tests/data/campaigns.json and writes
the table; without arguments it writes the table only. A run with the seed of an earlier one replaces it. With --check
in front it only prints them. `make test` runs a short sample of each, `.ci/nightly` a longer one.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fuzz_description
import random_loads
import wild_parameters

ROOT = Path(__file__).parents[1]
RECORDS = ROOT / "tests" / "data" / "campaigns.json"
PAGE = ROOT / "docs" / "campaigns.md"
PROGRAMS = ROOT / "build" / "tests"
HEAD = """# Campaigns

Long samples of what `make test` runs short ones of. Written by `python tests/campaigns.py` from the counts of its
runs in `tests/data/campaigns.json`; not by hand. `python tests/campaigns.py NAME COUNT SEED` runs another sample.

"""

Result = tuple[dict[str, int], list[str]]


@dataclass(frozen=True)
class Campaign:
    """A kind of random input.

    meaning: what is drawn and what counts as a fault, for the table. fmu: whose binary it runs, or none.
    run: returns counts and faults of COUNT draws from SEED.
    """

    name: str
    meaning: str
    fmu: str
    run: Callable[[int, int], Result]


def _fmu(name: str) -> Path:
    return ROOT / "fmus" / f"{name}.fmu"


def _driven(name: str, command: Callable[[str, str], list[str]], pattern: str = r"(\d+) ([a-z][a-z ]*)") -> Result:
    """Counts that a C++ program prints about an unpacked FMU; a fault is what it says when it fails."""
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(_fmu(name)) as archive:
        archive.extractall(folder)
        binary, description = f"{folder}/binaries/linux64/{name}.so", f"{folder}/modelDescription.xml"
        done = subprocess.run(command(binary, description), capture_output=True, text=True, check=False)
    words = {"of them accepted and harmless": "forged states accepted, harmless"}
    counts = {words.get(what.strip(), what.strip()): int(n) for n, what in re.findall(pattern, done.stdout)}
    return counts, [] if done.returncode == 0 else [done.stderr.strip()[-500:] or f"exit code {done.returncode}"]


def _calls(name: str) -> Callable[[int, int], Result]:
    def run(count: int, seed: int) -> Result:
        return _driven(name, lambda *fmu: [str(PROGRAMS / "contract"), *fmu, str(seed), str(count)])

    return run


def _cycles(name: str) -> Callable[[int, int], Result]:
    """COUNT cycles whose memory is compared, a tenth of them under valgrind too."""

    def run(count: int, seed: int) -> Result:
        del seed  # nothing is random here
        valgrind = shutil.which("valgrind")
        if valgrind is None:
            raise SystemExit("valgrind is not installed; `make test` installs it")
        check = [valgrind, "--quiet", "--error-exitcode=9", "--leak-check=full"]
        check.append("--errors-for-leak-kinds=definite,indirect,possible")
        program = str(PROGRAMS / "cycle")
        counts, faults = _driven(name, lambda *fmu: [program, *fmu, str(count)], r"(\d+) (cycles)")
        checked, more = _driven(name, lambda *fmu: [*check, program, *fmu, str(count // 10)], r"(\d+) (cycles)")
        return {**counts, "under valgrind": checked.get("cycles", 0)}, faults + more

    return run


def _wild(name: str, kind: str) -> Callable[[int, int], Result]:
    def run(count: int, seed: int) -> Result:
        counts, wrong = wild_parameters.campaign(wild_parameters.Fmu(_fmu(name)), count, seed, kind)
        return dict(counts), wrong

    return run


def _loads(count: int, seed: int) -> Result:
    counts, wrong = random_loads.campaign(count, seed)
    return dict(counts), wrong


def _descriptions(count: int, seed: int) -> Result:
    with tempfile.TemporaryDirectory() as folder:
        outcomes = fuzz_description.campaign(count, seed, Path(folder))
    read = outcomes.pop("read", 0)
    return {"read": read, "refused with one line": sum(outcomes.values())}, []


_CALLS = (
    "calls of all 44 functions, legal and illegal, damaged and forged states: each answered as the standard says, "
    "what is refused changes nothing, no value with fmi2OK that is not finite, a repeated step bitwise the same"
)
_CYCLES = (
    "instantiate, initialise, step, save, restore, free, both interfaces in turn: the memory in use does not grow, no "
    "invalid access"
)
_AUDITS = (
    "refused, discarded or failed with a message, or complete; those without a warning are audited, by each audit that "
    "applies"
)
_WILD = f"parameters over their allowed ranges, every method, closure and level: {_AUDITS}"
_MILD = f"parameters within 26 % of their start values, with a choice moved now and then: {_AUDITS}"
CAMPAIGNS = {
    campaign.name: campaign
    for campaign in (
        Campaign("calls_rod", _CALLS, "rod", _calls("rod")),
        Campaign("calls_thermal", _CALLS, "thermal", _calls("thermal")),
        Campaign("cycles_rod", _CYCLES, "rod", _cycles("rod")),
        Campaign("cycles_thermal", _CYCLES, "thermal", _cycles("thermal")),
        Campaign("wild_rod", _WILD, "rod", _wild("rod", "wild")),
        Campaign("wild_thermal", _WILD, "thermal", _wild("thermal", "wild")),
        Campaign("mild_rod", _MILD, "rod", _wild("rod", "mild")),
        Campaign("mild_thermal", _MILD, "thermal", _wild("thermal", "mild")),
        Campaign(
            "loads",
            "dead forces of random direction up to 300 mN at the tip, orders 2 to 7: what the quasi-static rod accepts "
            "is a stable equilibrium of the moving one, and damped motion ends there to 1e-6 m",
            "rod",
            _loads,
        ),
        Campaign(
            "descriptions",
            "modelDescription.xml with random faults: read, or refused with one line",
            "",
            _descriptions,
        ),
    )
}


def record(campaign: Campaign, count: int, seed: int) -> dict[str, Any]:
    """Run a campaign; return its counts and faults, and what binary it ran."""
    counts, faults = campaign.run(count, seed)
    version = subprocess.run(
        ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    ).stdout.strip()
    binary = ""
    if campaign.fmu:
        with zipfile.ZipFile(_fmu(campaign.fmu)) as archive:
            binary = hashlib.sha256(archive.read(f"binaries/linux64/{campaign.fmu}.so")).hexdigest()[:12]
    return {
        "campaign": campaign.name,
        "draws": count,
        "seed": seed,
        "commit": version,
        "binary": binary,
        "counts": dict(sorted(counts.items())),
        "faults": faults,
    }


def page(records: list[dict[str, Any]]) -> str:
    """The page with one row per campaign, summed over its runs."""
    rows = [
        "| `NAME` | what is drawn, and what must hold | counts | faults | commits |",
        "|---|---|---|---|---|",
    ]
    for name, campaign in CAMPAIGNS.items():
        runs = [each for each in records if each["campaign"] == name]
        if not runs:
            continue
        counts: Counter[str] = Counter()
        for each in runs:
            counts.update(each["counts"])
        faults = sum(len(each["faults"]) for each in runs)
        commits = ", ".join(sorted({each["commit"] for each in runs}))
        listed = "; ".join(f"{number:,}".replace(",", " ") + f" {what}" for what, number in counts.most_common())
        rows.append(f"| `{name}` | {campaign.meaning} | {listed} | {faults} | {commits} |")
    return HEAD + "\n".join(rows) + "\n"


def read() -> list[dict[str, Any]]:
    """The records of all runs so far."""
    return json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.exists() else []


def write(records: list[dict[str, Any]]) -> None:
    """Write the records, one per line, and the page."""
    lines = ",\n".join(json.dumps(each, sort_keys=True) for each in records)
    RECORDS.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    PAGE.write_text(page(records), encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Run the campaign that the arguments name; return 1 if it found a fault."""
    faults: list[str] = []
    if arguments[:1] == ["--check"]:
        new = record(CAMPAIGNS[arguments[1]], int(arguments[2]), int((arguments[3:] or ["0"])[0]))
        faults = new["faults"]
        print(json.dumps(new, indent=1))
    elif arguments:
        campaign, count, seed = CAMPAIGNS[arguments[0]], int(arguments[1]), int((arguments[2:] or ["0"])[0])
        new = record(campaign, count, seed)
        faults = new["faults"]
        same = (new["campaign"], new["seed"])
        records = [each for each in read() if (each["campaign"], each["seed"]) != same]
        write(sorted([*records, new], key=lambda each: (each["campaign"], each["seed"])))
        print(json.dumps(new, indent=1))
    else:
        write(read())
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
