"""Verdicts of loops drawn by seed beside their long-run swings.  python -m helpers.runs.wild_verdicts COUNT [FROM]"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from itertools import count as counted
from itertools import islice
from typing import Any, NamedTuple

from haploop.controller.dissipation import registry
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.judge import judge_scene
from haploop.launch.stability.looks import LOOKS_S
from haploop.protocol.scene.scene import Scene
from helpers.scenes.wild_loops import KINDS, drawn
from oracles.long_hold import swings

# A swing this much stronger than the weakest that is felt counts as felt, and one this much weaker as not felt.
_FELT = 1.1


class Judged(NamedTuple):
    """A loop, the finding at the end of its run, and its swing in the long run over the least that a hand feels."""

    seed: int
    scene: Scene
    finding: Finding
    swings: float

    @property
    def is_unsafe(self) -> bool:
        return self.finding.word == "steady" and self.swings > _FELT

    @property
    def is_false_alarm(self) -> bool:
        return self.finding.word in ("limit-cycle", "growing") and self.swings < 1.0 / _FELT


def judged(seeds: Iterable[int], count: int, each: Callable[..., Iterable[Any]] = map) -> list[Judged]:
    """``count`` loops of the seeds that end in contact without diverging; ``each`` maps the search over the loops."""
    left, found = iter(seeds), list[tuple[int, Scene, Finding]]()
    while len(found) < count and (some := [*islice(left, count - len(found))]):
        loops = [(seed, scene) for seed in some if (scene := drawn(seed))]
        findings = each(_found, [scene for _, scene in loops])
        told = ((*loop, finding) for loop, finding in zip(loops, findings, strict=True))
        found += [one for one in told if one[2].word not in ("diverged", "no-contact")]
    long = swings([scene.as_dict() for _, scene, _ in found])
    return [Judged(*one, most) for one, most in zip(found, long, strict=True)]


def _found(scene: Scene) -> Finding:
    return judge_scene(scene, registry(), None, LOOKS_S, thorough=True)


def main() -> None:
    count, first = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    with ProcessPoolExecutor() as pool:
        loops = judged(counted(first), count, pool.map)
    words = Counter((KINDS[one.seed % len(KINDS)], one.finding.word) for one in loops)
    for kind in KINDS:
        print(f"{kind:10}", ", ".join(f"{word} {n}" for (of, word), n in sorted(words.items()) if of == kind))
    told = {
        "undecided": [one for one in loops if one.finding.word == "undecided"],
        "unsafe": [one for one in loops if one.is_unsafe],
        "false alarm": [one for one in loops if one.is_false_alarm],
    }
    for name, some in told.items():
        print(f"{name}: {len(some)} of {len(loops)}, {100 * len(some) / len(loops):.1f} %")
        for one in some:
            kind, finding = KINDS[one.seed % len(KINDS)], one.finding
            print(f"  {one.seed} {kind}, {one.swings:.3g} times felt: {finding.word}. {finding.sentence()}")
    blown = [one.finding.blown for one in loops if one.finding.blown]
    print(f"swing on after a blow: {blown.count('swings on')} of {len(blown)} that rest after a push and were struck")


if __name__ == "__main__":
    main()
