"""FMU files: the variables that the XML declares, and the content, extracted into folders.

Descriptions are parsed once and kept by the hash of the file (cache.py). FMUs that tools of this package made are
extracted once as well; all others into folders of their own, which they may write to, and which are removed again.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import os
import tempfile
import zipfile
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import SceneError, similar
from . import cache, fmi2
from .description import Description, full_description, pack, read_description, unpack
from .unpacking import containing_file, extract, open_archive, read_member
from .variables import Value, Variable
from .vectors import Vector

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription

__all__ = ["Archive", "Value", "Variable", "cached_archive", "find_fmu", "library_path", "shipped_folders", "similar"]

MAX_PREFIX = 40  # characters of an FMU's name in that of its folder: file systems allow 255 bytes in all
# FMUs of these tools keep no state outside their instances, so that instances may share one loaded library.
REENTRANT_TOOLS = ("tca-cosim",)


_DESCRIPTIONS: dict[str, Description] = {}  # of this process, by the hash of the file's content


@lru_cache(maxsize=64)
def _digest(path: Path, identity: tuple[int, ...]) -> str:
    """Return the hash of an FMU's content; identity: what tells that the file is the same."""
    with open_archive(path) as file:
        return hashlib.sha256(file.read()).hexdigest()


class Archive:
    """An FMI 2.0 FMU; a context manager that removes what was extracted.

    Parameters
    ----------
    path
        The .fmu file, or that of one inside another archive: system.ssp/resources/rod.fmu.

    Raises
    ------
    SceneError
        The file cannot be read, is made for another version, or offers no interface.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            status = containing_file(path).stat()
            identity = (status.st_ino, status.st_mtime_ns, status.st_ctime_ns, status.st_size)
            self.digest = _digest(path, identity)  # of the file's content
        except Exception as error:  # archives fail in many ways
            raise SceneError(f"{path}: not a readable FMU ({_reason(error)})") from error
        known = _DESCRIPTIONS.get(self.digest)
        self.description: Description = known or self._kept_description() or self._read_description()
        _DESCRIPTIONS[self.digest] = self.description
        self.variables: Mapping[str, Variable] = self.description.variables
        self._folders: list[tempfile.TemporaryDirectory[str]] = []
        self._kept: Path | None = None

    def _kept_description(self) -> Description | None:
        content = cache.kept_bytes(self._cache_name)
        if content is None:
            return None
        try:
            return unpack(content)
        except (ValueError, TypeError, KeyError, IndexError):  # of another version
            return None

    def _read_description(self) -> Description:
        try:
            description = read_description(_content(self.path))
        except SceneError as error:
            raise SceneError(f"{self.path}: {error}") from error
        except Exception as error:  # archives and parsers fail in many ways
            raise SceneError(f"{self.path}: not a readable FMU ({_reason(error)})") from error
        cache.keep_bytes(self._cache_name, pack(description))
        return description

    @property
    def _cache_name(self) -> str:
        """Name of the kept description: a change of what reads it is another name."""
        return f"descriptions/{self.digest}-{_reader()}.json"

    @property
    def guid(self) -> str:
        """Identification of the XML, which the library must match."""
        return self.description.guid

    def model_description(self) -> ModelDescription:
        """Read the whole description by FMPy: model structure and what else runs do not need."""
        return full_description(_content(self.path))

    @property
    def arrays(self) -> dict[str, Vector]:
        """Base name -> vector or matrix of that name."""
        return self.description.arrays

    @property
    def vectors(self) -> dict[str, tuple[str, ...]]:
        """Base name -> names of the elements in the order of their indices."""
        return self.description.vectors

    @property
    def once_per_process(self) -> bool:
        """Whether a process may hold one instance only (canBeInstantiatedOnlyOncePerProcess)."""
        return self.description.interface.once_per_process

    @property
    def reentrant(self) -> bool:
        """Whether instances may share one loaded library."""
        return self.description.generation_tool.startswith(REENTRANT_TOOLS)

    def extract(self) -> Path:
        """Return a folder with the unpacked FMU, the same at each call."""
        if self.reentrant and self._kept is None and not self._folders:
            self._kept = cache.kept_folder(f"fmus/{self.digest}-{fmi2.PLATFORM}", self._extract_into)
        if self._kept is not None:
            return self._kept
        if not self._folders:
            self._add_folder()
        return Path(self._folders[0].name)

    def extract_for_instance(self, identifier: str) -> Path:
        """Return a folder with the unpacked FMU whose library `identifier` is not loaded in this process.

        Instances of one loaded library share its global variables; each instance of an FMU that is not known to be
        reentrant therefore loads a copy of its own.
        """
        if self.reentrant:
            return self.extract()
        for folder in self._folders:
            if not _loaded(library_path(Path(folder.name), identifier)):
                return Path(folder.name)
        return self._add_folder()

    def _add_folder(self) -> Path:
        prefix = self.path.stem.encode("ascii", "replace").decode().replace("?", "_")[:MAX_PREFIX]
        folder = tempfile.TemporaryDirectory(prefix=f"{prefix}-", ignore_cleanup_errors=True)
        try:
            self._extract_into(Path(folder.name))
        except SceneError:
            folder.cleanup()
            raise
        self._folders.append(folder)
        return Path(folder.name)

    def _extract_into(self, folder: Path) -> None:
        try:
            with open_archive(self.path) as file:
                extract(file, folder)
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise SceneError(f"{self.path}: cannot be extracted ({_reason(error)})") from error

    def close(self) -> None:
        """Remove what was extracted; what is kept for other processes stays."""
        while self._folders:
            self._folders.pop().cleanup()

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _CachedArchive(Archive):
    """An archive that stays extracted until the process ends."""

    def close(self) -> None:
        pass


def cached_archive(path: Path) -> Archive:
    """Return the archive of that file, read and extracted once per process and file content: for many runs."""
    status = containing_file(path).stat()
    return _cached_archive(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=16)
def _cached_archive(path: Path, modified: int, size: int) -> Archive:
    return _CachedArchive(path)


def library_path(folder: Path, identifier: str) -> Path:
    """Return the file of the shared library in an unpacked FMU."""
    return folder / "binaries" / fmi2.PLATFORM / f"{identifier}{fmi2.LIBRARY_ENDING}"


@lru_cache(maxsize=1)
def shipped_folders() -> tuple[Path, ...]:
    """Return the folders where FMUs and the engine of this package may lie: of a wheel, and of a source tree."""
    return (Path(str(resources.files(__package__.rpartition(".")[0]))) / "_fmus", Path(__file__).parents[2] / "fmus")


def find_fmu(name: str, near: Path | None = None) -> Path:
    """Return the file of an FMU.

    Parameters
    ----------
    name
        A path, also into an SSP archive, or the name of an FMU that comes with this package.
    near
        Folder from which relative paths start; default: the working folder.

    Raises
    ------
    SceneError
        There is none.
    """
    folders = [near or Path.cwd(), *shipped_folders()]
    for folder in folders:
        with contextlib.suppress(OSError):  # a name too long for the file system is no file
            if containing_file(folder / name).is_file():
                return (folder / name).resolve()
    known = [file.name for folder in folders if folder.is_dir() for file in folder.glob("*.fmu")]
    hint = similar(name, known) if known else "run `make fmus` to build thermal.fmu and rod.fmu"
    raise SceneError(f"no FMU {name!r} in {', '.join(str(folder) for folder in folders)}; {hint}")


def _content(path: Path) -> bytes:
    """Return the bytes of modelDescription.xml."""
    with open_archive(path) as file:
        try:
            return read_member(file, "modelDescription.xml")
        except KeyError as error:
            raise ValueError(f"no modelDescription.xml at its top; {_misplaced(path)}") from error


@lru_cache(maxsize=1)
def _reader() -> str:
    """Return a word for the code that reads descriptions: what it wrote before a change is not read again."""
    files = [Path(__file__).with_name(name) for name in ("description.py", "variables.py")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def _misplaced(path: Path) -> str:
    """Say where modelDescription.xml lies instead."""
    with open_archive(path) as file, zipfile.ZipFile(file) as archive:
        names = [name for name in archive.namelist() if name.replace("\\", "/").endswith("/modelDescription.xml")]
    return f"it lies at {names[0]}; zip the content of that folder" if names else "export the FMU again"


def _reason(error: Exception) -> str:
    """Return the text of an error without line breaks, with its kind where it has none."""
    return " ".join(str(error).split()) or type(error).__name__


def _loaded(library: Path) -> bool:
    """Whether a shared library is loaded in this process; True where the system does not tell."""
    flag = getattr(os, "RTLD_NOLOAD", None)
    if flag is None:
        return True
    try:
        asked = ctypes.CDLL(str(library), mode=flag)
    except OSError:
        return False
    fmi2.unload_library(asked)  # asking counts as a use
    return True
