"""Sentences about a process that did not answer, against what the system tells of it."""

import pytest

from haploop.launch.processes import strain
from haploop.launch.processes.strain import NOBODY, Strain


@pytest.fixture(autouse=True)
def quiet(monkeypatch) -> None:
    monkeypatch.setattr(strain.os, "getloadavg", lambda: (0.1, 0.1, 0.1))


@pytest.mark.parametrize(
    ("state", "used_s", "words"),
    [
        ("T", 0.0, "It is stopped"),
        ("D", 0.0, "waiting for a disk"),
        ("R", 0.02, "got almost no processor time"),
        ("R", 2.4, "working the whole time"),
        ("R", 0.8, ""),
        ("S", 0.0, ""),
        ("", 0.0, ""),
    ],
)
def test_a_silent_process_is_told_to_be_stopped_starved_or_at_work_where_it_is(state, used_s, words):
    """Seen first at half of a deadline of 5 s, with 7 s of processor time used before."""
    looks = iter([("R", 7.0), (state, 7.0 + used_s)])
    subject = Strain(lambda pid: next(looks))
    subject.note(1, heard=10.0, now=12.5)
    subject.note(1, heard=10.0, now=13.0)  # the same silence: nothing new
    told = subject.told(1, now=15.0)
    assert (words in told) if words else not told


def test_of_a_process_on_another_host_nothing_is_told_but_that_this_machine_was_busy(monkeypatch):
    monkeypatch.setattr(strain.os, "cpu_count", lambda: 2)
    for load, said in ((6.0, ""), (20.2, " The machine was busy: load average 20 on 2 cores.")):
        monkeypatch.setattr(strain.os, "getloadavg", lambda load=load: (load, 0.0, 0.0))
        subject = Strain()
        subject.note(NOBODY, heard=1.0, now=2.0)
        assert subject.told(NOBODY, now=3.0) == said
