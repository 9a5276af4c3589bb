"""The least tables that name each effect, and the tables that name nearly all of them."""

from __future__ import annotations

from typing import Any

ENCODER = {"resolution": 1e-5}
READ = {"acceleration": {"source": "accelerometer"}}
FILTER = {"estimator": "kalman", "jerk_density": 10.0}
# The least that names each effect. The lists of ``BESIDE`` hold the effects that an effect cannot be without.
METHODS = ("euler", "semi-implicit-euler", "rk4", "implicit-midpoint", "dop853")
NAMING: dict[str, dict[str, Any]] = {
    **{f"clock.integrator = {method}": {"clock": {"integrator": method}} for method in METHODS},
    "transmission": {"transmission": {"motor_mass": 0.003, "stiffness": 4000}},
    "hand.grip": {"hand": {"mass": 0.2, "grip": {"stiffness": 500}}},
    "actuator.bandwidth": {"actuator": {"bandwidth": 300}},
    "friction": {"friction": {"kinetic": 0.05}},
    "accelerometer.bandwidth": {"accelerometer": {"bandwidth": 400}, **READ},
    "accelerometer.delay": {"accelerometer": {"delay": 0.001}, **READ},
    "noise": {"noise": {"deviation": 1e-5, "cutoff": 300}},
    "encoder": {"encoder": ENCODER},
    "accelerometer": {"accelerometer": {"noise_density": 3e-3}, **READ},
    "accelerometer.range": {"accelerometer": {"range": 20}, **READ},
    "velocity.estimator = window": {"velocity": {"estimator": "window", "ticks": 5}},
    "velocity.estimator = foaw": {"velocity": {"estimator": "foaw", "ticks": 8, "bound": 1e-5}},
    "velocity.estimator = kalman": {"velocity": {**FILTER, "measurement_noise": 1e-5}},
    "velocity.cutoff": {"velocity": {"cutoff": 100}},
    "acceleration.source = accelerometer": READ,
    "acceleration.source = kalman": {
        "velocity": {**FILTER, "measurement_noise": 1e-5},
        "acceleration": {"source": "kalman"},
    },
    "acceleration.estimator = window": {"acceleration": {"estimator": "window", "ticks": 5}},
    "acceleration.estimator = foaw": {"acceleration": {"estimator": "foaw", "ticks": 5, "bound": 0.01}},
    "acceleration.cutoff": {"acceleration": {"cutoff": 100}},
    "jitter": {"jitter": {"kind": "uniform", "most": 0.001}},
    "loss": {"loss": {"probability": 0.1}},
    "actuator.resolution": {"actuator": {"resolution": 0.01}},
    "actuator.saturation": {"actuator": {"saturation": 5}},
}
BESIDE = {
    "accelerometer.bandwidth": ["accelerometer", "acceleration.source = accelerometer"],
    "accelerometer.delay": ["accelerometer", "acceleration.source = accelerometer"],
    "accelerometer": ["acceleration.source = accelerometer"],
    "accelerometer.range": ["accelerometer", "acceleration.source = accelerometer"],
    "acceleration.source = kalman": ["velocity.estimator = kalman"],
}
EVERYTHING: dict[str, Any] = {
    "wall": {"position": -0.001, "stiffness": 500},
    "dissipation": [{"kind": "damping", "damping": 0.5}, {"kind": "unidirectional-inertia", "mass": 0.005}],
    "hand": {
        "mass": 0.2,
        "stiffness": 80,
        "damping": 4,
        "grip": {"stiffness": 500},
        "force": {"kind": "sine", "offset": -1, "amplitude": 1, "frequency": 5},
    },
    "accelerometer": {"bandwidth": 400, "delay": 0.001, "range": 20, "noise_density": 3e-3},
    "actuator": {"bandwidth": 300, "resolution": 0.01, "saturation": 5},
    "velocity": {"estimator": "window", "ticks": 5, "cutoff": 100},
    "acceleration": {"source": "accelerometer", "cutoff": 100},
    **{key: NAMING[key][key] for key in ("transmission", "friction", "noise", "encoder", "jitter", "loss")},
}
