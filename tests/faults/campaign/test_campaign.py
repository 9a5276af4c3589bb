"""A few seeds of ``make faults``, and that it tells a promise that is broken."""

import os
import signal

import pytest
from faults.campaign import command

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def place_of_its_own(monkeypatch):
    """Every seed sets the place of its live runs; the test's own is put back."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", "")


@pytest.mark.parametrize("seed", range(5))
def test_a_real_run_that_is_struck_keeps_what_is_promised(seed):
    _kinds, why, _took_s = command.play(seed)
    assert not why


def test_a_run_that_fails_with_no_excuse_is_told(monkeypatch):
    def kill(played, dice, _live):
        os.kill(played.draw_node(dice)[1], signal.SIGKILL)

    monkeypatch.setattr(command, "KINDS", ("a node killed", "`haploop status`"))
    monkeypatch.setattr(command, "_SETS", ("duration=60", "run.verdict=window"))
    monkeypatch.setitem(command.STRIKES, "a node killed", kill)
    kinds, why, _took_s = command.play(1)
    assert "a node killed" in kinds
    assert "status 1 with no excuse" in why
