"""haploop.logger.read on files it did not write: MCAP logs of other programs, and what is no log at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from haploop.logger import read
from haploop.logger.log import LogError


def foreign(path: Path, topics: dict[str, list[Any]], **options: Any) -> None:
    """A log by the mcap library's own writer: the topics' messages in turns, topic by topic at each time."""
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start()
        channels = {}
        for topic, contents in topics.items():
            numbers = {name: {"type": "number", "unit": "m"} for name in ("x", "v")}
            schema: dict[str, Any] = {"type": "object", "properties": numbers}
            if isinstance(contents[0], list):
                schema = {"type": "array", "items": schema, "minItems": 1}
            number = writer.register_schema("foreign", "jsonschema", json.dumps(schema).encode())
            channels[topic] = writer.register_channel(topic, "msgpack", number)
        for time, row in enumerate(zip(*topics.values(), strict=True)):
            for topic, content in zip(topics, row, strict=True):
                writer.add_message(channels[topic], time, bytes(msgpack.packb(content) or b""), time)
        writer.finish()


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4, "chunk_size": 200},
        {"use_chunking": False},
    ],
    ids=["zstd", "small chunks", "no chunks"],
)
def test_a_log_of_another_program_reads_the_same(tmp_path: Path, options: dict[str, Any]) -> None:
    """Interleaved messages, numbers of other widths, another order of keys, absent keys, arrays of changing length."""
    path = tmp_path / "log.mcap"
    topics: dict[str, list[Any]] = {
        "/ours": [{"x": 0.5 * i, "v": -1.0 * i} for i in range(20)],
        "/ints": [{"x": i, "v": -i} for i in range(20)],
        "/order": [{"v": -1.0 * i, "x": 0.5 * i} for i in range(20)],
        "/absent": [{"x": 1.0} if i % 2 else {"v": 2.0} for i in range(20)],
        "/batches": [[{"x": float(i), "v": 0.0}] * (i % 3) for i in range(20)],
    }
    foreign(path, topics, **options)
    found = read(path)
    assert not found.truncated
    steps = np.arange(20.0)
    assert found["/ours"]["x"].tolist() == found["/order"]["x"].tolist() == (0.5 * steps).tolist()
    assert found["/ours"]["v"].tolist() == found["/order"]["v"].tolist() == found["/ints"]["v"].tolist()
    assert found["/ints"]["x"].tolist() == steps.tolist()
    np.testing.assert_array_equal(found["/absent"]["x"], np.where(steps % 2 == 1, 1.0, np.nan))
    np.testing.assert_array_equal(found["/absent"]["v"], np.where(steps % 2 == 0, 2.0, np.nan))
    assert found["/batches"]["x"].tolist() == [float(i) for i in range(20) for _ in range(i % 3)]


def test_what_is_no_log_is_refused_with_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"There is no .*nowhere; give the directory of a run"):
        read(tmp_path / "nowhere")
    with pytest.raises(FileNotFoundError, match=r"holds no log\.mcap"):
        read(tmp_path)
    log = tmp_path / "log.mcap"
    log.write_bytes(b"")
    with pytest.raises(LogError, match="is empty"):
        read(tmp_path)
    log.write_bytes(b"t,x\n0.0,1.0\n")
    with pytest.raises(LogError, match="is not an MCAP file"):
        read(tmp_path)
    with log.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.register_channel("/image", "cdr", 0)
        writer.add_message(1, 0, b"", 0)
        writer.finish()
    with pytest.raises(LogError, match="/image is cdr"):
        read(tmp_path)
    foreign(log, {"/words": [{"x": "one", "v": "two"}]})
    with pytest.raises(LogError, match="/words is not a msgpack map"):
        read(tmp_path)
