"""What was tried is kept: an interrupted advice goes on, and a damaged, full or unreadable store is told."""

import os

import pytest

from haploop.launch.spec import OutputError
from haploop.protocol.scene.paths import with_value
from haploop.tools.advise.walls.cases import Case
from haploop.tools.advise.walls.trial import Failure, Store, Tried
from helpers.scenes.presets import loop_of


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
    one, other = Store(file), Store(file)
    one.add({"a": None})
    other.add({"b": failure})
    with file.open("ab") as lines:
        lines.write(b'["c", {"case": "x", "at\n\xff\xfe\n[1]\n{}\n["d", {"no": 1}]\n["e", nul')
    one.add({"f": None})
    assert Store(file).known == {"a": None, "b": failure, "f": None}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit of a file's size")
def test_a_full_disk_is_told_in_a_sentence_and_what_was_kept_stays(tmp_path):
    import resource
    import signal

    file = tmp_path / "walls.jsonl"
    kept = Store(file)
    kept.add({"a": None})
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
    try:
        with pytest.raises(OutputError, match=r"walls.jsonl, where .* cannot be used: File too large. Make room"):
            kept.add({"b": None, "c": None})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    kept.add({"d": None})
    assert {"a", "d"} <= Store(file).known.keys() <= {"a", "b", "d"}


def test_a_store_that_cannot_be_read_is_told_in_a_sentence(tmp_path):
    with pytest.raises(OutputError, match="cannot be used: "):
        Store(tmp_path)
