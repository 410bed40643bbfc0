"""A macro step that did not succeed, and the error that ends a run when retrying does not help."""

from __future__ import annotations

import math

from ..errors import CouplingError

__all__ = ["StepError", "give_up"]


class StepError(Exception):
    """gain: estimated loop gain, nan if unknown; reached: time to which a subsystem came that asked for a smaller step
    [s]; remedy: where the gain suggests none."""

    def __init__(
        self,
        cause: str,
        residuals: tuple[float, ...] = (),
        gain: float = math.nan,
        reached: float | None = None,
        remedy: str = "",
    ) -> None:
        super().__init__(cause)
        self.cause, self.residuals, self.gain, self.reached, self.remedy = cause, residuals, gain, reached, remedy


def give_up(time: float, step: float, failure: StepError) -> CouplingError:
    """With the remedy that the loop gain suggests."""
    gain = failure.gain
    if gain >= 1.0:
        remedy = (
            "Plain iteration multiplies the error by the gain in each sweep: use coupling.method = 'iqn', 'newton' or "
            f"'broyden', 'relaxed' with omega below {2.0 / (1.0 + gain):.2g}, or let one FMU close the loop itself"
        )
    elif failure.remedy:
        remedy = failure.remedy
    elif failure.residuals:
        remedy = "Raise coupling.max_sweeps, coupling.reach or coupling.tolerance, or use coupling.method = 'iqn'"
    else:
        remedy = "Follow what the subsystem says, or make coupling.macro_step smaller"
    return CouplingError(time, step, len(failure.residuals), failure.residuals, gain, failure.cause, remedy)
