"""A running loop as a small table that stays in its place, or as a line now and then."""

from __future__ import annotations

from typing import TYPE_CHECKING

from haploop.protocol.changes import describe
from haploop.tools.attach.watched import Watched
from haploop.tools.render.terminal import make_facts, make_table, verdict_style
from haploop.tools.render.units import amount, fixed

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table
    from rich.text import Text

_BAR = 20
_TRUE, _SAMPLED = ".true", ".sampled"
_STATES = {"paused": "bold yellow", "running": "bold green", "waiting": "bold", "failed": "bold red"}


def live_table(watched: Watched) -> RenderableType:
    """Everything about a run that is worth a look, in at most 80 columns."""
    from rich.console import Group
    from rich.text import Text

    head = Text.assemble((watched.run_id, "bold"), "  ", watched.title, no_wrap=True, overflow="ellipsis")
    return Group(head, _progress(watched), _figures(watched), _books(watched))


def live_line(watched: Watched) -> str:
    """The same in one line, for a pipe."""
    motion, status = watched.motion(), watched.status()
    words = [f"{watched.t_s:.3f} s"]
    if motion:
        words += [f"x {amount(motion['x'], 'm')}", f"force {amount(motion['force'], 'N')}"]
    if status:
        words += [status["verdict"], f"{amount(status['oscillation_m'], 'm')} p-p"]
        words.append(f"residual {amount(status['residual_J'], 'J')}")
    if watched.factor is not None:
        words.append(f"{fixed(watched.factor)}x real time")
    if watched.skipped_ticks:
        words.append(f"skipped {watched.skipped_ticks} ticks")
    return "  ".join(words)


def ending(watched: Watched) -> str:
    """How a run ended, as a sentence."""
    why = f": {watched.why.rstrip('.')}" if watched.why else ""
    word = "" if watched.ended in ("ended", "done") else f" ({watched.ended})"
    return f"Run {watched.run_id} ended at tick {watched.tick}, {watched.t_s:g} s{word}{why}."


def _progress(watched: Watched) -> Text:
    """State, bar, time and pace."""
    from rich.text import Text

    state = watched.ended or ("paused" if watched.paused else "running" if watched.factor else "waiting")
    end = watched.time.ticks
    done = round(min(1.0, watched.tick / end) * _BAR)
    text = Text.assemble(
        (f"{state:<8}", _STATES.get(state, "bold")), "  ",
        ("━" * done, "green"), ("─" * (_BAR - done), "dim"),
        f"  {watched.t_s:.3f} s of {end / watched.time.control_rate:g} s, tick {watched.tick}",
        no_wrap=True, overflow="ellipsis",
    )  # fmt: skip
    if watched.factor is not None and not watched.paused:
        text.append(f"  {fixed(watched.factor)}× real time")
    return text


def _figures(watched: Watched) -> Table:
    from rich.text import Text

    grid = make_facts([], least_width=12)
    status, motion = watched.status(), watched.motion()
    if status:
        word = status["verdict"]
        swing = f"  oscillation {amount(status['oscillation_m'], 'm')} peak to peak"
        grid.add_row("verdict" if watched.ended else "so far", Text.assemble((word, verdict_style(word)), swing))
    grid.add_row("position", amount(motion.get("x"), "m") + _where(watched.penetration_m()))
    grid.add_row("velocity", amount(motion.get("v"), "m/s"))
    parts = ", ".join(f"{name} {amount(force, 'N')}" for name, force in watched.parts().items())
    grid.add_row("force", amount(motion.get("force"), "N") + (f"  commanded: {parts}" if parts else ""))
    grid.add_row("skipped", Text(f"{watched.skipped_ticks} ticks", "yellow" if watched.skipped_ticks else ""))
    if watched.changes:
        tick, event = watched.changes[-1]
        words = f"{describe(event)}, at {tick / watched.time.control_rate:g} s (tick {tick})"
        grid.add_row("last change", Text(words))
    return grid


def _where(penetration_m: float | None) -> str:
    if penetration_m is None:
        return ""
    if penetration_m > 0.0:
        return f"  {amount(penetration_m, 'm')} inside the wall"
    return f"  {amount(-penetration_m, 'm')} outside the wall"


def _books(watched: Watched) -> Table:
    """Energy by wall and element, and what the books leave unexplained."""
    numbers = ("true", "sampled")
    table = make_table("energy taken out of the device by", *numbers, numbers=numbers, least_width=9)
    books = watched.books()
    no_wall = watched.penetration_m() is None
    for name in (name.removesuffix(_TRUE) for name in books if name.endswith(_TRUE)):
        if not (name == "wall" and no_wall):
            table.add_row(name, *(amount(books[name + side], "J") for side in (_TRUE, _SAMPLED)))
    moved = books.get("moved")
    residual = watched.status().get("residual_J")
    share = f", {residual / moved:.1e} of what moved" if residual is not None and moved else ""
    table.add_section()
    table.add_row(f"residual{share}", amount(residual, "J"), "")
    return table
