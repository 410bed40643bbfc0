"""The command line as tests call it."""

from __future__ import annotations

from tca_cosim.cli import app
from typer.testing import CliRunner, Result

SCENE = """stop_time = "0.2 s"
[thermal]
V = [0, 1.5, 3]
[rod]
dynamic = false
"""


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))
