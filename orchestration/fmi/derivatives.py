"""Values and directional derivatives of an instance's real variables, by name."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from ..errors import SubsystemError
from . import fmi2
from .archive import Archive
from .instance import Instance
from .variables import Variable

__all__ = ["continuous_states", "jacobian", "real_values"]


def continuous_states(archive: Archive) -> list[tuple[Variable, Variable]]:
    """Return the continuous states that an FMU declares, each with its time derivative."""
    declared = [unknown.variable for unknown in archive.model_description().derivatives or []]
    pairs = [(derivative.derivative, derivative) for derivative in declared]
    return [(archive.variables[s.name], archive.variables[d.name]) for s, d in pairs if s is not None]


def real_values(instance: Instance, variables: Sequence[Variable]) -> np.ndarray:
    """Return the values (n,) of real variables now. Raises SubsystemError."""
    if not variables:
        return np.zeros(0)
    values = (fmi2.fmi2Real * len(variables))()
    _check(
        instance,
        instance.library.fmi2GetReal(
            instance.component, _references(variables), ctypes.c_size_t(len(variables)), values
        ),
        "fmi2GetReal",
    )
    return np.array(values)


def jacobian(instance: Instance, unknowns: Sequence[Variable], knowns: Sequence[Variable]) -> np.ndarray:
    """Return the partial derivatives of `unknowns` by `knowns` now.

    Parameters
    ----------
    instance : Instance
        Initialised.
    unknowns : sequence of Variable
        n outputs and derivatives of states.
    knowns : sequence of Variable
        m inputs, states and tunable parameters.

    Returns
    -------
    ndarray, shape (n, m)
        In units of the unknown per unit of the known.

    Raises
    ------
    SubsystemError
        The FMU has no directional derivatives (providesDirectionalDerivative = false), or none here.
    """
    result = np.zeros((len(unknowns), len(knowns)))
    if not result.size:
        return result
    if not instance.has_tangent:
        raise SubsystemError(
            f"{instance.name}: the FMU has no directional derivatives (providesDirectionalDerivative = false); export "
            "it with them"
        )
    rows, row_count, one = _references(unknowns), ctypes.c_size_t(len(unknowns)), ctypes.c_size_t(1)
    seed, column = fmi2.fmi2Real(1.0), (fmi2.fmi2Real * len(unknowns))()
    for k, known in enumerate(knowns):
        reference = fmi2.fmi2ValueReference(known.reference)
        status = instance.library.fmi2GetDirectionalDerivative(
            instance.component, rows, row_count, ctypes.byref(reference), one, ctypes.byref(seed), column
        )
        _check(instance, status, f"derivatives by {known.name}")
        result[:, k] = column
    return result


def _references(variables: Sequence[Variable]) -> ctypes.Array[ctypes.c_uint]:
    return (fmi2.fmi2ValueReference * len(variables))(*(v.reference for v in variables))


def _check(instance: Instance, status: int, what: str) -> None:
    if status != fmi2.fmi2OK:
        instance.check(status, what)
