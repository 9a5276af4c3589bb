"""Snapshots of a history: the tables that a page draws, at a resolution that fits its width."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from haploop.view.draw.messages import Table, encode
from haploop.view.draw.over_time import Interval, laid_over, over_time, overview
from haploop.view.draw.panels import PANELS, Look, sound
from haploop.view.look.compare import Changes
from haploop.view.store.history import History


@dataclass(frozen=True)
class Viewport:
    """The interval that a page shows, and its width.

    Attributes:
        span_s: length of the interval in simulated time, s; None for the whole run.
        points: about how many points fit side by side.
        end_s: end of the interval, s; None for the newest tick.
        panel: what is shown beside the charts over time, one of ``PANELS``.
        sound: whether the newest samples of the force are wanted, to play them.
    """

    span_s: float | None = 2.0
    points: int = 1000
    end_s: float | None = None
    panel: str = next(iter(PANELS))
    sound: bool = False


def snapshot(
    history: History,
    viewport: Viewport,
    changes: Changes | None = None,
    overlay: History | None = None,
    beside: bool = True,
) -> bytes:
    """Returns everything a page shows as bytes, packed by :func:`haploop.view.draw.messages.encode`.

    Tables over time are position, force and energy; each row by row where the page has room for it, else as an envelope
    whose rows are the two extremes of consecutive buckets, rising or falling as the data do. Position and total force
    of ``overlay``, another run, come with them. With ``beside`` there is also an overview of the whole run, and what
    the page's panel asks for, to which ``changes`` belong. A table without data is left out. ``coarse`` in the header
    tells whether the interval begins before what is held in full. The interval of a run that has ended does not reach
    beyond its end, except for what ``overlay`` has there.
    """
    rate = history.time.control_rate
    from_tick, to_tick = _window(history, viewport)
    if history.stop_tick is not None and not overlay:
        to_tick = min(to_tick, max(history.end_tick, from_tick + 1))
    known_from = to_tick if history.first_tick is None else history.first_tick
    first, end = max(from_tick, known_from), min(to_tick, history.end_tick)
    tables: list[Table | None] = []
    more: dict[str, Any] = {}
    if first < end:
        interval = Interval(first, end, rate, viewport.points)
        more["coarse"] = first < max(history.steps.full_from_tick, history.ticks.full_from_tick)
        tables = over_time(history, interval)
        tables += laid_over(overlay, from_tick / rate, to_tick / rate, viewport.points) if overlay else []
        tables += [sound(history)] if viewport.sound else []
        if beside:
            of_panel, own = PANELS[viewport.panel](Look(history, first, end, interval, changes))
            more |= own
            tables += [overview(history), *of_panel]
    return encode(from_tick / rate, to_tick / rate, [table for table in tables if table], beside=beside, **more)


def _window(history: History, viewport: Viewport) -> tuple[int, int]:
    """Returns (first, end); at the start of a run the interval reaches beyond the newest tick."""
    rate = history.time.control_rate
    end = max(1, history.end_tick if viewport.end_s is None else math.ceil(viewport.end_s * rate))
    if viewport.span_s is None:
        return min(end - 1, history.first_tick or 0), end
    ticks = max(1, round(viewport.span_s * rate))
    first = max(0, end - ticks)
    return first, first + ticks
