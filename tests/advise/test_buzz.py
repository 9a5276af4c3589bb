"""Why it buzzes: the cause is named right where only one exists."""

from typing import Any

import pytest

from haploop.protocol.scene.paths import with_value
from haploop.tools.advise.buzz import Ablation, Buzz, explain_buzz
from haploop.tools.advise.judge import Judge
from haploop.tools.advise.largest import Limit
from haploop.tools.advise.report import buzz_sentences
from haploop.tools.advise.variations import causes, without_causes
from helpers.scenes.least import KINDS, scene

HAND = {"force": {"kind": "minimum-jerk", "value": -1.0, "rise_time": 0.2}, "stiffness": 20.0, "damping": 0.3}
BASE: dict[str, Any] = {"device": {"mass": 0.05, "damping": 0.2, "position": 1e-3}, "hand": HAND}
LATE = scene(
    **BASE,
    clock={"round_trip_delay": 0.005},
    wall={"position": 0.0, "stiffness": 300.0},
    encoder={"resolution": 1e-6},
)
COARSE = scene(
    **BASE,
    clock={"round_trip_delay": 0.001},
    wall={"position": 0.0, "stiffness": 200.0},
    encoder={"resolution": 5e-5},
    dissipation=[{"kind": "unidirectional-inertia", "mass": 0.03}],
)
# Inertia rendered from an accelerometer at the far end of a cable.
RINGING = scene(
    **BASE,
    wall={"position": 0.0, "stiffness": 200.0},
    encoder={"resolution": 1e-6},
    transmission={"motor_mass": 0.003, "stiffness": 4300.0, "damping": 0.05},
    acceleration={"source": "accelerometer"},
    accelerometer={"mount": "tip"},
    dissipation=[{"kind": "bidirectional-inertia", "mass": 0.02}],
)
# Damping from a velocity that is filtered at 20 Hz, at a rate at which sampling itself does little.
LAGGING = scene(
    device={"mass": 0.05, "damping": 0.05, "position": 1e-3},
    hand={**HAND, "damping": 0.05},
    duration=1.5,
    clock={"control_rate": 5000},
    wall={"position": 0.0, "stiffness": 12000.0},
    encoder={"resolution": 1e-6},
    velocity={"cutoff": 20.0},
    dissipation=[{"kind": "damping", "damping": 6.0}],
)


@pytest.fixture(scope="module")
def late() -> Buzz:
    with Judge(KINDS, workers=1) as judge:
        return explain_buzz(LATE, judge)


@pytest.mark.parametrize(
    ("read", "name"),
    [
        (COARSE, "quantisation"),
        pytest.param(LAGGING, "estimator lag", marks=pytest.mark.slow),
        pytest.param(RINGING, "structural mode", marks=pytest.mark.slow),
    ],
    ids=lambda x: x.replace(" ", "-") if isinstance(x, str) else "",
)
def test_the_one_cause_of_a_buzz_is_named_and_no_other(read, name):
    with Judge(KINDS, workers=1) as judge:
        found = explain_buzz(read, judge)
    assert not found.steady
    assert [w.without for w in found.alone if w.steady and not w.is_element] == [(name,)]
    assert buzz_sentences(found)[0].startswith(f"It buzzes because of the {name}: without it the wall is steady up to")


def test_without_delay_the_wall_of_the_late_loop_is_as_stiff_as_its_damping_allows(late):
    [free] = [w for w in late.alone if w.without == ("delay",)]
    assert free.largest
    assert free.largest.stiffness_N_m == pytest.approx(0.5 / 0.0005, rel=0.05)
    assert late.largest.stiffness_N_m == pytest.approx(0.5 / 0.0055, rel=0.05)


def test_the_shares_of_the_leak_of_a_buzzing_wall_add_up(late):
    assert sum(w.leak_share for w in late.alone if w.leak_share) == pytest.approx(1.0)
    [free] = [w for w in late.alone if w.without == ("delay",)]
    assert free.leak_share
    assert free.leak_share > 0.8


def test_a_wall_that_does_not_buzz_is_told_how_far_it_is_from_it():
    soft = with_value(LATE, "wall.stiffness", 30.0)
    with Judge(KINDS, workers=1) as judge:
        found = explain_buzz(soft, judge)
    assert found.steady
    assert buzz_sentences(found)[0].startswith("It does not buzz: its wall of 0.030 N/mm could be 3.0 times as stiff")


def test_delay_is_named_where_it_is_the_one_cause(late):
    assert not late.steady
    assert [w.without for w in late.alone if w.steady] == [("delay",)]
    assert buzz_sentences(late)[0].startswith("It buzzes because of the delay: without it")


def test_sampling_which_every_loop_has_is_named_after_a_cause_of_its_own_unless_it_allows_twice_as_much():
    def buzz(without_sampling_N_m: float) -> str:
        def without(name: str, stiffness: float) -> Ablation:
            return Ablation((name,), "", None, None, True, "steady", 0.0, Limit(stiffness, stiffness))

        alone = without("sampling and hold", without_sampling_N_m), without("estimator lag", 1000.0)
        return buzz_sentences(Buzz(LATE, 100.0, False, "limit-cycle", 1e-3, Limit(50.0, 51.0), {}, alone, (), None))[0]

    assert "because of the estimator lag" in buzz(1900.0)
    assert "because of the sampling and hold" in buzz(2100.0)


def test_only_what_a_scene_has_can_be_a_cause():
    assert [cause.name for cause in causes(LATE)] == ["sampling and hold", "quantisation", "delay"]
    assert {cause.name for cause in causes(RINGING)} >= {"structural mode", "bidirectional inertia"}


def test_a_rigid_transmission_keeps_mass_and_damping():
    [mode] = [cause for cause in causes(RINGING) if cause.name == "structural mode"]
    rigid = without_causes(RINGING, [mode])
    assert rigid.transmission is None
    assert rigid.device.mass == pytest.approx(0.053)
