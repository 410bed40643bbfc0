"""UTF-8 mode of Python for locales whose encoding cannot name every file."""

from __future__ import annotations

import os
import sys

__all__ = ["require_utf8"]


def require_utf8() -> None:
    """Start this process again in UTF-8 mode where names of files are not in UTF-8, as in the locale C.

    Scenes are UTF-8, so the files that they name could not be found otherwise. Nothing happens where it was tried.
    """
    encoding = sys.getfilesystemencoding().lower().replace("-", "")
    if os.name != "posix" or encoding == "utf8" or os.environ.get("PYTHONUTF8") == "1":
        return
    os.environ["PYTHONUTF8"] = "1"
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
