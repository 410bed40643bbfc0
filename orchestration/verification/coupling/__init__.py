"""Verification of a coupled system: whether its co-simulation can be trusted, and if not, why.

Every FMU is tested alone against what its interface promises (contract). The system is run with macro steps H, H/2 and
H/4, which gives the observed order and an error estimate of every output (convergence), the loops with their gain
(loops), the energy of its power bonds (energy) and, where all FMUs offer model exchange, the difference to the
monolith. The verdict says healthy, step too long, diverging or hidden error, in plain words (verify, report).
"""

from .contract import Check
from .convergence import SignalVerdict
from .energy import PowerBond
from .report import as_json, write_html, write_json
from .verify import VERDICTS, Verification, verify

__all__ = [
    "VERDICTS",
    "Check",
    "PowerBond",
    "SignalVerdict",
    "Verification",
    "as_json",
    "verify",
    "write_html",
    "write_json",
]
