"""Frames: what is encoded comes back, and whatever else comes in is refused as WireError and nothing else."""

import math
import struct
from typing import Any

import msgpack
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from haploop.protocol.transport import wire
from haploop.protocol.transport.messages import MESSAGES, VERSION, required
from haploop.protocol.transport.wire import Frame, WireError, decode, encode

WHOLE = st.integers(-(2**63), 2**64 - 1)
TEXT = st.text(st.characters(exclude_categories=["Cs"]))
PLAIN = st.one_of(st.none(), st.booleans(), WHOLE, st.floats(allow_nan=False), TEXT, st.binary())
NESTED = st.recursive(
    PLAIN, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4), max_leaves=12
)
pack = msgpack.Packer(autoreset=True).pack
FIELD = {
    "int": WHOLE,
    "number": WHOLE | st.floats(allow_nan=False),
    "text": TEXT,
    "bool": st.booleans(),
    "bytes": st.binary(),
    "map": st.dictionaries(TEXT, NESTED, max_size=4),
    "list": st.lists(NESTED, max_size=4),
    "text?": TEXT | st.none(),
    "map?": st.dictionaries(TEXT, NESTED, max_size=4) | st.none(),
}


@st.composite
def messages(draw: st.DrawFn) -> tuple[str, list[Any]]:
    """Any message of the table with fields of its types."""
    name = draw(st.sampled_from(sorted(MESSAGES)))
    return name, [draw(FIELD[kind]) for _, kind in MESSAGES[name].fields]


@pytest.mark.parametrize("name", MESSAGES)
@settings(max_examples=10)
@given(data=st.data())
def test_every_message_comes_back_as_it_was(name: str, data: st.DataObject) -> None:
    fields = [data.draw(FIELD[kind]) for _, kind in MESSAGES[name].fields]
    frame = decode(encode(name, *fields))
    assert frame == Frame(name, fields)
    names = [field for field, _ in MESSAGES[name].fields]
    assert list(frame.as_dict().items()) == list(zip(names, fields, strict=True))


@given(bits=st.integers(0, 2**64 - 1))
def test_a_float_comes_back_bit_for_bit(bits: int) -> None:
    sent = struct.unpack("<d", struct.pack("<Q", bits))[0]
    (came,) = decode(encode("SAMPLES", 0, [sent])).fields[1]
    assert struct.pack("<d", came) == struct.pack("<d", sent)


@given(data=st.binary(max_size=200))
@example(b"")
@example(b"\xc1")  # never used by msgpack
@example(b"\xdd\xff\xff\xff\xff")  # an array of four billion
@example(b"\xdf\xff\xff\xff\xff")
@example(b"\xc6\xff\xff\xff\xff")
@example(b"\xc7\x0c\xff" + b"\xff" * 12)  # a time stamp that is none
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    with pytest.raises(WireError, match=r"^.{1,200}$"):
        decode(data)


@given(message=messages())
def test_what_may_be_nil_may_be_left_out_at_the_end(message: tuple[str, list[Any]]) -> None:
    name, fields = message
    left_out = [None] * (len(fields) - required(name))
    assert decode(encode(name, *fields[: required(name)])) == Frame(name, fields[: required(name)] + left_out)


@given(message=messages(), cut=st.floats(0, 1, exclude_max=True))
def test_a_truncated_message_is_refused(message: tuple[str, list[Any]], cut: float) -> None:
    data = encode(message[0], *message[1])
    with pytest.raises(WireError):
        decode(data[: int(cut * len(data))])


@given(message=messages(), more=st.binary(min_size=1, max_size=9))
def test_a_message_with_something_behind_it_is_refused(message: tuple[str, list[Any]], more: bytes) -> None:
    with pytest.raises(WireError):
        decode(encode(message[0], *message[1]) + more)


@given(message=messages(), version=NESTED)
@example(("READY", [0]), 1.0)
@example(("READY", [0]), True)
@example(("READY", [0]), math.nan)
def test_another_version_is_refused(message: tuple[str, list[Any]], version: Any) -> None:
    if type(version) is int and version == VERSION:
        return
    with pytest.raises(WireError, match=f"This is protocol version {VERSION}"):
        decode(pack([version, MESSAGES[message[0]].code, *message[1]]))


@given(code=NESTED)
@example(True)
@example(4.0)
@example(0)
@example(255)
def test_an_unknown_code_is_refused(code: Any) -> None:
    if type(code) is int and code in {message.code for message in MESSAGES.values()}:
        return
    with pytest.raises(WireError, match="No message has the code"):
        decode(pack([VERSION, code, 0]))


@given(message=messages(), where=st.integers(0, 5), wrong=NESTED)
def test_a_field_of_another_type_is_refused_by_name(message: tuple[str, list[Any]], where: int, wrong: Any) -> None:
    name, fields = message
    where %= len(fields)
    field, kind = MESSAGES[name].fields[where]
    fields[where] = wrong
    allowed = {"int": int, "number": (int, float), "text": str, "bool": bool, "bytes": bytes, "map": dict, "list": list}
    if kind.endswith("?") and wrong is None:
        return
    if isinstance(wrong, allowed[kind.rstrip("?")]) and (kind == "bool" or not isinstance(wrong, bool)):
        return
    with pytest.raises(WireError, match=rf"^{name}\.{field} must be of type"):
        decode(encode(name, *fields))


@given(message=messages(), more=st.lists(NESTED, min_size=1, max_size=3))
def test_missing_and_surplus_fields_are_refused(message: tuple[str, list[Any]], more: list[Any]) -> None:
    name, fields = message
    with pytest.raises(WireError, match=f"{name} has {len(fields)} fields"):
        decode(encode(name, *fields[: required(name) - 1]))
    with pytest.raises(WireError, match=f"{name} has {len(fields)} fields"):
        decode(encode(name, *fields, *more))


@pytest.mark.parametrize("wrapped", [{}, {1: 2}, "READY", 4, None, b"\x01\x04", [], [VERSION]])
def test_a_frame_must_be_an_array_of_version_and_code(wrapped: Any) -> None:
    with pytest.raises(WireError, match="array"):
        decode(pack(wrapped))


@pytest.mark.parametrize("depth", [100, 900, 1000, 1020, 1024, 5000, 100_000])
@pytest.mark.parametrize("head", [b"\x91", b"\x81\x01", b"\x81"], ids=["lists", "values", "keys"])
@pytest.mark.parametrize("place", ["version", "code", "field", "whole"])
def test_nesting_of_any_depth_ends_in_nothing_but_a_refusal(depth: int, head: bytes, place: str) -> None:
    deep = head * depth + b"\x01" * (depth + 1 if head == b"\x81" else 1)
    data = {
        "version": b"\x92" + deep + b"\x04",
        "code": b"\x92\x01" + deep,
        "field": b"\x93\x01\x04" + deep,
        "whole": deep,
    }[place]
    with pytest.raises(WireError):
        decode(data)


@pytest.mark.parametrize("value", [-(2**63), 2**63, 2**64 - 1])
def test_the_largest_whole_numbers_of_the_wire_come_through_and_larger_ones_cannot_be_sent(value: int) -> None:
    assert decode(encode("READY", value)).fields == [value]
    with pytest.raises(OverflowError):
        encode("READY", 2**64)


def test_a_text_that_is_no_unicode_is_carried_with_the_code_in_its_place() -> None:
    """What a user's file raises may hold half a surrogate pair; the message that tells of it must not fail."""
    assert decode(encode("REPLY", False, "no \ud800", {"\udfff": 1})).fields == [False, "no \\ud800", {"\\udfff": 1}]


def test_keys_that_cannot_be_keys_are_refused() -> None:
    for key in ([], {}, [1, [2]]):
        items = b"\x94\x01\x06\x00\x81" + pack(key) + b"\x00"
        with pytest.raises(WireError):
            decode(items)


def test_nothing_that_comes_in_is_ever_executed() -> None:
    """Extension types, where other formats hide objects, stay bytes: neither code nor a class of ours comes of them."""
    for code in range(128):
        came = decode(encode("PROGRESS", 0, {"odd": msgpack.ExtType(code, b"cos\nsystem\n(S'true'\ntR.")}))
        assert type(came.fields[1]["odd"]) is msgpack.ExtType
    source = wire.__spec__.loader.get_source(wire.__name__)  # pyright: ignore
    for way in ("pickle", "eval(", "exec(", "ext_hook", "object_hook", "import_module", "marshal"):
        assert way not in source
