"""Scenes read and run from Python, as briefly as from the command line."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from . import scene as scenes
from .errors import SceneError
from .scene import Scene
from .studies.model_selection import run_selected

__all__ = ["Overrides", "read", "run"]

Overrides = Sequence[str] | Mapping[str, Any]


def read(source: str | Path, overrides: Overrides = ()) -> Scene:
    """A scene, checked against its FMUs and ready to run.

    source: the name of one that comes with the package (titles()), or a .toml or .ssp file.
    overrides: what is set otherwise than there, as {"thermal.V": [0, "2 V", 3], "rod.order": 2} or ["rod.order=2"];
    numbers are in the variable's own unit, texts carry one.

    Raises SceneError, which names file, key, value and remedy."""
    return scenes.read(source, _lines(overrides))


def run(
    scene: Scene | str | Path,
    overrides: Overrides = (),
    progress: Callable[[float], None] = lambda time: None,
) -> xr.Dataset:
    """Runs a scene to its stop time.

    scene, overrides: as read() takes them; a scene that is read already takes no overrides any more.
    progress: called with the time reached [s] after every macro step.

    Returns a Dataset over time [s]: one variable for each of the FMUs' Real inputs and outputs, named member.variable,
    such as thermal.T (time, index3) [K] or rod.shape.p (time, index21, index3) [m]; the master's log as coupling.step,
    sweeps, residual, error, gain; attributes units and long_name on each; settings, scene and versions in attrs. Its
    `.tca` plots, animates and reports it (accessor.py).

    Raises SceneError; SubsystemError where an FMU refuses a value or a step; CouplingError where the loop cannot be
    closed. What had been computed by then is the error's `partial`."""
    if not isinstance(scene, Scene):
        scene = read(scene, overrides)
    elif overrides:
        raise SceneError(
            f"overrides {list(_lines(overrides))}: the scene {scene.name!r} has been read; give them to read(), or run "
            "the scene by its name"
        )
    return run_selected(scene, progress)


def _lines(overrides: Overrides) -> Sequence[str]:
    """As on the command line: key=value, the value in TOML."""
    if isinstance(overrides, str):
        raise SceneError(f"overrides {overrides!r}: one text; give a list, [{overrides!r}], or a table {{key: value}}")
    if not isinstance(overrides, Mapping):
        return overrides
    return [f"{key}={_toml(key, value)}" for key, value in overrides.items()]


def _toml(key: str, value: Any) -> str:
    if hasattr(value, "tolist"):  # numpy's
        value = value.tolist()
    if isinstance(value, str | bool):
        return json.dumps(value)
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(name)} = {_toml(key, item)}" for name, item in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_toml(key, item) for item in value) + "]"
    raise SceneError(f"overrides: {key} = {value!r}: {type(value).__name__} is no number, text, list or table")
