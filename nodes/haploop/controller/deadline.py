"""An element whose code does not return: at the launcher's signal an error ends it and says where it was."""

from __future__ import annotations

import faulthandler
import signal
from types import FrameType

from haploop.controller.active_elements import make_element
from haploop.controller.asked import answer_of
from haploop.controller.dissipation.registry import load_source
from haploop.controller.tick import tick

# The functions that call code of elements and turn what it raises into a sentence.
_CALLERS = {tick.__code__, answer_of.__code__, make_element.__code__, load_source.__code__}


class DeadlineOver(SystemExit):
    """Raised within an element's code; unlike other errors, it passes ``except Exception``."""


def heed_deadline() -> None:
    """Installs the handlers of the launcher's signals; to be called in the main thread.

    At SIGUSR1 the element's code is ended. SIGUSR2 comes later if that did not help, since compiled code lets no Python
    code run: the stack then goes to stderr.
    """
    signal.signal(signal.SIGUSR1, _give_up)
    faulthandler.register(signal.SIGUSR2, file=2, all_threads=False)


def _give_up(_number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code in _CALLERS:
            raise DeadlineOver("it did not finish within run.deadline")
        frame = frame.f_back
