"""The report of an outcome on the terminal, and the sentences that the figure shares with it."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from haploop.protocol.amounts import amount, fixed
from haploop.protocol.filled import filled
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.scene import Scene
from haploop.tools.dissipate.force_book import Passivity
from haploop.tools.dissipate.outcome import EQUAL_N, ElementOutcome, ForceOutcome, Outcome
from haploop.tools.dissipate.sentences import NEXT, buzz_sentence, filtered_out, low_pass
from haploop.tools.render.terminal import make_table

_PASSIVITY: dict[Passivity, str] = {
    "passive": "it never gave out more than it had taken: passive on this recording",
    "fed the buzz": (
        "it never gave out more than it had taken, but it fed the buzz, out of what the contact had stored: passive on "
        "this recording as a whole, not over the buzz"
    ),
    "generated": "it gave out up to {excess} more than it had taken: not passive",
    "other sign": (
        "it gave out up to {excess} and took next to nothing before: not passive, or recorded with the opposite "
        "sign (then --force-unit -1)"
    ),
    "unresolved": (
        "it gave out up to {excess} more than it had taken, which rounded positions alone can cause: "
        "whether it is passive cannot be said"
    ),
    "begins loaded": (
        "it already acts where the recording, or a part after a gap, begins, so energy may have been stored before: "
        "whether it is passive cannot be said"
    ),
}
_PULLS = (
    "The further in the device is, the more the recorded force pulls it in. A wall or a spring pushes back, so if the "
    "force is that of one of these, it was recorded with the opposite sign (then --force-unit -1)."
)
_NAIVE = (
    "This holds for a force that is positive along the position and held to the next sample; that of a sensor, or of a "
    "thinned-out recording, is not. Energy taken out of the device counts as positive. The sum F v T, with v at the "
    "sample (sampled books use the displacement after it), would say that the force {naive}: off by {off}{share}."
)
_NOISY_POSITIONS = (
    "The positions have noise of about {noise}, judging by their fastest changes. As much noise again would change the "
    "energy of {elements}; the noise already in them has changed it by about as much."
)
_FAST_FORCE = (
    "{elements} is faster than a quarter of the sampling rate. Unless the device buzzed that fast, this is noise of "
    "the estimates, and much of the energy may be noise, too."
)
_NAME = "--damping 2.7, --mass 0.0018 or --element KIND KEY=VALUE in quotes, or a column of forces with --force."
_NO_ELEMENT = f"no element was named, and none of those available gives a force on this motion. Name one with {_NAME}"
_AT_HAND = "what each available element would have taken, at a size with the same largest force."
_OTHERS = f"To book others, or other sizes, name them with {_NAME}"
_NO_FORCE = "none of these would have given a force on this motion"
_BESIDE_WALL = "{none}: it stays between {low} and {high}, and the wall is {occupies} {wall}."
# An inertia above this, kg, was more often meant in grams: the heaviest device that comes with haploop has 0.2 kg.
_HEAVY_KG = 0.5
_HEAVY = '{label}: a mass without a unit is in kg; is that what was meant? 1.8 g is --mass "1.8 g" or --mass 0.0018.'
# Counts of the notes, and what each of them means.
_COUNTS = {
    "gaps": "Gaps: {count}, {missing} in all; what happened there is not booked, and estimates start again after each.",
    "unusable_rows": "Rows left out, since a number in them is missing or not finite: {count}.",
    "bridged": "Single missing samples, taken as the mean of their neighbours: {count}.",
    "repeated": (
        "Samples that repeat the one before in mid-motion, at even intervals: {count} ({percent:.2g} %), as when a "
        "sensor is read faster than it measures. Each looks like a stop and a jump, in which an inertia seems to "
        "generate energy."
    ),
    "uneven": (
        "Periods more than a tenth off the others: {count}. Estimates treat them as equal, as a controller that "
        "counts its ticks does."
    ),
}


def make_report(outcome: Outcome) -> RenderableType:
    """Makes the report: doubts, whether the recording buzzes, conclusion, table and notes."""
    numbers = ("true", "sampled", "took", "gave back", "largest force")
    table = make_table("taken out of the device", *numbers, numbers=numbers)
    for element in rows(outcome):
        table.add_row(*make_row(element))
    head = Text(f"{outcome.recording.name}: {conclusion(outcome)}", style="bold")
    first = doubtful(outcome)
    doubts = [Text(sentence, style="bold yellow") for sentence in first]
    buzz = Text(buzz_sentence(outcome), style="bold" if outcome.buzz or outcome.several else "")
    tried = [_tried(outcome), Text(_EQUAL.format(equal=amount(EQUAL_N, "N")), style="dim")] if outcome.tried else []
    said = [sentence for sentence in note_sentences(outcome) if sentence not in first]
    said += [_OTHERS] * bool(outcome.tried and not outcome.force) + [NEXT] * bool(outcome.buzz or outcome.several)
    notes = (Text(sentence, style="dim") for sentence in said)
    return Group(*doubts, buzz, head, *([table] if rows(outcome) else []), *tried, *notes)


def _tried(outcome: Outcome) -> Table:
    """Makes the table of the elements tried at sizes of equal largest force because none was named."""
    numbers = ("takes", "gives back", "fast")
    table = make_table(f"{amount(EQUAL_N, 'N')} at most", *numbers, numbers=numbers)
    for each in outcome.tried:
        table.add_row(each.label, amount(each.true_J, "J"), amount(each.given_J, "J"), f"{100 * each.fast_share:.0f} %")
    return table


def rows(outcome: Outcome) -> list[ElementOutcome]:
    """Returns everything that has books: the elements, and a recorded force last."""
    return [*outcome.elements, *([outcome.force.books] if outcome.force else [])]


def make_row(element: ElementOutcome) -> tuple[str, ...]:
    """Returns label, true and sampled energy, energy taken and given back, and largest force of an element."""
    energies = (element.true_J, element.sampled_J, element.taken_J, element.given_J)
    return element.label, *(amount(value, "J") for value in energies), amount(element.strongest_N, "N")


def conclusion(outcome: Outcome) -> str:
    """Returns which element would have dissipated most, and which have fed the motion; for a force alone, its work."""
    if not outcome.elements and outcome.force:
        return _passivity(outcome)
    if not outcome.elements:
        return _AT_HAND if outcome.tried else _NO_ELEMENT
    if not any(element.strongest_N for element in outcome.elements):
        return _without_force(outcome)

    words = _energies(outcome.elements)
    if noisy := [element.label for element in outcome.elements if element.is_fast or element.is_moved_by_noise]:
        words += f". Not reliable, since much of the energy or of the force is noise: {', '.join(noisy)}"
    return f"{words}."


def _without_force(outcome: Outcome) -> str:
    wall, x = outcome.scene.wall, outcome.trace.lines()[1]
    if not wall or outcome.scene.event:
        return f"{_NO_FORCE}."
    low, high, at = (amount(float(each), "m") for each in (x.min(), x.max(), wall.position))
    return _BESIDE_WALL.format(none=_NO_FORCE, low=low, high=high, occupies=wall.occupies, wall=at)


def _energies(elements: list[ElementOutcome]) -> str:
    best, *others = sorted(elements, key=lambda element: element.true_J, reverse=True)
    if best.true_J <= 0.0:
        return "none of these would have dissipated" + ("; all would have fed the motion" if best.true_J < 0.0 else "")
    words = f"{best.label} would have dissipated {amount(best.true_J, 'J')}"
    if taking := [f"{_times(best, other)} {other.label}" for other in others[:2] if other.true_J > 0.0]:
        words += f", {' and '.join(taking)}"
    if others and others[-1].true_J < 0.0:
        words += f"; {others[-1].label} would have fed {amount(-others[-1].true_J, 'J')} into the motion"
    return words


def _times(best: ElementOutcome, other: ElementOutcome) -> str:
    ratio = best.true_J / other.true_J
    return "as much as" if ratio < 1.005 else f"{fixed(ratio)} times as much as" if ratio < 1e4 else "far more than"


_ROUNDED = "The times are rounded to {step}: even samples at {rate:.6g} Hz fit them and are assumed."
_MAY_BE_WRONG = (
    "Energies and rate may be wrong: {percent:.0f} % of the periods are more than a tenth off the others, and all are "
    "treated as equal. If the samples were even, give their rate (--rate)."
)
_EQUAL = (
    "Each element at the size whose largest force on this motion is {equal}; energies are proportional to sizes. Fast "
    "is the part of its force above a quarter of the sampling rate: noise, unless the device buzzed that fast."
)
_SIZES = "Each element is tried only at the size given here; at another it takes another amount."
_IN_CONTACT = "Elements act only in contact with the wall; one with acts=always would act everywhere."


def note_sentences(outcome: Outcome) -> list[str]:
    """Returns notes on the recording and on the books, a sentence each."""
    recording, force, (from_s, to_s) = outcome.recording, outcome.force, outcome.span_s
    notes, taken = recording.notes, " and ".join(sorted(recording.recorded))
    estimated = [name for name in ("velocity", "acceleration") if name not in recording.recorded]
    sentences = [
        f"{notes.rows} samples at {1.0 / recording.period_s:.6g} Hz, {from_s:g} to {to_s:g} s.",
        _ROUNDED.format(step=amount(notes.rounded_s, "s"), rate=1.0 / recording.period_s) if notes.rounded_s else "",
        (f"Taken as recorded: {taken}. " if taken else "") + _estimates(outcome.scene, estimated),
        _truth(outcome) if rows(outcome) else "",
        _SIZES if len(outcome.elements) > 1 else "",
        _IN_CONTACT if any(element.acts == "in-contact" for element in outcome.scene.dissipation) else "",
        *(_HEAVY.format(label=each.label) for each in outcome.elements if _is_heavy(each)),
        *_noise(outcome),
    ]
    if force and outcome.elements:
        said = _passivity(outcome)
        sentences.append(said[:1].upper() + said[1:])
    if force:
        sentences.append(_naive(force))
    for name, sentence in _COUNTS.items():
        if count := getattr(notes, name):
            percent, missing = 100.0 * count / notes.rows, amount(notes.missing_s, "s")
            sentences.append(filled(sentence, count=count, percent=percent, missing=missing))
    return [sentence for sentence in [*sentences, *doubtful(outcome)] if sentence]


def doubtful(outcome: Outcome) -> list[str]:
    """Returns the sentences that precede the answer: that it may be wrong, and why."""
    pulls = [_PULLS] if outcome.force and outcome.force.pushes_back is False else []
    return [*uneven(outcome), *outcome.recording.notes.remarks, *pulls, *filtered_out(outcome)]


def uneven(outcome: Outcome) -> list[str]:
    """Returns the warning that energies and rate may be wrong, where many of the periods are uneven."""
    notes = outcome.recording.notes
    return [_MAY_BE_WRONG.format(percent=100.0 * notes.uneven / notes.rows)] if notes.is_uneven else []


def _noise(outcome: Outcome) -> list[str]:
    moved = [
        f"{each.label} from {amount(each.true_J, 'J')} to {amount(each.noisier_J, 'J')}"
        for each in outcome.elements
        if each.is_moved_by_noise
    ]
    fast = [f"{100 * each.fast_share:.0f} % of the force of {each.label}" for each in outcome.elements if each.is_fast]
    sentences = [
        _NOISY_POSITIONS.format(noise=amount(outcome.noise_m, "m"), elements=", ".join(moved)) if moved else "",
        _FAST_FORCE.format(elements=" and ".join(fast)) if fast else "",
    ]
    return [*sentences, low_pass(outcome)] if moved or fast else []


def _is_heavy(element: ElementOutcome) -> bool:
    mass = element.parameters.get("mass", 0.0)
    return not isinstance(mass, str) and mass >= _HEAVY_KG


def _passivity(outcome: Outcome) -> str:
    force = outcome.force
    assert force
    words = _PASSIVITY[force.passivity].format(excess=amount(force.excess_J, "J"))
    where = "outside the gaps" if outcome.recording.notes.gaps else "in all"
    return f"{where} the recorded force {_given_or_taken(force.books.true_J)}; {words}."


def _given_or_taken(taken_J: float) -> str:
    """Returns in words what the table shows by the sign, where positive is taken out of the device."""
    size = amount(abs(taken_J), "J")
    return f"gave {size} to the device" if taken_J < 0.0 else f"took {size} out of the device"


def _naive(force: ForceOutcome) -> str:
    true_J, off_J = force.books.true_J, abs(force.naive_J - force.books.true_J)
    share = f" ({100.0 * off_J / abs(true_J):.0f} % of it)" if true_J else ""
    return _NAIVE.format(naive=_given_or_taken(force.naive_J), off=amount(off_J, "J"), share=share)


def _estimates(scene: Scene, names: list[str]) -> str:
    words = []
    for name in names:
        table = scene.estimate(name)
        source = table.source if isinstance(table, Acceleration) else "encoder"
        how = table.estimator or ("backward difference" if source == "encoder" else source)
        cutoff = f", low-passed at {table.cutoff:g} Hz" if table.cutoff is not None else ""
        words.append(f"{name} by {how}{cutoff}")
    return f"Estimated: {'; '.join(words)}." if words else ""


def _truth(outcome: Outcome) -> str:
    delay_s = outcome.recording.delay_s
    delay = f"{amount(delay_s, 's')} after their sample" if delay_s else "at once"
    if outcome.recording.between == "plant steps":
        where = ", over every step of the plant"
    elif outcome.books_agree:
        where = " on the recorded positions; they agree with the sampled ones"
    else:
        where = ", the device on straight lines between the samples"
    return f"True books: forces that act {delay}{where}."
