"""Elements that give, in mid-run, what is no finite number, or no number at all."""

import math
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError, Motion, registry
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.check import resolve
from haploop.launch.scene.reading.layers import Layers
from haploop.launch.spec import RunFailed
from haploop.logger import read
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import HELD, LEAST

DAMPING = {"kind": "damping", "damping": 0.3}
KINDS = registry()
GIVEN: dict[str, Any] = {"nan": math.nan, "inf": math.inf, "text": "abc", "nothing": None, "list": [1.0]}


def late(name: str, given: Any, after: int = 250, **more: Any) -> type[Element]:
    """Makes a kind of brake that gives something else from its ``after``-th tick on."""

    def force(self: Element, motion: Motion, memory: float) -> Any:
        return (-0.1 * motion.v if memory < after else given), memory + 1.0

    made = {"kind": name, "memory": 0.0, "force": force, "__doc__": "Late."} | more
    return type("Late", (Element,), made)


ASKS: dict[str, Any] = {"asks": ("output_energy",)}
KINDS |= {name: late(name, given) for name, given in GIVEN.items()}
KINDS |= {f"asking-{name}": late(f"asking-{name}", given, **ASKS) for name, given in GIVEN.items()}
KINDS |= {"later-nan": late("later-nan", math.nan, after=1001), "fine": late("fine", math.nan, after=9999)}


def scene(dissipation: list[dict[str, Any]], *events: dict[str, Any], **run: str):
    """A press on a wall for 1.5 s."""
    tables = {
        "duration": 1.5,
        **HELD,
        "dissipation": dissipation,
        "event": list(events),
        "run": {"verdict": "window", **run},
    }
    return resolve(Layers(__file__, {**LEAST, **tables}), KINDS)  # pyright: ignore[reportArgumentType]


def swapped(kind: str, **run: str):
    """Damping, at 0.1 s swapped for an element that fails at 0.35 s."""
    return scene([DAMPING], {"at": 0.1, "swap": {"kind": kind, "acts": "always"}}, **run)


def told(given: Any) -> str:
    what = "a finite number" if isinstance(given, float) else "a number"
    kind = "ValueError" if isinstance(given, float) else "TypeError"
    return f"{kind}: it returned {given!r}, and a force must be {what} (test_faulty_forces.py, line "


@pytest.mark.parametrize("asks", ["", "asking-"])
@pytest.mark.parametrize("name", GIVEN)
def test_what_is_no_finite_number_is_taken_back_in_the_first_second_and_told_with_file_and_line(name, asks, tmp_path):
    kind = asks + name
    summary = run_in_process(swapped(kind), KINDS, out=tmp_path)
    assert summary["ended"] == "done"
    [why] = summary["not_made"]
    assert why.startswith(f"Element 0 ({kind}) gave no force at tick 350: {told(GIVEN[name])}")
    assert why.endswith("The swap is taken back: element 0 becomes damping (damping 0.3).")
    by_hand = scene([DAMPING], {"at": 0.1, "swap": {"kind": "fine", "acts": "always"}}, {"at": 0.35, "swap": DAMPING})
    assert summary["trajectory_sha256"] == run_in_process(by_hand, KINDS)["trajectory_sha256"]
    log = read(tmp_path)
    assert np.isfinite(log["/controller"]["total"]).all()
    assert [event["restored"] for event in log["/events"] if "restored" in event] == [why]


def test_one_that_comes_later_that_was_there_from_the_start_or_is_to_end_the_run_still_ends_it():
    for of in (swapped("later-nan"), scene([{"kind": "nan"}]), swapped("nan", faulty_swap="end")):
        summary = run_in_process(of, KINDS)
        assert (summary["ended"], "not_made" in summary) == ("failed", False)
        assert "gave nan at tick" in summary["why"]


def test_a_new_element_is_not_blamed_for_one_before_it_in_the_list():
    behind = {"at": 0.1, "swap": {"kind": "asking-nan", "acts": "always"}, "element": 1}
    summary = run_in_process(scene([{"kind": "nan"}], behind), KINDS)
    assert (summary["ended"], "not_made" in summary) == ("failed", False)
    assert "element 0 (nan) gave nan at tick 250" in summary["why"]


@pytest.mark.parametrize("name", ["text", "nothing", "list"])
@pytest.mark.parametrize("asks", ["", "asking-"])
def test_what_is_no_number_ends_the_run_with_what_it_is(name, asks):
    with pytest.raises(RunFailed) as failed:
        run_in_process(scene([{"kind": asks + name, "acts": "always"}]), KINDS)
    assert told(GIVEN[name]) in str(failed.value)


def test_two_new_elements_that_fail_in_one_tick_are_both_taken_back():
    events = [{"at": 0.1, "swap": {"kind": "nan", "acts": "always"}, "element": place} for place in (0, 1)]
    summary = run_in_process(scene([DAMPING], *events), KINDS)
    assert summary["ended"] == "done"
    assert [why.split(" gave")[0] for why in summary["not_made"]] == ["Element 0 (nan)", "Element 1 (nan)"]


@pytest.mark.parametrize("kind", ["nan", "inf"])
def test_in_a_batch_it_comes_to_the_same_bits_as_alone(kind):
    of = swapped(kind)
    alone = run_in_process(of, KINDS)
    for summary in run_batch([of] * 16, KINDS, trajectories=True, fewest=2):
        assert summary["trajectory_sha256"] == alone["trajectory_sha256"]
        assert summary["not_made"] == alone["not_made"]


def test_a_member_of_a_batch_whose_new_element_fails_ends_the_batch():
    one = swapped("fine")
    controller = Controller(one, Timebase.from_scene(one), KINDS | {"fine": KINDS["inf"]})
    controller.schedule(0, one.event[0].as_dict())
    x = np.array([0.001, 0.002])
    with pytest.raises(ElementError, match="A force of a member is not a finite number"):
        controller.answer([(x,)] * 300)  # pyright: ignore[reportArgumentType]
