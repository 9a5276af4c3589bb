"""Fig. 5: where the sign of the acceleration alternates, inertia generates; and how unidirectional inertia behaves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.protocol.amounts import amount, fixed
from haploop.tools.figure.style import GREY, dress, empty_figure, legend, plain_numbers
from haploop.tools.studies.choi2022 import sampled
from haploop.tools.studies.choi2022.figures.claims import Finding
from haploop.tools.studies.choi2022.figures.drawing import COLOURS, INSIDE, draw_momentum
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.sampled import KINDS, MASS_KG, PERIOD_S, mean_taken, steps_J

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BI, UNI = "bidirectional-inertia", "unidirectional-inertia"
_JITTER_M_S, _DRIFT_M_S = 0.01, 0.05


def make_5(work: Work) -> list[Finding]:
    """Draws momentum over an alternating velocity, its energy sample by sample, and all kinds over frequency."""
    frequencies = np.concatenate([np.geomspace(2.03, 60.7, 20), np.linspace(63.1, 497.3, 60)])
    if work.small:
        frequencies = frequencies[::8]
    theta = 2.0 * np.pi * frequencies * PERIOD_S
    measured = {(kind, late): mean_taken(kind, theta, late) for kind in KINDS for late in (0, 2)}
    figure = empty_figure(14.0, 8.2)
    (momentum, over_samples), over_frequency = figure.subplots(2, 2)
    velocity = _DRIFT_M_S + _JITTER_M_S * np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
    draw_momentum(momentum, velocity, MASS_KG, "The sign alternates every sample")
    momentum.set_ylim(350.0, 650.0)
    books = _over_samples(over_samples)
    for ax, late in zip(over_frequency, (0, 2), strict=True):
        _over_frequency(ax, frequencies, measured, late)
    work.figure(figure, "figure_5")
    named = {f"{kind}_{late}_ticks_late_J_m2".replace("-", "_"): value for (kind, late), value in measured.items()}
    work.data("figure_5", {"frequency_Hz": frequencies, **named, **books})
    ends = {(kind, late): _first_negative(frequencies, measured[kind, late]) for kind, late in measured}
    both = (f"{kind.replace('-', ' ')} {_hertz(ends[kind, 0])} and {_hertz(ends[kind, 2])}" for kind in KINDS[1:])
    supports = all(min(ends[BI, late], ends[UNI, late]) > ends["damping", late] for late in (0, 2))
    work.conclude(supports=supports, ends=", ".join(both))
    return [*_on_alternation(work), *_on_unidirectional(work, frequencies, measured, ends)]


def _over_samples(ax: Axes) -> dict[str, np.ndarray]:
    drawn: dict[str, np.ndarray] = {}
    for kind in (BI, UNI):
        for drift, style, where in ((0.0, "-", "about rest"), (_DRIFT_M_S, (0, (4, 2)), "on 50 mm/s")):
            book = np.cumsum(_taken_under_jitter(kind, drift))
            look = {"color": COLOURS[kind], "linestyle": style, "linewidth": 1.5, "marker": ".", "markersize": 4}
            ax.plot(1e6 * book, label=f"{kind.partition('-')[0]}, {where}", **look)
            drawn[f"{kind}_{where}_J".replace("-", "_").replace(" ", "_").replace("/", "_per_")] = book
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)
    dress(ax, "Energy taken by 10 g of inertia under that jitter", "sample", "energy taken (µJ)")
    legend(ax, loc="lower left", bbox_to_anchor=(0.0, 0.0), ncols=1, **INSIDE)
    return drawn


def _taken_under_jitter(kind: str, drift_m_s: float, ticks: int = 24) -> np.ndarray:
    """Returns the energy of each sample after the first few, under a velocity drift +- jitter with alternating sign."""
    x = sampled.positions(drift_m_s + _JITTER_M_S * (-1.0) ** np.arange(ticks + 4))[:, None]
    taken = sampled.taken_J(x, sampled.forces(x, kind))[:, 0]
    return np.concatenate([[0.0], taken[4:]])


def _over_frequency(ax: Axes, frequencies: np.ndarray, measured: dict[tuple[str, int], np.ndarray], late: int) -> None:
    fine = np.geomspace(2.0, 500.0, 800)
    scale = _unsampled_damper(frequencies)
    for kind in KINDS:
        colour = COLOURS[kind]
        if kind != UNI:
            curve = sampled.closed_form(kind, 2.0 * np.pi * fine * PERIOD_S, late) / _unsampled_damper(fine)
            ax.plot(fine, curve, color=colour, linewidth=1.2)
        look = {"linestyle": "-" if kind == UNI else "none", "linewidth": 0.8, "marker": ".", "markersize": 5}
        ax.plot(frequencies, measured[kind, late] / scale, color=colour, label=kind.replace("-inertia", ""), **look)
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)
    dress(ax, f"From a sine, {late} ms of delay", "frequency (Hz)", "energy taken / that of an unsampled damper")
    ax.set_xscale("log")
    plain_numbers(ax.xaxis)
    ax.set_yscale("symlog", linthresh=0.1, linscale=0.7)
    legend(ax)


def _unsampled_damper(frequencies: np.ndarray) -> np.ndarray:
    """Returns the energy that 0.8 N s/m takes in 1 ms from a sine of 1 m, b omega^2 T / 2."""
    return 0.8 * (2.0 * np.pi * frequencies) ** 2 * PERIOD_S / 2.0


def _on_alternation(work: Work) -> list[Finding]:
    rng = np.random.default_rng(5)
    level = _taken_under_jitter(BI, 0.0)[1:].mean()
    formula = -2.0 * MASS_KG * _JITTER_M_S**2
    kept = [_closed(rng, shortest=2) for _ in range(2000)]
    broken = [_closed(rng, shortest=1) for _ in range(2000)]
    least, leaking = min(map(_cycle_J, kept)), float(np.mean([_cycle_J(v) < 0.0 for v in broken]))
    drifts = (-_DRIFT_M_S, 0.0, _DRIFT_M_S)
    shifts = [_taken_under_jitter(BI, drift)[1:].reshape(-1, 2).sum(axis=1).mean() for drift in drifts]
    return [
        work.claims["alternates"].holds_if(
            abs(level / formula - 1.0) < 1e-9,
            level=amount(level, "J"),
            formula=amount(formula, "J"),
            leaking=100 * leaking,
        ),
        work.claims["three"].holds_if(least >= -1e-15, least=amount(least, "J")),
        work.claims["any_velocity"].holds_if(
            max(shifts) - min(shifts) < 1e-9 * abs(shifts[1]), shifts=", ".join(amount(one, "J") for one in shifts)
        ),
        work.claims["at_rest"].holds_if(level < 0.0, power=amount(level / PERIOD_S, "W")),
    ]


def _closed(rng: np.random.Generator, shortest: int) -> np.ndarray:
    """Returns a random velocity that ends as it began, m/s: tendencies of ``shortest`` changes, or up to 2 more if 2.

    It is returned with its first three values again, so that every step of the cycle has its past.
    """
    tendencies = 2 * int(rng.integers(1, 5))
    changes = []
    for number in range(tendencies):
        length = shortest + (int(rng.integers(0, 3)) if shortest > 1 else 0)
        changes.append((-1) ** number * rng.uniform(0.1, 1.0, length))
    up, down = sum(part.sum() for part in changes[::2]), -sum(part.sum() for part in changes[1::2])
    changes = [part if number % 2 == 0 else part * (up / down) for number, part in enumerate(changes)]
    v = np.concatenate([[0.0], np.cumsum(np.concatenate(changes))])[:-1]
    return 0.01 * np.concatenate([v, v[:3]])


def _cycle_J(v: np.ndarray) -> float:
    period = len(v) - 3
    return float(steps_J(np.tile(v[:period], 2), MASS_KG)[period:].sum())


def _on_unidirectional(
    work: Work,
    frequencies: np.ndarray,
    measured: dict[tuple[str, int], np.ndarray],
    ends: dict[tuple[str, int], float],
) -> list[Finding]:
    ratio = measured[UNI, 0] / measured[BI, 0]
    until = _first_negative(frequencies, ratio - 1.0)
    at = int(np.argmin(np.abs(frequencies - 20.0)))
    rest, drift = (float(_taken_under_jitter(UNI, one)[1:].mean()) for one in (0.0, _DRIFT_M_S))
    sines = {"5 Hz": 5.1, "20 Hz": 20.3, "50 Hz": 50.7, "100 Hz": 101.0, "200 Hz": 201.3}
    back = {name: sampled.returned(hertz) for name, hertz in sines.items()}
    at_once = abs(sampled.returned(50.7, before=False))
    up_to = "; ".join(
        how + " " + ", ".join(f"{kind.partition('-')[0]} {_hertz(ends[kind, late])}" for kind in KINDS)
        for late, how in ((0, "without delay"), (2, "with 2 ms"))
    )
    return [
        work.claims["only_stored"].holds_if(
            False, True, shares=", ".join(f"{100 * share:.2g} % at {name}" for name, share in back.items())
        ),
        work.claims["before"].holds_if(at_once >= back["50 Hz"], before=100 * back["50 Hz"], present=100 * at_once),
        work.claims["pure"].holds_if(
            not np.isfinite(ends[UNI, 2]), True, undelayed=_hertz(ends[UNI, 0]), delayed=_hertz(ends[UNI, 2])
        ),
        work.claims["more"].holds_if(
            until > 0.0 and not np.isfinite(until),
            until > 0.0,
            hertz=frequencies[at],
            times=fixed(float(ratio[at])),
            slow=frequencies[4],
            slow_times=fixed(float(ratio[4])),
            until=_hertz(until),
        ),
        work.claims["chatter"].holds_if(
            False, rest >= 0.0, rest=amount(rest, "J") if rest else "nothing", drift=amount(drift, "J")
        ),
        work.claims["higher"].holds_if(min(ends[BI, 0], ends[UNI, 0]) > ends["damping", 0], ends=up_to),
    ]


def _first_negative(frequencies: np.ndarray, taken: np.ndarray) -> float:
    """Returns the frequency from which on it gives, between two that were tried; 0 if at the first, else infinite."""
    negative = taken < -1e-9 * np.abs(taken).max()
    if not negative.any() or negative[0]:
        return 0.0 if negative[0] else np.inf
    after = int(np.argmax(negative))
    last, first = taken[after - 1], taken[after]
    return float(np.interp(0.0, [first, last], [frequencies[after], frequencies[after - 1]]))


def _hertz(value: float) -> str:
    return "none" if not value else f"{value:.0f} Hz" if np.isfinite(value) else "500 Hz"
