"""Cores and scheduling of a node's process, tried in a thread of its own, which alone they change."""

import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from haploop.protocol.transport.node import stay_on

pytestmark = pytest.mark.skipif(not hasattr(os, "SCHED_BATCH"), reason="needs Linux")


def _after(cores: list[int], takes_turns: bool) -> tuple[set[int], int]:
    with ThreadPoolExecutor(1) as thread:
        thread.submit(stay_on, cores, takes_turns).result()
        return thread.submit(lambda: (os.sched_getaffinity(0), os.sched_getscheduler(0))).result()


@pytest.mark.parametrize(("takes_turns", "policy"), [(True, "SCHED_BATCH"), (False, "SCHED_OTHER")])
def test_a_process_that_takes_turns_on_its_core_is_interrupted_by_no_thread_that_a_message_wakes(takes_turns, policy):
    core = min(os.sched_getaffinity(0))
    assert _after([core], takes_turns) == ({core}, getattr(os, policy))


def test_a_core_that_is_not_there_is_let_be():
    before = os.sched_getaffinity(0), os.sched_getscheduler(0)
    assert _after([10_000], True) == before
