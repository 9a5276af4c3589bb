"""A cost.json as it might be, made up from the theory of each method, for tests of the code that shows it."""

from haploop.tools.cost.data import AlikeScene, Cost, Errors, Load, Point, ReferenceNote, SceneCost, Spread, Step

RATES = (1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000)
# method -> order, error at 1 kHz in m (0: at the rounding level), yardsticks per tick, and per plant step
METHODS = {
    "exact": (0, 0.0, 25.0, 1.0),
    "semi-implicit-euler": (1, 3e-4, 25.0, 1.6),
    "euler": (1, 6e-4, 25.0, 1.5),
    "rk4": (4, 2e-5, 25.0, 6.0),
    "implicit-midpoint": (2, 8e-5, 25.0, 3.0),
    "dop853": (0, 4e-12, 900.0, 2.0),
}
# scene -> (title, pointwise, the reference's own error in m, how much harder than a smooth one)
SCENES = {
    "wall_steady": ("A wall that steadies", True, 2e-16, 1.0),
    "wall_limit_cycle": ("A wall in a limit cycle", False, 3e-6, 5.0),
    "stick_slip": ("Stick and slip", True, 5e-15, 8.0),
    "stiff_cable": ("A stiff cable", True, 1e-14, 20.0),
    "all_effects": ("All effects at once", True, 4e-13, 10.0),
}
# Half the interval of the mean swing, which the errors of some methods exceed.
DOUBT_M = 1e-4
FAILS = {("stiff_cable", "euler"): 20_000, ("stiff_cable", "rk4"): 5_000, ("stiff_cable", "semi-implicit-euler"): 5_000}


def fake_error(size_m: float, pointwise: bool, doubt_m: float = 0.0) -> Errors:
    """Errors of one size."""
    judged = {"residual": size_m * 1e2}
    if pointwise:
        return Errors(final_m=0.5 * size_m, rms_m=size_m, max_m=3 * size_m, **judged)
    relative = {"amplitude": size_m / 1e-3, "frequency": size_m / 3e-3, "energy_per_cycle": size_m / 5e-4}
    return Errors(**relative, amplitude_m=size_m, doubt_m=doubt_m, **judged)


def fake_point(scene: str, method: str, rate: int) -> Point:
    """A point by theory: error falls with the rate by the method's order, down to rounding."""
    _, pointwise, floor_m, harder = SCENES[scene]
    order, at_1_kHz, tick_us, step_us = METHODS[method]
    steps = rate / 1000
    ratio = tick_us + step_us * steps * (1.0 if pointwise else 0.8)
    time = Spread(ratio, 0.97 * ratio, 1.06 * ratio)
    if rate < FAILS.get((scene, method), 0):
        tick = 3 + rate // 1000
        return Point(
            method, rate, None, f"Diverged: the device was at 3.2 m, beyond the limit of 1 m, at tick {tick}.", time
        )
    size = max(at_1_kHz * harder * steps**-order, 3 * floor_m)
    error = fake_error(size, pointwise, 0.0 if pointwise else DOUBT_M)
    return Point(method, rate, error, None, time)


def fake_alike(scene: str, states: int) -> AlikeScene:
    """Steps of the one-step methods, as dear as they may be."""
    steps = {"exact": 17, "semi-implicit-euler": 12, "euler": 10, "rk4": 50, "implicit-midpoint": 15}
    of_exact = {method: Spread(count / 17, 0.98 * count / 17, 1.03 * count / 17) for method, count in steps.items()}
    return AlikeScene(
        scene,
        states,
        [Step(method, count * states // 2, of_exact[method], of_exact[method]) for method, count in steps.items()],
    )


def fake_cost() -> Cost:
    """Five scenes, six methods, seven rates."""
    scenes = [
        SceneCost(
            name,
            title,
            "exact",
            10_000,
            1_000,
            500,
            ReferenceNote(
                "Solved with 50 digits (mpmath), switching instants found exactly; DOP853 at 1e-13 agrees."
                if pointwise
                else "Chaotic: compared by its swings; solved with 50 digits (mpmath).",
                floor_m,
                pointwise,
            ),
            [fake_point(name, method, rate) for method in METHODS for rate in RATES],
            "Cheapest within 1 µm: exact at 1 kHz.",
        )
        for name, (title, pointwise, floor_m, _) in SCENES.items()
    ]
    versions = {"haploop": "0.1.0", "numpy": "2.1.0", "scipy": "1.14.1", "python": "3.12.3"}
    alike = [fake_alike("wall_steady", 2), fake_alike("stiff_cable", 4)]
    machine = "A fast processor, 2 cores, Linux", versions, "0123456789ab"
    return Cost(*machine, 20, 3, 1e-6, "a tick of a plain wall", Load(4.3, 0.02, 0.9), scenes, [], alike)
