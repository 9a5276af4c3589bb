"""The Kalman filter: its gain, its errors, its surprises and where its numbers come from."""

import numpy as np
import pytest

from haploop.controller.estimators.kalman import jerk_density_limits, steady_state
from helpers.runs.estimates import CORNER, COUNT, ENCODER, FUSED, JERK, KALMAN, SIGMA, T, estimates, floats
from helpers.scenes.effect_tables import slowly


def test_the_kalman_filter_follows_an_acceleration_without_delay_and_a_jerk_late_by_its_gains():
    """On x = t^3 / 6: a is late by g_v / g_a - T / 2, and 2 / w0 when slow; v by what that leaves behind."""
    t = np.arange(2000) * T
    tables = {"velocity": KALMAN, "acceleration": {"source": "kalman"}}
    v, a = estimates(floats(t * t / 2), **tables)
    assert (v[-1], a[-1]) == (pytest.approx(t[-1], rel=1e-9), pytest.approx(1.0, rel=1e-9))
    (g_x,), (g_v,), (g_a,) = steady_state(JERK, [SIGMA], T)[0]
    v, a = estimates(floats(t**3 / 6), **tables)
    late = g_v / g_a - T / 2
    assert t[-1] - a[-1] == pytest.approx(late, rel=1e-5)
    assert t[-1] ** 2 / 2 - v[-1] == pytest.approx((g_x - g_v * T / 2) / g_a + T * T / 12, rel=1e-4)
    assert late == pytest.approx(2.0 / CORNER, rel=0.15)


def model(period_s: float, jerk_density: float) -> tuple[np.ndarray, np.ndarray]:
    """Step and process noise of x''' = w: exp(A T), and the integral of exp(A s) B B' exp(A' s) S by quadrature."""

    def step(s: float) -> np.ndarray:
        return np.array([[1.0, s, s * s / 2], [0.0, 1.0, s], [0.0, 0.0, 1.0]])

    nodes, weights = np.polynomial.legendre.leggauss(4)
    at = (nodes + 1) / 2 * period_s
    columns = np.array([step(s)[:, 2] for s in at])
    noise = np.einsum("i,ij,ik->jk", weights, columns, columns)
    return step(period_s), noise * period_s / 2 * jerk_density**2


@pytest.mark.parametrize("noises", [[SIGMA], [SIGMA, 0.5], [SIGMA, 0.0], [1e-9, 100.0]])
@pytest.mark.parametrize("corner_Hz", [10.0, 1000.0, *slowly([40.0])])
def test_the_steady_gain_is_where_the_recursion_of_the_textbook_settles(noises, corner_Hz):
    jerk = (2 * np.pi * corner_Hz) ** 3 * noises[0] * np.sqrt(T)
    gain, covariance = steady_state(jerk, noises, T)
    # The recursion as it stands in the textbook keeps its digits in units in which no number is far from 1.
    unit_s, measured = 1 / (2 * np.pi * corner_Hz), [0, 2][: len(noises)]
    units = noises[0] / np.array([1.0, unit_s, unit_s**2])
    gain, covariance = gain * units[measured] / units[:, None], covariance / np.outer(units, units)
    step, process = model(T / unit_s, jerk / noises[0] * unit_s**2.5)
    reads, noise = np.eye(3)[measured], np.diag(np.square(np.array(noises) / units[measured]))
    P, K, settled = process, np.zeros((3, len(noises))), process
    for _ in range(3000):
        K = P @ reads.T @ np.linalg.inv(reads @ P @ reads.T + noise)
        settled = (np.eye(3) - K @ reads) @ P @ (np.eye(3) - K @ reads).T + K @ noise @ K.T
        P = step @ settled @ step.T + process
        P = (P + P.T) / 2.0
    scale = np.sqrt(np.diag(P))
    per_surprise = np.sqrt(np.diag(reads @ P @ reads.T + noise))
    assert gain * per_surprise / scale[:, None] == pytest.approx(K * per_surprise / scale[:, None], rel=1e-6, abs=1e-9)
    assert covariance / np.outer(scale, scale) == pytest.approx(settled / np.outer(scale, scale), rel=1e-6, abs=1e-9)


def test_a_slow_filter_of_positions_has_the_butterworth_gains_and_the_errors_its_docstring_says():
    """Gains T times 2 w0, 2 w0^2, w0^3 and variances 3 w0^3, 2 w0^5 as w0 T -> 0, the difference falling with w0 T."""
    off = []
    for w0 in (20.0, 2.0):
        gain, covariance = steady_state(w0**3 * SIGMA * np.sqrt(T), [SIGMA], T)
        of_gain = gain[:, 0] / (T * np.array([2 * w0, 2 * w0**2, w0**3])) - 1
        of_error = np.diag(covariance)[1:] / (SIGMA**2 * T * np.array([3 * w0**3, 2 * w0**5])) - 1
        off.append(np.abs([*of_gain, *of_error]).max())
    assert off[0] < 0.1
    assert off[1] < 0.15 * off[0]


@pytest.mark.parametrize("place", np.linspace(0.0, 1.0, 5))
@pytest.mark.parametrize("reading_noise", [None, 0.0, 1e-3, 1e3, 1e9])
def test_the_filter_is_stable_wherever_its_jerk_density_may_lie(place, reading_noise):
    noises = [SIGMA] if reading_noise is None else [SIGMA, reading_noise]
    least, most = jerk_density_limits(SIGMA, T)
    jerk = least ** (1.0 - place) * most**place
    gain, covariance = steady_state(jerk, noises, T)
    reads = np.eye(3)[[0, 2][: len(noises)]]
    forgets = model(T, jerk)[0] @ (np.eye(3) - gain @ reads)
    assert np.abs(np.linalg.eigvals(forgets)).max() < 1.0
    assert (np.diag(covariance) >= -1e-12 * np.diag(covariance).max()).all()


def jerky(loops: int, ticks: int, seed: int) -> np.ndarray:
    """States (ticks, 3, loops) of as many masses at rest at first, whose jerk is white noise."""
    rng = np.random.default_rng(seed)
    step, process = model(T, JERK)
    root = np.linalg.cholesky(process)
    states = [np.zeros((3, loops))]
    for _ in range(ticks - 1):
        states.append(step @ states[-1] + root @ rng.normal(size=(3, loops)))
    return np.array(states)


@pytest.mark.parametrize("table", [KALMAN, FUSED])
def test_the_errors_of_the_filter_have_the_covariance_it_predicts(table):
    """On the motion of its model, 20000 loops at once; five standard errors."""
    loops, ticks = 20_000, 120
    rng = np.random.default_rng(3)
    truth = jerky(loops, ticks, 4)
    x = truth[:, 0] + rng.normal(0, SIGMA, (ticks, loops))
    readings = truth[:, 2] + rng.normal(0, FUSED["accelerometer_noise"], (ticks, loops))
    fused = table is FUSED
    v, a = estimates([*x], [*readings] if fused else (), velocity=table, acceleration={"source": "kalman"})
    errors = np.array([v[-1] - truth[-1, 1], a[-1] - truth[-1, 2]])
    _, covariance = steady_state(JERK, [SIGMA, 0.5] if fused else [SIGMA], T)
    P = covariance[1:, 1:]
    spread = np.sqrt((np.outer(np.diag(P), np.diag(P)) + P**2) / loops)
    assert (np.abs(np.cov(errors) - P) < 5 * spread).all()


def test_the_surprises_of_a_well_judged_filter_are_white_and_those_of_a_misjudged_one_are_not():
    """The surprise is a's correction over its gain; correlations of white ones have standard error 1 / sqrt(number)."""
    loops, ticks, settled = 500, 300, 100
    x = jerky(loops, ticks, 5)[:, 0] + np.random.default_rng(6).normal(0, SIGMA, (ticks, loops))

    def correlations(sigma: float) -> np.ndarray:
        table = KALMAN | {"measurement_noise": sigma}
        _, a = estimates([*x], velocity=table, acceleration={"source": "kalman"})
        surprise = np.diff(a, axis=0)[settled:]
        return np.array([(surprise[lag:] * surprise[:-lag]).mean() for lag in (1, 2, 3, 5, 8)]) / surprise.var()

    error = 1 / np.sqrt(loops * (ticks - settled))
    assert np.abs(correlations(SIGMA)).max() < 4 * error
    assert np.abs(correlations(4 * SIGMA)).max() > 20 * error


def test_an_exact_accelerometer_is_believed_and_any_accelerometer_helps():
    x, readings = [0.0, 1e-4, -2e-4, 3e-4], [1.0, -2.0, 0.5, 4.0]
    exact = FUSED | {"accelerometer_noise": 0.0}
    _, a = estimates(x, readings, velocity=exact, acceleration={"source": "kalman"})
    assert a == pytest.approx(readings, rel=1e-6)
    alone = np.diag(steady_state(JERK, [SIGMA], T)[1])
    errors = [np.diag(steady_state(JERK, [SIGMA, noise], T)[1]) for noise in (1e-3, 0.5, 50.0)]
    assert all((better < worse).all() for better, worse in zip(errors, [*errors[1:], alone], strict=True))


def test_noise_that_is_not_given_is_that_of_the_encoder_the_noise_and_the_accelerometer():
    encoder_and_noise = {"encoder": ENCODER, "noise": {"deviation": 4e-6, "cutoff": 200.0}}
    x = np.random.default_rng(7).normal(0, 1e-5, (20, 3))
    readings = np.random.default_rng(8).normal(0, 1.0, (20, 3))
    sensor = {"resolution": 0.06, "noise_density": 0.003, "bandwidth": 250.0, "delay": 0.0, "bias": 0.0, "mount": "tip"}
    table = {"estimator": "kalman", "jerk_density": JERK, "accelerometer": True}
    left_out = estimates([*x], [*readings], velocity=table, accelerometer=sensor, **encoder_and_noise)
    given = table | {
        "measurement_noise": np.hypot(COUNT / np.sqrt(12), 4e-6),
        "accelerometer_noise": np.hypot(0.06 / np.sqrt(12), 0.003 * np.sqrt(np.pi / 2 * 250.0)),
    }
    assert np.array_equal(left_out, estimates([*x], [*readings], velocity=given))
    ideal = estimates([*x], [*readings], velocity=table, **encoder_and_noise)
    assert np.array_equal(ideal, estimates([*x], [*readings], velocity={**given, "accelerometer_noise": 0.0}))
