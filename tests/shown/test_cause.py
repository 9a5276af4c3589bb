"""The likely cause of a swing in the report: the part without which the loop rests, and what fed the run."""

from __future__ import annotations

import re
from typing import Any

import pytest

from haploop.logger.cause import cause
from haploop.tools.render.report import summary_table
from helpers.shown import shown


@pytest.mark.parametrize(("verdict", "is_told"), [("steady", False), ("limit-cycle", True), ("growing", True)])
def test_without_trials_what_fed_a_swing_is_told_of_what_swings_alone_and_is_not_called_its_cause(
    swap: dict[str, Any], verdict: str, is_told: bool
) -> None:
    without_trials = {**swap, "verdict": verdict, "stability": swap["stability"] | {"without": None}}
    text = " ".join(shown(summary_table(without_trials)).split())
    assert (cause(swap["energy"]) in text) == is_told
    assert "Likely cause" not in text
    hardly_fed = {**without_trials, "energy": swap["energy"] | {"moved_J": 1e6}}
    assert cause(swap["energy"]) not in " ".join(shown(summary_table(hardly_fed)).split())


def test_of_a_hand_that_presses_harder_than_the_wall_holds_no_energy_is_said_to_be_the_cause(
    swap: dict[str, Any],
) -> None:
    pressed = {**swap, "verdict": "diverged", "stability": swap["stability"] | {"without": {}}}
    text = " ".join(shown(summary_table(pressed)).split())
    assert "Likely cause: the hand, which presses harder than" in text
    assert "the wall gave the device" not in text


def test_the_books_of_a_run_that_was_changed_in_its_last_window_do_not_stand_beside_its_cause(
    swap: dict[str, Any],
) -> None:
    stability = swap["stability"] | {"without": {"delay": "rests"}}
    for changed_s, stands in ((None, True), (2.9, False)):
        window = swap["window"] | {"changed_s": changed_s}
        of = {**swap, "verdict": "limit-cycle", "stability": stability, "window": window}
        assert ("According to the books" in " ".join(shown(summary_table(of)).split())) == stands


@pytest.mark.parametrize(
    ("without", "told"),
    [
        ({"delay": "rests", "friction": "swings on"}, "delay."),
        ({"delay": "undecided", "friction": "rests"}, "friction."),
        (
            {"delay": "rests", "friction": "swings on", "element 0 (damping)": "rests"},
            "delay and element 0 (damping) together: it rests as soon as one of them is left out.",
        ),
        (
            {"delay": "swings on", "friction": "swings on", "all": "rests"},
            "no single part, since it swings whichever one is left out.",
        ),
        ({"delay": "swings on", "friction": "swings on", "all": "swings on"}, "not found by these trials; what they"),
        ({"delay": "swings less", "friction": "swings on"}, "mostly delay."),
        ({"delay": "swings less", "friction": "rests"}, "friction."),
        ({"delay": "swings within its limit", "friction": "swings on"}, "mostly delay."),
        (
            {"delay": "swings within its limit", "hold": "swings within its limit"},
            "delay and hold together: taking out any one of them keeps it within its limit.",
        ),
        ({"delay": "swings less", "hold": "swings less"}, "delay and hold, either of which makes most of it."),
        ({"delay": "rests", "element 0 (damping)": "swings otherwise"}, "delay."),
        ({"friction": "swings on"}, "not found by these trials; what they leave"),
        ({"delay": "swings on", "friction": "undecided", "all": "rests"}, "not determined by these trials."),
        ({"delay": "swings on", "friction": "swings on", "all": "undecided"}, "not determined by these trials."),
    ],
)
def test_the_part_without_which_a_loop_rests_is_its_likely_cause_with_every_trial_and_the_books_beside_it(
    swap: dict[str, Any], without: dict[str, str], told: str
) -> None:
    stability = swap["stability"] | {"without": without}
    text = " ".join(shown(summary_table({**swap, "verdict": "limit-cycle", "stability": stability})).split())
    assert f"Likely cause: {told}" in text
    assert ("rests without delay" in text) == (without.get("delay") == "rests")
    assert ("is undecided without all of these at once" in text) == (without.get("all") == "undecided")
    for name, does in without.items():
        assert re.search(rf"{does.split()[0]} [^;]*without [^;]*{re.escape(name).replace('all', 'all of')}", text)
    assert cause(swap["energy"], "According to the books of the whole run") in text


def test_a_loop_that_was_not_tried_without_its_parts_is_said_not_to_have_been(swap: dict[str, Any]) -> None:
    def text(verdict: str, stability: dict[str, Any]) -> str:
        return " ".join(shown(summary_table({**swap, "verdict": verdict, "stability": stability})).split())

    untried = swap["stability"] | {"without": None}
    assert "No part is named: none was tried, or the loop, started anew" in text("limit-cycle", untried)
    assert "No part is named" not in text("steady", untried)
    assert "No part is named" not in text("limit-cycle", untried | {"without": {"delay": "rests"}})
    assert "No part is named" not in text("swinging", {})


def energy(*elements: tuple[str, float], **leak: float) -> dict[str, Any]:
    causes = dict.fromkeys(("delay_J", "sampling_and_hold_J", "quantisation_J"), 0.0) | leak
    booked = [{"kind": kind, "true_J": true_J} for kind, true_J in elements]
    return {"elements": booked, "wall": {"true_J": -1e-2, "leak": {"total_J": sum(causes.values()), **causes}}}


@pytest.mark.parametrize(
    ("books", "told"),
    [
        (energy(delay_J=-2e-3, sampling_and_hold_J=-1e-3), "3.00 mJ more than an ideal one would have, 67 % of it"),
        (energy(delay_J=1e-3, sampling_and_hold_J=-2e-3), "held for a tick"),
        (  # its first force comes after the end
            {**energy(), "wall": {**energy(delay_J=-2e-3)["wall"], "true_J": 0.0}},
            "the wall moved no energy at all: the motion here is not fed by it",
        ),
        (energy(quantisation_J=-1e-6), "100 % of it because the encoder rounds"),
        (energy(delay_J=-1e-3, sampling_and_hold_J=2e-3), "no more energy than an ideal one would"),
        (energy(), "no more energy than an ideal one would"),
        (energy(("damping", 3e-3), delay_J=-2e-3), "2.00 mJ more than an ideal one would"),
        (energy(("damping", -1e-3), delay_J=-2e-3), "2.00 mJ more than an ideal one would"),
        (energy(("damping", -3e-3), ("inertia", -1e-3), delay_J=-2e-3), "damping gave the device 3.00 mJ, more"),
        (energy(delay_J=-2e-3) | {"actuator_J": 1.5e-3}, "the actuator's limits kept 1.50 mJ of it back"),
        (energy(("damping", -3e-3)) | {"actuator_J": 1.5e-3}, "the actuator's limits kept 1.50 mJ of it back"),
        (energy(delay_J=-2e-3) | {"actuator_J": 1e-5}, "the device moves out."),
        ({"elements": [], "wall": {}}, ""),
    ],
)  # fmt: skip
def test_the_cause_is_what_gave_the_device_most(books: dict[str, Any], told: str) -> None:
    assert told in cause(books)
    assert bool(cause(books)) == bool(told)
