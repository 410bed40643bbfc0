"""Closed loops: observers, linear and predictive controllers, and an environment for reinforcement learning."""

from .linear_controller import LinearController
from .observer import HeatObserver, ObserverNoise
from .predictive import PredictiveController

__all__ = ["HeatObserver", "LinearController", "ObserverNoise", "PredictiveController"]
