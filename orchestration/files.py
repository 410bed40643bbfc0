"""Files that appear whole or not at all, whatever happens while they are written."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["atomic_write", "save_figure"]

SMALLEST_SPACE = 65536  # [bytes] free on a disk that is not full: the smallest result is about as large


@contextlib.contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a draft of the same name in a folder beside; at the end of the context it replaces `path`.

    Missing folders are made. Where the context raises, `path` stays as it was; an OSError names `path`, and a full disk
    as such, for which NetCDF's library gives other reasons.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as folder:
            draft = Path(folder) / path.name
            try:
                yield draft
            except (OSError, RuntimeError) as error:
                if shutil.disk_usage(folder).free < SMALLEST_SPACE:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from error
                raise
            os.replace(draft, path)
    except OSError as error:
        if error.errno is None or (
            error.filename and ".writing-" not in str(error.filename) and Path(error.filename) != path
        ):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def save_figure(
    figure: Figure, folder: Path, name: str, endings: Sequence[str] = ("png", "svg"), dpi: int = 110
) -> list[Path]:
    """Write folder/name.ending for each ending; return the files written."""
    paths = [folder / f"{name}.{ending}" for ending in endings]
    for path in paths:
        with atomic_write(path) as draft:
            figure.savefig(draft, dpi=dpi)
    return paths
