"""An element whose code does not return: at the launcher's signal it is ended by an error that says where it was."""

from __future__ import annotations

import faulthandler
import signal
from types import FrameType

from haploop.controller.active_elements import make_element
from haploop.controller.asked import answer_of
from haploop.controller.dissipation.registry import load_source
from haploop.controller.tick import tick

# Where code of elements is called from, and what it raises becomes a sentence.
_CALLERS = {tick.__code__, answer_of.__code__, make_element.__code__, load_source.__code__}


class DeadlineOver(SystemExit):
    """Raised within an element's code; unlike other errors, it passes ``except Exception``."""


def heed_deadline() -> None:
    """Takes the launcher's signal, SIGUSR1; in the main thread.

    The stack goes to stderr first, also where compiled code lets no Python code run.
    """
    signal.signal(signal.SIGUSR1, _give_up)
    faulthandler.register(signal.SIGUSR1, file=2, all_threads=False, chain=True)


def _give_up(_number: int, frame: FrameType | None) -> None:
    at = frame
    while at is not None and at.f_back is not None and at.f_back.f_code not in _CALLERS:
        at = at.f_back
    if at is not None and at.f_back is not None:
        raise DeadlineOver(f"it was in line {at.f_lineno} of {at.f_code.co_filename} when run.deadline was over")
