"""Scenes read and run from Python."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import scene as scenes
from . import simulation
from .cosim.signals import Constant, Ramps, Signal
from .errors import SceneError, SceneWarning
from .results.plausibility import doubtful
from .scene import Scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Overrides", "read", "run"]

Overrides = Sequence[str] | Mapping[str, Any]
Source = Scene | str | Path | Mapping[str, Any]
_ORIGIN = "overrides"  # word of messages for what a caller sets


def read(source: Source, overrides: Overrides = ()) -> Scene:
    """Read a scene, checked against its FMUs and ready to run.

    Parameters
    ----------
    source
        Name of a scene of the package (titles()), a .toml or .ssp file, a table as a file holds one, whose inputs may
        be arrays, DataFrames and functions as those of overrides, or a scene that is read already.
    overrides
        Values that win over the scene, as {"thermal.V": [0, "2 V", 3], "rod.order": 2} or ["rod.order=2"]. Numbers are
        in the variable's own unit, texts carry one. An input may be a function of time [s], an array whose first
        column is the time, or a pandas Series or DataFrame over time: values are joined by straight lines, those of a
        function between macro steps.

    Raises
    ------
    SceneError
        The message names file, key, value and remedy.
    """
    if isinstance(overrides, str):
        raise SceneError(f"overrides {overrides!r}: one text; give a list, [{overrides!r}], or a table {{key: value}}")
    if isinstance(source, Mapping):
        source, functions = _parted(source)
        if functions:
            return read(read(source, overrides), {k: f for k, f in functions.items() if not _is_set(k, overrides)})
    if not isinstance(overrides, Mapping):
        return _applied(source, list(overrides))
    plain = {key: _plain(key, value) for key, value in overrides.items() if not callable(value)}
    functions = {key: value for key, value in overrides.items() if callable(value)}
    scene = _applied(source, plain)
    if functions:
        times = np.append(np.arange(0.0, scene.stop_time, scene.coupling.macro_step), scene.stop_time)
        sampled = {key: _sampled(key, function, times) for key, function in functions.items()}
        scene = scenes.changed(scene, sampled, origin=_ORIGIN)
    return scene


def run(
    scene: Source,
    overrides: Overrides = (),
    progress: Callable[[float], None] = lambda time: None,
) -> xr.Dataset:
    """Run a scene to its stop time.

    Parameters
    ----------
    scene, overrides
        As read() takes them.
    progress
        Called with the time reached [s] after every macro step.

    Returns
    -------
    xarray.Dataset
        Over time [s]: one variable for each input and output of the FMUs, named member.variable, such as thermal.T
        (time, index3) [K] or rod.shape.p (time, index21, index3) [m]; the master's log as coupling.step, sweeps,
        residual, error, gain; attributes units and long_name on each; settings, scene, versions and warnings in attrs.
        Its accessor `.tca` plots, animates and reports it.

    Raises
    ------
    SceneError
        The scene cannot be run as written.
    SubsystemError
        An FMU refuses a value or a step.
    CouplingError
        The loop cannot be closed. The result until then is the error's `partial`.
    """
    described = read(scene, overrides)
    with simulation.partial_as_dataset():
        if described.accuracy.level == "auto":
            from .studies.model_selection import run_selected_table

            table = run_selected_table(described, progress)
        else:
            table = simulation.run_table(described, progress)
    for text in doubtful(described, table):
        warnings.warn(text, SceneWarning, stacklevel=2)
    return table.to_xarray()


def _applied(source: Source, overrides: Overrides) -> Scene:
    if isinstance(source, Scene):
        return scenes.changed(source, overrides, origin=_ORIGIN) if overrides else source
    return scenes.read(source, overrides, origin=_ORIGIN)


def _parted(table: Mapping[str, Any], prefix: str = "") -> tuple[dict[str, Any], dict[str, Callable[[float], Any]]]:
    """Part a table that describes a scene into what TOML could hold, and functions of time by their dotted keys."""
    plain: dict[str, Any] = {}
    functions: dict[str, Callable[[float], Any]] = {}
    for name, value in table.items():
        key = f"{prefix}{name}"
        if callable(value):
            functions[key] = value
        elif isinstance(value, Mapping):
            plain[name], inner = _parted(value, f"{key}.")
            functions |= inner
        else:
            plain[name] = _plain(key, value)
    return plain, functions


def _is_set(key: str, overrides: Overrides) -> bool:
    names = overrides if isinstance(overrides, Mapping) else [text.partition("=")[0].strip() for text in overrides]
    return any(name.partition("[")[0] == key for name in names)


def _plain(key: str, value: Any) -> Any:
    """A value as TOML would give it; courses over time as signals."""
    if isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, (Constant, Ramps)) or hasattr(value, "polynomial"):
        return value
    if hasattr(value, "index") and hasattr(value, "to_numpy"):  # a pandas Series or DataFrame
        columns = np.asarray(value.to_numpy(), dtype=float).reshape(len(value), -1)
        return _courses(key, np.asarray(value.index, dtype=float), columns)
    if isinstance(value, np.ndarray) and value.ndim == 2:
        return _courses(key, value[:, 0].astype(float), value[:, 1:].astype(float))
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(key, value.tolist())
    if isinstance(value, Mapping):
        return {str(name): _plain(key, item) for name, item in value.items()}
    if isinstance(value, Sequence):
        return [_plain(key, item) for item in value]
    raise SceneError(
        f"overrides: {key} = {value!r}: {type(value).__name__} is not a number, text, list, table, array, DataFrame or "
        "function of time"
    )


def _sampled(key: str, function: Callable[[float], Any], times: np.ndarray) -> Any:
    """A function of time as straight lines between its values at `times`."""
    try:
        values = np.array([np.asarray(function(float(time)), dtype=float).reshape(-1) for time in times])
    except (TypeError, ValueError) as error:
        raise SceneError(f"overrides: {key}: the function does not return numbers, always as many: {error}") from error
    return _courses(key, times, values)


def _courses(key: str, times: np.ndarray, columns: np.ndarray) -> Any:
    """Straight lines through the columns (time, n): a signal for one, a list of signals for several."""
    if times.size == 0 or columns.shape[1] == 0:
        raise SceneError(f"overrides: {key}: no values; give a column of times and one of values at least")
    if not (np.isfinite(times).all() and np.isfinite(columns).all() and (np.diff(times) > 0.0).all()):
        raise SceneError(f"overrides: {key}: times must increase, and all numbers be finite; sort and clean them")
    signals: list[Signal] = [Ramps(tuple(times.tolist()), tuple(column.tolist())) for column in columns.T]
    return signals[0] if len(signals) == 1 else signals
