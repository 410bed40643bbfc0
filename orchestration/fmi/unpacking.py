"""Archives on disk and inside other archives: reading one file of them, extracting them whole."""

from __future__ import annotations

import io
import re
import shutil
import zipfile
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from . import fmi2

__all__ = ["containing_file", "extract", "open_archive", "read_member"]

MAX_DESCRIPTION = 2**30  # [bytes] of one file that is read into memory; the largest public FMU's has 60 MB


def containing_file(path: Path) -> Path:
    """Return the file on disk: the path itself, or the archive that it leads into (system.ssp/resources/rod.fmu)."""
    return path if path.is_file() else next((parent for parent in path.parents if parent.is_file()), path)


def open_archive(path: Path) -> BinaryIO:
    """Open the bytes of an archive, which may lie inside another one."""
    container = containing_file(path)
    if container == path:
        return path.open("rb")
    with zipfile.ZipFile(container) as outer:
        return io.BytesIO(outer.read(path.relative_to(container).as_posix()))


def read_member(file: BinaryIO, name: str) -> bytes:
    """Return the content of one file of a ZIP archive.

    KeyError where there is none, ValueError where it is too large.
    """
    with zipfile.ZipFile(file) as archive:
        entry = next((info for info in archive.infolist() if info.filename.replace("\\", "/") == name), None)
        if entry is None:
            raise KeyError(name)
        if entry.file_size > MAX_DESCRIPTION:
            raise ValueError(f"{name} has {entry.file_size} bytes, allowed: {MAX_DESCRIPTION}")
        return archive.read(entry)


def extract(file: BinaryIO, folder: Path) -> None:
    """Extract a ZIP archive; backslashes in its names, which some Windows tools write, are taken for slashes.

    Binaries of other platforms stay packed where there are some of this one: they are most of an FMU's bytes.

    Raises
    ------
    ValueError
        A name leads outside the folder.
    """
    own = ("binaries", fmi2.PLATFORM)
    with zipfile.ZipFile(file) as archive:
        names = [entry.filename.replace("\\", "/") for entry in archive.infolist()]
        has_own = any(PurePosixPath(name).parts[:2] == own for name in names)
        for entry, name in zip(archive.infolist(), names, strict=True):
            parts = PurePosixPath(name).parts
            if name.startswith("/") or ".." in parts or re.match(r"[A-Za-z]:", name):
                raise ValueError(f"its file {name!r} would be written outside the folder of the FMU")
            if has_own and parts[:1] == own[:1] and parts[:2] != own:
                continue
            target = folder.joinpath(*parts)
            if name.endswith("/"):
                target.mkdir(parents=True, exist_ok=True)
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(entry) as source, target.open("wb") as sink:
                shutil.copyfileobj(source, sink)
