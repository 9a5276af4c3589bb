"""Loops that rest at one place within an encoder's count and chatter at the next: steady only where friction holds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from haploop.launch.scene.file import load
from haploop.launch.stability.judge import judge
from haploop.launch.stability.looks import LOOKS_S
from haploop.launch.stability.still_hand import deeper_holds
from haploop.protocol.scene.effects import Actuator, Grip
from haploop.protocol.scene.hand_force import Constant
from haploop.protocol.scene.scene import Encoder, Hand, Scene
from haploop.protocol.walls.hunt_crossley import HuntCrossley
from haploop.protocol.walls.wall import Spring
from helpers.runs.judged import ended, found
from helpers.scenes.least import scene

COUNT_M = 2e-5


def premium(stiffness: float, *sets: str) -> Scene:
    """A PHANToM Premium 1.5 behind 2 ms of delay, held against a damped wall."""
    damped = ("event=[]", 'dissipation=[{kind="damping", damping=0.5}]')
    return load("demo", [*damped, "duration=0.8", f"wall.stiffness={stiffness}", *sets])


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [583.0, 950.0])
def test_without_friction_it_is_not_steady_and_held_a_part_of_a_count_deeper_it_chatters_so_that_a_hand_feels_it(
    stiffness: float,
) -> None:
    of = replace(premium(stiffness), friction=None)
    end = ended(of)
    assert judge(end, LOOKS_S).word == "steady"
    told = judge(end, LOOKS_S, thorough=True)
    assert (told.word, told.deeper) == ("undecided", "swings on")
    assert (
        f"Held {told.deeper_N:.2g} N harder, by a part of a count or of a step of the force, it swings on."
        in told.sentence()
    )
    assert of.hand
    assert told.deeper_N
    harder = found(replace(of, hand=replace(of.hand, force=Constant(value=end.hold_N - told.deeper_N))))
    assert (harder.word, harder.felt) == ("limit-cycle", True)


@pytest.mark.slow
def test_friction_of_0_is_none() -> None:
    told = judge(ended(premium(583.0, "friction.kinetic=0")), LOOKS_S, thorough=True)
    assert (told.word, told.frictionless, told.deeper) == ("undecided", None, "swings on")


@pytest.mark.slow
def test_what_rests_at_all_places_within_a_count_is_steady_and_says_so() -> None:
    told = judge(ended(replace(premium(320.0), friction=None)), LOOKS_S, thorough=True)
    assert (told.word, told.deeper) == ("steady", "rests")
    assert told.sentence().endswith("It also does so held harder by parts of a count, or of a step of the force.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "does"), [(200.0, "rests"), (583.0, "swings on a part of a count deeper"), (850.0, "swings on")]
)
def test_where_friction_alone_holds_it_at_any_place_within_a_count_that_is_said_beside_steady(
    stiffness: float, does: str
) -> None:
    told = judge(ended(premium(stiffness)), LOOKS_S, thorough=True)
    assert (told.word, told.frictionless, told.deeper) == ("steady", does, None)
    assert told.entries()["stability"]["provisos"] == ["only friction holds it"] * (does != "rests")


@pytest.mark.parametrize("hold_N", [-1.2, 1.2])
def test_a_spring_is_held_deeper_by_its_own_force_and_that_of_the_hand_on_the_way(hold_N: float) -> None:
    """(K + k) q / 3 and twice that, where k is the hand's stiffness in series with its grip's."""
    hand = Hand(stiffness=100.0, grip=Grip(stiffness=300.0))
    of = replace(scene(), encoder=Encoder(resolution=COUNT_M), hand=hand)
    holds = deeper_holds(of, Spring(0.0, 900.0, -1.0 if hold_N < 0.0 else 1.0), hold_N)
    more_N = (900.0 + 100.0 * 300.0 / 400.0) * COUNT_M / 3.0
    assert [abs(hold) - abs(hold_N) for hold in holds] == pytest.approx([more_N, 2.0 * more_N], rel=1e-9)
    assert all(hold * hold_N > 0.0 for hold in holds)


def test_another_wall_is_held_deeper_by_what_it_answers_there() -> None:
    """V' = k p^1.5 with k = K / p_r^0.5, so that a hold of F lies (F / k)^(2/3) deep."""
    of, k = replace(scene(), encoder=Encoder(resolution=COUNT_M), hand=Hand()), 900.0 / 1e-3**0.5
    wall = HuntCrossley(0.0, 900.0, -1.0, damping_factor=1.0, exponent=1.5, depth=1e-3)
    depth_m = (1.2 / k) ** (2.0 / 3.0)
    more_N = k * ((depth_m + COUNT_M) ** 1.5 - depth_m**1.5) / 3.0
    assert [-1.2 - hold for hold in deeper_holds(of, wall, -1.2)] == pytest.approx([more_N, 2.0 * more_N], rel=1e-9)


def test_without_counts_or_without_a_wall_nothing_is_held_deeper() -> None:
    of = replace(scene(), encoder=None)
    assert deeper_holds(of, Spring(0.0, 900.0, -1.0), -1.0) == []
    assert deeper_holds(replace(of, encoder=Encoder(resolution=COUNT_M)), Spring(0.0, 0.0, -1.0), -1.0) == []


def test_without_an_encoder_it_is_held_harder_by_parts_of_a_step_of_the_force() -> None:
    of = replace(scene(), encoder=None, actuator=Actuator(resolution=0.03))
    assert deeper_holds(of, Spring(0.0, 900.0, -1.0), -1.0) == pytest.approx([-1.01, -1.02], rel=1e-12)


@pytest.mark.slow
def test_what_rests_at_one_place_within_a_step_of_the_force_and_swings_at_the_next_is_not_steady() -> None:
    """An independent program saw it swing at a quarter of a step more."""
    push = {"kind": "ramp", "value": -1.0, "rise_time": 0.3}
    of = scene(
        clock={"round_trip_delay": 0.0007}, device={"mass": 0.1, "damping": 0.05}, duration=3.0,
        hand={"mass": 0.02, "damping": 3.0, "stiffness": 30.0, "force": push},
        wall={"position": -1e-3, "stiffness": 5181.24728213178}, actuator={"resolution": 0.03},
        dissipation=[{"kind": "damping", "damping": 10.064019785071272}],
    )  # fmt: skip
    end = ended(of)
    assert judge(end, LOOKS_S).word == "steady"
    assert judge(end, LOOKS_S, thorough=True).word == "undecided"
