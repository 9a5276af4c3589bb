"""A plugin with a brake, f = -b v, that does what a test wants when it is imported, made, and asked for a force."""

from __future__ import annotations

_SOURCE = """
import ctypes, logging, os, signal, subprocess, sys, threading, time
from pathlib import Path
from typing import Annotated
from haploop.controller.dissipation import Element, Quantity
def recurse(): recurse()
{at_import}

class Brake(Element):
    '''A force against the motion.'''
    kind = "brake"
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="how much")] = 0.05

    def __post_init__(self):
        self.tick = -1
        {at_making}

    def force(self, motion):
        self.tick += 1
        {at_force}
        return -self.damping * motion.v
"""


def source(at_import: str = "pass", at_making: str = "pass", at_force: str = "pass") -> str:
    """Returns the text of the file, with each statement on a separate line. ``self.tick`` counts from 0."""
    return _SOURCE.format(at_import=at_import, at_making=at_making, at_force=at_force)
