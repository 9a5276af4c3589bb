"""The whole advice on a device or a scene, also as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

from haploop.launch.plan.idealised import idealised
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.changes import Borne, assumed_otherwise, changed_limits, changes
from haploop.tools.advise.families import Values
from haploop.tools.advise.known import PUBLISHED, Formula, Published, formulas
from haploop.tools.advise.search import Found, search
from haploop.tools.advise.shown import advised_scene, breaking, provisos_of
from haploop.tools.advise.subject import Assumed, Subject
from haploop.tools.advise.walls.cases import every_case, is_ideal, make_loop, task_words
from haploop.tools.advise.walls.corners import ASSUMED, as_built, is_number, quantity, ranges
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.walls.store import Failure, Tried
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.linear.linearity import installed_kinds
from haploop.tools.render.units import format_stiffness

# An advice as one JSON object.
AdviceData = dict[str, Any]
UPPER_BOUND = (
    "Upper bound, not advice: {name} is taken as rigid and its loop as without delay, "
    "which is true of no device. Give --delay and a [transmission]."
)
ADVICE = "Advice on {name}."
VARIED, HALVED, NOT_VARIED = "Varied by 20 %: {0}.", "Halved and doubled: {0}.", "Not varied, as built: {0}."
_RIGID = "The scene has no [transmission]: what a resonance of the structure costs is not included."
_PLUGIN = "The scene's own wall is not tried: its elements come from a plugin file."
HOLDS_MORE = (
    "An element that renders less than its wall may hold more: {0} ({1}), {2} in the loop as described. It "
    "was not tried in every corner; `haploop compare` shows what it holds."
)
FELL = (
    "With {0}, walls of {1} withstand every corner at three holds; at more holds and under attack, a wall of {2} fails."
)
NO_OTHER = (
    "None of these elements, tried with seven parameter values each, allows {0} in every corner, a tenth more "
    "than the best of the wall alone, damping and inertia: {1}."
)
NOR_ANY = "None of these elements, tried with seven parameter values each, allows {0} in every corner either: {1}."
READING = (
    "Every corner: uncertain quantities 20 % more or less, assumed ones halved or doubled, in all combinations, or 32 "
    "if there are more, at holds of 0.3, 1 and 3 times the task's; a dash where an element does not allow a tenth more "
    "than the wall alone. Attacked: at all holds, sways and approaches, as in the first line; a dash where that was "
    "not tried, since another allows more, or nearly as much with fewer elements. *: stiffer walls withstand what a "
    "softer one does not. Changes and assumptions: as described and in the corners hardest on the wall, at the three "
    "holds, with the advised element at half to 1.4 times its size, twice as far if an end of that range suits best, "
    "or with none; and, separately, without one. Same: the difference is within the accuracy of the limits. "
    "Assumed numbers otherwise stay as described, and none of these walls is attacked. Below: that wall fails, and no "
    "softer one was tried."
)
UNCHANGED = "unchanged"
SAFE_MEANS = (
    "at rest, or swinging by less than a hand feels, in position (Israr, Choi and Tan 2006) and in force (what would "
    "move device and hand by as much)"
)


@dataclass(frozen=True)
class Changed:
    """What a changed loop bears in the hardest corners, also as a multiple of what it bears without the change.

    A multiple is 1 where it may be 1 within the tolerances of both limits, and 0 where there is nothing to multiply.
    ``limit`` is with the element tuned again or with none, whichever bears more; ``alone`` is without an element.
    """

    words: str
    limit: Limit
    factor: float
    alone: Limit
    alone_factor: float
    values: Values = ()

    @classmethod
    def from_borne(cls, words: str, borne: Borne, base: Borne) -> Self:
        """Makes it from what the loop bears with and without the change."""
        limits = (borne.limit, base.limit), (borne.alone, base.alone)
        factor, alone = (_multiple(*pair) for pair in limits)
        return cls(words, borne.limit, factor, borne.alone, alone, borne.values)


def _multiple(of: Limit, base: Limit) -> float:
    if of.stiffness_N_m <= base.fails_N_m and base.stiffness_N_m <= of.fails_N_m:
        return 1.0
    return of.stiffness_N_m / base.stiffness_N_m if base.stiffness_N_m else 0.0


@dataclass(frozen=True)
class Advice:
    """The whole advice.

    Attributes:
        is_ideal: whether the device is rigid and its loop has no delay: the advice is then an upper bound.
        tried_by: the task that every wall was tried with, in words.
        uncertain: the factors between which each uncertain quantity, or assumed number, was varied.
        not_varied: what the loop has that was taken as described.
        hand: mass, kg, damping, N s/m, and stiffness, N/m, of the hand; None if there is none.
        grip: damping, N s/m, and stiffness, N/m, of the grip through which the hand holds; None if there is none.
        unchanged: what the unchanged loop bears in the hardest corners, with which the changes are compared.
        changed, without: the same after each change of the device, and without each cause of buzzing, best first.
        assumed: each assumed number with the limits at half and at twice its value.
        own: for a scene with a wall: its stiffness, and how it fails with its own elements, None if it bears all cases.
        scene: the scene that shows the advised wall; None if nothing is safe.
        provisos: the provisos in the verdict of that scene.
        breaks: the scene of the case that breaks first, on the softest wall on which its verdict is not steady; if
            there is none, on the wall that broke, up to the end of the stretch in which that was seen.
    """

    name: str
    notes: tuple[str, ...]
    is_ideal: bool
    tried_by: str
    uncertain: dict[str, tuple[float, float]]
    not_varied: tuple[str, ...]
    hand: tuple[float, float, float] | None
    grip: tuple[float, float] | None
    found: Found
    formulas: tuple[Formula, ...]
    published: tuple[Published, ...]
    unchanged: Changed
    changed: tuple[Changed, ...]
    without: tuple[Changed, ...]
    assumed: tuple[tuple[Assumed, Limit, Limit], ...]
    own: tuple[float, Failure | None] | None
    scene: Scene | None
    breaks: Scene | None
    runs: int
    provisos: tuple[str, ...] = ()

    @property
    def recommended(self) -> dict[str, Any]:
        """What is recommended, as in ``advice.json``: ``element``, ``stiffness_N_m`` and ``parameters``."""
        return {"element": self.element, "stiffness_N_m": self.stiffness_N_m, "parameters": self.parameters}

    @property
    def stiffness_N_m(self) -> float:
        """The stiffest safe wall, N/m, rounded down; 0 where no wall is safe."""
        return self.found.stiffness_N_m

    @property
    def element(self) -> str:
        """The name of the element to use with that wall; ``nothing`` where none is worth having."""
        return self.found.advised.family.name

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters of that element in SI units (N s/m, kg, s, N/m), by ``kind.key``; empty for none."""
        best = self.found.advised
        return {f"{kind}.{key}": size for (kind, key), size in zip(best.family.parts, best.values, strict=True)}

    @property
    def without_N_m(self) -> float:
        """The stiffest safe wall without an element, N/m; 0 where no wall is safe."""
        return self.found.alone_N_m

    def __repr__(self) -> str:
        at_most, best = "at most " if self.is_ideal else "", self.found.advised
        wall = format_stiffness(self.stiffness_N_m) if self.stiffness_N_m else "no wall"
        return f"<Advice on {self.name}: {at_most}{wall} with {best.family.phrase(best.values)}>"

    @property
    def headline(self) -> str:
        """What the device is taken as, and what was varied; the answer is ``recommended``."""
        lead = (UPPER_BOUND if self.is_ideal else ADVICE).format(name=self.name)
        return f"{lead} {reach(self.uncertain, self.not_varied)}"


def advice(subject: Subject, trial: Trial, stage: Callable[[str], object] = lambda name: None) -> Advice:
    """Searches for the wall, then for the effect of changing the device, or what is assumed of it, on that wall."""
    scene, loop = subject.scene, make_loop(subject.scene, subject.has_task)
    assumed = [of for of in subject.assumed if is_number(value_at(loop, of.key))]
    keys = [of.key for of in assumed]
    found = search(loop, keys, trial, stage)
    told: list[str] = []
    if found.others:
        names = "; ".join(each.name for each in found.others)
        told.append((NO_OTHER if found.stiffness_N_m else NOR_ANY).format(format_stiffness(found.worth_N_m, 2), names))
    for of in found.hidden:
        told.append(HOLDS_MORE.format(of.family.name, of.family.words(of.values), format_stiffness(of.held_N_m, 2)))
    for of, below in found.fell:
        if of.safe:
            walls = format_stiffness(of.safe.stiffness_N_m), format_stiffness(below)
            told.append(FELL.format(of.family.phrase(of.values), *walls))
    stage("changes of the device")
    altered, otherwise = changes(loop), assumed_otherwise(loop, keys)
    ideal = {f"no {name}": changed for name, changed in idealised(loop).items()}
    loops = [loop, *altered.values(), *ideal.values(), *otherwise.values()]
    base, *others = changed_limits(trial, loops, found)
    borne = iter(others)

    def rows(some: dict[str, Scene]) -> tuple[Changed, ...]:
        made = [Changed.from_borne(words, next(borne), base) for words in some]
        return tuple(sorted(made, key=lambda row: -row.factor))

    changed, without = rows(altered), rows(ideal)
    by_number = {number: each.limit for number, each in zip(otherwise, borne, strict=True)}
    held, shown = loop.hand if scene.hand else None, advised_scene(subject, loop, found)
    own, notes = None, [] if is_ideal(loop) or loop.transmission else [_RIGID]
    if subject.has_task and scene.wall and scene.wall.stiffness:
        wall = Tried(scene.wall.stiffness, tuple(scene.dissipation))
        if {element.name for element in wall.elements} <= installed_kinds().keys():
            own = wall.stiffness_N_m, trial.failures(loop, [wall], every_case(ranges(loop, keys)))[0]
        else:
            notes.append(_PLUGIN)
    return Advice(
        name=subject.name,
        notes=(*subject.notes, *notes, *told),
        is_ideal=is_ideal(loop),
        tried_by=task_words(loop),
        uncertain=(of := ranges(loop, keys)),
        not_varied=as_built(loop, of),
        hand=(held.mass, held.damping, held.stiffness) if held else None,
        grip=(held.grip.damping, held.grip.stiffness) if held and held.grip else None,
        found=found,
        formulas=tuple(formulas(loop)),
        published=PUBLISHED.get(subject.name, ()),
        unchanged=Changed.from_borne(UNCHANGED, base, base),
        changed=changed,
        without=without,
        assumed=tuple((of, by_number[of.key, 0.5], by_number[of.key, 2.0]) for of in assumed),
        own=own,
        scene=shown,
        breaks=breaking(subject, loop, found),
        runs=trial.runs,
        provisos=provisos_of(shown) if shown else (),
    )


def reach(uncertain: Mapping[str, tuple[float, float]], not_varied: Sequence[str]) -> str:
    """Returns the sentences that say what was varied, and by how much, and what was not."""
    wide = [name for name, ends in uncertain.items() if ends == ASSUMED]
    varied = [name for name in uncertain if name not in wide]
    told = zip((NOT_VARIED, VARIED, HALVED), (not_varied, varied, wide), strict=True)
    return " ".join(sentence.format(", ".join(map(quantity, names))) for sentence, names in told if names)


def advice_data(told: Advice, sentences: list[str]) -> AdviceData:
    """Returns the advice as one JSON object: the recommendation and the sentences first, then all that was found."""
    return {
        "headline": told.headline,
        "recommended": told.recommended,
        "safe_means": SAFE_MEANS,
        "reading": READING,
        "advice": " ".join(sentences),
        **asdict(replace(told, scene=None, breaks=None)),
    }
