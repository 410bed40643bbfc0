"""What a result offers in a notebook or script, as `result.tca` (an accessor of xarray).

result = tca.run("step")
result.tca.plot()                     # a figure
result.tca.animate("step.gif")        # a file; without a name a film that notebooks show
result.tca.report("step.html")        # an interactive page
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from ..errors import CosimError

if TYPE_CHECKING:
    from .plots import Sheet

__all__ = ["GifImage", "ResultAccessor"]


@dataclass(frozen=True, repr=False)
class GifImage:
    """A GIF: data, its bytes. Notebooks show it."""

    data: bytes

    def __repr__(self) -> str:
        return f"<GifImage: GIF of {len(self.data) / 1e6:.1f} MB>"

    def _repr_html_(self) -> str:
        return f'<img src="data:image/gif;base64,{base64.b64encode(self.data).decode()}">'


@xr.register_dataset_accessor("tca")
class ResultAccessor:
    """Of a result of run()."""

    def __init__(self, result: xr.Dataset) -> None:
        self._result = result

    def plot(self) -> Sheet:
        """A matplotlib figure with a panel for each group of quantities, labelled with units; notebooks show it,
        savefig() writes it."""
        from .plots import plot

        return plot(self._result)

    def animate(self, path: str | Path | None = None, frames: int = 100, fps: float = 20.0) -> GifImage | Path:
        """The manipulator in motion, coloured by temperature: at most `frames` pictures, evenly spread in time, shown
        at `fps` [1/s]. With a path writes .gif or .mp4 (extra `report`) and returns the path; without one returns a
        film for a notebook. Raises CosimError for another ending, for numbers out of range, and where the result has no
        rod."""
        from . import animation

        if path is None:
            return GifImage(animation.gif(animation.images(self._result, frames), fps))
        animation.save(self._result, Path(path), frames, fps)
        return Path(path)

    def report(self, path: str | Path) -> Path:
        """Writes one self-contained HTML page (extra `report`) and returns its path: charts, the body in space, the
        temperature field of its cross-section, settings and versions. Raises CosimError where the extra is missing."""
        try:
            from .report import page
        except ModuleNotFoundError as error:
            raise CosimError(f"{error}; run pip install 'tca-cosim[report]'") from error
        page.write(self._result, Path(path))
        return Path(path)
