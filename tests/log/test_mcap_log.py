"""The log as written, checked with the mcap library's own readers and msgpack: nothing of haploop reads it here."""

from __future__ import annotations

import inspect
import io
import struct
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from haploop.logger.log.writer import Compression, Log

PLANT = {"timestamp": "s", "t": "s", "x": "m", "v": "m/s", "force": "N"}
CONTROLLER = {"timestamp": "s", "x": "m", "in_contact": ""}
COMPRESSIONS = st.sampled_from(["", "lz4"])


def bits(value: float) -> bytes:
    return struct.pack(">d", value)


def any_floats(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    """Random bit patterns: NaN of every payload, infinities and denormal numbers among them."""
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 2**64, size=shape, dtype=np.uint64).view(np.float64)
    special = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, -2.2e-308, 1.7976931348623157e308])
    return np.where(rng.random(shape) < 0.3, rng.choice(special, shape), values)


def messages(log: bytes) -> list[tuple[str, int, Any]]:
    """Topic, log time and content of every message, in the order of the seeking reader."""
    reader = make_reader(io.BytesIO(log), validate_crcs=True)
    return [
        (channel.topic, message.log_time, msgpack.unpackb(message.data))
        for _, channel, message in reader.iter_messages()
        if message.publish_time == message.log_time
    ]


def write_run(path: Path, *, blocks: int, flush_every: int, compression: Compression = "lz4") -> None:
    """A log as of a run: /plant with 10 samples a tick, /controller, /events; tick k is k ms."""
    with Log(path, compression=compression) as log:
        plant = log.channel("/plant", PLANT, samples_per_message=10, title="Plant")
        controller = log.channel("/controller", CONTROLLER, title="Controller")
        events = log.channel("/events", {}, title="Events")
        for block in range(blocks):
            times = np.arange(block * 20, (block + 1) * 20) * 1_000_000
            log.write(plant, times, any_floats(block, (20, 10, 5)))
            log.message(events, int(times[0]), {"tick": block * 20, "what": "block"})
            log.write(controller, times, any_floats(-1 - block + 2**31, (20, 3)))
            if block % flush_every == flush_every - 1:
                log.flush()


NAMES = st.lists(st.text(st.characters(exclude_categories=["Cs"]), max_size=40), min_size=1, max_size=20, unique=True)


@settings(max_examples=30, deadline=None)
@given(
    names=NAMES,
    samples=st.none() | st.integers(1, 20),
    blocks=st.lists(st.tuples(st.integers(0, 40), st.booleans()), max_size=6),
    seed=st.integers(0, 2**32),
    compression=COMPRESSIONS,
)
def test_every_value_written_comes_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory,
    names: list[str],
    samples: int | None,
    blocks: list[tuple[int, bool]],
    seed: int,
    compression: Compression,
) -> None:
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    shape = (len(names),) if samples is None else (samples, len(names))
    written, first = [], 0
    with Log(path, compression=compression) as log:
        channel = log.channel("/any", dict.fromkeys(names, ""), samples_per_message=samples, title="Any")
        for count, flush in blocks:
            values = any_floats(seed + first, (count, *shape))
            log.write(channel, np.arange(first, first + count), values)
            written.extend(values)
            first += count
            if flush:
                log.flush()
    found = messages(path.read_bytes())
    assert [time for _, time, _ in found] == list(range(first))
    for (_, _, content), values in zip(found, written, strict=True):
        maps = [content] if samples is None else content
        assert [list(one) for one in maps] == [names] * len(maps)
        assert [[bits(value) for value in one.values()] for one in maps] == [
            [bits(value) for value in row] for row in values.reshape(-1, len(names))
        ]


def test_the_seeking_reader_gives_all_channels_in_the_order_of_log_time(tmp_path: Path) -> None:
    write_run(tmp_path / "log.mcap", blocks=7, flush_every=3)
    found = messages((tmp_path / "log.mcap").read_bytes())
    times = [time for _, time, _ in found]
    assert times == sorted(times)
    assert len(found) == 7 * (20 + 20 + 1)
    for topic in ("/plant", "/controller"):
        assert [time for name, time, _ in found if name == topic] == [k * 1_000_000 for k in range(140)]


def test_a_message_is_counted_on_its_channel_without_a_gap(tmp_path: Path) -> None:
    write_run(tmp_path / "log.mcap", blocks=5, flush_every=2)
    sequences: dict[int, list[int]] = {}
    for _, _, message in make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes())).iter_messages():
        sequences.setdefault(message.channel_id, []).append(message.sequence)
    assert sequences == {1: list(range(100)), 2: list(range(100)), 3: list(range(5))}


def test_one_message_can_be_found_by_time_through_the_index(tmp_path: Path) -> None:
    write_run(tmp_path / "log.mcap", blocks=6, flush_every=1, compression="")
    log = (tmp_path / "log.mcap").read_bytes()
    reader = make_reader(io.BytesIO(log))
    at = 77 * 1_000_000
    is_old = "starting_at" not in inspect.signature(reader.iter_messages).parameters  # mcap before 1.6
    span: dict[str, Any] = {"start_time": at, "end_time": at + 1} if is_old else {"starting_at": at, "ending_at": at}
    found = list(reader.iter_messages(topics=["/controller"], **span))
    assert [message.log_time for _, _, message in found] == [at]
    # The index entries point at the message records themselves: opcode, length and channel stand there.
    summary = reader.get_summary()
    assert summary is not None
    for chunk in summary.chunk_indexes:
        body_start = chunk.chunk_start_offset + chunk.chunk_length - chunk.uncompressed_size
        for channel, offset in chunk.message_index_offsets.items():
            opcode, _, index_channel, entry_bytes = struct.unpack_from("<BQHI", log, offset)
            assert (opcode, index_channel) == (0x07, channel)
            for time, place in struct.iter_unpack("<QQ", log[offset + 15 : offset + 15 + entry_bytes]):
                code, _, of_channel, _, log_time = struct.unpack_from("<BQHIQ", log, body_start + place)
                assert (code, of_channel, log_time) == (0x05, channel, time)


def test_the_statistics_count_what_the_file_holds(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    write_run(path, blocks=5, flush_every=2)
    summary = make_reader(io.BytesIO(path.read_bytes())).get_summary()
    assert summary is not None
    statistics = summary.statistics
    assert statistics is not None
    assert statistics.channel_message_counts == {1: 100, 2: 100, 3: 5}
    assert (statistics.message_count, statistics.channel_count, statistics.schema_count) == (205, 3, 3)
    assert (statistics.message_start_time, statistics.message_end_time) == (0, 99_000_000)
    assert statistics.chunk_count == 3


def test_a_chunk_is_closed_once_its_messages_pass_a_megabyte(tmp_path: Path) -> None:
    write_run(tmp_path / "log.mcap", blocks=200, flush_every=10**9)
    summary = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes())).get_summary()
    assert summary is not None
    sizes = [chunk.uncompressed_size for chunk in summary.chunk_indexes]
    assert len(sizes) > 2
    assert all(1 << 20 <= size < (1 << 20) + 20_000 for size in sizes[:-1])


def test_of_a_chunk_that_is_written_the_log_keeps_less_than_two_hundred_bytes(tmp_path: Path) -> None:
    """Of the objects that describe a chunk in the summary it would be ten times as much."""
    with Log(tmp_path / "log.mcap") as log:
        channels = [log.channel(f"/{name}", {"x": "m"}, title=name) for name in "abc"]

        def write_chunks(first: int, count: int) -> int:
            for number in range(first, first + count):
                for channel in channels:
                    log.write(channel, np.array([number]), np.zeros((1, 1)))
                log.flush()
            return tracemalloc.get_traced_memory()[0]

        tracemalloc.start()
        before = write_chunks(0, 200)
        after = write_chunks(200, 1000)
        tracemalloc.stop()
    assert after - before < 200 * 1000
    with (tmp_path / "log.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary
    assert summary.statistics
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count == 1200
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (0, 1199)


def test_the_footer_leads_to_the_summary_and_its_groups_and_checks_them(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    write_run(path, blocks=5, flush_every=2)
    log = path.read_bytes()
    opcode, length, summary_start, offsets_start, crc = struct.unpack("<BQQQI", log[-37:-8])
    assert (opcode, length) == (0x02, 20)
    assert zlib.crc32(log[summary_start:-12]) == crc
    groups = list(struct.iter_unpack("<BQBQQ", log[offsets_start:-37]))
    assert [group[2] for group in groups] == [0x03, 0x04, 0x0B, 0x08]
    for _, _, group_opcode, start, group_length in groups:
        assert log[start] == group_opcode
        assert start + group_length == offsets_start or log[start + group_length] != group_opcode
