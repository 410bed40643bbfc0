"""Methods of a result in a notebook or script, as ``result.tca`` (an accessor of xarray).

result = tca.run("step")
result.tca.plot(["rod.tip.p"], "tip.png")    # a figure, also as a file
result.tca.show()                            # an interactive view of the body in a notebook
result.tca.animate("step.gif")               # a file; without a name a GIF that notebooks show
result.tca.report("step.html")               # an interactive page
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import CosimError

if TYPE_CHECKING:
    import xarray as xr

    from .plots import Sheet

__all__ = ["BodyView", "GifImage", "ResultAccessor"]

_VIEW_HEIGHT = 620  # [pixel] of the frame in a notebook


@dataclass(frozen=True, repr=False)
class GifImage:
    """GIF that notebooks show."""

    data: bytes

    def __repr__(self) -> str:
        return f"<GifImage: {len(self.data) / 1e6:.1f} MB>"

    def _repr_html_(self) -> str:
        text = base64.b64encode(self.data).decode()
        return f'<img alt="animation of the manipulator" src="data:image/gif;base64,{text}">'


@dataclass(frozen=True, repr=False)
class BodyView:
    """Interactive view of the body over time that notebooks show; `page` is a whole HTML document."""

    page: str

    def __repr__(self) -> str:
        return f"<BodyView: {len(self.page) / 1e6:.1f} MB>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe title="manipulator" srcdoc="{escape(self.page)}" width="100%" height="{_VIEW_HEIGHT}" '
            'style="border:0"></iframe>'
        )


class ResultAccessor:
    """Figures, animations and reports of a result."""

    def __init__(self, result: xr.Dataset) -> None:
        self._result = result

    def plot(self, quantities: Sequence[str] | None = None, path: str | Path | None = None) -> Sheet:
        """Draw time courses as a matplotlib figure, a panel for each group of quantities.

        Parameters
        ----------
        quantities : sequence of str, optional
            Names of variables, such as ``rod.tip.p``, or of their elements, such as ``thermal.T[3]``, a panel each; by
            default everything that changes.
        path : path, optional
            File to write the figure to: .png, .svg or .pdf.

        Returns
        -------
        Sheet
            Figure that notebooks show.

        Raises
        ------
        CosimError
            The result has no quantity of that name, or the ending is another one.
        """
        from . import plots

        figure = plots.plot(self._result, quantities)
        if path is not None:
            plots.save(figure, Path(path))
        return figure

    def show(self) -> BodyView:
        """Show the body over time in a notebook: drag it to turn, move the slider.

        Raises
        ------
        CosimError
            The result has no rod.
        """
        from .report import view

        return BodyView(view.html(self._result))

    def animate(self, path: str | Path | None = None, frames: int = 100, fps: float = 20.0) -> GifImage | Path:
        """Draw the manipulator in motion, coloured by temperature.

        Parameters
        ----------
        path : path, optional
            File to write: .gif, or .mp4 or .webm (extra `report`).
        frames : int
            Largest number of frames, evenly spaced in time.
        fps : float
            Frames per second.

        Returns
        -------
        GifImage or Path
            GIF for a notebook, or the path.

        Raises
        ------
        CosimError
            Another ending, a number out of range, no rod in the result, or no ffmpeg.
        """
        from . import animation

        if path is None:
            return GifImage(animation.gif(animation.images(self._result, frames, animation.GIF_SIZE), fps))
        animation.save(self._result, Path(path), frames, fps)
        return Path(path)

    def report(self, path: str | Path, other: xr.Dataset | None = None, measured: str | Path | None = None) -> Path:
        """Write one self-contained HTML page with body, cross-section, charts and settings (extra `report`).

        Parameters
        ----------
        other : Dataset, optional
            Result to compare with: its curves are dotted, its body is an outline, and a table lists the differences.
        measured : path, optional
            CSV file of measured samples to show beside the curves: the time in the first column, others named as in
            the result, with units: rod.tip.p[1] [mm].

        Raises
        ------
        CosimError
            The extra `report` is not installed, the two results have nothing in common, or the file does not fit.
        """
        try:
            from .measured import read_measured
            from .report import page
        except ModuleNotFoundError as error:
            raise CosimError(f"{error}; run pip install 'tca-cosim[report]'") from error
        samples = read_measured(Path(measured), self._result) if measured else None
        page.write(self._result, Path(path), other, samples)
        return Path(path)
