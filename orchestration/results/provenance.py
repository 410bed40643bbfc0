"""Provenance of a measurement: the machine and the commit it was made with."""

from __future__ import annotations

import contextlib
import os
import platform
import subprocess
from pathlib import Path

__all__ = ["commit", "machine", "processor"]


def processor() -> str:
    """Return the model of the processor."""
    file = Path("/proc/cpuinfo")  # platform.processor() is empty on Linux
    lines = file.read_text().splitlines() if file.is_file() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def machine() -> dict[str, str]:
    """Return processor, cores, system, and the load: tasks that ran or waited in the last minute."""
    load = f"{os.getloadavg()[0]:.2f}" if hasattr(os, "getloadavg") else "unknown"
    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(terse=True),
        "load": load,
    }


def commit() -> str:
    """Return the commit of the checkout that this package runs from.

    With + where files differ from it; 'none' for an installed package.
    """
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        git = ["git", "-C", str(Path(__file__).parent)]
        commands = [["rev-parse", "--short=12", "HEAD"], ["status", "--porcelain", "--untracked-files=no", "."]]
        name, changed = (
            subprocess.run([*git, *words], capture_output=True, text=True, check=True).stdout.strip()
            for words in commands
        )
        return name + ("+" if changed else "")
    return "none"
