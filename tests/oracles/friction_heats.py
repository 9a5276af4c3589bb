"""Heat of friction, step by step and piece by piece, from the plant's columns alone."""

from __future__ import annotations

import numpy as np

from helpers.runs.captured import Captured


def friction_heats(ran: Captured) -> np.ndarray:
    """Returns the heat of friction in every step of one piece, and in every piece of the other steps, J."""
    plant = ran.plant
    dx = np.diff(plant["x"]) + np.diff(plant["x_low"])
    whole = -plant["friction"][:-1] * dx
    step = plant["pieces.step"].astype(int)
    ends = np.append(np.diff(step) != 0, True)[: len(step)]
    following = {name: np.append(plant[f"pieces.{name}"][1:], 0.0)[: len(step)] for name in ("x", "x_low")}
    end_x, end_low = (np.where(ends, plant[name][step + 1], following[name]) for name in ("x", "x_low"))
    way = (end_x - plant["pieces.x"]) + (end_low - plant["pieces.x_low"])
    pieces = -plant["pieces.friction"] * way + plant["pieces.snap_J"]
    return np.concatenate([np.delete(whole, step), pieces])
