"""Parameters from measurements: nonlinear least squares, confidence, and what the data cannot tell."""

from .estimate import Estimate, identify
from .measurements import Measurements, measurements_of, read_measurements
from .parameters import FreeParameter, read_free
from .resampling import Bootstrap, bootstrap

__all__ = [
    "Bootstrap",
    "Estimate",
    "FreeParameter",
    "Measurements",
    "bootstrap",
    "identify",
    "measurements_of",
    "read_free",
    "read_measurements",
]
