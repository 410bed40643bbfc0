"""FMUs of this package at another size: their binaries describe themselves for a configuration, without a compiler.

The binary exports tcaExport (fmus/runtime/export.cpp), which writes modelDescription.xml, the documentation and the
file resources/configuration.txt, from which the binary takes its size again when it is instantiated.
"""

from __future__ import annotations

import ctypes
import hashlib
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from ..errors import SceneError
from ..files import atomic_write
from . import cache, fmi2
from .archive import Archive, library_path
from .unpacking import open_archive, read_member
from .variables import Value

__all__ = ["Configuration", "can_configure", "configured_fmu", "write_configured"]

_FUNCTION = "tcaExport"
_RECEIVER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_char_p)
_DATE = (1980, 1, 1, 0, 0, 0)  # of files in the archive: the same configuration gives the same bytes
_NOTES = "documentation/notes.md"
_CONFIGURATION = "resources/configuration.txt"


@dataclass(frozen=True)
class Configuration:
    """What an FMU is written with; None: as the FMU is without a configuration."""

    tcas: int | None = None  # 1 to 12
    segments: int | None = None  # 1 to 6; FMUs of one cross-section ignore it
    ports: bool | None = None  # of the rod: forces along the body, velocities there, reaction of the clamp
    creep: bool | None = None  # of the rod: parameters and outputs of creeping TCAs
    only_moving_states: bool = False  # declares only states that the start values let move
    starts: Mapping[str, Value] = field(default_factory=dict)  # start values of parameters and inputs

    def text(self) -> str:
        """Write the configuration as the binary reads it."""
        lines = [f"{name} {size}" for name, size in (("tcas", self.tcas), ("segments", self.segments)) if size]
        for name, chosen in (("ports", self.ports), ("creep", self.creep)):
            lines += [] if chosen is None else [f"{name} {_text(chosen)}"]
        lines += ["states moving"] * self.only_moving_states
        lines += [f"start {name} {_text(value)}" for name, value in self.starts.items()]
        return "".join(f"{line}\n" for line in lines)


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else repr(value)


def can_configure(archive: Archive) -> bool:
    """Whether an FMU was made by this package, so that its binary describes other sizes."""
    return archive.reentrant


def configured_fmu(source: Archive, configuration: Configuration) -> Path:
    """Return the file of an FMU at a configuration, made where it is not among the user's caches.

    Raises
    ------
    SceneError
        The FMU has no such configuration: the message says what is allowed.
    """
    text = configuration.text()
    key = hashlib.sha256(text.encode()).hexdigest()[:16]
    name = source.path.name

    def fill(folder: Path) -> None:
        _pack(source, text, folder / name, zipfile.ZIP_STORED)

    kept = cache.kept_folder(f"configured/{source.digest}-{key}", fill)
    return kept / name if kept else _temporary(source.path, source.digest, text)


def write_configured(source: Archive, configuration: Configuration, path: Path) -> None:
    """Write an FMU at a configuration to a file. Raises SceneError as configured_fmu()."""
    with atomic_write(path) as draft:
        _pack(source, configuration.text(), draft, zipfile.ZIP_DEFLATED)


@lru_cache
def _temporary(path: Path, digest: str, text: str) -> Path:
    """Write the FMU to a folder that lives as long as the process, where no caches can be kept."""
    folder = tempfile.TemporaryDirectory(prefix=f"{path.stem}-", ignore_cleanup_errors=True)
    _temporary_folders.append(folder)
    with Archive(path) as source:
        _pack(source, text, Path(folder.name) / path.name, zipfile.ZIP_STORED)
    return Path(folder.name) / path.name


_temporary_folders: list[tempfile.TemporaryDirectory[str]] = []  # removed when the process ends


def _pack(source: Archive, text: str, path: Path, compression: int) -> None:
    """Write the FMU: the source's files, but those that the configuration changes."""
    changed = _described(source, text)
    with open_archive(source.path) as file, zipfile.ZipFile(path, "w", compression) as target:
        kept = {name: content for name, content in _files(zipfile.ZipFile(file)) if name not in changed}
        for name, content in {**changed, **kept}.items():  # the description first, as readers of streams like it
            target.writestr(zipfile.ZipInfo(name, _DATE), content, compression)


def _member(source: Archive, name: str) -> bytes:
    """Return the content of a file of the FMU, nothing where it has none of that name."""
    with open_archive(source.path) as file:
        try:
            return read_member(file, name)
        except KeyError:
            return b""


def _files(archive: zipfile.ZipFile) -> Iterator[tuple[str, bytes]]:
    for entry in archive.infolist():
        if not entry.is_dir():
            yield entry.filename.replace("\\", "/"), archive.read(entry)


def _described(source: Archive, text: str) -> dict[str, bytes]:
    """Let the binary write what a configuration changes: path inside the FMU -> content."""
    identifier = source.description.interface.model_identifier
    library = fmi2.load_library(library_path(source.extract(), identifier), fmi2.CO_SIMULATION)
    function = getattr(library, _FUNCTION, None)
    if function is None:
        raise SceneError(f"{source.path}: its binary is older than this package; run `make fmus` to build it again")
    function.argtypes = [ctypes.c_char_p, ctypes.c_char_p, _RECEIVER, ctypes.c_void_p]
    own = _member(source, _CONFIGURATION).decode()  # of a source that was written at another size; later lines win
    files: dict[str, bytes] = {}

    def receive(_: object, path: bytes, content: bytes) -> None:
        files[path.decode()] = content

    failed = function((own + text).encode(), _member(source, _NOTES), _RECEIVER(receive), None)
    if failed:
        raise SceneError(f"{source.path.name}: {files['error'].decode()}")
    return files
