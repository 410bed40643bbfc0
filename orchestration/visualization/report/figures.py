"""The pictures of a report as plotly figures: charts over time, the body in space, its cross-section. They start at the
first moment; page.js moves them."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ..charts import Chart
from ..geometry import Surface, disc
from ..manipulator import ZERO_CELSIUS, Manipulator
from .field import Field

__all__ = ["body", "chart", "section"]

_SCALE = "Plasma"
_MILLI = 1e3
_GRID, _INK = "#e4e8ee", "#2b3440"
_FONT = {"family": "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 12, "color": _INK}
_FLESH = "#9fb2c8"
_LIGHT = {"ambient": 0.7, "diffuse": 0.6, "specular": 0.15, "roughness": 0.7}
_FLAT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0}


def chart(shown: Chart, times: np.ndarray) -> go.Figure:
    """With a vertical line, the first shape, at the moment that is shown."""
    figure = go.Figure()
    for line in shown.lines:
        style = {"color": line.colour, "width": 1.8, "dash": "dash" if line.dashed else "solid"}
        figure.add_scatter(
            x=times, y=line.values, name=line.label, line=style | {"shape": "vh" if shown.stepped else "linear"}
        )
    axis = {"gridcolor": _GRID, "zerolinecolor": _GRID, "linecolor": "#c3cad4", "ticks": "outside", "ticklen": 4}
    unit = "" if shown.unit == "1" else f" [{shown.unit}]"
    figure.update_layout(
        template="none",
        title={"text": f"{shown.title}{unit}", "x": 0.0, "xref": "container", "pad": {"l": 14}, "font": {"size": 14}},
        font=_FONT,
        margin={"l": 58, "r": 14, "t": 40, "b": 70},
        xaxis=axis | {"title": {"text": "t [s]", "standoff": 4}, "range": [times[0], times[-1]]},
        yaxis=axis
        | {"type": "log" if shown.log else "linear", "rangemode": "tozero" if shown.from_zero else "normal"}
        | ({"exponentformat": "e", "nticks": 6} if shown.log else {"tickformat": "~g"}),
        legend={"orientation": "h", "y": -0.24, "x": 0.0, "font": {"size": 11}},
        showlegend=len(shown.lines) > 1,
        hovermode="x unified",
        shapes=[
            {"type": "line", "x0": times[0], "x1": times[0], "yref": "paper", "y0": 0, "y1": 1}
            | {"line": {"color": _INK, "width": 1.2}}
        ],
    )
    return figure


def body(m: Manipulator, field: Field | None) -> tuple[go.Figure, list[Surface]]:
    """Traces: a surface for each of the surfaces returned (cap, TCAs, body), then the tip's way."""
    cap = field.cap if field else disc(m.radius, m.frames.p.shape[1] - 1, 32)
    surfaces = [cap, *m.tcas, m.body]
    celsius = m.temperature - ZERO_CELSIUS
    names = ["cross-section at the tip", *(f"TCA {i + 1}" for i in range(len(m.tcas))), "body"]
    figure = go.Figure()
    for k, (name, surface) in enumerate(zip(names, surfaces, strict=True)):
        x, y, z = _MILLI * m.frames.sweep(surface.offsets, surface.stations)[0].T
        i, j, n = surface.triangles.T
        look: dict = {"color": _FLESH, "opacity": 1.0 if k == 0 else 0.16, "hoverinfo": "skip"}
        if 0 < k <= len(m.tcas):
            look = {"intensity": np.full(x.size, celsius[0, k - 1])}
        elif k == 0 and field:
            look = {"intensity": field.T_0 - ZERO_CELSIUS + field.cap_modes @ field.courses[0]}
        if "intensity" in look:
            look |= {"coloraxis": "coloraxis", "hovertemplate": f"{name}<br>%{{intensity:.1f}} °C<extra></extra>"}
        figure.add_mesh3d(x=x, y=y, z=z, i=i, j=j, k=n, name=name, lighting=_FLAT if k == 0 else _LIGHT, **look)
    way = _MILLI * m.frames.p[:, -1]
    figure.add_scatter3d(
        x=way[:, 0],
        y=way[:, 1],
        z=way[:, 2],
        mode="lines",
        line={"color": "#7a8594", "width": 3},
        name="way of the tip",
        hovertemplate="tip<br>%{x:.2f}, %{y:.2f}, %{z:.2f} mm<extra></extra>",
    )
    reach = _MILLI * m.frames.sweep(m.body.offsets, m.body.stations)
    low, high = reach.min(axis=(0, 1)), reach.max(axis=(0, 1))
    aspect = dict(zip("xyz", 1.85 * (high - low) / np.linalg.norm(high - low), strict=True))
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} [mm]"}, "range": [low[c], high[c]], "gridcolor": _GRID}
        | {"backgroundcolor": "#f7f9fb", "showbackground": True, "zerolinecolor": _GRID}
        for c, axis in enumerate("xyz")
    }
    side = np.arctan2(way[-1, 1], way[-1, 0]) - 0.95  # so that the tip turns towards the eye in the end
    eye = {"x": 2.05 * np.cos(side), "y": 2.05 * np.sin(side), "z": 0.75}
    figure.update_layout(
        template="none",
        font=_FONT,
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        scene=axes
        | {
            "aspectmode": "manual",
            "aspectratio": aspect,
            "camera": {"eye": eye, "projection": {"type": "orthographic"}},
        },
        coloraxis=_coloraxis(m, field),
        uirevision="kept",
        showlegend=False,
    )
    return figure, surfaces


def section(field: Field, m: Manipulator | None) -> go.Figure:
    """The field as seen from the tip; what is no material is covered."""
    axis, radius = _MILLI * field.axis, _MILLI * field.section.radius
    figure = go.Figure(
        go.Heatmap(
            x=axis,
            y=axis,
            z=field.at(0) - ZERO_CELSIUS,
            coloraxis="coloraxis",
            zsmooth="best",
            hovertemplate="(%{x:.2f}, %{y:.2f}) mm<br>%{z:.1f} °C<extra></extra>",
        )
    )
    edge = 1.04 * radius
    frame = f"M{-edge},{-edge} H{edge} V{edge} H{-edge} Z " + _path(0.0, 0.0, radius)
    thin = {"color": _INK, "width": 1}
    shapes: list[dict] = [
        {"type": "path", "path": frame, "fillcolor": "white", "fillrule": "evenodd", "line": {"width": 0}},
        {"type": "path", "path": _path(0.0, 0.0, radius), "line": thin},
    ]
    labels = []
    for i, (x, y) in enumerate(_MILLI * field.section.centres):
        shapes.append({"type": "path", "path": _path(x, y, _MILLI * field.section.outer_radius), "line": thin})
        bore = _path(x, y, _MILLI * field.section.inner_radius)
        shapes.append({"type": "path", "path": bore, "fillcolor": "white", "line": thin})
        out = 1.0 + 1.7 * field.section.outer_radius / field.section.offset if field.section.offset else 1.0
        labels.append({"x": out * x, "y": out * y, "text": f"TCA {i + 1}", "showarrow": False})
    tick = {"ticks": "outside", "ticklen": 4, "range": [-edge, edge], "showgrid": False, "zeroline": False}
    figure.update_layout(
        template="none",
        font=_FONT,
        margin={"l": 50, "r": 10, "t": 8, "b": 44},
        xaxis=tick | {"title": {"text": "x [mm]", "standoff": 4}, "constrain": "domain"},
        yaxis=tick | {"title": {"text": "y [mm]", "standoff": 4}, "scaleanchor": "x", "constrain": "domain"},
        coloraxis=_coloraxis(m, field),
        shapes=shapes,
        annotations=[label | {"font": {"color": "white", "size": 11}} for label in labels],
    )
    return figure


def _path(x: float, y: float, radius: float) -> str:
    angle = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    points = np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])
    return "M" + " L".join(f"{a:.4f},{b:.4f}" for a, b in points) + " Z"


def _coloraxis(m: Manipulator | None, field: Field | None) -> dict:
    """One scale for all that is coloured by temperature, over the whole run."""
    seen = ([m.temperature] if m else []) + ([field.T_0 + field.cap_modes @ field.courses.T] if field else [])
    low = min(float(s.min()) for s in seen) - ZERO_CELSIUS
    high = max(max(float(s.max()) for s in seen) - ZERO_CELSIUS, low + 1.0)
    bar = {"title": {"text": "T [°C]"}, "thickness": 12, "len": 0.8, "outlinewidth": 0}
    return {"colorscale": _SCALE, "cmin": low, "cmax": high, "colorbar": bar}
