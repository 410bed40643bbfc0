"""Versions of installed packages."""

from __future__ import annotations

import re
import sys
from pathlib import Path

__all__ = ["version"]


def version(package: str) -> str:
    """Return the version of an installed package.

    Read from the name of its .dist-info folder: importlib.metadata takes longer to load than a short run.

    Raises
    ------
    importlib.metadata.PackageNotFoundError
        It is not installed.
    """
    name = re.sub(r"[-_.]+", "_", package).lower()
    for folder in sys.path:
        for record in Path(folder or ".").glob(f"{name}-*.dist-info"):
            return record.name.removesuffix(".dist-info").split("-", 1)[1]
    from importlib import metadata

    return metadata.version(package)
