"""What is kept of FMUs from one process to the next: descriptions, and unpacked FMUs of this package's own tools.

Everything is named by the hash of the FMU's content, appears whole or not at all, and is made anew where it is missing,
damaged, or cannot be written. The folder is that of the user's caches, or TCA_COSIM_CACHE; an empty one keeps nothing.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

__all__ = ["VARIABLE", "cache_folder", "clean", "keep_bytes", "kept_bytes", "kept_folder"]

VARIABLE = "TCA_COSIM_CACHE"  # environment variable with the folder
MAX_AGE = 30 * 86400.0  # [s] since the last use, after which something is removed: nothing of it is likely to return
TOUCH_AGE = 86400.0  # [s] after which a use is noted again: a share of MAX_AGE, so that most uses write nothing
_MANIFEST = "manifest.json"  # in an unpacked FMU: name -> size and time of modification of every file
_DRAFT = ".draft-"  # prefix of what is being written


def cache_folder() -> Path | None:
    """Return the folder of the cache; None where nothing is to be kept."""
    chosen = os.environ.get(VARIABLE)
    if chosen is None:
        from platformdirs import user_cache_path

        return Path(user_cache_path("tca-cosim", appauthor=False))
    return Path(chosen) if chosen else None


def kept_bytes(name: str) -> bytes | None:
    """Return what was kept under a name; None where there is nothing whole."""
    folder = cache_folder()
    if folder is None:
        return None
    path = folder / name
    try:
        digest, _, content = path.read_bytes().partition(b"\n")
    except OSError:
        return None
    if hashlib.sha256(content).hexdigest().encode() != digest:
        return None
    _note_use(path)
    return content


def keep_bytes(name: str, content: bytes) -> None:
    """Keep something under a name, where the folder can be written."""
    folder = cache_folder()
    if folder is None:
        return
    path = folder / name
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, draft = tempfile.mkstemp(prefix=_DRAFT, dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
            os.replace(draft, path)
        except OSError:
            Path(draft).unlink(missing_ok=True)
            raise
        _clean_once(path.parent)


def kept_folder(name: str, fill: Callable[[Path], None]) -> Path | None:
    """Return the folder kept under a name; `fill` writes its content where there is none, or a damaged one.

    None where nothing can be kept. Processes that fill one at the same time do not disturb each other: the first one
    that ends wins. What `fill` raises passes through.
    """
    base = cache_folder()
    if base is None:
        return None
    path = base / name
    if _is_whole(path):
        _note_use(path)
        return path
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=_DRAFT, dir=path.parent))
    except OSError:
        return None
    try:
        fill(draft)
        with contextlib.suppress(OSError), _locked(path.parent):
            _write_manifest(draft)
            if not _is_whole(path):
                if path.exists():  # damaged; a process that uses it keeps what it has loaded
                    path.rename(draft.with_name(f"{draft.name}-damaged"))
                draft.rename(path)
        if not _is_whole(path):
            return None
    finally:
        shutil.rmtree(draft, ignore_errors=True)
        shutil.rmtree(draft.with_name(f"{draft.name}-damaged"), ignore_errors=True)
    _clean_once(path.parent)
    return path


@lru_cache
def _clean_once(folder: Path) -> None:
    """Clean a folder once per process: it may hold thousands of files, which all would be looked at in every write."""
    clean(folder)


def clean(folder: Path, now: float | None = None) -> None:
    """Remove what was not used for MAX_AGE, and drafts of processes that died. now: the time [s]; default: the clock's.

    Where another process cleans, or files cannot be removed, they stay for the next time.
    """
    now = time.time() if now is None else now
    with contextlib.suppress(OSError), _locked(folder):
        for entry in folder.iterdir():
            age = TOUCH_AGE if entry.name.startswith(_DRAFT) else MAX_AGE
            if entry.name == _LOCK or now - entry.stat().st_mtime < age:
                continue
            if entry.is_dir():
                old = entry.with_name(f"{_DRAFT}old-{entry.name}")  # gone at once for others, then removed
                entry.rename(old)
                shutil.rmtree(old, ignore_errors=True)
            else:
                entry.unlink(missing_ok=True)


def _note_use(path: Path) -> None:
    with contextlib.suppress(OSError):
        if time.time() - path.stat().st_mtime > TOUCH_AGE:
            os.utime(path)


def _files(folder: Path) -> dict[str, list[int]]:
    """Return name -> [size in bytes, time of modification in ns] of all files but the manifest."""
    stamps = {}
    for path in folder.rglob("*"):
        if path.is_file() and path.name != _MANIFEST:
            status = path.stat()
            stamps[path.relative_to(folder).as_posix()] = [status.st_size, status.st_mtime_ns]
    return stamps


def _write_manifest(folder: Path) -> None:
    (folder / _MANIFEST).write_text(json.dumps(_files(folder)))


def _is_whole(folder: Path) -> bool:
    """Whether every file of an unpacked FMU is as it was written."""
    try:
        return bool(json.loads((folder / _MANIFEST).read_text()) == _files(folder))
    except (OSError, ValueError):
        return False


_LOCK = ".lock"


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, where the system has locks that end with their process."""
    try:
        import fcntl
    except ImportError:  # on Windows names of files in use cannot be taken away, which is as safe
        yield
        return
    with (folder / _LOCK).open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
