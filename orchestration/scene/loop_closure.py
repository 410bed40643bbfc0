"""A scene whose TCA loop, delta -> delta_guess, is closed inside the rod instead of by the master."""

from __future__ import annotations

from dataclasses import replace

from . import Scene

__all__ = ["closed_inside"]

_INSIDE, _EXCHANGED = 1, 2  # items of the parameter closure


def closed_inside(scene: Scene) -> Scene:
    """The scene with `closure = inside` where the master would have closed it from the same FMU's delta."""
    members, connections = [], list(scene.connections)
    for member in scene.members:
        loop = [c for c in connections if c.source[0] == c.target[0] == member.name and "delta_guess" in c.target[1]]
        if member.value("closure") == _EXCHANGED and loop:
            member = replace(member, parameters={**member.parameters, "closure": _INSIDE})
            connections = [c for c in connections if c not in loop]
        members.append(member)
    return replace(scene, members=tuple(members), connections=tuple(connections))
