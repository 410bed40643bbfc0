"""Animations of manipulators: bodies, TCAs coloured by temperature, voltages and temperatures beside them."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba_array
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from PIL import Image

from ..errors import CosimError
from ..files import atomic_write
from ..plotting import SERIES
from .assembly import FACES, Assembly, Block, assembly
from .charts import charts, charts_of
from .geometry import ball
from .manipulator import ZERO_CELSIUS, Manipulator, rod_members, select_rows
from .plots import draw_chart

__all__ = ["ENDINGS", "GIF_SIZE", "gif", "images", "save"]

ENDINGS = (".gif", ".mp4", ".webm")
GIF_SIZE = (800, 450)  # [pixel] a hundred frames of this size stay below 1 MB
_FILM_SIZE = (960, 540)  # [pixel]
_COLOUR_MAP = "plasma"
_BODY = np.array([0.62, 0.68, 0.76, 0.16])  # red, green, blue, opacity
_BLOCK = np.array([0.55, 0.5, 0.42, 0.45])
_TURNED = (55.0, 25.0)  # [deg] of the viewer from where the tip goes: it bends towards him; of several manipulators
_PAYLOAD = np.array([0.35, 0.37, 0.4, 0.9])
_DARKER = np.array([0.8, 0.8, 0.8, 1.7])  # every second segment: less light, more opacity
_LIGHT = np.array([0.4, -0.7, 0.6]) / np.linalg.norm([0.4, -0.7, 0.6])  # direction of the light on the body
_GIF_COLOURS = 96  # of a GIF: enough for the colour map and antialiased text; more make the file larger
_GIF_SCALE = 40  # height [pixel] of the colour map in the picture that the palette is made for: its weight there
_MILLI = 1e3


def images(result: xr.Dataset, frames: int = 100, size: tuple[int, int] = _FILM_SIZE) -> Iterator[np.ndarray]:
    """Draw the frames of an animation.

    Parameters
    ----------
    frames : int
        Largest number of frames, evenly spaced in time; at least 2.
    size : tuple of int
        Width and height [pixel].

    Yields
    ------
    ndarray
        Frame (height, width, 3) of bytes.

    Raises
    ------
    CosimError
        The result has no shape, or `frames` is below 2.
    """
    if frames < 2:
        raise CosimError(f"frames = {frames}: allowed: 2 or more")
    bodies = assembly(result, select_rows(result, frames))
    figure = Figure(figsize=(9.6, 5.4), dpi=size[0] / 9.6, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.suptitle(str(result.attrs.get("title", "")), fontsize=12)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.25, 1.0))[0]
    updates = [_draw_bodies(left, bodies), _draw_charts(right, result, bodies.times)]
    canvas.draw()  # the still parts are drawn once; the moving ones are drawn over them
    background = canvas.copy_from_bbox(figure.bbox)
    for row in range(bodies.times.size):
        canvas.restore_region(background)
        for update in updates:
            for artist in update(row):
                artist.draw(canvas.get_renderer())
        yield np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3])


def gif(frames: Iterable[np.ndarray], fps: float) -> bytes:
    """Encode frames as a GIF that repeats for ever.

    All frames share one palette, so that parts that do not move are stored once.
    """
    pictures = [Image.fromarray(frame) for frame in frames]
    palette = _common_palette(pictures)
    first, *rest = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
    file = io.BytesIO()
    first.save(file, "GIF", save_all=True, append_images=rest, duration=1e3 / fps, loop=0, optimize=True)
    return file.getvalue()


def save(
    result: xr.Dataset,
    path: Path,
    frames: int = 100,
    fps: float = 20.0,
    progress: Callable[[], object] = lambda: None,
) -> None:
    """Write an animation as .gif, or with ffmpeg (extra `report`) as .mp4 or .webm.

    The file appears whole or not at all.

    Parameters
    ----------
    frames : int
        Largest number of frames, evenly spaced in time; at least 2.
    fps : float
        Frames per second, above 0, up to 100.
    progress : callable
        Called after each frame.

    Raises
    ------
    CosimError
        Another ending, a number out of range, no rod in the result, or no ffmpeg.
    """
    if path.suffix not in ENDINGS:
        raise CosimError(f"{path}: unknown ending {path.suffix!r}; allowed: {', '.join(ENDINGS)}")
    if not 0.0 < fps <= 100.0:
        raise CosimError(f"fps = {fps:g}: allowed: above 0, up to 100 frames per second")

    def counted() -> Iterator[np.ndarray]:
        for frame in images(result, frames, GIF_SIZE if path.suffix == ".gif" else _FILM_SIZE):
            yield frame
            progress()

    with atomic_write(path) as draft:
        if path.suffix == ".gif":
            draft.write_bytes(gif(counted(), fps))
        else:
            _write_film(counted(), draft, fps)


def _common_palette(pictures: list[Image.Image]) -> Image.Image:
    """Palette of the first, middle and last picture, the colour map and the colours of the lines together."""
    width = pictures[0].width
    scale = np.tile(colormaps[_COLOUR_MAP](np.linspace(0.0, 1.0, width)), (_GIF_SCALE, 1, 1))
    lines = np.tile(to_rgba_array(SERIES)[:, None], (1, width, 1)).repeat(_GIF_SCALE // 5, axis=0)
    chosen = [pictures[k] for k in sorted({0, len(pictures) // 2, len(pictures) - 1})]
    chosen += [Image.fromarray(np.uint8(255 * colours[:, :, :3])) for colours in (scale, lines)]
    joined = Image.fromarray(np.concatenate([np.asarray(picture) for picture in chosen]))
    return joined.quantize(_GIF_COLOURS, method=Image.Quantize.MEDIANCUT, kmeans=1, dither=Image.Dither.NONE)


def _write_film(frames: Iterator[np.ndarray], path: Path, fps: float) -> None:
    try:
        import imageio_ffmpeg  # brings ffmpeg along, or uses that of the machine
    except ModuleNotFoundError as error:
        raise CosimError(
            f"{path.suffix} needs ffmpeg: {error}; run pip install 'tca-cosim[report]', or write a .gif"
        ) from error
    first = next(frames)  # an error of the drawing comes before ffmpeg starts
    height, width, _ = first.shape
    codec = "libvpx-vp9" if path.suffix == ".webm" else "libx264"
    writer = imageio_ffmpeg.write_frames(str(path), (width, height), fps=fps, codec=codec, macro_block_size=4)
    writer.send(None)
    try:
        writer.send(first)
        for frame in frames:
            writer.send(frame)
    finally:
        writer.close()


_Update = Callable[[int], Iterable[Artist]]  # moves its artists to a row and returns them


def _draw_bodies(figure: SubFigure, bodies: Assembly) -> _Update:
    """Draw manipulators and blocks in axes that contain the whole motion."""
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    celsius = bodies.temperatures - ZERO_CELSIUS
    scale = ScalarMappable(Normalize(celsius.min(), max(celsius.max(), celsius.min() + 1.0)), _COLOUR_MAP)
    parts = [_manipulator_faces(m, scale) for m in bodies.manipulators] + [_block_faces(b) for b in bodies.blocks]
    faces = Poly3DCollection([], linewidths=0.0, antialiased=True, animated=True)
    axes.add_collection3d(faces)
    low, high = (_MILLI * limit for limit in bodies.extent)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_box_aspect(high - low)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    axes.view_init(elev=18.0, azim=float(np.degrees(bodies.azimuth)) - _TURNED[len(bodies.manipulators) > 1])
    axes.tick_params(labelsize=8)
    _draw_gravity(axes, bodies.gravity, low, high)
    if len(bodies.manipulators) > 1:
        for m in bodies.manipulators:
            axes.text(*(_MILLI * m.frames.p[0, 0]), m.name, fontsize=9, ha="center", va="top")
    clock = axes.text2D(0.02, 0.96, "", transform=axes.transAxes, fontsize=12, family="monospace", animated=True)
    bar = figure.colorbar(scale, ax=axes, shrink=0.6, pad=0.1, location="left")
    bar.set_label("mean temperature of the TCAs [°C]", fontsize=9)

    def update(row: int) -> Iterable[Artist]:
        drawn = [part(row) for part in parts]
        faces.set_verts(np.concatenate([triangles for triangles, _ in drawn]))
        faces.set_facecolor(np.concatenate([colours for _, colours in drawn]))
        faces.do_3d_projection()
        clock.set_text(f"t = {bodies.times[row]:6.2f} s")
        return faces, clock

    return update


_Faces = Callable[[int], tuple[np.ndarray, np.ndarray]]  # triangles (n, 3, 3) [mm] and colours (n, 4) of a row


def _manipulator_faces(m: Manipulator, scale: ScalarMappable) -> _Faces:
    """Triangles and colours of body, TCAs and payload."""
    surfaces = [m.body, *m.tcas]
    corners = [_MILLI * m.frames.sweep(s.offsets, s.stations) for s in surfaces]
    celsius = m.temperature - ZERO_CELSIUS
    carried = _payload_triangles(m)
    darker = _of_even_segments(m)

    def faces(row: int) -> tuple[np.ndarray, np.ndarray]:
        triangles = [points[row][s.triangles] for points, s in zip(corners, surfaces, strict=True)]
        flesh = _shaded(_BODY, triangles[0])
        flesh[darker] *= _DARKER
        colours = [flesh]  # TCAs are not shaded: their colour means a temperature
        colours += [
            np.tile(np.array(scale.to_rgba(T)), (len(t), 1)) for T, t in zip(celsius[row], triangles[1:], strict=True)
        ]
        if carried is not None:
            triangles.append(carried[row])
            colours.append(_shaded(_PAYLOAD, carried[row]))
        return np.concatenate(triangles), np.concatenate(colours)

    return faces


def _block_faces(block: Block) -> _Faces:
    """Triangles and colours of a block."""
    corners = _MILLI * block.corners
    triangles = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])

    def faces(row: int) -> tuple[np.ndarray, np.ndarray]:
        drawn = corners[row][triangles]
        return drawn, _shaded(_BLOCK, drawn)

    return faces


def _payload_triangles(m: Manipulator) -> np.ndarray | None:
    """Triangles (time, n, 3, 3) [mm] of the ball that stands for the body at the tip."""
    if m.payload is None:
        return None
    points, triangles = ball(m.payload.radius, 16)
    return _MILLI * (m.payload.centre[:, None, None] + points[triangles])


def _of_even_segments(m: Manipulator) -> np.ndarray:
    """Which triangles of the body's surface belong to its second, fourth, sixth segment, (n,)."""
    intervals = np.zeros(m.stations.size - 1, dtype=bool)
    for j in range(2, len(m.body_parameters.segments) + 1, 2):
        first, behind = m.bounds(j, j)
        intervals[first : behind - 1] = True
    return np.repeat(intervals, len(m.body.triangles) // intervals.size)


def _draw_gravity(axes: Axes3D, gravity: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Draw an arrow in the direction of gravity (time, 3) [m/s2], where it is constant and not zero."""
    g = gravity[-1]
    size = float(np.linalg.norm(g))
    if size == 0.0 or np.ptp(gravity, axis=0).any():
        return
    start, arrow = np.array([low[0], high[1], high[2]]), 0.3 * float((high - low).max()) * g / size
    axes.quiver(*start, *arrow, color="black", linewidth=1.5, arrow_length_ratio=0.25)
    axes.text(*start, f"g = {size:.3g} m/s²", fontsize=9)


def _shaded(colour: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Colours (n, 4) of triangles (n, 3, 3) in the light of a distant lamp."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    brightness = 0.65 + 0.35 * np.abs(normal @ _LIGHT)
    return np.column_stack([brightness[:, None] * colour[:3], np.full(len(triangles), colour[3])])


def _draw_charts(figure: SubFigure, result: xr.Dataset, times: np.ndarray) -> _Update:
    """Draw voltages, where they change, and temperatures, with a line at the time that is shown."""
    shown = [c for c in charts(result) if c.title.partition(",")[0] in ("Voltages", "Temperatures") and c.lines]
    if not any(chart.title.startswith("Temperatures") for chart in shown):
        shown += charts_of(result, [f"{rod}.T" for rod in rod_members(result)])
    markers = []
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, chart in zip(panels, shown, strict=True):
        draw_chart(axes, chart, result["time"].to_numpy())
        axes.label_outer()
        markers.append(axes.axvline(times[0], color="black", linewidth=1.0, animated=True))

    def update(row: int) -> Iterable[Artist]:
        for marker in markers:
            marker.set_xdata([times[row]] * 2)
        return markers

    return update
