"""All bodies of a result in one picture: its manipulators, and what stands between them.

The scene's table [placement] says where they stand. Manipulators that it does not place stand side by side along x.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from ..errors import CosimError
from .manipulator import Manipulator, manipulator, members, rod_members

__all__ = ["FACES", "Assembly", "Block", "assembly"]

_GAP = 10e-3  # [m] between manipulators that stand side by side
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FACES = np.array(  # corners of a block's faces, in cyclic order
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
)


@dataclass(frozen=True)
class Block:
    """Member of the scene that is drawn as a block."""

    name: str
    size: np.ndarray  # edges (3,) [m]
    axes: np.ndarray  # directions of the edges, as rows (3, 3)
    centre: np.ndarray  # (time, 3) [m]

    @property
    def corners(self) -> np.ndarray:
        """Positions of the corners (time, 8, 3) [m]; FACES has their order."""
        return self.centre[:, None] + (_CORNERS * self.size) @ self.axes


@dataclass(frozen=True)
class Assembly:
    """Manipulators and blocks over time.

    Attributes
    ----------
    manipulators : tuple of Manipulator
        At least one.
    blocks : tuple of Block
        What the scene gives a size.
    is_arranged : bool
        Whether manipulators stand side by side because the scene does not say where they are.
    """

    manipulators: tuple[Manipulator, ...]
    blocks: tuple[Block, ...]
    is_arranged: bool

    @property
    def times(self) -> np.ndarray:
        """Times of the rows (time,) [s]."""
        return self.manipulators[0].times

    @cached_property
    def temperatures(self) -> np.ndarray:
        """Temperatures of the TCAs of all manipulators, one after the other (time, n) [K]."""
        return np.concatenate([m.temperature for m in self.manipulators], axis=1)

    @cached_property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates [m] of the whole motion, (3,) each."""
        corners = [block.corners.reshape(-1, 3) for block in self.blocks]
        points = np.concatenate([np.array(m.extent) for m in self.manipulators] + corners)
        return points.min(axis=0), points.max(axis=0)

    @property
    def gravity(self) -> np.ndarray:
        """Gravity (time, 3) [m/s2]; zero where that of the manipulators is not one and the same in the picture."""
        first, *others = (m.gravity for m in self.manipulators)
        return first if all(np.allclose(first, other, atol=1e-9) for other in others) else np.zeros_like(first)

    @property
    def azimuth(self) -> float:
        """Direction seen from above [rad] into which the tip of the only manipulator goes; of several, -y."""
        if len(self.manipulators) > 1:
            return -0.5 * np.pi
        x, y, _ = self.manipulators[0].frames.p[-1, -1]
        return float(np.arctan2(y, x))


def assembly(result: xr.Dataset, rows: np.ndarray) -> Assembly:
    """Bodies at some rows of a result. CosimError where it contains no rod."""
    placed: Mapping[str, Any] = json.loads(result.attrs.get("placement", "{}"))
    own = [manipulator(result, rows, rod) for rod in rod_members(result)] or [manipulator(result, rows)]
    known = [m.moved(np.array(pose["position"]), pose["turn"]) for m in own if (pose := placed.get(m.name))]
    unknown = [m for m in own if m.name not in placed]
    blocks = tuple(
        _block(result, rows, name, pose) for name, pose in placed.items() if pose["size"] and name in members(result)
    )
    if not known and len(unknown) == 1:
        return Assembly((unknown[0],), blocks, False)
    stood: list[Manipulator] = list(known)
    for m in unknown:
        behind = max((one.extent[1][0] for one in stood), default=0.0) + _GAP if stood else m.extent[0][0]
        stood.append(m.moved(np.array([behind - m.extent[0][0], 0.0, 0.0]), 0.0))
    order = {m.name: k for k, m in enumerate(own)}
    return Assembly(tuple(sorted(stood, key=lambda m: order[m.name])), blocks, bool(unknown))


def _block(result: xr.Dataset, rows: np.ndarray, name: str, pose: Mapping[str, Any]) -> Block:
    axes = Rotation.from_euler("z", pose["turn"]).as_matrix().T
    motion = np.zeros((rows.size, 3))
    if pose["motion"]:
        moved = result.get(f"{name}.{pose['motion']}")
        if moved is None:
            raise CosimError(
                f"placement of {name!r}: {name}.{pose['motion']} is not in the result; run the scene with it recorded"
            )
        values = moved.to_numpy()[rows].reshape(rows.size, -1)
        motion[:, : values.shape[1]] = values
    return Block(name, np.array(pose["size"]), axes, np.array(pose["position"]) + motion @ axes)
