"""Include direction between the rooms of the C++ models."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# Rooms of each model and of the FMI runtime, lowest first: a file includes its own room and those before it. Models
# share fmus/core. Only their last room may include the rest of the runtime, so the physics compiles without FMI.
ROOMS = {
    "rod_fmu": ("numerics", "physics", "mechanics", "integration", "pade", "fmu"),
    "thermal_fmu": ("physics", "mesh", "reduction", "levels", "fmu"),
    "fmus": ("core", "model", "sum", "description", "runtime", "engine"),
}
STANDARD = "fmi2Functions.h"


def includes(file: Path) -> list[str]:
    """Paths that a file includes in quotes."""
    return re.findall(r'^#include "([^"]+)"', file.read_text(), flags=re.MULTILINE)


def violations(model: Path, rooms: tuple[str, ...]) -> list[str]:
    """Includes that point to a later room, to no room, or from a lower room to the FMI runtime."""
    faults = []
    for file in sorted(model.rglob("*.?pp")):
        parts = file.relative_to(model).parts
        if parts == ("unload.cpp",):
            continue
        if len(parts) < 2 or parts[0] not in rooms:
            faults.append(f"{file.relative_to(model)} is in none of the rooms")
            continue
        for path in includes(file):
            target = path.split("/")[0]
            is_own = (model / path).is_file()
            if is_own and rooms.index(target) > rooms.index(parts[0]):
                faults.append(f"{file.relative_to(model)} includes {path}")
            if not is_own and target not in ("core", STANDARD) and parts[0] != rooms[-1]:
                faults.append(f"{file.relative_to(model)} includes {path} of the FMI runtime")
    return faults


@pytest.mark.parametrize("model", ROOMS)
def test_rooms_include_only_lower_rooms(model: str) -> None:
    assert violations(ROOT / model, ROOMS[model]) == []


def test_violations_are_found(tmp_path: Path) -> None:
    for room, text in {"low": '#include "high/b.hpp"\n', "high": '#include "low/a.hpp"\n#include "fmi.hpp"\n'}.items():
        (tmp_path / room).mkdir()
        (tmp_path / room / ("a.hpp" if room == "low" else "b.hpp")).write_text(text)
    (tmp_path / "low" / "c.cpp").write_text('#include "fmi.hpp"\n')
    (tmp_path / "stray.cpp").write_text("")
    assert violations(tmp_path, ("low", "high")) == [
        "low/a.hpp includes high/b.hpp",
        "low/c.cpp includes fmi.hpp of the FMI runtime",
        "stray.cpp is in none of the rooms",
    ]
