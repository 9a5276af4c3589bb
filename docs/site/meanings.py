"""Meanings of the columns of a log and the entries of a summary, as the code that declares them says them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping

from haploop.launch.clock.pace import LATENESS
from haploop.launch.stability.finding import BESIDE, Finding
from haploop.logger.books.meanings import BOOKS
from haploop.logger.entries import ENERGY, PARTS, RUN
from haploop.logger.log.channels import CONTROLLER, OWN, PLANT, TIME, Column
from haploop.logger.verdict.measures import Extremes, Figures
from haploop.plant.counters import COUNTERS

# What a finding has that no summary holds under this name.
_NOT_TOLD = ("word", "detail")
_WITHOUT = (
    "what the loop does without this part: rests, swings within its limit (which it leaves otherwise), swings less "
    "(than a third as wide), swings otherwise (at another frequency), swings on, or undecided"
)


def attributes(kind: type) -> dict[str, str]:
    """Returns what the docstring of a class says of each of its attributes."""
    section = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2].partition("\n\n")[0]
    entries = re.findall(r"^ {4}([\w, ]+): (.+(?:\n {8}.+)*)", section, re.MULTILINE)
    told = {name: " ".join(text.split()) for names, text in entries for name in names.split(", ")}
    return {name: text.replace("``", "`").replace("None", "null").rstrip(".") for name, text in told.items()}


def _under(table: str, of: Mapping[str, str]) -> dict[str, str]:
    return {f"{table}.{name}": text for name, text in of.items()}


def summary() -> dict[str, str]:
    """Returns the meaning of every entry of a summary by its dotted key, with N and NAME as in ``logger.entries``."""
    finding = {name: text for name, text in attributes(Finding).items() if name not in _NOT_TOLD}
    beside = {f"{name}.N" if name != "own_share" else name: text for name, text in BESIDE.items()}
    return {
        **RUN,
        **_under("stability", finding | beside | {"without.NAME": _WITHOUT}),
        **_under("window", attributes(Figures)),
        **_under("extremes", attributes(Extremes)),
        **ENERGY,
        **COUNTERS,
        **PARTS,
        **_under("lateness", LATENESS),
    }


def pattern(key: str) -> str:
    """Returns a dotted key of a summary with N for every place in a list and NAME for every name of the scene's."""
    key = re.sub(r"(?<=\.)\d+(?=\.|$)", "N", key)
    return re.sub(
        r"(?<=\.parameters\.)\w+|(?<=^versions\.)\w+|(?<=^programs\.)\w+|(?<=^stability\.without\.).+", "NAME", key
    )


def columns() -> dict[str, dict[str, Column]]:
    """Returns the columns of each channel; N is an element's place, NAME a name of its own, ELEMENT its kind."""
    energy = {"timestamp": TIME} | {name: Column("J", text) for name, text in BOOKS.items()}
    return {"/plant": {**PLANT}, "/controller": {**CONTROLLER, "dissipation.N.NAME": OWN}, "/energy": energy}


def column(topic: str, name: str) -> Column | None:
    """Returns the column of a log by its name there, None for one that nothing declares."""
    known = columns()[topic]
    name = re.sub(r"^dissipation\.\d+", "dissipation.N", name)
    general = re.sub(r"^(dissipation\.N)\.\w+$", r"\1.NAME", re.sub(r"^[\w-]+(\.sampled|\.true)$", r"ELEMENT\1", name))
    return known.get(name) or known.get(general)
