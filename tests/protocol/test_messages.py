"""The table of messages: one code each, known types and channels, and a README that says the same."""

import re
from pathlib import Path

import pytest

from haploop.protocol import changes, document
from haploop.protocol.transport.messages import BY_CODE, CHANNELS, MESSAGES, PROCESSES, VERSION, complaint

README = Path(__file__).parents[2] / "protocol" / "README.md"
KINDS = {"int", "number", "text", "bool", "bytes", "map", "list", "text?", "map?"}


def test_every_message_has_a_code_of_its_own() -> None:
    assert len(BY_CODE) == len(MESSAGES)
    assert {BY_CODE[message.code] for message in MESSAGES.values()} == set(MESSAGES)
    assert all(0 <= message.code < 128 for message in MESSAGES.values()), "a code is one byte of msgpack"


def test_every_message_travels_on_a_known_channel_with_fields_of_known_types() -> None:
    for name, message in MESSAGES.items():
        assert message.channel in CHANNELS, name
        assert {kind for _, kind in message.fields} <= KINDS, name
        names = [field for field, _ in message.fields]
        assert names == sorted(set(names), key=names.index), name
        assert message.meaning.endswith("."), name


def test_every_channel_is_bound_by_some_process_or_by_the_clock() -> None:
    bound = {channel for process in PROCESSES.values() for channel in process.binds}
    assert bound | {"clock"} == set(CHANNELS)
    files = [file for process in PROCESSES.values() for file in process.binds.values()]
    assert len(files) == len(set(files))


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ([], "PROGRESS has 2 fields (tick, status), but 0 came"),
        ([1, {}, 3], "PROGRESS has 2 fields (tick, status), but 3 came"),
        (["1", {}], "PROGRESS.tick must be of type int, but str came"),
        ([1.0, {}], "PROGRESS.tick must be of type int, but float came"),
        ([True, {}], "PROGRESS.tick must be of type int, but bool came"),
        ([1, []], "PROGRESS.status must be of type map, but list came"),
    ],
)
def test_a_complaint_names_message_field_and_what_came(fields: list[object], says: str) -> None:
    assert complaint("PROGRESS", fields) == says
    assert complaint("PROGRESS", [1, {}]) is None


def test_the_readme_holds_exactly_what_the_tables_say() -> None:
    text = README.read_text(encoding="utf-8")
    assert document.with_tables(text) == text, f"renew it: {document.COMMAND}"


def test_a_readme_that_differs_from_the_tables_is_noticed() -> None:
    text = README.read_text(encoding="utf-8")
    assert document.with_tables(text.replace("| 6 | `PROGRESS`", "| 60 | `PROGRESS`")) == text
    assert document.with_tables(text.replace("| 23 | `LAST`", "")) == text
    with pytest.raises(ValueError, match="marked once"):
        document.with_tables(text.replace(document.END, ""))


def test_the_readme_explains_every_message_beyond_its_row_and_no_other() -> None:
    text = README.read_text(encoding="utf-8")
    before, _, rest = text.partition(document.BEGIN)
    prose = before + rest.partition(document.END)[2]
    assert set(MESSAGES) <= set(re.findall(r"\b[A-Z]+(?:_[A-Z]+)*\b", prose))
    assert set(re.findall(r"\*\*([A-Z_]+)\*\*", prose)) <= set(MESSAGES)
    assert f"version {VERSION}" in prose
    table = rest.partition(document.END)[0]
    assert set(re.findall(r"\| `([A-Z_]+)` \|", table)) == set(MESSAGES)


def test_the_readme_tells_every_kind_of_event() -> None:
    _, _, after = README.read_text(encoding="utf-8").partition("An event is a map with one of these keys.")
    rows = [line for line in after.split("\n\n")[1].splitlines() if line.startswith("| `")]
    assert {key for row in rows for key in re.findall(r"`(\w+)`", row.split("|")[1])} == set(changes.KINDS)


def test_the_tables_hold_every_process_channel_and_field() -> None:
    table = document.table()
    for name, message in MESSAGES.items():
        (row,) = [line for line in table.splitlines() if line.startswith(f"| {message.code} | `{name}` |")]
        assert all(f"`{field}` {kind}" in row for field, kind in message.fields)
        assert message.meaning in row
    for process in PROCESSES.values():
        assert f"| {process.role} | `python -m {process.module}` |" in table
    assert all(f"#### Channel `{channel}`" in table for channel in CHANNELS)
