"""Generator of the tables in ``protocol/README.md``, run as ``python -m haploop.protocol.document``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from haploop.protocol.transport.messages import CHANNELS, MESSAGES, PROCESSES

COMMAND = "python -m haploop.protocol.document"
BEGIN = f"<!-- begin: written by {COMMAND} -->"
END = "<!-- end -->"
README = Path(__file__).parents[2] / "README.md"


def table() -> str:
    """Returns processes, channels and messages as markdown."""
    parts = [_processes()]
    for channel, sockets in CHANNELS.items():
        rows = (
            (
                str(message.code),
                f"`{name}`",
                f"{message.sender} → {message.receiver}",
                ", ".join(f"`{field}` {kind}" for field, kind in message.fields),
                message.meaning,
            )
            for name, message in MESSAGES.items()
            if message.channel == channel
        )
        header = ("code", "message", "from → to", "fields, in order", "meaning")
        parts.append(f"#### Channel `{channel}`\n\n{sockets}.\n\n{_markdown(header, rows)}")
    return "\n\n".join(parts)


def _processes() -> str:
    rows = (
        (
            process.role,
            f"`python -m {process.module}`",
            ", ".join(f"`{f}.sock` ({ch})" for ch, f in process.binds.items()),
        )
        for process in PROCESSES.values()
    )
    return "#### Processes of every run\n\n" + _markdown(("role", "started as", "binds"), rows)


def _markdown(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def with_tables(text: str) -> str:
    """Returns ``text`` with everything between the two marker comments replaced by ``table()``.

    Raises ValueError unless each marker is there once, and in order.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end or BEGIN in rest or END in after:
        raise ValueError(f"The tables' place must be marked once by {BEGIN} and, after it, {END}.")
    return f"{before}{BEGIN}\n\n{table()}\n\n{END}{after}"


if __name__ == "__main__":
    README.write_text(with_tables(README.read_text(encoding="utf-8")), encoding="utf-8")
