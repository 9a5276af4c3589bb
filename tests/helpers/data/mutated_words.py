"""Command lines as typing, shells and scripts spoil them: seeded mutations of correct ones.

``PYTHONPATH=tests python -m helpers.data.mutated_words FIRST END`` tries some seeds and reports each that breaks.
"""

from __future__ import annotations

import contextlib
import random
import shlex
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from helpers.data.damage import damage
from helpers.live.in_process import Answer, ask
from helpers.scenes.brake import source

SCENE = Path(__file__).parents[3] / "launch" / "scenes" / "fig6c.toml"
# Replacements for a word or its value.
_ODD = (
    "", " ", "-", "--", "=", "==", "0", "-1", "1e308", "-1e308", "nan", "inf", "1e-320", "99999999999999999999", "0x10",
    "1_0", "true", "[]", "{}", "[[[]]]", '"', "'", "\n", "\0", "\udce9", "µ", "1 µm", "1 N/mm", "5 s", "1 parsec", "٣",
    "½", "a" * 5000, "[" * 2000, "/", "..", "/dev/null", "/dev/zero", "/proc/self/mem", "*", "$HOME", "%s", "{0}",
    "--json", "--help", "--set", "--out",
)  # fmt: skip
LINES = (
    f"check {SCENE} --set wall.stiffness=100",
    f"check {SCENE} --set event.0.at=0.5 --set \"event.0.set={{'wall.stiffness'=200.0}}\" --json",
    f"explain {SCENE} --set velocity.estimator=foaw --set velocity.ticks=5 --json",
    f"run {SCENE} --set duration=0.01 --set run.verdict=window --in-process --out new --json",
    f"run {SCENE} --set duration=0.01 --in-process --pace free --plugin brake.py",
    "replay done --json",
    "judge done --json",
    "export done --to csv --topics controller,plant --out exported --force",
    "dissipate recording.csv --damping 0.5 --mass 0.01 --position x --time t --unit mm --out figure.png --json",
    'dissipate recording.csv --element "damping damping=0.5" --wall 0 --occupies above --delay 0.001 --json',
    "dissipate done --damping 0.5 --set velocity.cutoff=100 --json",
    "plugins --plugin brake.py --json",
    "status --json",
    "pause --run abcdef",
    "step 10 --run abcdef",
    "pace 0.5",
    "swap damping damping=0.8 --element 0 --at 1.5",
    "set wall.stiffness=100 --at 1.5 --json",
)


def drop(rng: random.Random, words: list[str]) -> None:
    del words[rng.randrange(len(words))]


def double(rng: random.Random, words: list[str]) -> None:
    words.insert(rng.randrange(len(words) + 1), rng.choice(words))


def exchange(rng: random.Random, words: list[str]) -> None:
    a, b = rng.randrange(len(words)), rng.randrange(len(words))
    words[a], words[b] = words[b], words[a]


def replace(rng: random.Random, words: list[str]) -> None:
    words[rng.randrange(len(words))] = rng.choice(_ODD)


def replace_value(rng: random.Random, words: list[str]) -> None:
    """Replaces the key or the value of KEY=VALUE."""
    at = rng.randrange(len(words))
    key, equals, value = words[at].partition("=")
    words[at] = rng.choice(
        [f"{key}{equals}{rng.choice(_ODD)}", f"{rng.choice(_ODD)}{equals}{value}", f"{key}.0={value}"]
    )


def mistype(rng: random.Random, words: list[str]) -> None:
    at = rng.randrange(len(words))
    place = rng.randrange(len(words[at]) + 1)
    words[at] = words[at][:place] + rng.choice("aeE0123456789.-+=[]{}\"' ,µ/\\") + words[at][place + rng.randrange(2) :]


MUTATIONS: tuple[Callable[[random.Random, list[str]], None], ...] = (
    drop, double, exchange, replace, replace_value, replace_value, mistype, mistype,
)  # fmt: skip


class MutatedWords:
    """A folder with a run, a recording and a plugin, in which the command lines make sense."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        (folder / "brake.py").write_text(source(), encoding="utf-8")
        rows = "\n".join(f"{k / 1000:.3f},{0.01 * k * k:.6g}" for k in range(200))
        self._recording = f"t (s),x (mm)\n{rows}\n".encode()
        with contextlib.chdir(folder):
            made = ask(
                "run",
                str(SCENE),
                "--set",
                "duration=0.3",
                "--set",
                "run.verdict=window",
                "--in-process",
                "--out",
                "done",
            )
        assert not made.status, made

    def attempt(self, seed: int) -> tuple[list[str], Answer]:
        """Mutates a command line, in one of five cases also the recording, and runs it."""
        rng = random.Random(seed)
        words = shlex.split(rng.choice(LINES))
        for _ in range(rng.choice([1, 1, 1, 2])):
            if len(words) > 1:
                rng.choice(MUTATIONS)(rng, words)
        recording = self._folder / "recording.csv"
        with _fresh(recording, self._recording), contextlib.chdir(self._folder):
            if rng.random() < 0.2:
                damage(rng, recording)
            answer = ask(*words)
        for made in ("new", "runs", "exported"):
            shutil.rmtree(self._folder / made, ignore_errors=True)
        return words, answer


@contextlib.contextmanager
def _fresh(path: Path, content: bytes) -> Iterator[None]:
    path.write_bytes(content)
    try:
        yield
    finally:
        path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)


def main(first: int, end: int) -> None:
    broken, statuses = 0, [0, 0, 0]
    with tempfile.TemporaryDirectory() as folder:
        words = MutatedWords(Path(folder))
        for seed in range(first, end):
            line, answer = words.attempt(seed)
            if fault := answer.broken():
                broken += 1
                print(f"seed {seed}, {[word[:60] for word in line]}:\n{fault}", flush=True)
            else:
                statuses[answer.status] += 1
    print(f"{end - first} tried, {broken} broken, exit statuses 0, 1, 2: {statuses}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
