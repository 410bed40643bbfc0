"""Closed loops: observers, linear and predictive controllers, and an environment for reinforcement learning."""

from .linear_controller import LinearController
from .observer import HeatObserver
from .predictive import PredictiveController

__all__ = ["HeatObserver", "LinearController", "PredictiveController"]
