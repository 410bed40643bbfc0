"""tca-cosim list: scenes and sweeps of the package."""

from __future__ import annotations

from .listing import print_titles

__all__ = ["command"]


def command() -> None:
    """Lists the scenes and sweeps that come with the package."""
    print_titles()
