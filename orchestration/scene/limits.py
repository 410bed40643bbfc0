"""Limits of plausibility: the table [limits] of a scene. Results beyond them are computed, and said to be doubtful."""

from __future__ import annotations

from dataclasses import dataclass

from .schema import setting

__all__ = ["Limits"]


@dataclass(frozen=True)
class Limits:
    """Values up to which the models hold."""

    temperature: float = setting(423.15, "highest temperature that body and TCAs stand: 150 degC", "K", 1.0)
    speed: float = setting(
        0.1, "speed of the tip up to which the heat transfer from the surface may be taken as constant", "m/s", 1e-9
    )
    strain: float = setting(
        0.3, "stretch or compression of the body along a TCA up to which it may be taken as linear elastic", "1", 1e-9
    )
