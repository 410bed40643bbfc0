"""Vectors and matrices among scalar variables: elements of structured names such as T[1] or shape.p[2,3], by index."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["Vector", "find_vectors", "split_index"]

Index = tuple[int, ...]
_INDEXED = re.compile(r"(.+)\[\s*(\d{1,9}(?:\s*,\s*\d{1,9})*)\s*\]", re.DOTALL)


@dataclass(frozen=True)
class Vector:
    """Elements of one structured name in the order of their indices (the last index runs fastest)."""

    elements: tuple[str, ...]
    indices: tuple[Index, ...]

    @property
    def first(self) -> Index:
        """Least index of each dimension: 1 in most FMUs, 0 in some."""
        return tuple(min(index[d] for index in self.indices) for d in range(len(self.indices[0])))

    @property
    def shape(self) -> Index:
        """Number of elements along each dimension, gaps included."""
        first = self.first
        return tuple(max(index[d] for index in self.indices) - first[d] + 1 for d in range(len(first)))

    @property
    def complete(self) -> bool:
        """Whether the elements fill their array, without a gap."""
        return math.prod(self.shape) == len(self.elements)


def split_index(name: str) -> tuple[str, Index]:
    """Split a structured name: 'shape.p[2,3]' -> ('shape.p', (2, 3)); a name without indices has the index ()."""
    match = _INDEXED.fullmatch(name)
    return (name, ()) if match is None else (match[1], tuple(int(part) for part in match[2].split(",")))


def find_vectors(names: Iterable[str]) -> dict[str, Vector]:
    """Return base name -> vector.

    Names whose elements differ in their number of indices, such as T[1] beside T[1,2], or that say one index twice,
    such as T[1] beside T[01], are no vector.
    """
    groups: dict[str, list[tuple[Index, str]]] = {}
    for name in names:
        base, index = split_index(name)
        if index:
            groups.setdefault(base, []).append((index, name))
    vectors = {}
    for base, group in groups.items():
        group.sort()
        indices = tuple(index for index, _ in group)
        if len({len(index) for index in indices}) == 1 and len(set(indices)) == len(indices):
            vectors[base] = Vector(tuple(name for _, name in group), indices)
    return vectors
