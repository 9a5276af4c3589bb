"""Energy budget of a loop by cause: what fed the device and what took energy out, since the start and in a window."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from haploop.logger.books.ideal_wall import DISSIPATED
from haploop.view.look.book_names import book_names
from haploop.view.store.history import EARLIER, TRUE, WALL_BOOK, History

# Books of the plant in the order in which they are reported; labels of books that do not go by their own name.
_STORED = ("kinetic", "spring")
_LABELS = {"unmodelled_work": "hand, as the remainder", EARLIER.removesuffix(TRUE): "earlier elements"}
# The wall's share by cause: label, the book it goes up to and the book it starts from.
_OF_WALL = (
    ("sampling and hold", "sampled_and_held", "ideal"),
    ("quantisation", "quantised", "sampled_and_held"),
    ("delay", WALL_BOOK, "quantised"),
)
_KEPT, _STORE = "kept back by the actuator's limits", "put into store"
_NO_FLOW = {_KEPT: "kept", _STORE: "store"}


def budget(history: History, from_tick: int, end: int) -> dict[str, Any] | None:
    """Returns every cause with its energy in J, negative where it feeds the device, positive where it takes energy out.

    ``rows`` are {name, is, total_J, window_J}: since the start of the run, and in the ticks from ``from_tick`` to
    before ``end``; a row ``is`` a flow, or what is in store, or was kept back. They sum to 0 but for rounding, since
    the books close: what is put into store counts as taken out, and so does what the wall's and the elements' commanded
    forces would have given, but for the actuator's limits.
    ``from_s`` is where the window begins, later than requested where no energy is known before; it is exact to within
    ``about_s`` where the past is held coarsely. Returns None without any energy.
    """
    series, rate = history.energy, history.time.control_rate
    end = min(end, series.end_tick)
    first = max(from_tick, series.first_tick or 0)
    if series.first_tick is None or first >= end:
        return None
    names = series.names
    now, (before, about) = _at(series, names, end - 1)[0], _at(series, names, first)
    total, window = (dict(zip(names, values.tolist(), strict=True)) for values in (now, now - before))
    rows = [
        {"name": label, "is": _NO_FLOW.get(label, "flow"), "total_J": sum(sign * total[name] for sign, name in parts),
         "window_J": sum(sign * window[name] for sign, name in parts)}
        for label, parts in _causes(names, {**_LABELS, **book_names(history)})
    ]  # fmt: skip
    shown = [row for row in rows if np.isfinite(row["total_J"]) and np.isfinite(row["window_J"])]
    return {"from_s": first / rate, "to_s": (end - 1) / rate, "about_s": about / rate, "rows": shown}


def _at(series: Any, names: Sequence[str], tick: int) -> tuple[np.ndarray, int]:
    """Returns the books at a tick, and to within how many ticks that is exact; a book not yet open is 0."""
    if tick >= series.full_from_tick:
        return np.nan_to_num(series.rows(names, tick, tick + 1)[:, 0], nan=0.0), 0
    bucket = series.bucket_from(tick, 1)
    begin = series.aligned(tick, bucket)
    return np.nan_to_num(series.envelope(names, begin, begin + bucket, bucket)[:, 0], nan=0.0), bucket


def _causes(names: Sequence[str], labels: Mapping[str, str]) -> Iterator[tuple[str, list[tuple[float, str]]]]:
    """Yields each cause with its books and their signs; ``labels``, by book, are for those not shown by their name."""
    for name in names:
        if name.endswith("_work"):
            yield labels.get(name, name.removesuffix("_work")), [(-1.0, name)]
    has_wall = "ideal" in names
    by_law = [(-1.0, DISSIPATED)] if DISSIPATED in names else []
    for label, up_to, start in _OF_WALL if has_wall else ():
        estimates = " and estimates" if by_law and label == "quantisation" else ""  # a damper acts by the estimated v
        yield label + estimates, [(1.0, up_to), (-1.0, start), *(by_law if start == "ideal" else [])]
    if by_law:
        yield "law of the wall", [(1.0, DISSIPATED)]
    for name in names:
        if name.endswith(TRUE) and name != WALL_BOOK:
            yield labels[name.removesuffix(TRUE)], [(1.0, name)]
    for name in names:
        if name.endswith("_heat"):
            yield f"heat in {name.removesuffix('_heat')}", [(1.0, name)]
    if "actuator" in names:
        yield _KEPT, [(1.0, "actuator")]
    stored = [*(name for name in _STORED if name in names), *(["ideal"] if has_wall else [])]
    yield _STORE, [(1.0, name) for name in stored]
