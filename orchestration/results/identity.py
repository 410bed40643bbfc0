"""Keys of caches for objects that never change but have no cheap hash, such as scenes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

__all__ = ["Identity"]

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Identity(Generic[T]):
    """An object that equals itself alone: what is known of it holds for as long as it lives."""

    it: T

    def __hash__(self) -> int:
        return id(self.it)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Identity) and other.it is self.it
