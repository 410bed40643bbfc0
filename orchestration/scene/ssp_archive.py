"""Entries and XML documents of an SSP archive.

Documents of version 1 are checked against the standard's schemas. Of version 2, whose schemas are not published with
FMPy, everything is read that version 1 can say; elements beyond that are refused by name.
"""

from __future__ import annotations

import posixpath
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import NoReturn
from urllib.parse import unquote, urlsplit

from fmpy.ssp import ssd as fmpy_ssp
from lxml import etree

from ..errors import SceneError
from .unit_conversion import Unit

__all__ = ["SPACES", "SSPArchive", "local_name", "unit_definitions"]

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
SPACES = {
    "ssc": f"{_SSP}Common",
    "ssd": f"{_SSP}Description",
    "ssv": f"{_SSP}ParameterValues",
    "ssm": f"{_SSP}ParameterMapping",
    "ssb": f"{_SSP}SignalDictionary",
}
_VALUES = {"Real", "Integer", "Boolean", "String", "Enumeration"}
_VALUES_2 = {"Float64", "Float32", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))}
TYPES = _VALUES | _VALUES_2
_BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_TRANSFORMATIONS = {"LinearTransformation"}
_MAPPINGS = {f"{kind}MappingTransformation" for kind in ("Boolean", "Integer", "Enumeration")}
_WITH_FILES = {"Component", "ParameterBinding", "ParameterMapping", "SignalDictionary"}  # source is that of a file
# Elements that change nothing that is computed: drawings, texts, what is read from anywhere.
_WITHOUT_EFFECT = {
    "Annotations",
    "ConnectionGeometry",
    "ConnectorGeometry",
    "DefaultExperiment",
    "ElementGeometry",
    "Enumerations",
    "GraphicalElements",
    "MetaData",
    "Signature",
    "SystemGeometry",
    "Units",
}
# Element -> the children that are read.
_READ: Mapping[str, set[str]] = {
    "SystemStructureDescription": {"System"},
    "System": {"Connectors", "ParameterBindings", "Elements", "Connections", "SignalDictionaries"},
    "Elements": {"Component", "System", "SignalDictionaryReference"},
    "Component": {"Connectors", "ParameterBindings"},
    "SignalDictionaryReference": {"Connectors"},
    "SignalDictionaries": {"SignalDictionary"},
    "SignalDictionary": {"DictionaryEntry", "SignalDictionary"},
    "DictionaryEntry": TYPES,
    "Connectors": {"Connector"},
    "Connector": TYPES,
    "Connections": {"Connection"},
    "Connection": _TRANSFORMATIONS,
    "ParameterBindings": {"ParameterBinding"},
    "ParameterBinding": {"ParameterValues", "ParameterMapping"},
    "ParameterValues": {"ParameterSet"},
    "ParameterMapping": {"MappingEntry", "ParameterMapping"},
    "MappingEntry": _TRANSFORMATIONS | _MAPPINGS,
    **{mapping: {"MapEntry"} for mapping in _MAPPINGS},
    "ParameterSet": {"Parameters"},
    "Parameters": {"Parameter"},
    "Parameter": TYPES,
}
_SCHEMAS = {
    "SystemStructureDescription": "SystemStructureDescription.xsd",
    "ParameterSet": "SystemStructureParameterValues.xsd",
    "ParameterMapping": "SystemStructureParameterMapping.xsd",
    "SignalDictionary": "SystemStructureSignalDictionary.xsd",
}
_ATTRIBUTES = {  # that an element must have
    "System": ("name",),
    "Component": ("name", "source"),
    "SignalDictionaryReference": ("name", "dictionary"),
    "Connector": ("name", "kind"),
    "Connection": ("startConnector", "endConnector"),
    "DictionaryEntry": ("name",),
    "MappingEntry": ("source", "target"),
    "MapEntry": ("source", "target"),
    "Parameter": ("name",),
    "Unit": ("name",),
}


@lru_cache(maxsize=len(_SCHEMAS))
def _schema(name: str) -> etree.XMLSchema:
    """The standard's schema as FMPy brings it."""
    return etree.XMLSchema(file=str(Path(fmpy_ssp.__file__).parent / "schema" / name))


class SSPArchive:
    """An opened archive. Use as a context manager. Raises SceneError, which names the file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.texts: list[str] = []  # of the documents read, for the record
        try:
            self._zip = zipfile.ZipFile(path)
        except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError) as error:
            raise SceneError(f"{path}: not a readable SSP archive ({error}); give a ZIP file made as SSP") from error
        # Archives made on Windows may separate folders by backslashes.
        self._entries = {str(PurePosixPath(name.replace("\\", "/"))): name for name in self._zip.namelist()}

    def __enter__(self) -> SSPArchive:
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    @property
    def entries(self) -> Iterable[str]:
        """Names of the files in the archive, folders separated by slashes."""
        return self._entries.keys()

    def refuse(self, element: str, problem: str) -> NoReturn:
        """Raise SceneError with file, element and problem."""
        raise SceneError(f"{self.path}: {element}: {problem}")

    def resolve(self, source: str, element: str) -> str:
        """Find the entry of a source: a URI relative to the archive's top, percent-encoded or not."""
        parts = urlsplit(source)
        if parts.netloc or len(parts.scheme) > 1:
            self.refuse(element, f"source {source!r} lies outside the archive; put the file into it")
        for text in (source, unquote(source), unquote(parts.path)):
            name = posixpath.normpath(text.replace("\\", "/"))
            if name in self._entries:
                return name
        self.refuse(element, f"source {source!r} is not in the archive; put it there")

    def file(self, entry: str) -> Path:
        """Path of an entry, leading into the archive."""
        return self.path.resolve() / self._entries[entry]

    def document(self, entry: str, root_name: str) -> etree._Element:
        """Read and check an XML document. Its sources become relative to the archive's top.

        root_name: of its root element; a missing entry, malformed XML, a document that is not valid, and elements that
        are not supported raise SceneError.
        """
        if entry not in self._entries:
            self.refuse(entry, "is not in the archive; an SSP archive has it at its top")
        try:
            text = self._zip.read(self._entries[entry])
            root = etree.fromstring(
                text, etree.XMLParser(resolve_entities=False, remove_comments=True, remove_pis=True)
            )
        except Exception as error:  # the many ways of zipfile and lxml to say that a file cannot be read
            self.refuse(entry, f"is not readable XML: {error}")
        for element in root.iter(etree.Element):
            if ":" in str(element.tag).rpartition("}")[2]:  # libxml2 takes an undeclared prefix for a part of the name
                prefix = str(element.tag).partition(":")[0]
                self.refuse(entry, f"prefix {prefix!r} of {element.tag} has no namespace; declare xmlns:{prefix}")
        if local_name(root) != root_name:
            self.refuse(entry, f"root element {local_name(root)}: an SSP document of this kind has {root_name}")
        if etree.QName(root).namespace not in SPACES.values():
            self.refuse(entry, f"namespace {etree.QName(root).namespace!r} is not one of SSP 1.0 or 2.0")
        version = root.get("version", "")
        if re.match(r"1\.", version):
            schema = _schema(_SCHEMAS[root_name])
            if not schema.validate(root):
                errors = "; ".join(f"line {entry.line}: {entry.message}" for entry in list(schema.error_log)[:3])
                self.refuse(entry, f"is not valid SSP 1.0: {errors}")
        elif not re.match(r"2\.", version):
            self.refuse(entry, f"version {version!r} is not supported; allowed: 1.0, and 2.0 as far as 1.0 goes")
        self._check(root)
        _rebase(root, posixpath.dirname(entry))
        self.texts.append(text.decode("utf-8-sig", "replace"))
        return root

    def _check(self, element: etree._Element) -> None:
        """Refuse what is not read, and elements without the attributes that they need."""
        tag = local_name(element)
        for name in _ATTRIBUTES.get(tag, ()):
            if element.get(name) is None:
                self.refuse(_named(element), f"has no attribute {name!r}; add it")
        for child in element:
            name = local_name(child)
            if name in _WITHOUT_EFFECT:
                continue
            if name not in _READ.get(tag, set()):
                self.refuse(f"{tag}/{name} {_called(child) or _called(element)}".strip(), _unsupported(name))
            self._check(child)


def _rebase(root: etree._Element, folder: str) -> None:
    """Make sources, which are relative to the folder of their document, relative to the archive's top."""
    for element in root.iter(etree.Element) if folder else ():
        source = element.get("source")
        if local_name(element) in _WITH_FILES and source and not re.match(r"#|[\w+.-]+:", source):
            element.set("source", f"{folder}/{source}")


def _unsupported(name: str) -> str:
    if name == "Dimension":
        return "arrays of SSP 2.0 are not supported; write one connector for each element"
    if name in _MAPPINGS:
        return "not supported in connections; map the values inside an FMU"
    return "not supported; leave it out"


def _called(element: etree._Element) -> str:
    return element.get("name") or element.get("endConnector") or element.get("source") or ""


def _named(element: etree._Element) -> str:
    return f"{local_name(element)} {_called(element)}".strip()


def local_name(element: etree._Element) -> str:
    """Tag of an element without its namespace."""
    return str(etree.QName(element).localname)


def unit_definitions(archive: SSPArchive, root: etree._Element) -> dict[str, Unit]:
    """Units that a document defines, by name."""
    return {unit.name: unit for unit in _units(archive, root)}


def _units(archive: SSPArchive, root: etree._Element) -> Iterator[Unit]:
    for element in root.iterfind(".//ssc:Unit", SPACES):
        name, base = element.get("name") or "", element.find("ssc:BaseUnit", SPACES)
        if base is None:
            yield Unit(name)
            continue
        try:
            exponents = {key: int(base.get(key, 0)) for key in _BASE_UNITS}
            factor, offset = float(base.get("factor", 1.0)), float(base.get("offset", 0.0))
        except ValueError as error:
            archive.refuse(f"Unit {name}", f"its BaseUnit cannot be read: {error}")
        yield Unit(name, {key: power for key, power in exponents.items() if power}, factor, offset)
