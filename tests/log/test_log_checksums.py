"""The checksums of a log: what a flipped bit in any of its records does, in a whole log and in one that was cut."""

from __future__ import annotations

import io
import os

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.records import DataEnd
from mcap.stream_reader import StreamReader

from haploop.logger import read
from haploop.logger.log import LogError
from haploop.logger.log.recording import Recording, Rows
from haploop.logger.log.records import records
from haploop.logger.log.stream import LogStream, survey
from helpers.data.logs import SCENE, same_bits, swapped_run


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return (swapped_run(tmp_path_factory.mktemp("run"), ticks=60, flush_ticks=10) / "log.mcap").read_bytes()


def data_end(log: bytes) -> int:
    """Where the data of a log ends and its closing summary begins."""
    return next(at for at, opcode, _ in places(log) if opcode == Opcode.DATA_END)


def places(log: bytes) -> list[tuple[int, int, int]]:
    """Start, opcode and length of the content of every record."""
    found, at = [], 8
    while at + 9 <= len(log) - 8:
        length = int.from_bytes(log[at + 1 : at + 9], "little")
        found.append((at, log[at], length))
        at += 9 + length
    return found


def size(rows: Rows) -> int:
    return len(rows) if isinstance(rows, list) else len(next(iter(rows.values())))


def differs_unsaid(damaged: Recording, undamaged: Recording) -> str:
    """What is wrong with what was read of a damaged log: numbers that are not those of the undamaged one, or fewer
    without a word; "" for nothing."""
    for topic, rows in damaged.items():
        if not size(rows):
            continue
        if topic not in undamaged:
            return f"a new topic {topic}"
        if isinstance(rows, list):
            if rows != undamaged[topic][: len(rows)]:
                return f"other maps on {topic}"
        else:
            for name, column in rows.items():
                if name not in undamaged[topic] or undamaged[topic].units[name] != rows.units[name]:
                    return f"a new column {name} of {topic}, or in another unit"
                if not same_bits(column, undamaged[topic][name][: len(column)]):
                    return f"other numbers in {name} of {topic}"
    same = damaged.keys() >= undamaged.keys() and all(size(damaged[t]) == size(undamaged[t]) for t in undamaged)
    same &= damaged.attachments == undamaged.attachments
    return "" if same or damaged.cut else "less, without a word"


@pytest.mark.parametrize("step", [19, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("share", [1.0, 0.6])
def test_no_flipped_bit_of_any_byte_gives_a_wrong_number_or_hides_a_right_one(whole, share, step, tmp_path):
    """One bit of the first 50 bytes of every record, and of some further on, in a whole log and in one cut off."""
    log, path = whole[: int(share * len(whole))], tmp_path / "log.mcap"
    path.write_bytes(log)
    undamaged = read(path)
    starts = [(at, 9 + length) for at, _, length in places(log)]
    bytes_tried = {at + by for at, size in starts for by in (*range(min(size, 50)), *range(50, size, 97))}
    for at in sorted(at for at in bytes_tried if at < len(log))[::step]:
        path.write_bytes(log[:at] + bytes([log[at] ^ 1 << at % 8]) + log[at + 1 :])
        try:
            found = read(path)
        except LogError:
            continue
        assert not (fault := differs_unsaid(found, undamaged)), f"byte {at}: {fault}"


def test_a_flipped_bit_of_the_attached_scene_is_told_and_the_scene_is_left_out(whole, tmp_path):
    at, path = whole.index(SCENE) + 3, tmp_path / "log.mcap"
    path.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
    found = read(path)
    assert "scene.toml" not in found.attachments
    assert "does not match its checksum and was left out" in found.cut
    assert found["/plant"]["x"].size == 601


def test_a_description_that_is_damaged_outside_its_chunk_is_taken_from_within(whole, tmp_path):
    """The first schema, that of the events, then the plant's: the numbers keep their names and units."""
    path = tmp_path / "log.mcap"
    path.write_bytes(whole[: data_end(whole)])
    units = survey(path).units
    for name in (b'"unit": "m/s"', b'"force"', b"/plant"):
        at = whole.index(name) + len(name) - 2
        path.write_bytes(whole[:at] + b"q" + whole[at + 1 : data_end(whole)])
        assert survey(path).units == units


def test_a_chunk_that_is_missing_ends_the_reading_there(whole, tmp_path):
    """As where blocks of a disk were lost; a hole in the middle of a run is no run."""
    chunks = [(at, length) for at, opcode, length in places(whole) if opcode == Opcode.CHUNK]
    at, length = chunks[2]
    path = tmp_path / "log.mcap"
    path.write_bytes(whole[:at] + whole[at + 9 + length :])
    found = read(path)
    assert found["/plant"]["x"].size == 200
    assert "message 20 of /plant was expected" in found.cut


def test_the_checksums_are_those_of_the_mcap_format(whole):
    data_ends = [one for one in StreamReader(io.BytesIO(whole), validate_crcs=True).records if isinstance(one, DataEnd)]
    assert [bool(one.data_section_crc) for one in data_ends] == [True]


def test_a_log_reads_in_pieces_as_it_grows_with_its_checksum_over_all(whole, tmp_path):
    """Iterated over twice, before and after its end was written."""
    path = tmp_path / "log.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    log = LogStream(path, "/plant")
    rows = sum(len(batch.rows["x"]) for batch in log if not isinstance(batch.rows, list))
    path.write_bytes(whole)
    rows += sum(len(batch.rows["x"]) for batch in log if not isinstance(batch.rows, list))
    assert (rows, log.cut) == (601, "")


@pytest.mark.parametrize("what", ["directory", "pipe", "link to itself", "device"])
def test_what_is_no_file_is_refused_at_once(what, tmp_path):
    path = tmp_path / "log.mcap"
    match what:
        case "directory":
            path.mkdir()
        case "pipe":
            os.mkfifo(path)
        case "device":
            path.symlink_to("/dev/zero")
        case _:
            path.symlink_to("log.mcap")
    with pytest.raises(LogError, match=r"The log .*log\.mcap cannot be read: "):
        read(tmp_path)


def test_records_of_a_whole_log_are_all_gone_through(whole, tmp_path):
    (tmp_path / "log.mcap").write_bytes(whole)
    with (tmp_path / "log.mcap").open("rb") as file:
        file.seek(8)
        assert np.array([opcode for opcode, _ in records(file)]).tolist() == [opcode for _, opcode, _ in places(whole)]
