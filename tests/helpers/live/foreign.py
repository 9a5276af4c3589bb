"""Runs of figure 6(c) whose controller is a foreign program, the plain one of the oracles."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path

from helpers.live.launched import Run

CONTROLLER = Path(__file__).parents[2] / "oracles/plain_controller.py"
PLAIN = shlex.join([sys.executable, "-I", str(CONTROLLER)])
Started = Callable[..., Run]
