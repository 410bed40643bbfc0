"""Closing the TCA loop, delta -> delta_guess, inside the rod instead of by the master."""

from __future__ import annotations

from dataclasses import replace

from . import Scene
from .manipulator import CLOSURE_EXCHANGED, CLOSURE_INSIDE, DISPLACEMENT_GUESS, is_element_of

__all__ = ["closed_inside"]


def closed_inside(scene: Scene) -> Scene:
    """Return the scene with `closure = inside` where the master would have closed the loop.

    That is where delta_guess is wired from the same FMU's delta.
    """
    members, connections = [], list(scene.connections)
    for member in scene.members:
        loop = [
            c
            for c in connections
            if c.source[0] == c.target[0] == member.name and is_element_of(c.target[1], DISPLACEMENT_GUESS)
        ]
        if member.value("closure") == CLOSURE_EXCHANGED and loop:
            member = member.with_values({"closure": CLOSURE_INSIDE})
            connections = [c for c in connections if c not in loop]
        members.append(member)
    return replace(scene, members=tuple(members), connections=tuple(connections))
