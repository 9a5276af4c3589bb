"""The ``[velocity]`` and ``[acceleration]`` tables: how the controller estimates what it does not measure."""

from __future__ import annotations

from typing import Annotated, Literal

from haploop.protocol.quantity import si
from haploop.protocol.scene.table import OpenTable

Cutoff = Annotated[float, si("Hz", "cutoff of a first-order low-pass", above=0)]
Ticks = Annotated[
    int | None, si("", "ticks of the window, the longest one for foaw", whole=True, at_least=1, at_most=10_000)
]
Fit = Literal["end", "best"]


class Velocity(OpenTable):
    """The velocity estimate: a backward difference unless an estimator is named; low-passed when a cutoff is given."""

    estimator: str | None = None
    ticks: Ticks = None
    bound: Annotated[
        float | None, si("m", "how far samples may lie off a line; one count of the encoder by default", above=0)
    ] = None
    fit: Fit | None = None
    jerk_density: Annotated[float | None, si("m/s^3/Hz^0.5", "density of the expected jerk", above=0)] = None
    measurement_noise: Annotated[
        float | None, si("m", "standard deviation of a position; that of encoder and noise by default", above=0)
    ] = None
    accelerometer: bool | None = None
    accelerometer_noise: Annotated[
        float | None,
        si("m/s^2", "standard deviation of a reading; that of the accelerometer by default", at_least=0, at_most=1e9),
    ] = None
    cutoff: Cutoff | None = None


class Acceleration(OpenTable):
    """The acceleration estimate: a rate of the velocity, an accelerometer's reading, or the Kalman filter's."""

    source: Literal["encoder", "accelerometer", "kalman"] = "encoder"
    estimator: str | None = None
    ticks: Ticks = None
    bound: Annotated[float | None, si("m/s", "how far velocities may lie off a line", above=0)] = None
    fit: Fit | None = None
    cutoff: Cutoff | None = None
