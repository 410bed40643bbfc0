"""A source of raw values of a scene, with messages that name file, line, key and value."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from ..errors import SceneError

__all__ = ["Layer"]

MAX_SHOWN = 200  # characters of a value that a message repeats


@dataclass(frozen=True)
class Layer:
    """A source of raw values: a parameter set, a scene file, an SSP archive, overrides. Later layers win."""

    origin: str
    text: str
    raw: Mapping[str, Any]
    numbered: bool = True  # whether the text is TOML, whose lines messages name
    overrides: bool = False  # whether it only changes what another layer says
    folder: Path = Path()  # that its relative paths start from

    def refuse(self, key: str, value: Any, problem: str) -> NoReturn:
        """Raise SceneError with origin, line, key, value and problem."""
        text = repr(value)
        text = text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."
        shown = "" if value is None else f" = {text}"
        raise SceneError(f"{self.origin}{self._line(key)}: {key}{shown}: {problem}")

    def _line(self, key: str) -> str:
        """':n' where the key (table.name[i]) is written, as far as the lines tell without parsing them."""
        if not self.numbered:
            return ""
        table, _, name = key.partition(".")
        name = re.split(r"\[\d", name)[0] if name else table
        inside = not key.partition(".")[2]
        for n, line in enumerate(self.text.splitlines(), 1):
            if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line):
                inside = header[1].strip('"') == table
                if inside and not name:
                    return f":{n}"
            elif inside and re.match(rf'\s*"?{re.escape(name)}(\[\d+\])?"?\s*=', line):
                return f":{n}"
        return ""
