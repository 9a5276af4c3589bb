"""Estimates along sampled positions, by the tables of a scene."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from haploop.controller.controller import make_params
from haploop.controller.tick import StateTuple, initial_state, tick
from haploop.plant.sensing.encoder import make_encoder
from haploop.protocol.scene.scene import Encoder
from helpers.scenes.least import typed

T = 1e-3
COUNT = 1e-5
ENCODER = {"resolution": COUNT, "rounding": "nearest"}
EVERYTHING = 1e9  # a bound that lets every window pass
SIGMA = 3e-6
CORNER = 2 * np.pi * 40.0
JERK = CORNER**3 * SIGMA * np.sqrt(T)
KALMAN = {"estimator": "kalman", "jerk_density": JERK, "measurement_noise": SIGMA}
FUSED = {**KALMAN, "accelerometer": True, "accelerometer_noise": 0.5}


def estimates(x: Sequence[Any], readings: Sequence[Any] = (), **tables: Any) -> tuple[np.ndarray, np.ndarray]:
    """v and a along sampled positions, by the tables of a scene; shape (ticks, ...) as the samples are."""
    samples = list(zip(x, readings, strict=True)) if len(readings) else [(at,) for at in x]
    params, rows = make_params(typed(**tables), T, {}), []
    state: StateTuple = initial_state(params, samples[0])
    for sample in samples:
        state, row = tick(params, state, sample)
        rows.append(row[1:3])
    v, a = zip(*rows, strict=True)
    return np.array(v), np.array(a)


def floats(values: np.ndarray) -> list[float]:
    return values.tolist()


def measured(x: np.ndarray, rounding: str = "nearest") -> list[float]:
    measure = make_encoder(Encoder.from_dict(ENCODER | {"rounding": rounding}))
    return [measure(at) for at in floats(x)]
