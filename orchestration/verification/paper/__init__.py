"""Comparison with Fig. 3 of Pawlowski, Sun, Xu, Liu, Zhao (CDC 2018): three scenes against values read off the figure.

fig3.csv holds temperatures [degC] and angles [rad] over time, tip.csv positions of the tip [mm]. The angles of the
figure are (YZ, XZ, XY) = -(alpha, beta, gamma) of the tip's orientation R = Rx(alpha) Ry(beta) Rz(gamma).
"""

from .data import ANGLES, SCENES, TEMPERATURES, Reading, TipReading, readings, tip_readings
from .deviations import Deviations, TipComparison, compare_tips, deviations, time_course

__all__ = [
    "ANGLES",
    "SCENES",
    "TEMPERATURES",
    "Deviations",
    "Reading",
    "TipComparison",
    "TipReading",
    "compare_tips",
    "deviations",
    "readings",
    "time_course",
    "tip_readings",
]
