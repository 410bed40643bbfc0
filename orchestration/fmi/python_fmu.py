"""FMUs written in Python: a file with a class of PythonFMU becomes an FMU when a scene names it, without a compiler."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path

from ..errors import SceneError
from ..packages import version
from . import cache

__all__ = ["SUFFIX", "built_fmu"]

SUFFIX = ".py"


def built_fmu(source: Path) -> Path:
    """Return the FMU of a Python file, made where it is not among the user's caches.

    Raises
    ------
    SceneError
        PythonFMU is not installed, or does not make an FMU of the file.
    """
    try:
        import pythonfmu  # noqa: F401  an extra
    except ModuleNotFoundError as error:
        raise SceneError(
            f"{source.name} is an FMU written in Python: {error}; run pip install 'tca-cosim[python]'"
        ) from error
    key = hashlib.sha256(source.read_bytes() + version("pythonfmu").encode()).hexdigest()[:16]

    def fill(folder: Path) -> None:
        _build(source, folder)

    kept = cache.kept_folder(f"python/{source.stem}-{key}", fill)
    if kept is None:
        folder = tempfile.TemporaryDirectory(prefix=f"{source.stem}-", ignore_cleanup_errors=True)
        _temporary_folders.append(folder)
        kept = Path(folder.name)
        fill(kept)
    return kept / f"{source.stem}.fmu"


_temporary_folders: list[tempfile.TemporaryDirectory[str]] = []  # removed when the process ends


def _build(source: Path, folder: Path) -> None:
    from pythonfmu import FmuBuilder

    try:
        made = FmuBuilder.build_FMU(source, dest=folder, canGetAndSetFMUstate=True)
    except (Exception, SystemExit) as error:  # whatever the code of the file raises
        raise SceneError(
            f"{source}: PythonFMU makes no FMU of it: {type(error).__name__}: {error}; give a class derived from "
            "pythonfmu.Fmi2Slave that registers its variables"
        ) from error
    Path(made).rename(folder / f"{source.stem}.fmu")
