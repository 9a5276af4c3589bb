"""haploop.logger.read: what the log holds comes back as arrays, from whole, cut and damaged files."""

from __future__ import annotations

import contextlib
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from haploop.logger import read
from haploop.logger.log import LogError
from haploop.logger.log.recording import Recording, Table
from haploop.logger.log.writer import Compression, Log
from haploop.tools.command.options import what_was_logged

PLANT = {"timestamp": "s", "t": "s", "x": "m", "v": "m/s", "force": "N"}


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype == np.float64 and a.tobytes() == np.ascontiguousarray(b).tobytes()


def write_blocks(path: Path, blocks: list[np.ndarray], compression: Compression = "lz4") -> None:
    """/plant blocks of shape (messages, 10, 5) and an event a block, a chunk each."""
    first = 0
    with Log(path, compression=compression) as log:
        plant = log.channel("/plant", PLANT, samples_per_message=10, title="Plant")
        events = log.channel("/events", {}, title="Events")
        for block in blocks:
            log.write(plant, np.arange(first, first + len(block)), block)
            log.message(events, first, {"tick": first, "swap": {"kind": "damping", "damping": 0.8}})
            first += len(block)
            log.flush()


@settings(max_examples=30, deadline=None)
@given(
    sizes=st.lists(st.integers(1, 30), min_size=1, max_size=5),
    seed=st.integers(0, 2**32),
    compression=st.sampled_from(["", "lz4"]),
    share=st.floats(0, 1),
)
def test_a_log_cut_anywhere_gives_its_values_bit_for_bit_up_to_the_cut(
    tmp_path_factory: pytest.TempPathFactory, sizes: list[int], seed: int, compression: Compression, share: float
) -> None:
    directory = tmp_path_factory.mktemp("run")
    rng = np.random.default_rng(seed)
    blocks = [rng.integers(0, 2**64, size=(size, 10, 5), dtype=np.uint64).view(np.float64) for size in sizes]
    write_blocks(directory / "log.mcap", blocks, compression)
    rows = np.concatenate(blocks).reshape(-1, 5)

    whole = read(directory)
    assert (whole.truncated, whole.cut) == (False, "")
    assert list(whole) == ["/plant", "/events"]
    assert whole["/plant"].units == PLANT
    for number, name in enumerate(PLANT):
        assert same_bits(whole["/plant"][name], rows[:, number])
    assert [event["tick"] for event in whole["/events"]] == [sum(sizes[:i]) for i in range(len(sizes))]
    assert whole["/events"][0] == {"tick": 0, "swap": {"kind": "damping", "damping": 0.8}}

    content = (directory / "log.mcap").read_bytes()
    content = content[: max(8, int(share * len(content)))]
    (directory / "log.mcap").write_bytes(content)
    part = read(directory)
    assert part.truncated == (share < 1)
    assert bool(part.cut) == part.truncated
    found = len(part["/plant"]["x"]) if "/plant" in part else 0
    assert found // 10 in np.cumsum([0, *sizes])
    for number, name in enumerate(PLANT if found else {}):
        assert same_bits(part["/plant"][name], rows[:found, number])


def test_a_log_still_being_written_is_read_up_to_its_last_flush(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        channel = log.channel("/energy", {"timestamp": "s", "wall.true": "J"}, title="Energy")
        log.write(channel, np.arange(3), np.arange(6.0).reshape(3, 2))
        assert read(tmp_path)["/energy"]["wall.true"].size == 0
        log.flush()
        recording = read(tmp_path)
        assert recording["/energy"]["wall.true"].tolist() == [1.0, 3.0, 5.0]
        assert recording.truncated
        assert recording.cut.startswith(f"The log {tmp_path / 'log.mcap'} was cut off or is still being written")
    assert not read(tmp_path).truncated


def test_channels_of_one_topic_join_in_the_order_of_time_with_nan_for_absent_columns(tmp_path: Path) -> None:
    """As after a swap there and back, all within one chunk, where each channel's messages stand together."""
    with Log(tmp_path / "log.mcap") as log:
        one = log.channel("/controller", {"x": "m", "dissipation.0": "N"}, title="Controller")
        two = log.channel("/controller", {"x": "m", "dissipation.1": "N"}, title="Controller")
        log.write(one, np.array([0, 1]), np.array([[0.0, 10.0], [1.0, 11.0]]))
        log.write(two, np.array([2, 3]), np.array([[2.0, 22.0], [3.0, 23.0]]))
        log.write(one, np.array([4]), np.array([[4.0, 14.0]]))
    table = read(tmp_path)["/controller"]
    nan = np.nan
    assert table.units == {"x": "m", "dissipation.0": "N", "dissipation.1": "N"}
    assert table["x"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    np.testing.assert_array_equal(table["dissipation.0"], [10.0, 11.0, nan, nan, 14.0])
    np.testing.assert_array_equal(table["dissipation.1"], [nan, nan, 22.0, 23.0, nan])


def test_messages_of_other_sample_counts_join_on_one_topic(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        ticks = log.channel("/plant", {"x": "m"}, samples_per_message=3, title="Plant")
        last = log.channel("/plant", {"x": "m"}, samples_per_message=1, title="Plant")
        log.write(ticks, np.array([0, 1]), np.arange(6.0).reshape(2, 3, 1))
        log.write(last, np.array([2]), np.full((1, 1, 1), 6.0))
    assert read(tmp_path)["/plant"]["x"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_an_attachment_comes_back(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        log.attach("scene.toml", "application/toml", b"duration = 3.0\n")
    assert read(tmp_path / "log.mcap").attachments == {"scene.toml": b"duration = 3.0\n"}


def test_a_flipped_bit_ends_the_reading_before_its_chunk(tmp_path: Path) -> None:
    blocks = [np.full((30, 10, 5), float(number)) for number in range(3)]
    write_blocks(tmp_path / "log.mcap", blocks, "")
    content = bytearray((tmp_path / "log.mcap").read_bytes())
    at = content.index(struct.pack(">d", 1.0))
    content[at + 5] ^= 1
    (tmp_path / "log.mcap").write_bytes(content)
    recording = read(tmp_path)
    assert recording["/plant"]["x"].tolist() == [0.0] * 300
    assert recording.truncated
    assert "damaged: crc validation failed" in recording.cut


@settings(max_examples=50, deadline=None)
@given(share=st.floats(0, 1, exclude_max=True), byte=st.integers(1, 255), length=st.integers(1, 30))
def test_damage_anywhere_gives_a_recording_or_a_log_error(
    tmp_path_factory: pytest.TempPathFactory, share: float, byte: int, length: int
) -> None:
    path = tmp_path_factory.mktemp("damaged") / "log.mcap"
    write_blocks(path, [np.ones((2, 10, 5))] * 3, "lz4")
    content = bytearray(path.read_bytes())
    at = int(share * len(content))
    content[at : at + length] = bytes(one ^ byte for one in content[at : at + length])
    path.write_bytes(content)
    with contextlib.suppress(LogError):
        read(path)


def test_a_wrong_name_is_answered_with_the_right_ones(tmp_path: Path) -> None:
    write_blocks(tmp_path / "log.mcap", [np.zeros((1, 10, 5))])
    recording = read(tmp_path)
    with pytest.raises(KeyError, match="its channels are /plant, /events"):
        recording["/plnt"]
    with pytest.raises(KeyError, match="the columns are timestamp, t, x, v, force"):
        recording["/plant"]["y"]


def test_importing_the_logger_imports_no_heavy_library() -> None:
    code = "import sys, haploop.logger; print({'numpy', 'mcap', 'msgpack', 'lz4'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


def test_a_recording_and_its_tables_print_as_names_units_and_rows_without_numbers():
    table = Table([("t", np.linspace(0.0, 7.7, 5)), ("n", np.zeros(5))], {"t": "s", "n": ""})
    assert repr(table) == "<5 rows of t (s), n>"
    assert repr(Table([], {})) == "<0 rows of no columns>"
    kept = Recording({"/plant": table, "/events": [{"stop": True}]}, "It ends early.", {})
    assert repr(kept).splitlines() == [
        "<recording, cut: It ends early.>", "/plant: <5 rows of t (s), n>", "/events: <1 maps>",
    ]  # fmt: skip


@pytest.mark.parametrize(("controller_s", "said"), [(0.37, ": /plant to 0.300 s, /controller to 0.370 s."), (0.3, ".")])
def test_of_a_run_that_failed_it_is_said_until_when_each_part_was_logged_where_they_end_apart(
    tmp_path: Path, controller_s: float, said: str
) -> None:
    with Log(tmp_path / "log.mcap") as log:
        for topic, end_s in (("/plant", 0.3), ("/controller", controller_s)):
            channel = log.channel(topic, {"timestamp": "s"}, title=topic)
            log.write(channel, np.arange(2), np.array([[0.0], [end_s]]))
    assert what_was_logged(tmp_path).startswith(f"What was logged is in {tmp_path}{said}")
