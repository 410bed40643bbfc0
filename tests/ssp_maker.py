"""Texts of SSP documents for tests, and archives made of them."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

import tca_cosim as tca
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.scene import read

SPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in {
        "ssc": "Common",
        "ssd": "Description",
        "ssv": "ParameterValues",
        "ssm": "ParameterMapping",
        "ssb": "SignalDictionary",
    }.items()
)
UNITS = (
    '<ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>'
    '<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>'
    '<ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit>'
    '<ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>'
    '<ssc:Unit name="Pa"><ssc:BaseUnit kg="1" m="-1" s="-2"/></ssc:Unit>'
    '<ssc:Unit name="kPa"><ssc:BaseUnit kg="1" m="-1" s="-2" factor="1000"/></ssc:Unit>'
)
OMS = (
    '<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:Annotations xmlns:oms="x">{}</oms:Annotations>'
    "</ssc:Annotation></ssd:Annotations>"
)


def connector(name: str, kind: str, unit: str = "") -> str:
    inner = f'<ssc:Real unit="{unit}"/>' if unit else "<ssc:Real/>"
    return f'<ssd:Connector name="{name}" kind="{kind}">{inner}</ssd:Connector>'


def component(name: str, file: str, connectors: str, more: str = "", attributes: str = "") -> str:
    name = name.replace("&", "&amp;").replace(">", "&gt;")
    head = f'<ssd:Component name="{name}" source="{file}" {attributes}>'
    return f"{head}<ssd:Connectors>{connectors}</ssd:Connectors>{more}</ssd:Component>"


def wire(start: str, end: str, more: str = "", attributes: str = "") -> str:
    """Ends as element/connector, or a connector of the system."""

    def side(text: str, which: str) -> str:
        element, slash, name = text.rpartition("/")
        owner = f'{which}Element="{element.replace(">", "&gt;")}" ' if slash else ""
        return f'{owner}{which}Connector="{name}"'

    return f"<ssd:Connection {side(start, 'start')} {side(end, 'end')} {attributes}>{more}</ssd:Connection>"


def parameters(text: str, units: str = "", version: str = "1.0") -> str:
    units = f"<ssv:Units>{units}</ssv:Units>" if units else ""
    head = f'<ssv:ParameterSet version="{version}" name="p" {SPACES}>'
    return f"{head}<ssv:Parameters>{text}</ssv:Parameters>{units}</ssv:ParameterSet>"


def parameter(name: str, value: object, kind: str = "Real", unit: str = "") -> str:
    unit = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}"{unit}/></ssv:Parameter>'


def binding(source: str, inner: str = "", attributes: str = "") -> str:
    head = f'<ssd:ParameterBinding source="{source}" {attributes}>'
    return f"<ssd:ParameterBindings>{head}{inner}</ssd:ParameterBinding></ssd:ParameterBindings>"


def system(elements: str, connections: str = "", connectors: str = "", more: str = "", tail: str = "") -> str:
    connectors = f"<ssd:Connectors>{connectors}</ssd:Connectors>" if connectors else ""
    connections = f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    return f"{connectors}{more}<ssd:Elements>{elements}</ssd:Elements>{connections}{tail}"


def ssd(content: str, version: str = "1.0", stop: str = ' stopTime="1"', attributes: str = "") -> str:
    head = f'<ssd:SystemStructureDescription version="{version}" name="s" {SPACES}>'
    root = f'<ssd:System name="root" {attributes}>{content}</ssd:System>'
    units = f"<ssd:Units>{UNITS}</ssd:Units>"
    return f"{head}{root}{units}<ssd:DefaultExperiment{stop}/></ssd:SystemStructureDescription>"


class Reader:
    """Writes archives into a folder and reads them."""

    def __init__(self, folder: Path, fmus: Mapping[str, bytes]) -> None:
        self.folder, self.fmus = folder, fmus

    def __call__(
        self,
        text: str | bytes,
        files: Mapping[str, str | bytes] | None = None,
        name: str = "s.ssp",
        separator: str = "/",
        overrides: tuple[str, ...] = (),
    ) -> tca.Scene:
        path = self.folder / name
        own = {f"resources/{file}": content for file, content in self.fmus.items()}
        with zipfile.ZipFile(path, "w") as archive:
            for entry, content in {"SystemStructure.ssd": text, **own, **(files or {})}.items():
                info = zipfile.ZipInfo("x")
                info.filename = entry.replace("/", separator)
                archive.writestr(info, content)
        return read(path, overrides, cached_archive)


SOURCE = component("src", "resources/src.fmu", connector("y", "output"))
TARGET = component("dst", "resources/dst.fmu", connector("u", "input"))
PAIR = SOURCE + TARGET
WIRE = wire("src/y", "dst/u")


def pair(source: str = "", target: str = "", more: str = "") -> str:
    """The two components with units of their connectors."""
    return component("src", "resources/src.fmu", connector("y", "output", source)) + component(
        "dst", "resources/dst.fmu", connector("u", "input", target) + connector("p", "parameter", target), more
    )


HELD = ("coupling.exchange=held", "coupling.waveform=held")
SCALED = '<ssc:LinearTransformation factor="2" offset="3"/>'
