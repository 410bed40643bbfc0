"""The manipulator in motion, as a GIF or MP4: body, TCAs coloured by temperature, voltages and temperatures beside."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from PIL import Image

from ..errors import CosimError
from ..files import atomic_write
from .charts import COLOURS
from .manipulator import ZERO_CELSIUS, Manipulator, manipulator, moments, of_heat, of_rod

__all__ = ["ENDINGS", "gif", "images", "save"]

ENDINGS = (".gif", ".mp4")
_SCALE = "plasma"
_BODY = np.array([0.62, 0.68, 0.76, 0.16])
_LIGHT = np.array([0.4, -0.7, 0.6]) / np.linalg.norm([0.4, -0.7, 0.6])
_MILLI = 1e3


def images(result: xr.Dataset, frames: int = 100) -> Iterator[np.ndarray]:
    """Pictures (height, width, 3) of bytes, at most that many, evenly spread in time. CosimError where the result has
    no shape, or frames is below 2."""
    if frames < 2:
        raise CosimError(f"frames = {frames}: an animation has 2 or more")
    m = manipulator(result, moments(result, frames))
    figure = Figure(figsize=(9.6, 5.4), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.suptitle(str(result.attrs.get("title", "")), fontsize=11)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.25, 1.0))[0]
    movers = [_body(left, m), _courses(right, result, m)]
    canvas.draw()  # what stays; what moves is drawn over it
    background = canvas.copy_from_bbox(figure.bbox)
    for row in range(m.times.size):
        canvas.restore_region(background)
        for move in movers:
            for artist in move(row):
                artist.draw(canvas.get_renderer())
        yield np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3])


def gif(pictures: Iterable[np.ndarray], fps: float) -> bytes:
    """As a file of that kind that repeats for ever."""
    first, *rest = (
        Image.fromarray(p).quantize(method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE) for p in pictures
    )
    file = io.BytesIO()
    first.save(file, "GIF", save_all=True, append_images=rest, duration=1e3 / fps, loop=0)
    return file.getvalue()


def save(
    result: xr.Dataset,
    path: Path,
    frames: int = 100,
    fps: float = 20.0,
    progress: Callable[[], object] = lambda: None,
) -> None:
    """Writes a .gif or, with the extra `report`, an .mp4. The file appears whole or not at all. progress: called after
    each frame. CosimError names what is wrong with ending, frames or fps, or that ffmpeg is missing."""
    if path.suffix not in ENDINGS:
        raise CosimError(f"{path}: unknown ending {path.suffix!r}; allowed: {', '.join(ENDINGS)}")
    if not 0.0 < fps <= 100.0:
        raise CosimError(f"fps = {fps:g}: allowed: above 0, up to 100 frames a second")

    def watched() -> Iterator[np.ndarray]:
        for picture in images(result, frames):
            yield picture
            progress()

    with atomic_write(path) as draft:
        if path.suffix == ".gif":
            draft.write_bytes(gif(watched(), fps))
        else:
            _write_mp4(watched(), draft, fps)


def _write_mp4(pictures: Iterator[np.ndarray], path: Path, fps: float) -> None:
    try:
        import imageio_ffmpeg  # finds ffmpeg, or brings it along
    except ModuleNotFoundError as error:
        raise CosimError(
            f"an MP4 needs ffmpeg: {error}; run pip install 'tca-cosim[report]', or write a .gif"
        ) from error
    first = next(pictures)  # an error of theirs comes before ffmpeg starts
    height, width, _ = first.shape
    writer = imageio_ffmpeg.write_frames(str(path), (width, height), fps=fps, macro_block_size=4)
    writer.send(None)
    try:
        writer.send(first)
        for picture in pictures:
            writer.send(picture)
    finally:
        writer.close()


_Mover = Callable[[int], Iterable[Artist]]  # puts its artists where they are at that row, and names them


def _body(figure: SubFigure, m: Manipulator) -> _Mover:
    """Body and TCAs, in axes that hold all of the motion."""
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    surfaces = [m.body, *m.tcas]
    places = [_MILLI * m.frames.sweep(s.offsets, s.stations) for s in surfaces]
    celsius = m.temperature - ZERO_CELSIUS
    scale = ScalarMappable(Normalize(celsius.min(), max(celsius.max(), celsius.min() + 1.0)), _SCALE)
    faces = Poly3DCollection([], linewidths=0.0, antialiased=True, animated=True)
    axes.add_collection3d(faces)
    low, high = places[0].min(axis=(0, 1)), places[0].max(axis=(0, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_box_aspect(high - low)
    x, y, _ = m.frames.p[-1, -1]
    axes.view_init(elev=18.0, azim=float(np.degrees(np.arctan2(y, x))) - 55.0)  # the tip turns towards the eye
    axes.tick_params(labelsize=7)
    clock = axes.text2D(0.02, 0.96, "", transform=axes.transAxes, fontsize=11, family="monospace", animated=True)
    bar = figure.colorbar(scale, ax=axes, shrink=0.6, pad=0.1, location="left")
    bar.set_label("mean temperature of the TCAs [°C]", fontsize=8)

    def move(row: int) -> Iterable[Artist]:
        triangles = [place[row][s.triangles] for place, s in zip(places, surfaces, strict=True)]
        colours = [_shaded(np.array(_BODY), triangles[0])]
        colours += [_shaded(np.array(scale.to_rgba(T)), t) for T, t in zip(celsius[row], triangles[1:], strict=True)]
        faces.set_verts(np.concatenate(triangles))
        faces.set_facecolor(np.concatenate(colours))
        faces.do_3d_projection()
        clock.set_text(f"t = {m.times[row]:6.2f} s")
        return faces, clock

    return move


def _shaded(colour: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n, 4): one colour in the light of a lamp, for triangles (n, 3, 3)."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = 0.65 + 0.35 * np.abs(normal @ _LIGHT)
    return np.column_stack([light[:, None] * colour[:3], np.full(len(triangles), colour[3])])


def _courses(figure: SubFigure, result: xr.Dataset, m: Manipulator) -> _Mover:
    """Charts of voltages, where a heat model has them, and temperatures, with a line at the time that is shown."""
    heat, rod = of_heat(result), of_rod(result)
    shown = [(f"{heat}.V", "voltage [V]", 0.0)] if heat else []
    shown.append((f"{rod}.T", "temperature [°C]", ZERO_CELSIUS))
    lines = []
    places = figure.subplots(len(shown), 1, sharex=True, squeeze=False).flat
    for axes, (name, label, zero) in zip(places, shown, strict=True):
        for k, course in enumerate(result[name].to_numpy().T):
            axes.plot(result["time"], course - zero, color=COLOURS[k % len(COLOURS)], label=f"TCA {k + 1}")
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
        lines.append(axes.axvline(0.0, color="black", linewidth=1.0, animated=True))
    axes.set_xlabel("t [s]")
    axes.legend(fontsize=8, loc="upper left")

    def move(row: int) -> Iterable[Artist]:
        for line in lines:
            line.set_xdata([m.times[row]] * 2)
        return lines

    return move
