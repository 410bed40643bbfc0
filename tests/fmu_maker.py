"""FMUs for tests: a table of variables and a few lines of C become an FMI 2.0 archive, for co-simulation, for model
exchange or for both.

`make_fmu(path, variables, output=..., step=...)` compiles the template `fmu_template.c` against the headers of fmpy.
The C texts see the values by reference, which by default counts the variables of each type from 0: real[0],
integer[0] (also of enumerations), boolean[0], string[0]. Beside them: t and h (time and length of the step, s),
m->time, m->start_time, m->stop_time, m->tolerance, m->steps (accepted so far), memory[16] (free for the model, saved
with the state), m->resources, and LOG(status, format, ...). See the arguments of make_fmu for what runs when.
"""

from __future__ import annotations

import hashlib
import subprocess
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import fmpy

__all__ = ["Variable", "boolean", "enumeration", "integer", "make_fmu", "real", "string"]

TEMPLATE = Path(__file__).parent / "fmu_template.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
PLATFORM = "linux64"
ARRAYS = {"Real": "real", "Integer": "integer", "Enumeration": "integer", "Boolean": "boolean", "String": "string"}
_compiled: dict[str, bytes] = {}  # hash of source and flags -> shared library, once per test session


@dataclass(frozen=True)
class Variable:
    """One ScalarVariable. attributes: of the type's element, such as start, unit, nominal, declaredType."""

    type: str
    name: str
    causality: str = "output"
    variability: str = ""  # default: continuous for Real, fixed for parameters, else discrete
    initial: str = ""
    reference: int | None = None  # default: its number among the variables of its type
    description: str = ""
    attributes: Mapping[str, object] = field(default_factory=dict)


def _constructor(kind: str) -> Callable[..., Variable]:
    def variable(
        name: str,
        causality: str = "output",
        *,
        variability: str = "",
        initial: str = "",
        reference: int | None = None,
        description: str = "",
        **attributes: object,
    ) -> Variable:
        return Variable(kind, name, causality, variability, initial, reference, description, attributes)

    return variable


real = _constructor("Real")
integer = _constructor("Integer")
boolean = _constructor("Boolean")
string = _constructor("String")
enumeration = _constructor("Enumeration")


def make_fmu(
    path: Path,
    variables: Sequence[Variable],
    *,
    output: str = "",  # computes outputs, derivatives and indicator[k] from values and m->time; runs at each get
    step: str = "",  # body of fmi2DoStep, returns a status or falls through to fmi2OK; default: RK4 over the states
    event: str = "",  # of fmi2NewDiscreteStates, also at the start; may change states, m->next_event, m->terminated
    head: str = "",  # before all functions, such as static variables
    instantiate: str = "",  # at the end of fmi2Instantiate; `return NULL;` refuses
    setup: str = "",  # in fmi2SetupExperiment
    enter: str = "",  # in fmi2EnterInitializationMode
    leave: str = "",  # in fmi2ExitInitializationMode
    terminate: str = "",  # in fmi2Terminate
    free: str = "",  # in fmi2FreeInstance
    save: str = "",  # at the begin of fmi2GetFMUstate
    restore: str = "",  # at the end of fmi2SetFMUstate
    rates: str = "",  # sets rate[k], the time derivative of real[k], for fmi2GetRealOutputDerivatives
    states: Mapping[str, str] | None = None,  # name of a continuous state -> name of its derivative
    indicators: int = 0,
    substeps: int = 20,  # of the default step
    co_simulation: Mapping[str, object] | None = None,  # further attributes of the element
    model_exchange: Mapping[str, object] | None = None,  # the same; None: no such interface
    cs: bool = True,  # whether there is co-simulation
    state: bool = True,  # canGetAndSetFMUstate
    units: str = "",  # content of UnitDefinitions
    types: str = "",  # content of TypeDefinitions
    experiment: Mapping[str, object] | None = None,  # attributes of DefaultExperiment
    categories: Sequence[str] = (),  # of the log
    guid: str = "{test}",
    identifier: str = "",
    xml: Callable[[str], str | bytes] = lambda text: text,  # last change of modelDescription.xml
    files: Mapping[str, str | bytes] | None = None,  # further content of the archive, by name in it
    platform: str = PLATFORM,  # folder of the library; "": none
    flags: Sequence[str] = (),  # of the compiler
) -> Path:
    """Write the FMU file `path` and return it."""
    placed = tuple(_placed(variables))
    name = identifier or "".join(c if c.isascii() and c.isalnum() else "_" for c in path.stem)[:60] or "model"
    states = dict(states or {})
    bodies = {
        "HEAD": head,
        "OUTPUT": output,
        "STEP": step or ("return integrate(m, h);" if states else ""),
        "EVENT": event,
        "INSTANTIATE": instantiate,
        "SETUP": setup,
        "ENTER": enter,
        "LEAVE": leave,
        "TERMINATE": terminate,
        "FREE": free,
        "SAVE": save if state else "return fmi2Error;",
        "RESTORE": restore,
        "RATES": rates or "return fmi2Error;",
        "STARTS": "\n".join(_start(variable) for variable in placed),
    }
    references = {variable.name: variable.reference for variable in placed}
    constants: dict[str, object] = {
        "STATES": len(states),
        "INDICATORS": indicators,
        "SUBSTEPS": substeps,
        "STATE_REFERENCES": ", ".join(str(references[x]) for x in states) or "0",
        "DERIVATIVE_REFERENCES": ", ".join(str(references[dx]) for dx in states.values()) or "0",
        **{f"{array.upper()}S": _size(placed, array) for array in set(ARRAYS.values())},
    }
    source = TEMPLATE.read_text(encoding="utf-8")
    for key, text in bodies.items():
        source = source.replace(f"/*{key}*/", text)
    interfaces = ""
    if cs:
        attributes = {"canHandleVariableCommunicationStepSize": "true", **_saving(state), **(co_simulation or {})}
        interfaces += f"<CoSimulation modelIdentifier={quoteattr(name)}{_attributes(attributes)}/>"
    if model_exchange is not None:
        attributes = {**_saving(state), **model_exchange}
        interfaces = f"<ModelExchange modelIdentifier={quoteattr(name)}{_attributes(attributes)}/>" + interfaces
    description = _description(
        name, guid, placed, interfaces, states, indicators, units, types, experiment or {}, categories
    )
    changed = xml(description)
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", changed if isinstance(changed, bytes) else changed.encode("utf-8"))
        if platform:
            archive.writestr(f"binaries/{platform}/{name}.so", _library(source, constants, flags))
        for inside, content in (files or {}).items():
            archive.writestr(inside, content)
    return path


def _placed(variables: Iterable[Variable]) -> Iterable[Variable]:
    """The variables with references, which count the variables of an array from 0 where none is given."""
    counts = dict.fromkeys(ARRAYS.values(), 0)
    for v in variables:
        reference = counts[ARRAYS[v.type]] if v.reference is None else v.reference
        counts[ARRAYS[v.type]] = reference + 1
        yield Variable(v.type, v.name, v.causality, v.variability, v.initial, reference, v.description, v.attributes)


def _size(variables: Iterable[Variable], array: str) -> int:
    return max((v.reference + 1 for v in variables if ARRAYS[v.type] == array and v.reference is not None), default=1)


def _start(v: Variable) -> str:
    """The assignment of a start value, where the XML's text is one of C as well."""
    text = str(v.attributes.get("start", ""))
    array, k = ARRAYS[v.type], v.reference
    if v.type == "String":
        return f'snprintf(m->string[{k}], TEXT, "%s", {_c_string(text)});' if text else ""
    if v.type == "Boolean":
        return f"m->boolean[{k}] = {int(text.lower() in ('true', '1'))};"
    try:
        value = float(text)
    except ValueError:  # left out, or wrong on purpose
        return ""
    return f"m->{array}[{k}] = {value!r};" if value == value and abs(value) != float("inf") else ""


def _c_string(text: str) -> str:
    return '"' + "".join(f"\\{byte:03o}" for byte in text.encode("utf-8")) + '"'


def _saving(state: bool) -> dict[str, object]:
    return {"canGetAndSetFMUstate": "true"} if state else {}


def _attributes(values: Mapping[str, object]) -> str:
    return "".join(f" {key}={quoteattr(str(value))}" for key, value in values.items())


def _description(
    name: str,
    guid: str,
    variables: Sequence[Variable],
    interfaces: str,
    states: Mapping[str, str],
    indicators: int,
    units: str,
    types: str,
    experiment: Mapping[str, object],
    categories: Sequence[str],
) -> str:
    """The text of modelDescription.xml."""
    index = {v.name: k for k, v in enumerate(variables, 1)}
    outputs = [k for k, v in enumerate(variables, 1) if v.causality == "output"]
    unknowns = "".join(f'<Unknown index="{k}"/>' for k in outputs)
    rates = "".join(f'<Unknown index="{index[dx]}"/>' for dx in states.values())
    initial = sorted(
        {*(k for k in outputs if _initial(variables[k - 1]) != "exact"), *(index[d] for d in states.values())}
    )
    later = "".join(f'<Unknown index="{k}"/>' for k in initial)
    rows = "".join(_row(v, {dx: index[x] for x, dx in states.items()}) for v in variables)
    logs = "".join(f"<Category name={quoteattr(category)}/>" for category in categories)
    parts = (
        interfaces,
        f"<UnitDefinitions>{units}</UnitDefinitions>" if units else "",
        f"<TypeDefinitions>{types}</TypeDefinitions>" if types else "",
        f"<LogCategories>{logs}</LogCategories>" if logs else "",
        f"<DefaultExperiment{_attributes(experiment)}/>" if experiment else "",
        f"<ModelVariables>{rows}</ModelVariables>",
        "<ModelStructure>",
        f"<Outputs>{unknowns}</Outputs>" if unknowns else "",
        f"<Derivatives>{rates}</Derivatives>" if rates else "",
        f"<InitialUnknowns>{later}</InitialUnknowns>" if later else "",
        "</ModelStructure>",
    )
    head = {"fmiVersion": "2.0", "modelName": name, "guid": guid, "generationTool": "fmu_maker"}
    if indicators:
        head["numberOfEventIndicators"] = str(indicators)
    content = "\n".join(part for part in parts if part)
    text = f"<fmiModelDescription{_attributes(head)}>\n{content}\n</fmiModelDescription>\n"
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}'


def _initial(v: Variable) -> str:
    return v.initial or ("exact" if v.causality in ("output", "local") and "start" in v.attributes else "")


def _row(v: Variable, states: Mapping[str, int]) -> str:
    """One ScalarVariable; states: name of a derivative -> index of its state."""
    default = "fixed" if v.causality == "parameter" else "continuous" if v.type == "Real" else "discrete"
    head: dict[str, object] = {"name": v.name, "valueReference": v.reference, "causality": v.causality}
    head["variability"] = v.variability or default
    if _initial(v):
        head["initial"] = _initial(v)
    if v.description:
        head["description"] = v.description
    attributes = {**v.attributes, **({"derivative": states[v.name]} if v.name in states else {})}
    return f"<ScalarVariable{_attributes(head)}><{v.type}{_attributes(attributes)}/></ScalarVariable>\n"


def _library(source: str, constants: Mapping[str, object], flags: Sequence[str]) -> bytes:
    """The shared library of a C text, compiled once per session."""
    definitions = "".join(f"#define {key} {value}\n" for key, value in constants.items())
    text = definitions + source
    key = hashlib.sha256("\0".join((text, *flags)).encode()).hexdigest()
    if key not in _compiled:
        with tempfile.TemporaryDirectory() as folder:
            file, library = Path(folder) / "model.c", Path(folder) / "model.so"
            file.write_text(text, encoding="utf-8")
            command = [
                "cc",
                "-O1",
                "-w",
                "-shared",
                "-fPIC",
                f"-I{HEADERS}",
                *flags,
                str(file),
                "-o",
                str(library),
                "-lm",
            ]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            _compiled[key] = library.read_bytes()
    return _compiled[key]
