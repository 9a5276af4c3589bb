"""Trial of a plugin in a separate process: whatever it does to that process, here it is a sentence.

This process never runs the file. What it needs of it, the declared parameters, it gets as a stand-in for each element.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Generator, Iterable, Mapping
from pathlib import Path
from typing import Any, Self

from haploop.controller.dissipation.element import Element, ElementError, hint_of
from haploop.controller.dissipation.registry import PluginError
from haploop.launch.one_thread import ask_for_one_thread
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.scene import ElementTable

# Limit for loading the file, and for making its elements: what a large library may take to import on a busy machine.
LIMIT_S = 10.0
_LARGEST = 1 << 20
_LOOK_S = 0.05
Kinds = dict[str, type[Element]]
Steps = Generator[None, None, Any]


class StandIn(Element):
    """An element as its file declares it, without its code."""

    def force(self, *args: Any, **kwargs: Any) -> Any:
        raise ElementError(f"{self.kind} is the declaration of an element; it has no force here.")


def read_source(path: Path) -> str:
    """Returns the text of a plugin file; raises PluginError if it is not a file, too large, or not text."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) or status.st_size > _LARGEST:
            raise PluginError(f"The plugin {path} does not load: a Python file of at most 1 MiB was expected.")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise PluginError(f"The plugin {path} does not load: there is no such file.") from error
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        raise PluginError(f"The plugin {path} does not load: {why}.") from error


class PluginTrial:
    """A plugin in a separate process, which ends with this object, a context manager.

    ``load`` and ``make`` are generators, so that a clock can go on meanwhile: they yield until the answer is there.

    Attributes:
        brings: whether the file also has walls, estimators or hand forces; known once it is loaded.
    """

    brings = False

    def __init__(self, source: str, origin: str, limit_s: float = LIMIT_S) -> None:
        self._source, self._origin, self._limit_s = source, origin, limit_s
        environment = {**os.environ}
        ask_for_one_thread(environment)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "haploop.controller.trial"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            process_group=0,
            env=environment,
        )
        assert self._process.stdin
        assert self._process.stdout
        self._in, self._out = self._process.stdin.fileno(), self._process.stdout.fileno()
        os.set_blocking(self._in, False)
        os.set_blocking(self._out, False)

    def load(self) -> Generator[None, None, Kinds]:
        """Loads the file; returns a stand-in for each element, by kind.

        Raises PluginError if it does not load, ends its process, or does not finish within the limit.
        """
        when = "while it was being loaded"
        reply = yield from self._ask({"source": self._source, "origin": self._origin}, when, PluginError)
        self.brings = reply.get("brings") is True
        try:
            return {kind: _stand_in(kind, declared) for kind, declared in reply["kinds"].items()}
        except (LookupError, TypeError, ValueError, AttributeError):
            raise PluginError(self._forged(when)) from None

    def make(self, elements: Iterable[ElementTable]) -> Steps:
        """Makes elements from resolved tables and a force at rest from each; raises ElementError as ``load`` does."""
        asked = [[element.name, dict(element.parameters)] for element in elements]
        names = " and ".join(f"the element {name}" for name, _ in asked)
        if asked:
            yield from self._ask({"make": asked}, f"while {names} was being made and tried at rest", ElementError)

    def _ask(self, request: Mapping[str, Any], when: str, kind: type[Exception]) -> Generator[None, None, Any]:
        to_send, answer = json.dumps(request).encode() + b"\n", b""
        give_up = time.monotonic() + self._limit_s
        while not answer.endswith(b"\n"):
            with contextlib.suppress(BlockingIOError, BrokenPipeError):
                to_send = to_send[os.write(self._in, to_send) :] if to_send else to_send
            with contextlib.suppress(BlockingIOError):
                data = os.read(self._out, 1 << 16)
                answer += data
                if not data or len(answer) > _LARGEST:
                    raise kind(f"The plugin {self._origin} ended the process it was tried in {when}: {self._end()}.")
            if time.monotonic() > give_up:
                raise kind(f"The plugin {self._origin} was stopped: it took longer than {self._limit_s:g} s {when}.")
            yield
        try:
            reply = json.loads(answer)
        except (ValueError, RecursionError):
            raise kind(self._forged(when)) from None
        if not isinstance(reply, dict):
            raise kind(self._forged(when))
        if "error" in reply:
            raise kind(str(reply["error"]))
        return reply

    def _forged(self, when: str) -> str:
        return f"The plugin {self._origin} answered in place of the process it was tried in {when}."

    def _end(self) -> str:
        try:
            code = self._process.wait(timeout=1.0)
        except subprocess.TimeoutExpired:
            return "it closed its output"
        return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"

    def wait(self, steps: Generator[None, None, Any]) -> Any:
        """Runs steps of this trial to their end, with nothing else to do; returns what they return."""
        while True:
            try:
                next(steps)
            except StopIteration as done:
                return done.value
            select.select([self._out], [], [], _LOOK_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Ends the process and those it has started, unless they have left its group."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                with contextlib.suppress(OSError):
                    pipe.close()


def _stand_in(kind: str, declared: Mapping[str, Any]) -> type[Element]:
    parameters = declared["parameters"]
    quantities = {name: Quantity(**of | {"choices": tuple(of["choices"])}) for name, of in parameters.items()}
    defaults = declared["defaults"]
    annotations = {name: hint_of(quantity) for name, quantity in quantities.items()}
    about = {"__doc__": declared["about"], "__module__": __name__, "__annotations__": annotations}
    says = {"kind": kind, "linear": declared["linear"], "limits": declared["limits"]}
    return type(declared["name"], (StandIn,), about | defaults | says)
