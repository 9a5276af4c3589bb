"""A lossy node hears everything it keeps up with, knows what it missed, and never costs the loop anything."""

import numpy as np
import pytest

from haploop.logger import read
from haploop.protocol.transport.clock_client import ClockClient
from haploop.protocol.transport.observer import Observer
from helpers.live.live_run import going, undisturbed
from helpers.live.waiting import wait_for

ALL = ("plant", "controller", "logger")


def receive_all(observer, until=ALL):
    """Every message up to the end of each stream."""
    frames = []
    while not set(until) <= observer.ended.keys():
        observer.wait(200)
        frames += observer.poll()
    return frames


def join_blocks(frames, name, column, steps=1):
    """One column of all blocks of a kind, end to end; the plant's without the state two blocks share."""
    parts = []
    for _, frame in frames:
        if frame.name == name:
            block = frame.as_dict()
            parts.append(np.frombuffer(block["columns"][column], "<f8")[: block["ticks"] * steps])
    return np.concatenate(parts)


def views(subject):
    """What the clock knows of the viewers."""
    return [node for node in subject.ask("status")[1]["nodes"] if node["role"] == "view"]


@pytest.mark.slow
def test_an_observer_hears_every_tick_of_all_three_streams_and_every_event_at_its_tick(tmp_path):
    with going(tmp_path, "duration=3", pauses=(7,)) as subject:
        subject.stands_at(7)
        context = subject.live.make_context()
        observer = Observer(context, "print", subject.live.clock, ALL)
        try:
            while len([None for _, f in observer.poll() if f.name == "STATE"]) < len(ALL):
                observer.wait(200)
                if observer.tick == 7:
                    break
            subject.ask("set", set={"wall.stiffness": 200.0})
            subject.ask("resume")
            frames = receive_all(observer)
            events = observer.take_events()
        finally:
            context.destroy(linger=0)
        subject.result()
    log = read(subject.prepared.out)
    assert observer.skipped == dict.fromkeys(ALL, 0)
    assert np.array_equal(join_blocks(frames, "PLANT_BLOCK", "x", 10), log["/plant"]["x"][70:-1])
    assert np.array_equal(join_blocks(frames, "CONTROLLER_BLOCK", "total"), log["/controller"]["total"][7:])
    assert np.array_equal(join_blocks(frames, "ENERGY_BLOCK", "wall.true"), log["/energy"]["wall.true"][7:])
    assert [(tick, next(key for key in event if key != "at")) for tick, event in events] == [
        (7, "pause"), (7, "set"), (7, "resume"),
    ]  # fmt: skip


@pytest.mark.slow
def test_one_that_does_not_listen_costs_the_run_no_bit_and_is_told_what_it_missed(tmp_path):
    """Blocks so short that there are far more of them than any queue holds."""
    with going(tmp_path, "duration=2", "run.block_ticks=1", pauses=(7, 1900)) as subject:
        subject.stands_at(7)
        context = subject.live.make_context()
        observer = Observer(context, "view", subject.live.clock, ALL)
        try:
            while observer.tick < 7:
                observer.wait(200)
                observer.poll()
            subject.ask("resume")
            subject.stands_at(1900)
            for _ in range(10):  # it wakes up, and takes what its queues still hold
                observer.wait(50)
                observer.poll()
            subject.ask("resume")
            receive_all(observer)
        finally:
            context.destroy(linger=0)
        summary = subject.result()
    assert min(observer.skipped.values()) > 1000
    assert summary["trajectory_sha256"] == undisturbed(subject.prepared)["trajectory_sha256"]
    assert summary["lost"]["telemetry_gaps"] == 0


def test_status_shows_an_observer_with_its_tick_its_lag_and_what_it_skipped(tmp_path):
    with going(tmp_path, "duration=600", pauses=(300,)) as subject:
        subject.stands_at(300)
        context = subject.live.make_context()
        observer = Observer(context, "view", subject.live.clock, ALL)
        try:

            def rows(tick=300):
                observer.wait(50)
                observer.poll()
                return [node for node in views(subject) if node["tick"] == tick]

            [row] = wait_for("the observer at tick 300", rows)
            assert (row["skipped_ticks"], row["behind_ticks"], row["lossless"]) == (0, 0, False)
            observer.leave()
            wait_for("its leaving", lambda: not views(subject))
        finally:
            context.destroy(linger=0)
        subject.ask("stop")
        assert subject.result()["ended"] == "stopped"


@pytest.mark.slow
def test_one_the_clock_has_dropped_joins_again_by_itself_and_hears_each_event_once(tmp_path):
    with going(tmp_path, "duration=600", pauses=(300,)) as subject:
        subject.stands_at(300)
        context = subject.live.make_context()
        observer = Observer(context, "view", subject.live.clock, ALL)
        try:
            events = []

            def hears(verbs):
                observer.wait(50)
                observer.poll()
                events.extend(next(key for key in event if key != "at") for _, event in observer.take_events())
                return events == verbs and len(views(subject)) == 1

            wait_for("the first event", lambda: hears(["pause"]))
            # As if the clock had taken it off: the next report is refused.
            observer.client.leave("LEAVE", 300)
            observer.client = ClockClient(context, "view", subject.live.clock, "")
            subject.ask("set", set={"wall.stiffness": 200.0})
            wait_for("both events, each once", lambda: hears(["pause", "set"]))
            for _ in range(20):
                assert hears(["pause", "set"]), "nothing is heard twice"
        finally:
            context.destroy(linger=0)
        subject.ask("stop")
        subject.result()
