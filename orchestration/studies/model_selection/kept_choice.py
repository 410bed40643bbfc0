"""Choices that earlier searches made, in this process or another one: the same scene is not searched twice.

A choice is known by all that decides it: the scene with its FMUs and what it asks for, and the code that searches.
`fidelity.search = "anew"` searches whatever is known, and replaces it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...fmi import cache
from ...results.identity import Identity
from ...results.software import versions
from ...scene import Scene
from .hierarchy import Choice, apply_choice, model_hierarchies

__all__ = ["KeptChoice", "keep_choice", "kept_choice"]

# Parts of the package that decide a choice: where their code changes, choices are searched again.
_CODE = ("studies/model_selection", "cosim", "simulation.py", "scene/loop_closure.py")


@dataclass(frozen=True)
class KeptChoice:
    """A choice and what its search found.

    choice: level of each hierarchy; record: Selection.record() of the search.
    """

    choice: Choice
    record: Mapping[str, Any]

    def scene(self, scene: Scene) -> Scene:
        """The scene with that choice."""
        return _applied(Identity(scene), Identity(self))


_CHOICES: dict[str, KeptChoice] = {}  # of this process, by key


@lru_cache(maxsize=16)
def _applied(scene: Identity[Scene], kept: Identity[KeptChoice]) -> Scene:
    return apply_choice(scene.it, kept.it.choice)


def kept_choice(scene: Scene) -> KeptChoice | None:
    """Return what an earlier search found for a scene; None where there was none, or it is to be searched anew."""
    if scene.accuracy.search == "anew":
        return None
    key = _key(Identity(scene))
    if key not in _CHOICES:
        content = cache.kept_bytes(f"choices/{key}.json")
        if content is None:
            return None
        try:
            read = json.loads(content)
            choice = KeptChoice({str(k): int(v) for k, v in read["choice"].items()}, dict(read["record"]))
        except (ValueError, KeyError, TypeError, AttributeError):
            return None
        if {h.name for h in model_hierarchies(scene)} != set(choice.choice):
            return None
        _CHOICES[key] = choice
    return _CHOICES[key]


def keep_choice(scene: Scene, choice: Choice, record: Mapping[str, Any]) -> None:
    """Keep what a search found."""
    key = _key(Identity(scene))
    _CHOICES[key] = KeptChoice(dict(choice), record)
    cache.keep_bytes(f"choices/{key}.json", json.dumps({"choice": dict(choice), "record": record}).encode())


@lru_cache(maxsize=16)
def _key(same: Identity[Scene]) -> str:
    """Return the hash of all that decides a choice. Titles, names of files and limits do not."""
    scene = same.it
    accuracy = {name: value for name, value in asdict(scene.accuracy).items() if name not in ("level", "search")}
    facts = [
        [scene.start_time, scene.stop_time, scene.tolerance, accuracy, asdict(scene.coupling)],
        [str(connection) for connection in scene.connections],
        [
            [
                member.name,
                member.archive.digest,
                sorted(member.parameters.items()),
                [[name, type(signal).__name__, vars(signal)] for name, signal in member.signals.items()],
                member.frozen,
                sorted(member.recorded),
            ]
            for member in scene.members
        ],
        _code(),
    ]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


@lru_cache(maxsize=1)
def _code() -> list[str]:
    """Return version and hash of the code that searches."""
    root = Path(__file__).parents[2]
    files = [
        f for part in _CODE for f in ([root / part] if part.endswith(".py") else sorted((root / part).rglob("*.py")))
    ]
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    return [versions()["tca-cosim"], digest]
