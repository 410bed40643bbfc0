"""tca-cosim explain: the meaning of a key of scenes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer

from ..errors import CosimError
from ..fmi.archive import Archive, Variable, find_fmu, similar
from ..scene import KEYS, TABLES
from ..scene.manipulator import DEFAULT_FMUS
from ..scene.member import settable
from ..scene.schema import declared
from ..scene.sizes import SIZE_KEYS
from .console import out, reported

__all__ = ["command", "meaning"]

SIZED = {"tca.": "one per TCA, body.tcas of them", "segment.": "one per segment, body.segments of them"}
PER_TCA = ("T", "V", "P", "N", "delta", "delta_guess")  # vectors of our FMUs with an element for each TCA


def command(
    key: Annotated[str, typer.Argument(metavar="KEY", help="Key of a scene, such as thermal.V, coupling.method")],
) -> None:
    """Explains a key of a scene: meaning, unit, default, allowed values."""
    with reported():
        out.print(meaning(key), highlight=False, soft_wrap=True)


def meaning(key: str) -> str:
    """Return the lines that explain a key. Raises CosimError where no scene has it."""
    archives = {name: Archive(find_fmu(file)) for name, file in DEFAULT_FMUS.items()}
    try:
        known = dict(_known(archives))
    finally:
        for archive in archives.values():
            archive.close()
    if key in known:
        return known[key]
    owners = [name for name in known if name.partition(".")[2] == key]
    if owners:
        return "\n".join(known[name] for name in owners)
    raise CosimError(f"explain {key!r}: no such key; {similar(key, known)}")


def _known(archives: dict[str, Archive]) -> Iterator[tuple[str, str]]:
    for name, text in KEYS.items():
        yield name, f"{name}: {text}"
    for name, text in SIZE_KEYS.items():
        yield name, f"{name}: {text}"
    for table, kind in TABLES.items():
        for name, variable in declared(kind).items():
            yield f"{table}.{name}", _described(f"{table}.{name}", variable)
    for member, archive in archives.items():
        names = [*settable(archive), *(element for vector in archive.vectors.values() for element in vector)]
        for name in [*names, *(v.name for v in archive.variables.values())]:
            elements = archive.vectors.get(name, (name,))
            variable = archive.variables[elements[0]]
            more = f", vector of {len(elements)}{_size(name)}" if name in archive.vectors else ""
            yield f"{member}.{name}", _described(f"{member}.{name}", variable, f"{variable.causality}{more}")


def _size(name: str) -> str:
    """What the length of a vector follows from, in brackets; '' where it is always the same."""
    reasons = [text for prefix, text in SIZED.items() if name.startswith(prefix)]
    if not reasons and name in PER_TCA:
        reasons = [SIZED["tca."]]
    return "".join(f" ({reason})" for reason in reasons)


def _described(name: str, variable: Variable, kind: str = "setting") -> str:
    """Meaning, then unit, default and allowed values."""
    lines = [f"{name}: {variable.description or 'no description'}", f"  {kind} of type {variable.type}"]
    if variable.unit != "1":
        lines.append(f"  unit {variable.unit}")
    if variable.start is not None:
        default = variable.start
        if variable.items and isinstance(default, int) and not isinstance(default, bool):
            default = variable.item_name(default)
        lines.append(f"  default {default}")
    if variable.items:
        lines.append(f"  allowed: {', '.join(variable.items)}")
    elif variable.type == "Real" and (variable.least > -1e300 or variable.most < 1e300):
        lines.append(f"  allowed: {variable.least:g} to {variable.most:g}")
    elif variable.type == "Integer" and variable.least == variable.most:
        lines.append(f"  allowed: {variable.least:g}, and up to body.segments where that is more")
    elif variable.type == "Integer":
        lines.append(f"  allowed: whole numbers from {variable.least:g} to {variable.most:g}")
    return "\n".join(lines)
