"""The log when something goes wrong: cut off anywhere, on a full disk, interrupted; read by the mcap library alone."""

from __future__ import annotations

import contextlib
import errno
import io
import resource
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

from haploop.logger.log import LogError
from haploop.logger.log.writer import Compression, Log

PLANT = {"timestamp": "s", "t": "s", "x": "m", "v": "m/s", "force": "N"}
CONTROLLER = {"timestamp": "s", "x": "m", "in_contact": ""}
CHUNK_MESSAGES = 41


def streamed(log: bytes) -> list[Message]:
    """The messages up to the point where the log breaks off."""
    found = []
    with contextlib.suppress(EndOfFile, struct.error, UnicodeDecodeError):
        found.extend(record for record in StreamReader(io.BytesIO(log), validate_crcs=True).records)
    return [record for record in found if isinstance(record, Message)]


def write_chunks(path: Path, count: int, compression: Compression = "") -> None:
    """Chunks of 20 ticks on two channels and one event, 41 messages each."""
    rng = np.random.default_rng(1)
    with Log(path, compression=compression) as log:
        plant = log.channel("/plant", PLANT, samples_per_message=10, title="Plant")
        controller = log.channel("/controller", CONTROLLER, title="Controller")
        events = log.channel("/events", {}, title="Events")
        for first in range(0, 20 * count, 20):
            times = np.arange(first, first + 20) * 1_000_000
            log.write(plant, times, rng.normal(size=(20, 10, 5)))
            log.write(controller, times, rng.normal(size=(20, 3)))
            log.message(events, int(times[0]), {"tick": first})
            log.flush()


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
    write_chunks(path, 5, request.param)
    return path.read_bytes()


@settings(max_examples=50, deadline=None)
@given(share=st.floats(0, 1))
def test_a_log_cut_anywhere_streams_a_prefix_of_its_messages(run_log: bytes, share: float) -> None:
    whole, cut = streamed(run_log), streamed(run_log[: int(share * len(run_log))])
    assert cut == whole[: len(cut)]
    assert len(cut) % CHUNK_MESSAGES == 0


@pytest.fixture(scope="module")
def full_log(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("full") / "log.mcap"
    write_chunks(path, 20)
    return path.read_bytes()


@settings(max_examples=25, deadline=None)
@given(room=st.integers(0, 120_000))
def test_a_full_disk_raises_one_sentence_and_leaves_whole_chunks(
    full_log: bytes, tmp_path_factory: pytest.TempPathFactory, room: int
) -> None:
    """The operating system stops the file at ``room`` bytes, mid-write, as a full disk does."""
    path = tmp_path_factory.mktemp("full") / "log.mcap"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(LogError, match=r"log\.mcap failed after \d+ bytes \(File too large\)\. .* run again\."):
            write_chunks(path, 20)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    found = path.read_bytes()
    assert full_log.startswith(found)
    summary = make_reader(io.BytesIO(full_log)).get_summary()
    assert summary is not None
    chunk_ends = [at.chunk_start_offset + at.chunk_length + at.message_index_length for at in summary.chunk_indexes]
    fitting = [end for end in chunk_ends if end <= room]
    assert len(streamed(found)) == CHUNK_MESSAGES * len(fitting)
    assert len(found) == fitting[-1] if fitting else len(found) <= room


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a device that is always full")
def test_a_device_without_room_raises_and_stays_shut() -> None:
    with pytest.raises(LogError, match="No space left on device"):
        Log("/dev/full")


class Through:
    """A file that passes everything on to another."""

    def __init__(self, file: Any) -> None:
        self.file = file

    def __getattr__(self, name: str) -> Any:
        return getattr(self.file, name)


def test_after_a_failed_write_the_log_refuses_more_and_closes_in_peace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = Log(tmp_path / "log.mcap")
    channel = log.channel("/controller", CONTROLLER, title="Controller")
    log.write(channel, np.arange(5), np.ones((5, 3)))
    log.flush()

    class Full(Through):
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

    class Interrupted(Through):
        interrupts = 1

        def write(self, data: Any) -> int:
            done = self.file.write(data)
            if self.interrupts:
                self.interrupts = 0
                raise KeyboardInterrupt
            return done

    monkeypatch.setattr(log._file, "_file", Interrupted(log._file._file))
    log.write(channel, np.arange(50), np.ones((50, 3)))
    with pytest.raises(KeyboardInterrupt):
        log.flush()
    log.close()
    reader = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes()), validate_crcs=True)
    assert [message.log_time for _, _, message in reader.iter_messages()] == list(range(50))


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
    # A closed chunk of 71 000 bytes leaves nothing but its index, less than 2 kB.
    assert after - before < 200 * 2000


@pytest.mark.slow
def test_a_log_of_four_times_as_many_chunks_takes_no_more_memory_and_its_summary_lists_them_all(tmp_path: Path) -> None:
    """Entries of the summary pass what is held in memory, 64 kB, within the first 1000 chunks."""
    path = tmp_path / "log.mcap"
    with Log(path, compression="") as log:
        controller = log.channel("/controller", CONTROLLER, title="Controller")

        def chunks(ticks: range) -> int:
            for tick in ticks:
                log.write(controller, np.array([tick]), np.full((1, 3), float(tick)))
                log.flush()
            return tracemalloc.get_traced_memory()[0]

        tracemalloc.start()
        try:
            before, after = chunks(range(1000)), chunks(range(1000, 4000))
        finally:
            tracemalloc.stop()
    assert after - before < 30_000
    summary = make_reader(io.BytesIO(path.read_bytes()), validate_crcs=True).get_summary()
    assert summary
    assert [index.message_start_time for index in summary.chunk_indexes] == list(range(4000))
    assert len(streamed(path.read_bytes())) == 4000
