"""A macro step that failed, and the error that ends a run when retrying does not help."""

from __future__ import annotations

import math
from typing import Any

from ..errors import CouplingError

__all__ = ["StepError", "give_up"]


class StepError(Exception):
    """A macro step failed; it may succeed with a shorter length.

    Attributes
    ----------
    cause : str
        What happened.
    residuals : tuple of float
        Residual norm after each sweep, in units of the nominals.
    gain : float
        Estimated loop gain; nan if unknown.
    reached : float or None
        Time that a subsystem reached which asked for a smaller step [s].
    remedy : str
        Advice where the gain suggests none.
    termination : bool
        Whether a subsystem asks for the end of the simulation, at the time reached.
    log : object
        Log of the part of the step that was done by then and cannot be taken back; None where there is none.
    """

    def __init__(
        self,
        cause: str,
        residuals: tuple[float, ...] = (),
        gain: float = math.nan,
        reached: float | None = None,
        remedy: str = "",
        termination: bool = False,
        log: Any = None,
    ) -> None:
        super().__init__(cause)
        self.cause, self.residuals, self.gain, self.reached, self.remedy = cause, residuals, gain, reached, remedy
        self.termination, self.log = termination, log


ANY_GAIN = ("iqn", "broyden", "newton", "tangent")  # methods that a gain above 1 alone does not defeat


def give_up(time: float, step: float, failure: StepError, method: str) -> CouplingError:
    """Return the error that ends a run at `time` [s], after a `step` [s], with the remedy for its gain and method."""
    gain = failure.gain
    if gain >= 1.0 and method in ANY_GAIN:
        remedy = (
            f"The response of the loop bends too much within this step for coupling.method = {method!r}, as where "
            "contact sets in: let failed steps get shorter with a larger coupling.halvings, make coupling.macro_step "
            "smaller, reduce the inputs and loads, or let one FMU close the loop itself"
        )
        remedy += "" if method == "iqn" else "; coupling.method = 'iqn' searches near such bends"
    elif gain >= 1.0:
        remedy = (
            "Plain iteration multiplies the error by the gain in each sweep: use coupling.method = 'iqn', 'newton' or "
            f"'broyden', 'relaxed' with omega below {2.0 / (1.0 + gain):.2g}, or let one FMU close the loop itself"
        )
    elif failure.remedy:
        remedy = failure.remedy
    elif failure.residuals:
        remedy = (
            "Raise coupling.halvings, which lets failed steps get shorter, coupling.max_sweeps or coupling.tolerance"
        )
        remedy += "" if method in ANY_GAIN else ", or use coupling.method = 'iqn'"
    else:
        remedy = "Follow what the subsystem says, or make coupling.macro_step smaller"
    return CouplingError(time, step, len(failure.residuals), failure.residuals, gain, failure.cause, remedy)
