"""Commands whose arguments are plain, called without typer, which takes longer to load than they take to run.

Whatever is not understood here at once, a request for help or a mistake, is left to typer, which knows all options and
explains mistakes. `run` and `list` are called thousands of times by scripts; the other commands take longer anyway.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

__all__ = ["parsed_run", "run_plain"]

_OPTIONS = {"--set": "override", "--out": "folder", "--name": "name"}  # of `run`, each with a value


def run_plain(arguments: Sequence[str]) -> bool:
    """Run a command with plain arguments; False where typer is to look at them."""
    # One thread of the linear algebra: starting others takes longer than the small systems of a run gain by them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if list(arguments) == ["list"]:
        from . import listing

        listing.print_titles()
        return True
    if arguments[:1] == ["run"] and (parsed := parsed_run(arguments[1:])) is not None:
        from . import running

        running.run_scene(**parsed)
        return True
    return False


def parsed_run(arguments: Sequence[str]) -> dict[str, Any] | None:
    """Return the arguments of running.run_scene, or None where typer is to look at them."""
    parsed: dict[str, Any] = {"override": []}
    waiting = iter(arguments)
    for argument in waiting:
        option, equals, value = argument.partition("=")
        if option in _OPTIONS:
            if not equals:
                value = next(waiting, "")
            if not value or (not equals and value.startswith("-")):
                return None
            key = _OPTIONS[option]
            if key == "override":
                parsed[key].append(value)
            else:
                parsed[key] = Path(value) if key == "folder" else value
        elif argument.startswith("-") or not argument or "scene" in parsed:
            return None
        else:
            parsed["scene"] = argument
    return parsed if "scene" in parsed else None
