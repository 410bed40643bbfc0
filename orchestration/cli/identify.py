"""tca-cosim identify: parameters from measurements."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from ..errors import SceneError
from .console import out, reported, written
from .options import Folder, Overrides, SceneName
from .workers import Scheduler, Workers, worker

__all__ = ["command"]


def command(
    scene: SceneName,
    data: Annotated[Path, typer.Option(help="CSV: time [s], then outputs such as thermal.T[1] [degC]; empty: missing")],
    free: Annotated[
        list[str],
        typer.Option(help="Parameter to estimate, again for more: NAME, NAME=LOW:HIGH, NAME~MEAN:DEVIATION (prior)"),
    ],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    also: Annotated[list[str] | None, typer.Option(help="SCENE=FILE of a further experiment, again for more")] = None,
    noise: Annotated[
        list[str] | None, typer.Option(help="OUTPUT=DEVIATION of a sensor, such as thermal.T=0.3; default: estimated")
    ] = None,
    offset: Annotated[list[str] | None, typer.Option(help="Output whose sensor has an unknown offset")] = None,
    repeats: Annotated[
        int,
        typer.Option(
            "--bootstrap", min=0, help="Number of fits to resampled measurements, for intervals by percentiles; 0: none"
        ),
    ] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    folder: Folder = Path("results"),
) -> None:
    """Estimates parameters by least squares (requires tca-cosim[control]).

    Writes NAME.parameters.toml, a parameter set for other scenes, and NAME.estimate.json. Only --bootstrap uses
    --workers and --scheduler.
    """
    from ..api import read
    from ..files import atomic_write
    from ..identification import bootstrap, identify, read_free, read_measurements
    from ..identification.report import as_dict, parameter_set, table, warnings_of
    from ..scene.toml_writer import toml_text

    with reported():
        first = read(scene, override)
        experiments = [(first, read_measurements(first, data))]
        known = {(scene, data.resolve())}
        for text in also or []:
            name, equals, file = text.partition("=")
            if not equals:
                raise SceneError(f"--also {text}: not of the form SCENE=FILE, such as switch=switch.csv")
            if (name, Path(file).resolve()) in known:
                raise SceneError(f"--also {text}: these measurements are there already; give each once")
            known.add((name, Path(file).resolve()))
            described = read(name, override)
            experiments.append((described, read_measurements(described, Path(file))))
        names = [part for text in free for part in text.split()]
        sensors: dict[str, float] = {}
        for text in noise or []:
            name, deviation = _deviation(text)
            if name in sensors:
                raise SceneError(f"--noise {text}: given twice; keep one")
            sensors[name] = deviation
        estimate = identify(experiments, read_free(first, names), sensors, offset or ())
        resampled = None
        if repeats:
            resampled = bootstrap(experiments, estimate, repeats, worker=worker(scheduler, workers))
        out.print(table(estimate, resampled))
        for name, rms in estimate.residuals.items():
            out.print(f"residuals of {name}: {rms:.4g} rms", highlight=False)
        for text in warnings_of(estimate, resampled):
            out.print(f"warning: {text}", highlight=False, soft_wrap=True)
        files = [folder / f"{first.name}.parameters.toml", folder / f"{first.name}.estimate.json"]
        texts = [toml_text(parameter_set(first, estimate)), json.dumps(as_dict(estimate, resampled), indent=1)]
        for path, content in zip(files, texts, strict=True):
            with atomic_write(path) as draft:
                draft.write_text(content, encoding="utf-8")
        written(*files)


def _deviation(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError as error:
        raise SceneError(f"--noise {text}: not of the form OUTPUT=DEVIATION, such as thermal.T=0.3") from error
