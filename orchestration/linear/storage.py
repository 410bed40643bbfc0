"""Files of linear models: .npz (numpy), .mat (MATLAB, scipy.io) and .json, with the same names in each."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from scipy.io import savemat

from ..errors import SceneError
from ..files import atomic_write
from .model import LinearModel, Quantity

__all__ = ["ENDINGS", "load", "save"]

ENDINGS = (".npz", ".mat", ".json")
_ARRAYS = ("A", "B", "C", "D", "x_0", "u_0", "y_0", "drift")
_GROUPS = ("states", "inputs", "outputs")


def save(model: LinearModel, path: Path) -> None:
    """Write a model; the ending of the path chooses the kind.

    Besides the arrays of LinearModel a file has the lists states, state_units, state_nominals and likewise for inputs
    and outputs, the time [s], the scene and the notes.

    Raises
    ------
    SceneError
        Another ending than .npz, .mat and .json.
    """
    content = _content(model)
    if path.suffix not in ENDINGS:
        raise SceneError(f"{path}: linear models are written as {', '.join(ENDINGS)}; choose one of these endings")
    with atomic_write(path) as draft, draft.open("wb") as file:
        if path.suffix == ".npz":
            arrays: dict[str, Any] = {key: np.asarray(value) for key, value in content.items()}
            np.savez(file, **arrays)
        elif path.suffix == ".mat":
            savemat(file, {key: _as_mat(value) for key, value in content.items()}, oned_as="column")
        else:
            lists = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in content.items()}
            file.write(json.dumps(lists, indent=1).encode())


def load(path: Path) -> LinearModel:
    """Read a model that save() wrote as .npz or .json. Raises SceneError."""
    try:
        if path.suffix == ".npz":
            with np.load(path) as file:
                content: dict[str, Any] = {key: file[key].tolist() for key in file.files}
        elif path.suffix == ".json":
            content = json.loads(path.read_text(encoding="utf-8"))
        else:
            raise SceneError(f"{path}: linear models are read from .npz and .json; choose one of these")
        groups = {
            group: tuple(
                Quantity(*row)
                for row in zip(
                    content[group], content[f"{group[:-1]}_units"], content[f"{group[:-1]}_nominals"], strict=True
                )
            )
            for group in _GROUPS
        }
        n, m, p = (len(groups[group]) for group in _GROUPS)
        shapes = ((n, n), (n, m), (p, n), (p, m), (n,), (m,), (p,), (n,))
        arrays = [np.array(content[key], dtype=float).reshape(s) for key, s in zip(_ARRAYS, shapes, strict=True)]
        A, B, C, D, x_0, u_0, y_0, drift = arrays
        time, scene, notes = content["time"], content["scene"], tuple(content["notes"])
        states, inputs, outputs = (groups[group] for group in _GROUPS)
        return LinearModel(A, B, C, D, states, inputs, outputs, x_0, u_0, y_0, drift, time, scene, notes)
    except (OSError, EOFError, BadZipFile, KeyError, ValueError, TypeError) as error:
        raise SceneError(f"{path}: not a linear model of tca-cosim linearise ({error}); write it again") from error


def _content(model: LinearModel) -> dict[str, Any]:
    content: dict[str, Any] = {key: getattr(model, key) for key in _ARRAYS}
    for group in _GROUPS:
        quantities = getattr(model, group)
        content[group] = [q.name for q in quantities]
        content[f"{group[:-1]}_units"] = [q.unit for q in quantities]
        content[f"{group[:-1]}_nominals"] = [q.nominal for q in quantities]
    return content | {"time": model.time, "scene": model.scene, "notes": list(model.notes)}


def _as_mat(value: Any) -> Any:
    """Return lists of texts as cell arrays."""
    return np.array(value, dtype=object) if isinstance(value, list) and value and isinstance(value[0], str) else value
