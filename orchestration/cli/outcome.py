"""The outcome of a run in a few lines: what the manipulator does, in mm, degrees and degC; then how it was coupled."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

import numpy as np

from ..results import ResultLike
from ..scene.manipulator import TEMPERATURE

__all__ = ["describe"]

ZERO_CELSIUS = 273.15  # [K]
MAX_OUTPUTS = 6  # of foreign FMUs that are shown
_TIP, _ANGLES, _HOTTEST = "tip.p", "tip.euler", "T_max"


def describe(result: ResultLike) -> list[str]:
    """Describe the end of a run, the hottest TCA and the coupling, one line for each.

    Where several FMUs have such lines, each begins with the name of its FMU.
    """
    members, lines = list(json.loads(result.attrs.get("members", "{}"))), []
    for part in (_tip, _heat):
        said = {member: list(part(result, member)) for member in members}
        several = sum(map(bool, said.values())) > 1
        lines += [f"{member}: {line}" if several else line for member, texts in said.items() for line in texts]
    return [*(lines or _outputs(result)), _coupling(result)]


def _end(result: ResultLike) -> str:
    return f"at {float(result['time'].to_numpy()[-1]):g} s"


def _tip(result: ResultLike, member: str) -> Iterator[str]:
    """Position and angles of the tip at the end."""
    if f"{member}.{_TIP}" not in result or result[f"{member}.{_TIP}"].shape[1:] != (3,):
        return
    position = 1e3 * result[f"{member}.{_TIP}"].to_numpy()[-1]
    yield f"tip {_end(result)}: " + ", ".join(
        f"{axis} {value:.2f} mm" for axis, value in zip("xyz", position, strict=True)
    )
    if f"{member}.{_ANGLES}" in result:
        angles = np.degrees(result[f"{member}.{_ANGLES}"].to_numpy()[-1])
        yield f"angles {_end(result)}: " + ", ".join(
            f"{name} {v:.2f} deg" for name, v in zip(("x", "y", "z"), angles, strict=True)
        )


def _heat(result: ResultLike, member: str) -> Iterator[str]:
    """The hottest TCA, with the highest temperature in it where it is known."""
    name, hottest = f"{member}.{TEMPERATURE}", f"{member}.{_HOTTEST}"
    if hottest not in result or name not in result:
        return
    means = result[name].to_numpy()
    row, tca = np.unravel_index(int(np.argmax(means)), means.shape)
    peak = float(result[hottest].to_numpy().max()) - ZERO_CELSIUS
    time = float(result["time"].to_numpy()[int(row)])
    yield f"hottest TCA: {tca + 1}, mean {means[row, tca] - ZERO_CELSIUS:.1f} degC at {time:g} s, peak {peak:.1f} degC"


def _outputs(result: ResultLike) -> Iterator[str]:
    """Last values of the scalar outputs of other FMUs."""
    shown = [
        f"{name} = {float(array.to_numpy()[-1]) + 0.0:.6g}"
        + (f" {unit}" if (unit := array.attrs.get("units", "1")) != "1" else "")
        for name, array in result.data_vars.items()
        if array.dims == ("time",) and array.attrs.get("causality") == "output" and array.dtype.kind in "fiub"
    ]
    if shown:
        more = f", and {len(shown) - MAX_OUTPUTS} more" if len(shown) > MAX_OUTPUTS else ""
        yield f"{_end(result)}: {', '.join(shown[:MAX_OUTPUTS])}{more}"


def _coupling(result: ResultLike) -> str:
    steps = result.sizes["time"] - 1
    if steps == 0:
        return "coupling: no macro step"
    sweeps, gain = float(result["coupling.sweeps"].to_numpy()[1:].mean()), float(result["coupling.gain"].to_numpy()[-1])
    loop = "" if math.isnan(gain) else f", loop gain {gain:.3g}"  # nan: nothing was iterated
    return f"coupling: {steps} macro steps, {sweeps:.2f} sweeps each{loop}"
