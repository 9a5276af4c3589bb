"""``make simulate``: plays seed after seed, goes on where it was stopped, and shows the shortest history that fails."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import haploop
from simulation.plan import draw, shrink, tell
from simulation.play import play

_PIECE = 50


def failure(seed: int) -> str:
    """Returns why a seed fails, with its shortest history; "" where it does not."""
    broken = play(draw(seed)).broken
    if not broken:
        return ""
    shortest = shrink(draw(seed), lambda plan: bool(play(plan).broken))
    outcome = play(shortest)
    history = "\n".join(f"  {when - 1000.0:10.6f} s  {what}" for when, what in outcome.history[-12:])
    told = outcome.broken.strip().splitlines()[-1]
    return f"seed {seed} breaks a promise: {broken}\nits shortest history: {told}\n{tell(shortest)}\n{history}"


def _play_piece(seeds: range) -> tuple[Counter[str], list[str]]:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one who hands out the seeds
    tally: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="hl") as directory:
        os.environ["XDG_RUNTIME_DIR"] = directory
        failures = []
        for seed in seeds:
            outcome = play(draw(seed), reads_log=seed % 4 == 0)
            tally.update([f"ended: {outcome.how}", *(f"fault: {kind}" for kind in outcome.kinds)])
            failures += [failure(seed)] if outcome.broken else []
    return tally, failures


def digest_of_the_code() -> str:
    """A digest of every module that is played or plays: what an older program kept says nothing of this one."""
    digest = hashlib.sha256()
    for folder in (*haploop.__path__, Path(__file__).parent):
        for module in sorted(Path(folder).rglob("*.py")):
            digest.update(module.read_bytes())
    return digest.hexdigest()


def pieces(first: int, last: int) -> Iterator[range]:
    for start in range(first, last, _PIECE):
        yield range(start, min(start + _PIECE, last))


def main() -> None:
    parser = argparse.ArgumentParser(description="Plays simulated histories of haploop's processes.")
    parser.add_argument("--seeds", type=int, default=2000, help="how many, those tried before included")
    parser.add_argument("--from", dest="first", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes beside each other")
    parser.add_argument("--state", type=Path, default=Path("runs/simulation.json"), help="what was tried so far")
    given = parser.parse_args()
    state = json.loads(given.state.read_text()) if given.state.exists() else {}
    begun = {"first": given.first, "code": digest_of_the_code()}
    if begun != {key: state.get(key) for key in begun}:  # other seeds, or another program
        state = {**begun, "next": given.first, "tally": {}, "failures": []}
    tally, began, start = Counter(state["tally"]), time.monotonic(), state["next"]
    given.state.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(given.jobs) as pool:
        try:
            todo = list(pieces(start, given.first + given.seeds))
            for piece, (counted, failures) in zip(
                pieces(start, given.first + given.seeds), pool.map(_play_piece, todo), strict=True
            ):
                tally.update(counted)
                for text in failures:
                    print("\n" + text, flush=True)
                state |= {"next": piece.stop, "tally": dict(tally), "failures": [*state["failures"], *failures]}
                given.state.write_text(json.dumps(state, indent=1))
                each_ms = 1e3 * (time.monotonic() - began) / (piece.stop - start)
                print(
                    f"\rseeds {given.first} to {piece.stop - 1}, {len(state['failures'])} fail, {each_ms:.1f} ms each",
                    end="",
                    flush=True,
                )
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            print(f"\nstopped; the same command goes on from seed {state['next']}")
    print(f"\nseeds {given.first} to {state['next'] - 1}: {len(state['failures'])} fail")
    for text in state["failures"]:
        print(text.splitlines()[0])
    for what, count in sorted(tally.items()):
        print(f"{count:8d}  {what}")
    sys.exit(bool(state["failures"]))


if __name__ == "__main__":
    main()
