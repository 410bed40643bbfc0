"""What runs need of a modelDescription.xml: variables, interfaces and sizes, as plain data that can be kept."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..errors import SceneError
from .variables import Variable
from .vectors import Vector, find_vectors

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription

__all__ = ["Description", "Interface", "full_description", "pack", "read_description", "unpack"]


@dataclass(frozen=True)
class Interface:
    """Abilities of an FMU in one of its interfaces; those of the other interface are False or 0."""

    model_identifier: str
    can_save_state: bool  # canGetAndSetFMUstate
    has_directional_derivatives: bool  # providesDirectionalDerivative
    once_per_process: bool  # canBeInstantiatedOnlyOncePerProcess
    can_interpolate_inputs: bool = False
    max_output_derivative_order: int = 0
    takes_variable_steps: bool = False  # canHandleVariableCommunicationStepSize
    needs_completed_step: bool = False  # not completedIntegratorStepNotNeeded


@dataclass(frozen=True)
class Description:
    """Head of a model description."""

    guid: str
    model_name: str
    generation_tool: str
    log_categories: tuple[str, ...]
    co_simulation: Interface | None
    model_exchange: Interface | None
    state_count: int
    event_indicator_count: int
    variables: Mapping[str, Variable]

    @cached_property
    def arrays(self) -> dict[str, Vector]:
        """Base name -> vector or matrix of that name."""
        return find_vectors(self.variables)

    @cached_property
    def vectors(self) -> dict[str, tuple[str, ...]]:
        """Base name -> names of the elements in the order of their indices."""
        return {base: vector.elements for base, vector in self.arrays.items()}

    @cached_property
    def interface(self) -> Interface:
        """Interface for co-simulation, or that for model exchange where there is no other."""
        interface = self.co_simulation or self.model_exchange
        assert interface is not None, "archives without an interface are refused"
        return interface


def full_description(content: bytes) -> ModelDescription:
    """Read modelDescription.xml by FMPy.

    The schema is checked by whoever makes the FMU; a scene needs only what is read here.
    """
    from fmpy.model_description import read_model_description  # slow to load

    plain = io.BytesIO()
    with zipfile.ZipFile(plain, "w") as archive:
        archive.writestr("modelDescription.xml", content)
    return read_model_description(plain, validate=False)


def read_description(content: bytes) -> Description:
    """Read modelDescription.xml.

    Raises
    ------
    SceneError
        It is not one of FMI 2.0, or a variable cannot be read.
    Exception
        Of the parsers of XML and of FMPy, of many kinds.
    """
    from lxml import etree

    from .variables import read_variables

    root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True))
    version = root.get("fmiVersion")
    if version != "2.0":
        raise SceneError(f"made for FMI {version}; export it for FMI 2.0, as co-simulation")
    variables = read_variables(root)
    try:
        full = full_description(content)
    except Exception as error:  # fmpy expects what the schema says
        text = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(f"modelDescription.xml is not valid ({text}); export it again") from error
    if full.coSimulation is None and full.modelExchange is None:
        raise SceneError("offers neither co-simulation nor model exchange; export it with one of them")
    return Description(
        guid=full.guid or "",
        model_name=full.modelName or "",
        generation_tool=full.generationTool or "",
        log_categories=tuple(category.name for category in full.logCategories if category.name),
        co_simulation=_interface(full.coSimulation),
        model_exchange=_interface(full.modelExchange),
        state_count=len(full.derivatives),
        event_indicator_count=int(full.numberOfEventIndicators or 0),
        variables=variables,
    )


def _interface(declared: Any) -> Interface | None:
    if declared is None:
        return None
    return Interface(
        model_identifier=declared.modelIdentifier or "",
        can_save_state=bool(declared.canGetAndSetFMUstate),
        has_directional_derivatives=bool(declared.providesDirectionalDerivative),
        once_per_process=bool(declared.canBeInstantiatedOnlyOncePerProcess),
        can_interpolate_inputs=bool(getattr(declared, "canInterpolateInputs", False)),
        max_output_derivative_order=int(getattr(declared, "maxOutputDerivativeOrder", 0) or 0),
        takes_variable_steps=bool(getattr(declared, "canHandleVariableCommunicationStepSize", False)),
        needs_completed_step=bool(getattr(declared, "needsCompletedIntegratorStep", False)),
    )


_COLUMNS = tuple(f.name for f in fields(Variable))
_TUPLES = [k for k, name in enumerate(_COLUMNS) if name in ("items", "item_values")]
_DIMENSION = _COLUMNS.index("dimension")


def pack(description: Description) -> bytes:
    """Return a description as JSON; dimensions of units, of which many variables share one, stand once."""
    dimensions: list[Any] = []
    rows = []
    for variable in description.variables.values():
        row = [getattr(variable, name) for name in _COLUMNS]
        if row[_DIMENSION] not in dimensions:
            dimensions.append(row[_DIMENSION])
        row[_DIMENSION] = dimensions.index(row[_DIMENSION])
        rows.append(row)
    head = {f.name: getattr(description, f.name) for f in fields(Description) if f.name != "variables"}
    for name in ("co_simulation", "model_exchange"):
        head[name] = None if head[name] is None else vars(head[name])
    return json.dumps({"head": head, "columns": _COLUMNS, "dimensions": dimensions, "rows": rows}).encode()


def unpack(content: bytes) -> Description:
    """Return the description that pack() wrote.

    Raises
    ------
    ValueError, TypeError, KeyError
        The content is of another version, or none of pack().
    """
    packed = json.loads(content)
    if tuple(packed["columns"]) != _COLUMNS:
        raise ValueError("of another version")
    dimensions, variables = packed["dimensions"], {}
    for row in packed["rows"]:
        row[_DIMENSION] = dimensions[row[_DIMENSION]]
        for k in _TUPLES:
            row[k] = tuple(row[k])
        variables[row[0]] = Variable(*row)
    head = packed["head"]
    for name in ("co_simulation", "model_exchange"):
        head[name] = None if head[name] is None else Interface(**head[name])
    head["log_categories"] = tuple(head["log_categories"])
    return Description(**head, variables=variables)
