"""Where and from what a measurement came."""

from __future__ import annotations

import contextlib
import os
import platform
import subprocess
from pathlib import Path

__all__ = ["commit", "machine", "processor"]


def processor() -> str:
    about = Path("/proc/cpuinfo")  # platform.processor() is empty on Linux
    lines = about.read_text().splitlines() if about.is_file() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def machine() -> dict[str, str]:
    """Processor, cores, system, and how busy it is now: tasks that ran or waited in the last minute."""
    busy = f"{os.getloadavg()[0]:.2f}" if hasattr(os, "getloadavg") else "unknown"
    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(terse=True),
        "load": busy,
    }


def commit() -> str:
    """Of the checkout that this package runs from, with + where files differ from it; 'none' for an installed one."""
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        here = ["git", "-C", str(Path(__file__).parent)]
        asked = [["rev-parse", "--short=12", "HEAD"], ["status", "--porcelain", "--untracked-files=no", "."]]
        name, changed = (
            subprocess.run([*here, *words], capture_output=True, text=True, check=True).stdout.strip()
            for words in asked
        )
        return name + ("+" if changed else "")
    return "none"
