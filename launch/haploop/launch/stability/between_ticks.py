"""Resonances that swing between the ticks, where no sample shows how."""

from __future__ import annotations

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.scene import Scene

BETWEEN_TICKS = "a resonance may swing between its ticks"
# Damped by more than this share of critical damping, a mode does not swing.
_DAMPED = 0.5


def rings_between_ticks(scene: Scene) -> bool:
    """Tells whether the free device with its cable has a lightly damped mode at half the control rate or above.

    A verdict compares positions at the ticks with what a hand feels. A swing at f > 1 / (2 T) appears in them at
    another, slower frequency, where a hand feels less (Israr et al. 2006), and may not appear at all.
    """
    if not scene.transmission:
        return False
    poles = Chain.from_scene(scene).poles()
    swings = -poles.real < _DAMPED * np.abs(poles)
    return bool((poles.imag[swings] >= np.pi * scene.clock.control_rate).any())
