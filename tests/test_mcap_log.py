"""The log as written, checked with the mcap library's own readers and msgpack: nothing of haploop reads it here."""

from __future__ import annotations

import errno
import io
import json
import resource
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import jsonschema
import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

from haploop.logger.log_error import LogError
from haploop.logger.mcap_log import Compression, Log

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


def streamed(log: bytes) -> list[Message]:
    """The messages up to the point where the log breaks off."""
    found = []
    try:
        found.extend(record for record in StreamReader(io.BytesIO(log), validate_crcs=True).records)
    except (EndOfFile, struct.error, UnicodeDecodeError):
        pass
    return [record for record in found if isinstance(record, Message)]


def write_run(
    path: Path, *, blocks: int, block_ticks: int = 20, flush_every: int = 1, compression: str = "lz4"
) -> None:
    """A log as of a run: /plant with 10 samples a tick, /controller, /events; tick k is k ms."""
    with Log(path, compression="lz4" if compression else "") as log:
        plant = log.channel("/plant", PLANT, samples_per_message=10, title="Plant")
        controller = log.channel("/controller", CONTROLLER, title="Controller")
        events = log.channel("/events", {}, title="Events")
        for block in range(blocks):
            times = np.arange(block * block_ticks, (block + 1) * block_ticks) * 1_000_000
            log.write(plant, times, any_floats(block, (block_ticks, 10, 5)))
            log.message(events, int(times[0]), {"tick": block * block_ticks, "what": "block"})
            log.write(controller, times, any_floats(-1 - block + 2**31, (block_ticks, 3)))
            if block % flush_every == flush_every - 1:
                log.flush()


NAMES = st.lists(st.text(st.characters(exclude_categories=["Cs"]), max_size=40), min_size=1, max_size=20, unique=True)


@settings(max_examples=80, deadline=None)
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
    for message in streamed((tmp_path / "log.mcap").read_bytes()):
        sequences.setdefault(message.channel_id, []).append(message.sequence)
    assert sequences == {1: list(range(100)), 2: list(range(100)), 3: list(range(5))}


def test_one_message_can_be_found_by_time_through_the_index(tmp_path: Path) -> None:
    write_run(tmp_path / "log.mcap", blocks=6, compression="")
    log = (tmp_path / "log.mcap").read_bytes()
    reader = make_reader(io.BytesIO(log))
    at = 77 * 1_000_000
    found = list(reader.iter_messages(topics=["/controller"], starting_at=at, ending_at=at))
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
    statistics = make_reader(io.BytesIO(path.read_bytes())).get_summary().statistics  # type: ignore[union-attr]
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


@pytest.mark.parametrize("samples", [None, 1, 10])
def test_the_schema_is_json_schema_that_the_messages_obey(tmp_path: Path, samples: int | None) -> None:
    shape = (3, 5) if samples is None else (3, samples, 5)
    with Log(tmp_path / "log.mcap") as log:
        channel = log.channel("/plant", PLANT, samples_per_message=samples, title="Plant")
        log.write(channel, np.arange(3), np.ones(shape))
    reader = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes()))
    for schema, found, message in reader.iter_messages():
        assert schema is not None
        assert (schema.encoding, schema.name, found.message_encoding) == ("jsonschema", "Plant", "msgpack")
        described = json.loads(schema.data)
        jsonschema.Draft202012Validator.check_schema(described)
        jsonschema.validate(msgpack.unpackb(message.data), described)
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate([{"t": 0.0}], described)
        properties = (described if samples is None else described["items"])["properties"]
        assert {name: kind["unit"] for name, kind in properties.items()} == PLANT


def test_registering_again_gives_the_same_channel_and_other_columns_a_new_one(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        first = log.channel("/controller", {"x": "m"}, title="Controller")
        other = log.channel("/controller", {"x": "m", "dissipation.0": "N"}, title="Controller")
        assert log.channel("/controller", {"x": "m"}, title="Controller") == first != other
        log.write(first, np.array([0]), np.array([[1.0]]))
        log.write(other, np.array([1]), np.array([[2.0, 3.0]]))
    assert messages((tmp_path / "log.mcap").read_bytes()) == [
        ("/controller", 0, {"x": 1.0}),
        ("/controller", 1, {"x": 2.0, "dissipation.0": 3.0}),
    ]


def test_an_attachment_comes_back(tmp_path: Path) -> None:
    scene = 'title = "µ"\n'.encode()
    with Log(tmp_path / "log.mcap") as log:
        log.attach("scene.toml", "application/toml", scene)
    [found] = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes())).iter_attachments()
    assert (found.name, found.media_type, found.data) == ("scene.toml", "application/toml", scene)


def test_values_of_a_wrong_shape_and_times_before_zero_are_refused(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        plant = log.channel("/plant", PLANT, samples_per_message=2, title="Plant")
        events = log.channel("/events", {}, title="Events")
        for shape in [(3, 5), (3, 3, 5), (3, 2, 4), (2, 2, 5)]:
            with pytest.raises(ValueError, match="of shape"):
                log.write(plant, np.arange(3), np.ones(shape))
        with pytest.raises(ValueError, match="0 or later"):
            log.write(plant, np.array([0, -1]), np.ones((2, 2, 5)))
        with pytest.raises(ValueError, match="through write"):
            log.message(plant, 0, {"x": 1.0})
        with pytest.raises(ValueError, match="through message"):
            log.write(events, np.arange(1), np.ones((1, 0)))
        with pytest.raises(ValueError, match="at least one sample"):
            log.channel("/none", PLANT, samples_per_message=0, title="None")


@pytest.mark.parametrize("compression", ["", "lz4"])
def test_everything_before_a_flush_is_in_the_file_while_it_is_open(tmp_path: Path, compression: Compression) -> None:
    path = tmp_path / "log.mcap"
    with Log(path, compression=compression) as log:
        channel = log.channel("/controller", CONTROLLER, title="Controller")
        for flushed in range(1, 4):
            log.write(channel, np.arange(50) + flushed * 50, np.ones((50, 3)))
            assert len(streamed(path.read_bytes())) == (flushed - 1) * 50
            log.flush()
            assert len(streamed(path.read_bytes())) == flushed * 50


@pytest.fixture(scope="module", params=["", "lz4"])
def run_log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("cut") / "log.mcap"
    write_run(path, blocks=5, compression=request.param)
    return path.read_bytes()


@settings(max_examples=150, deadline=None)
@given(share=st.floats(0, 1))
def test_a_log_cut_anywhere_streams_a_prefix_of_its_messages(run_log: bytes, share: float) -> None:
    whole, cut = streamed(run_log), streamed(run_log[: int(share * len(run_log))])
    assert cut == whole[: len(cut)]
    assert len(cut) % 41 == 0  # whole chunks: a block of 20 ticks and an event


@settings(max_examples=40, deadline=None)
@given(room=st.integers(0, 120_000))
def test_a_full_disk_raises_one_sentence_and_leaves_whole_chunks(
    tmp_path_factory: pytest.TempPathFactory, room: int
) -> None:
    """The operating system stops the file at ``room`` bytes, mid-write, as a full disk does."""
    path = tmp_path_factory.mktemp("full") / "log.mcap"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(LogError, match=r"log\.mcap failed after \d+ bytes \(File too large\)\. .* run again\."):
            write_run(path, blocks=20, compression="")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    found = path.read_bytes()
    assert len(found) <= room
    write_run(path.with_name("whole.mcap"), blocks=20, compression="")
    whole = path.with_name("whole.mcap").read_bytes()
    assert found == whole[: len(found)]
    assert len(streamed(found)) == len(streamed(whole[:room]))


def test_a_device_without_room_raises_and_stays_shut() -> None:
    with pytest.raises(LogError, match="No space left on device"):
        Log("/dev/full")


def test_after_a_failed_write_the_log_refuses_more_and_closes_in_peace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = Log(tmp_path / "log.mcap")
    channel = log.channel("/controller", CONTROLLER, title="Controller")
    log.write(channel, np.arange(5), np.ones((5, 3)))
    log.flush()

    class Full(io.RawIOBase):
        def __init__(self, file: Any) -> None:
            self.file, self.truncate, self.seek, self.close = file, file.truncate, file.seek, file.close

        def write(self, data: Any) -> int:
            if len(data) > 10:
                return self.file.write(data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(log._file, "_file", Full(log._file._file))
    log.write(channel, np.arange(5, 10), np.ones((5, 3)))
    for _ in range(2):
        with pytest.raises(LogError, match="No space left"):
            log.flush()
    log.close()
    assert len(streamed((tmp_path / "log.mcap").read_bytes())) == 5


def test_an_interrupt_during_a_write_neither_doubles_nor_loses_messages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = Log(tmp_path / "log.mcap")
    channel = log.channel("/controller", CONTROLLER, title="Controller")
    raw = log._file._file

    class Interrupted(io.RawIOBase):
        writable_again = False

        def __init__(self) -> None:
            self.seek, self.close = raw.seek, raw.close

        def write(self, data: Any) -> int:
            done = raw.write(data)
            if not self.writable_again:
                self.writable_again = True
                raise KeyboardInterrupt
            return done

    monkeypatch.setattr(log._file, "_file", Interrupted())
    log.write(channel, np.arange(50), np.ones((50, 3)))
    with pytest.raises(KeyboardInterrupt):
        log.flush()
    log.close()
    assert [time for _, time, _ in messages((tmp_path / "log.mcap").read_bytes())] == list(range(50))


def test_no_message_is_remembered_once_its_chunk_is_closed(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        plant = log.channel("/plant", PLANT, samples_per_message=10, title="Plant")
        times, values = np.arange(100), np.ones((100, 10, 5))

        def chunks(count: int) -> int:
            for _ in range(count):
                log.write(plant, times, values)
                log.flush()
            return tracemalloc.get_traced_memory()[0]

        tracemalloc.start()
        try:
            before, after = chunks(20), chunks(200)
        finally:
            tracemalloc.stop()
    # A closed chunk of 71 000 bytes leaves its index: less than 1 kB.
    assert after - before < 200 * 1000
