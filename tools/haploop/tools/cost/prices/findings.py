"""What was found about the other prices: which is dear, and what stiffness costs."""

from __future__ import annotations

from haploop.tools.ablation import NONE
from haploop.tools.cost.finding_words import Finding, times
from haploop.tools.cost.prices.data import Price, PriceGroup, chance_in
from haploop.tools.render.units import fixed, spring


def other_prices(groups: dict[str, PriceGroup]) -> Finding | None:
    """Books, logging, processes and effects, the dearest first."""
    found: list[tuple[float, str]] = []
    for name, what, words in (
        ("books", "with", "the exact energy books of every plant step {} times plant and controller alone"),
        ("log", "steps", "every plant step logged {} times a run as processes without a log"),
        ("processes", "three processes", "three processes without delay {} times one"),
    ):
        if entry := _entry(groups.get(name), what):
            found.append((entry.ratio, words.format(fixed(entry.ratio))))
    effects = groups.get("effects")
    if effects and (none := _entry(effects, NONE)):
        dearest = max((price for price in effects.prices[1:] if price.what != NONE), key=lambda price: price.costs)
        more = f"all effects at once {fixed(1.0 / none.ratio)} times the same loop without any"
        if dearest.costs > chance_in(effects):
            whole = fixed(effects.baseline.time.median)
            more += f" (without {dearest.what} it would save {fixed(dearest.costs)} of {whole} µs a tick)"
        found.append((1.0 / none.ratio, more))
    if not found:
        return None
    words = [text for _, text in sorted(found, key=lambda entry: -entry[0])]
    return Finding("The other prices, the dearest first", f"In time, {'; '.join(words)}.")


def stiffness(groups: dict[str, PriceGroup]) -> Finding | None:
    """What control rate and delay do to the largest stiffness that stays steady, and to the time."""
    sentences = []
    if pair := _ends(groups.get("control rate")):
        low, high = pair
        sentences.append(
            f"From a control rate of {low.what} to {high.what} the stiffest wall that stays steady goes from "
            f"{_limit(low)} to {_limit(high)} ({times(_stiffness(high) / _stiffness(low))}), and a simulated second "
            f"takes {times(high.time.median / low.time.median)} as long"
        )
    if pair := _ends(groups.get("delay")):
        high, low = pair
        ratio = high.time.median / low.time.median
        why = ", since delay is lookahead" if ratio < 1.0 else ""
        sentences.append(
            f"From {low.what} to {high.what} of delay it goes from {_limit(low)} to {_limit(high)}, while a tick as "
            f"processes takes {times(ratio)} as long{why}"
        )
    return Finding("What stiffness costs", f"{'. '.join(sentences)}.") if sentences else None


def _entry(group: PriceGroup | None, what: str) -> Price | None:
    return next((price for price in group.prices if price.what == what), None) if group else None


def _ends(group: PriceGroup | None) -> tuple[Price, Price] | None:
    """The prices with the least and the largest stiffness."""
    found = [price for price in group.prices if price.stiffness] if group else []
    return (min(found, key=_stiffness), max(found, key=_stiffness)) if len(found) > 1 else None


def _stiffness(price: Price) -> float:
    assert price.stiffness is not None
    return price.stiffness.stiffness_N_m


def _limit(price: Price) -> str:
    assert price.stiffness is not None
    return spring(price.stiffness.stiffness_N_m) + ("" if price.stiffness.confirmed else " in theory")
