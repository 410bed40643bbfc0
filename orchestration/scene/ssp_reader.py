"""An SSP archive (System Structure and Parameterization) as a layer of a scene.

It gives FMUs, connections, values, times, and the macro step where OMSimulator's annotation has one.

Systems of co-simulation FMUs of SSP 1.0, and of 2.0 as far as it says what 1.0 can say: nested systems, signal
dictionaries, parameter mappings, units of connectors and parameter files, linear transformations; sum.fmu of this
package becomes a weighted sum again. Members of the scene
have the names of the components, with the systems that contain them: motor, axle.motor. What else the standard has is
refused by the name of its element.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lxml import etree

from ..fmi.archive import Archive
from .ssp_archive import SPACES, SSPArchive
from .ssp_structure import Component, Connector, Structure, attribute_number
from .ssp_sums import is_sum, summed_sources
from .ssp_values import values
from .validation import Layer

__all__ = ["read"]

_SSD = "SystemStructure.ssd"
# OMSimulator's step: of the current release, and of older ones.
_STEPS = (
    (".//{*}SimulationInformation[@fixedStepSize]", "fixedStepSize"),
    (".//{*}FixedStepMaster[@stepSize]", "stepSize"),
)


def read(
    path: Path,
    chosen: str | None = None,
    archive: Callable[[Path], Archive] = Archive,
    reserved: frozenset[str] = frozenset(),
) -> Layer:
    """Read an SSP archive.

    Parameters
    ----------
    path
        The archive.
    chosen
        A parameter set of the archive, by the name of its file up to the first dot, in place of those bound.
    archive
        Opens an FMU.
    reserved
        Names that components must not have, since scenes give them another meaning.

    Raises
    ------
    SceneError
        Something is wrong or not supported; the message names file and element.
    """
    with SSPArchive(path) as opened:
        root = opened.document(_SSD, "SystemStructureDescription")
        system = root.find("ssd:System", SPACES)
        if system is None:
            opened.refuse(_SSD, "has no System; add one")
        structure = Structure(opened, archive)
        structure.add_system(system, root)
        components = {component.name: component for component in structure.components.values()}
        if not components:
            opened.refuse(_SSD, "has no Component; add an FMU")
        for name in components:
            if name in reserved:
                opened.refuse(f"Component {name}", f"the name {name!r} is taken by a key of scenes; rename it")
        given = values(structure, chosen)
        sums = [name for name, component in components.items() if is_sum(component.archive)]
        connections, gone = summed_sources(_connections(structure), given, sums)
        wired = {entry["to"] for entry in connections}
        raw: dict[str, Any] = {
            "title": system.get("description") or root.get("name") or path.stem,
            "fmus": {name: str(component.archive.path) for name, component in components.items() if name not in gone},
            "connections": connections,
            **_experiment(opened, root),
            # A connection replaces the start value of the input that it feeds.
            **{
                name: {v: x for v, x in table.items() if (name, v) not in wired}
                for name, table in given.items()
                if name not in gone
            },
        }
        return Layer(str(path), "\n".join(opened.texts), raw, numbered=False)


def _connections(structure: Structure) -> list[dict[str, Any]]:
    """Connections between FMUs as a scene has them; units are converted already."""
    connections = []
    for component in structure.components.values():
        for connector in _sources(structure, component):
            variable = component.archive.variables[connector.name]
            for reached in structure.reached(connector, None):
                if variable.causality != "output" or reached.variable.causality != "input":
                    structure.archive.refuse(
                        f"Connection {connector} to {reached.component}.{reached.variable.name}",
                        f"from {variable.causality} to {reached.variable.causality} is not supported; connect outputs "
                        "to inputs, and give parameters in a parameter set",
                    )
                connections.append(
                    {
                        "from": (component.name, connector.name),
                        "to": (reached.component, reached.variable.name),
                        "factor": reached.factor,
                        "offset": reached.offset,
                        "convert": False,
                    }
                )
    return connections


def _sources(structure: Structure, component: Component) -> list[Connector]:
    return [connector for connector in structure.edges if connector.path == component.path]


def _experiment(archive: SSPArchive, root: etree._Element) -> dict[str, Any]:
    """Start time, stop time and macro step, where the archive gives them."""
    raw: dict[str, Any] = {}
    experiment = root.find("ssd:DefaultExperiment", SPACES)
    if experiment is not None:
        for attribute, key in {"startTime": "start_time", "stopTime": "stop_time"}.items():
            if attribute in experiment.attrib:
                raw[key] = attribute_number(archive, experiment, attribute, 0.0, "DefaultExperiment")
    for path, key in _STEPS:
        element = root.find(path)
        if element is not None:
            raw["coupling"] = {"macro_step": attribute_number(archive, element, key, 0.0, "SimulationInformation")}
            break
    return raw
