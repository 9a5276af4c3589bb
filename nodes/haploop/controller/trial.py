"""A process in which a plugin is tried before anything depends on it: ``python -m haploop.controller.trial``.

Every line of stdin is a JSON object, answered by one on the original stdout. ``source`` and ``origin`` of a file are
answered by ``kinds``, the elements it declares, and ``brings``, whether it holds anything else; ``make``, a list of
kinds and parameters, by ``made``; a failure by ``error``, a sentence. The process ends with the one that started it,
and has a memory limit; the other side sets a time limit.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import queue
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from haploop.controller.active_elements import make_element
from haploop.controller.dissipation.element import ASKABLE, Element, ElementError, Motion, as_number, place_in, raised
from haploop.controller.dissipation.registry import PluginError, load_source
from haploop.protocol.installed import all_brought
from haploop.protocol.quantity import MEANT
from haploop.protocol.scene.scene import ElementTable
from haploop.protocol.transport.prints import keep_prints

_MOST_BYTES = 4 << 30
_MOST_CPU_S = 120
Reply = dict[str, Any]


def main() -> None:
    """Answers requests until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    keep_prints("trial", Path(os.devnull))  # what the file prints, it prints again where it is used
    _limit_memory()
    requests: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin, requests), daemon=True).start()
    sys.stdin = Path(os.devnull).open()  # noqa: SIM115 (code that asks for input gets none)
    kinds: dict[str, type[Element]] = {}
    origin = ""
    while True:
        request = json.loads(requests.get())
        origin = request.get("origin", origin)
        try:
            reply = _load(request, kinds) if "source" in request else _make(request["make"], kinds)
        except (PluginError, ElementError) as error:
            reply = {"error": str(error)}
        except BaseException as error:  # whatever the file raises is reported
            reply = {"error": f"The plugin {origin} cannot be used: {type(error).__name__}: {error}"}
        print(json.dumps(reply), file=answers, flush=True)


def _read(asked: TextIO, requests: queue.SimpleQueue[str]) -> None:
    for line in asked:
        requests.put(line)
    os._exit(0)


def _limit_memory() -> None:
    import resource

    physical = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    limit = min(_MOST_BYTES, physical // 2)
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (_MOST_CPU_S, _MOST_CPU_S))  # if nobody is there to end it


def _load(request: Reply, kinds: dict[str, type[Element]]) -> Reply:
    kinds.update(load_source(request["source"], request["origin"]))
    for named in ({element.__name__: element for element in kinds.values()}, *all_brought().values()):
        check_units(named, request["origin"])
    declared = {kind: _declaration(element) for kind, element in kinds.items()}
    return {"kinds": declared, "brings": bool(all_brought())}


def check_units(named: Mapping[str, Any], origin: str) -> None:
    """Checks the units in which the parameters of some classes, elements or walls, are declared.

    Raises:
        PluginError: one is not a unit.
    """
    for name, made in named.items():
        for key, (quantity, _) in made.parameters().items():
            _check_unit(quantity.unit, f"{origin}: {key} of {name}")


def _declaration(element: type[Element]) -> Reply:
    parameters, defaults = {}, {}
    for name, (quantity, default) in element.parameters().items():
        parameters[name] = dataclasses.asdict(quantity)
        if default is not dataclasses.MISSING:
            defaults[name] = default if quantity.choices else int(default) if quantity.whole else float(default)
    says = {"linear": bool(element.linear) and not element.asks, "limits": bool(element.limits)}
    return {"name": element.__name__, "about": element.__doc__, **says, "parameters": parameters, "defaults": defaults}


def _check_unit(unit: str, where: str) -> None:
    """Raises PluginError if ``unit`` is not a unit; one that is unusual here takes a second, since pint is loaded."""
    if unit in ("", *MEANT):
        return
    import pint

    try:
        pint.UnitRegistry().parse_units(unit)
    except Exception as error:  # what a parser of arbitrary text raises is not documented
        raise PluginError(
            f'{where} is declared in {unit!r}, which is not a unit; write one such as "N s/m".'
        ) from error


def _make(elements: list[tuple[str, dict[str, float]]], kinds: dict[str, type[Element]]) -> Reply:
    """Makes each element and lets it give a force at rest, out of contact and in contact."""
    for kind, parameters in elements:
        element, _ = make_element(ElementTable(name=kind, parameters=parameters), kinds)
        memory = element.memory
        for contact in (False, True):
            motion = Motion(0.001, -1.0).telling(dict.fromkeys(ASKABLE, 0.0), element.asks)
            motion.contact = contact
            try:
                force, _ = (element.force(motion), None) if memory is None else element.force(motion, memory)
                finite = math.isfinite(as_number(force))
            except Exception as error:
                what = raised(error, type(element))
                raise ElementError(f"The element {kind} gave no force when it was tried at rest: {what}.") from error
            if not finite:
                what = f"{force}, not a finite force, when it was tried at rest{place_in(type(element))}"
                raise ElementError(f"The element {kind} gave {what}.")
    return {"made": len(elements)}


if __name__ == "__main__":
    main()
