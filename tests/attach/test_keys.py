"""Keys of runs: made whole, private, one for each; what cannot guard a run is refused with a sentence."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from haploop.protocol.transport.keys import CLIENT, CLOCK, KeysError, make_keys, read_keys
from haploop.protocol.transport.messages import PROCESSES
from helpers.live.in_process import ask

HOLDERS = (CLOCK, *PROCESSES, CLIENT)


@pytest.fixture
def keys(tmp_path) -> Path:
    assert make_keys(tmp_path / "keys") == list(HOLDERS)
    return tmp_path / "keys"


def content(keys: Path) -> dict[str, bytes]:
    return {str(path.relative_to(keys)): path.read_bytes() for path in keys.rglob("*") if path.is_file()}


def test_keys_are_private_different_and_kept_when_they_are_asked_for_again(keys):
    secrets = [keys / f"{holder}.key_secret" for holder in HOLDERS]
    assert all(path.stat().st_mode & 0o077 == 0 for path in (keys, *secrets))
    before = content(keys)
    assert len(set(before.values())) == len(HOLDERS) + 2
    assert make_keys(keys) == []
    assert content(keys) == before


@pytest.mark.parametrize("lost", ["controller.key_secret", "client.key_secret", "clock.key_secret", "clock.key"])
def test_half_made_keys_are_refused_then_completed_and_what_is_there_stays(keys, lost):
    before = content(keys)
    (keys / lost).unlink()
    if lost == "clock.key_secret":  # interrupted before its public part was written
        (keys / "clock.key").unlink()
    with pytest.raises(KeysError, match=r"key(_secret)? is missing"):
        [read_keys(keys, holder) for holder in HOLDERS]
    make_keys(keys)
    holder = lost.removesuffix("_secret").removesuffix(".key")
    changed = {name for name, of in content(keys).items() if before[name] != of}
    assert changed <= {lost, f"{holder}.key", f"{CLIENT}s/{holder}.key"}
    assert read_keys(keys, CLOCK).known[f"clients/{CLIENT}"] == read_keys(keys, CLIENT).public


def test_a_client_whose_public_key_is_taken_away_is_known_no_more(keys):
    (keys / "clients/client.key").unlink()
    assert read_keys(keys, CLIENT).public not in read_keys(keys, CLOCK).known.values()


def test_a_client_needs_two_files_and_its_copy_makes_no_keys_of_its_own(keys, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir(mode=0o700)
    for name in ("clock.key", "client.key_secret"):
        shutil.copy2(keys / name, copy)
    assert read_keys(copy, CLIENT).clock == read_keys(keys, CLOCK).public
    with pytest.raises(KeysError, match=r"clock\.key_secret is missing"):
        read_keys(copy, CLOCK)
    with pytest.raises(KeysError, match="as a client's copy does"):
        make_keys(copy)
    assert sorted(path.name for path in copy.glob("*.*")) == ["client.key_secret", "clock.key"]


@pytest.mark.parametrize(
    ("name", "mode", "words"),
    [
        ("", 0o777, "is writable to others"),
        ("clients", 0o775, "is writable to others"),
        ("controller.key_secret", 0o644, r"is open to others \(mode 0644\); repair it with chmod 600"),
    ],
)
def test_keys_that_others_can_read_or_replace_are_refused_with_the_way_to_mend_it(keys, name, mode, words):
    (keys / name).chmod(mode)
    with pytest.raises(KeysError, match=words):
        read_keys(keys, CLOCK)


def test_a_key_that_anybody_can_read_is_no_matter_where_it_is_public(keys):
    keys.chmod(0o755)
    (keys / "clock.key").chmod(0o644)
    assert read_keys(keys, CLIENT).known == {}


@pytest.mark.parametrize(
    "text", ["", "hello", 'curve\n    public-key = "short"\n    secret-key = "short"\n', "\xff\xfe"]
)
@pytest.mark.parametrize("name", ["plant.key_secret", "clients/client.key"])
def test_a_file_that_is_no_certificate_is_named(keys, name, text):
    (keys / name).write_bytes(text.encode("latin-1"))
    with pytest.raises(KeysError, match=rf"{name} (is not a CURVE certificate|cannot be read)"):
        read_keys(keys, CLOCK)


def test_the_command_makes_keys_and_says_what_goes_to_another_host(tmp_path):
    answer = ask("keys", str(tmp_path / "keys"))
    assert answer.status == 0
    assert "clock.key" in answer.stdout
    assert "client.key_secret alone" in answer.stdout
    (tmp_path / "file").write_text("")
    refused = ask("keys", str(tmp_path / "file"))
    assert (refused.status, refused.stderr.count("\n")) == (2, 1)
    assert refused.stderr.startswith("Keys cannot be made in")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("status", "--at", "nobody"), "--at takes"),
        (("status", "--at", "lab:x"), "A port from 1 to 65535"),
        (("status", "--at", "127.0.0.1:9", "--run", "ab"), "leave one of them out"),
        (("status", "--keys", "somewhere"), "name its address with --at"),
        (("set", "wall.stiffness=1", "--at", "lab"), "--at must be a time"),
        (("status", "--at", "127.0.0.1:9", "--keys", "nowhere"), "There is no directory of keys nowhere"),
        (("status", "--at", "host.invalid:9"), "is not a host that is known here"),
        (("join", "nowhere.json"), "nowhere.json cannot be read"),
        (("join", __file__), "is not a file that haploop run --external"),
    ],
)
def test_an_address_or_keys_that_cannot_be_meant_are_a_sentence(arguments, words):
    answer = ask(*arguments)
    assert (answer.status, answer.broken()) == (2, "")
    assert words in answer.stderr
