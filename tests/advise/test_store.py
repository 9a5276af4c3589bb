"""Trials are kept: an interrupted advice goes on, and a damaged, full or unreadable store is told."""

import json
import os
from dataclasses import replace

import pytest

from haploop.launch.spec import OutputError
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import ElementTable
from haploop.tools.advise.walls.cases import Case
from haploop.tools.advise.walls.store import Failure, Job, Store, Tried
from helpers.scenes.presets import loop_of

JOB = Job(loop_of("touch"), (Tried(1000.0),), (Case(1.0), Case(3.0, (("friction", 0.8),))))
JOBS = dict.fromkeys("abcdf", JOB)


def test_a_changed_number_of_a_loop_makes_another_key():
    store, cases = Store(), [Case(1.0)]
    loop = loop_of("touch")
    key = store.key(loop, Tried(1000.0), cases)
    assert key == store.key(loop_of("touch"), Tried(1000.0), [Case(1.0)])
    changed = with_value(loop, "friction.kinetic", 0.261)
    others = {store.key(changed, Tried(1000.0), cases), store.key(loop, Tried(1000.1), cases),
              store.key(loop, Tried(1000.0), [Case(1.5)])}  # fmt: skip
    assert len(others | {key}) == 4


def test_lines_of_a_damaged_store_are_passed_over_and_whole_ones_of_two_advices_at_once_are_kept(tmp_path):
    file, failure = tmp_path / "walls.jsonl", Failure("hold x 3", 1.0, gone=False, force_N=0.1)
    failure = replace(failure, tried=Case(3.0, (("friction", 0.8),)))
    one, other = Store(file), Store(file)
    one.add({"a": None}, JOBS)
    other.add({"b": failure}, JOBS)
    with file.open("ab") as lines:
        lines.write(b'{"key": "c", "fails": {"case\n\xff\n[1]\n{}\n{"key": "d", "fails": {"no": 1}}\n{"key": "e", "fa')
    one.add({"f": None}, JOBS)
    assert Store(file).known == {"a": None, "b": failure, "f": None}
    assert b"" not in file.read_bytes().split(b"\n")[:-1], "no line is empty"


def test_a_line_of_the_store_says_which_wall_was_tried_with_what_and_what_it_did(tmp_path):
    file, failure = tmp_path / "walls.jsonl", Failure("hold x 3", 1.0, gone=False, force_N=0.1)
    damped = Tried(1420.0, (ElementTable(name="damping", parameters={"damping": 5.0}),))
    Store(file).add({"a": failure}, {"a": replace(JOB, walls=(damped,))})
    told = json.loads(file.read_text())
    assert told["wall_N_m"] == 1420.0
    assert told["elements"] == [{"kind": "damping", "acts": "in-contact", "damping": 5.0}]
    assert (told["cases"], told["first_case"], told["fails"]["case"]) == (2, "hold x 1", "hold x 3")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit of a file's size")
def test_a_full_disk_is_told_in_a_sentence_and_what_was_kept_stays(tmp_path):
    import resource
    import signal

    file = tmp_path / "walls.jsonl"
    kept = Store(file)
    kept.add({"a": None}, JOBS)
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
    try:
        with pytest.raises(OutputError, match=r"walls.jsonl, which keeps .* cannot be used: File too large. Make room"):
            kept.add({"b": None, "c": None}, JOBS)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    kept.add({"d": None}, JOBS)
    assert {"a", "d"} <= Store(file).known.keys() <= {"a", "b", "d"}


def test_a_store_that_cannot_be_read_is_told_in_a_sentence(tmp_path):
    with pytest.raises(OutputError, match="cannot be used: "):
        Store(tmp_path)
