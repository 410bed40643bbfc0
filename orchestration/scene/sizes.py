"""Size of the body in a scene: the keys tcas, segments, ports and creep of the table [body], or body.tcas of one FMU.

FMUs of this package are written at that size when the scene is read (fmi/configuration.py); all others have the size
that they have.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..fmi.archive import Archive, find_fmu
from ..fmi.configuration import Configuration, can_configure, configured_fmu
from ..fmi.python_fmu import SUFFIX, built_fmu
from .validation import Layer

__all__ = ["MAX_SIZES", "SIZE_KEYS", "open_archives", "take_sizes"]

_TABLE = "body"
_OPTIONS = ("ports", "creep")  # true or false: the rod's ports for models of its surroundings, creep of its TCAs
MAX_SIZES = {"tcas": 12, "segments": 6}  # room in the FMUs (fmus/core/capacity.hpp)
SIZE_KEYS = {  # keys of a scene, and what they mean
    f"{_TABLE}.tcas": f"number of TCAs, 1 to {MAX_SIZES['tcas']}; start values spread them evenly (default 3)",
    f"{_TABLE}.segments": f"number of segments of the rod, 1 to {MAX_SIZES['segments']}, each with radii, material and "
    "order of its own: segment.radius[j,1], segment.E[j] (default 1)",
    f"{_TABLE}.ports": "true gives the rod inputs shape.f (force per length along the body), outputs shape.v, "
    "base.force and base.moment (default false)",
    f"{_TABLE}.creep": "true gives measured TCAs of the rod tca.creep_compliance, tca.creep_time and "
    "tca.creep_activation, and the output creep (default false)",
}
Sizes = dict[str, dict[str, tuple[int, Layer]]]  # by member, "" for all: key -> size and the layer that sets it


def take_sizes(layers: Sequence[Layer], members: Mapping[str, str]) -> tuple[list[Layer], Sizes]:
    """Take the sizes out of the layers.

    Parameters
    ----------
    layers
        Layers of the scene, the later ones win.
    members
        Name -> file of the FMUs.

    Returns
    -------
    tuple
        Layers without the sizes, and the sizes.

    Raises
    ------
    SceneError
        A size is out of its range.
    """
    sizes: Sizes = {}
    rest = []
    for layer in layers:
        raw = dict(layer.raw)
        if isinstance(raw.get(_TABLE), Mapping) and _TABLE not in members:
            raw[_TABLE] = _without(layer, "", _TABLE, raw[_TABLE], sizes)
        for name in members:
            if not isinstance(raw.get(name), Mapping):
                continue
            own = _without(layer, name, f"{name}.{_TABLE}", raw[name], sizes, f"{_TABLE}.")
            if isinstance(own.get(_TABLE), Mapping):
                own[_TABLE] = _without(layer, name, f"{name}.{_TABLE}", own[_TABLE], sizes)
            raw[name] = own
        rest.append(replace(layer, raw=raw))
    return rest, sizes


def _without(
    layer: Layer, member: str, label: str, table: Mapping[str, Any], sizes: Sizes, prefix: str = ""
) -> dict[str, Any]:
    """Return the table without its sizes, which are noted."""
    kept = dict(table)
    for key, most in MAX_SIZES.items():
        size = kept.pop(prefix + key, None)
        if size is None:
            continue
        if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= most:
            layer.refuse(f"{label}.{key}", size, f"give a whole number from 1 to {most}")
        sizes.setdefault(member, {})[key] = (size, layer)
    for key in _OPTIONS:
        chosen = kept.pop(prefix + key, None)
        if chosen is None:
            continue
        if not isinstance(chosen, bool):
            layer.refuse(f"{label}.{key}", chosen, "give true or false")
        sizes.setdefault(member, {})[key] = (chosen, layer)
    return kept


def _fmu_of(file: str, folder: Path) -> Path:
    """Return the file of an FMU, which is made first where it is written in Python."""
    path = find_fmu(file, folder)
    return built_fmu(path) if path.suffix == SUFFIX else path


def open_archives(
    files: Mapping[str, str], folder: Path, sizes: Sizes, archive: Callable[[Path], Archive]
) -> dict[str, Archive]:
    """Open the FMUs of a scene, at their sizes.

    Parameters
    ----------
    files
        Name of the member -> file of its FMU.
    folder
        Folder that relative paths start from.
    sizes
        As take_sizes() returns them.
    archive
        Opens an FMU.

    Raises
    ------
    SceneError
        An FMU is not there, or is none whose size can be chosen.
    """
    archives = {name: archive(_fmu_of(file, folder)) for name, file in files.items()}
    if not sizes:
        return archives
    for name, source in archives.items():
        wanted = {**sizes.get("", {}), **sizes.get(name, {})}
        if can_configure(source) and wanted:
            tcas, segments = (wanted[key][0] if key in wanted else None for key in MAX_SIZES)
            ports, creep = (bool(wanted[key][0]) if key in wanted else None for key in _OPTIONS)
            archives[name] = archive(configured_fmu(source, Configuration(tcas, segments, ports, creep)))
            source.close()
        elif name in sizes:
            key, (size, layer) = next(iter(sizes[name].items()))
            layer.refuse(
                f"{name}.{_TABLE}.{key}", size, f"the size of {source.path.name} cannot be chosen; leave it out"
            )
    if "" in sizes and not any(can_configure(each) for each in archives.values()):
        key, (size, layer) = next(iter(sizes[""].items()))
        layer.refuse(f"{_TABLE}.{key}", size, "no FMU of the scene has a size that can be chosen; leave it out")
    return archives
