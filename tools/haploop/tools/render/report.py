"""Reports on the terminal: the summary of a run, and what a judge found."""

from __future__ import annotations

from typing import TYPE_CHECKING

from haploop.launch.foreign import described
from haploop.launch.scene.mistakes import counted
from haploop.logger.cause import SWINGS, by_trial, likely_cause
from haploop.protocol.amounts import amount, fixed
from haploop.tools.render.terminal import console, make_facts, make_table, told, verdict_style
from haploop.tools.render.units import NO_UNITS, parameters, spring

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import RenderableType
    from rich.table import Table

    from haploop.launch.plan.meant.rule import Note
    from haploop.launch.stability.finding import Finding
    from haploop.logger.summary import Summary
    from haploop.protocol.transport.wire import Message

_ITS_WORD = "Only the {} itself says that it does what the scene says; haploop replay checks it against the scene."
_TRIED = "with the hand's force of {}, pushed by up to {}; haploop advise tries taps, other holds and devices"
_LIMITED = "; of the command: the actuator gave less at times"
# Frequencies that differ by no more than this share are told once, as that of the pushed loop, which is more exact.
_ALIKE = 0.15
_AT = ", at about {0} Hz"
_REST = "dying away, or a wider swing than the push leaves"
_NOTE = "A note on its scene: {first}"
_NOTES = "{count} notes on its scene; the first: {first}"
# Entries of the summary's window, their words, and what stands after the number. Peaks of two swings do not add.
_OF_FORCE = {
    "force_swing_N": ("commanded force", " peak to peak at its end"),
    "force_ripple_N": ("commanded ripple", " peak to peak, above about 30 Hz only"),
}
# Entry of the summary, the count in it, and its words.
_COUNTS = (
    ("lost", "commands_dropped", "commands dropped"),
    ("lost", "commands_lost", "commands lost"),
    ("lost", "telemetry_gaps", "telemetry gaps"),
    ("actuator", "saturated_commands", "commands saturated"),
    ("accelerometer", "clipped_ticks", "readings clipped"),
)
# Verdicts of a loop whose force over depth is a stiffness.
_RESTS = ("steady", "no-swing-seen")
# The causes of a wall's leak by their keys in the summary.
_CHANGED = "changes of the wall in contact"
HELD, LAW_TAKES = "stored by an ideal wall at the end", "taken by its law"
# The damping of a wall acts on the estimated velocity.
_OF_DAMPING = {"quantisation_J": "quantisation and estimates"}
LEAK_CAUSES = {"sampling_and_hold_J": "sampling and hold", "quantisation_J": "quantisation", "delay_J": "delay"}


def plant_books(energy: Summary) -> dict[str, str]:
    """Returns the words for each key of the summary's ``energy`` that is a book of the plant: work, then every heat."""
    words = {"hand_work_J": "work of the hand", "unmodelled_work_J": "work of the hand, as the remainder"}
    words |= {key: f"heat in the {key.removesuffix('_heat_J')}" for key in energy if key.endswith("_heat_J")}
    words |= {"friction_heat_J": "heat of friction", "actuator_J": "kept back by the actuator's limits"}
    return {key: name for key, name in words.items() if key in energy}


def limited(summary: Summary) -> str:
    """Returns what to say beside a stiffness or force of the command where the actuator gave less than that."""
    return _LIMITED * bool(summary.get("actuator", {}).get("saturated_commands"))


def how_often(summary: Summary) -> str:
    """Returns the frequency of a run's last swing; "" where there is none, or that of the pushed loop is alike."""
    if not (seen_Hz := summary["window"].get("frequency_Hz")):
        return ""
    pushed_Hz = summary.get("stability", {}).get("frequency_Hz") or 0.0
    return "" if abs(seen_Hz - pushed_Hz) <= _ALIKE * pushed_Hz else _AT.format(fixed(seen_Hz, 2))


def displayed_stiffness(summary: Summary) -> float | None:
    """Returns the displayed stiffness, N/m; None where the loop may swing, whose mean force over depth is none."""
    return summary["window"]["displayed_stiffness_N_m"] if summary["verdict"] in _RESTS else None


def count_losses(summary: Summary) -> dict[str, int]:
    """Returns what was lost or limited, and how often; what never happened is left out."""
    found = {words: summary.get(entry, {}).get(key, 0) for entry, key, words in _COUNTS}
    return {words: count for words, count in found.items() if count}


def noted(notes: Sequence[str]) -> str:
    """Returns how many notes on a scene there are, and the first of them; "" for none."""
    words = _NOTES if len(notes) > 1 else _NOTE if notes else ""
    return words.format(count=len(notes), first=notes[0]) if notes else ""


def print_summary(summary: Summary, notes: Sequence[Note], units: Mapping[str, str]) -> None:
    console().print(summary_table(summary, notes, units))


def summary_table(summary: Summary, notes: Sequence[Note] = (), units: Mapping[str, str] = NO_UNITS) -> RenderableType:
    """Makes the report of a run from its summary: verdict, key numbers and every book of energy.

    Of the ``notes`` on its scene, those on why the device does not touch the wall stand at the verdict of a run without
    contact. How many notes there are stands at the end, beside the verdict, since the report is longer than many a
    terminal. ``units`` are those of the elements' parameters, as ``units_of`` returns them.
    """
    from rich.console import Group
    from rich.text import Text

    word = told(summary)
    provisos = _provisos(summary.get("stability", {}))
    head = Text.assemble((word, verdict_style(word)), (provisos, "bold yellow"), "  ", (summary["title"], "bold"))
    # Of a window's rule only the measures, without the limits they were compared with.
    rule = summary["verdict_rule"] if "stability" in summary else summary["verdict_rule"].partition("; ")[0]
    rule = rule.rstrip(".")
    parts: list[RenderableType] = [head, Text(f"{rule[:1].upper()}{rule[1:]}.", style="dim")]
    if summary["verdict"] in SWINGS and (why := likely_cause(summary)):
        parts.append(Text(why))
    if summary["verdict"] == "no-contact":
        parts += [Text(note) for note in notes if note.keeps_off]
    if summary["ended"] not in ("done", "diverged"):
        why = f", since {summary['why'].rstrip('.')}" if summary["ended"] == "failed" and summary["why"] else ""
        parts.append(Text(f"ended early: {summary['ended']}{why}", style="bold red"))
    told_too = [*summary.get("not_made", ()), *filter(None, [summary["energy"].get("balance")])]
    parts += [Text(sentence, style="bold yellow") for sentence in told_too]
    parts += [Text(_ITS_WORD.format(words.split()[0])) for words, _ in program_rows(summary)]
    control_rate = summary["ticks"] / summary["duration_s"] if summary["duration_s"] else 1.0
    end = (
        [Text.assemble("Verdict: ", (word, verdict_style(word)), ". ", (noted(notes), "bold yellow"))] if notes else []
    )
    return Group(*parts, make_facts(_key_figures(summary)), _books(summary["energy"], control_rate, units), *end)


def _key_figures(summary: Summary) -> list[tuple[str, str]]:
    window = summary["window"]
    ran = f"{summary['duration_s']:g} s, {counted(summary['ticks'], 'tick')}"
    if summary["wall_s"]:
        ran += f", in {amount(summary['wall_s'], 's')} ({fixed(summary['real_time_factor'])} times real time)"
    at_Hz = how_often(summary)
    figures = [
        ("ran", ran),
        *lateness_rows(summary),
        *program_rows(summary),
        ("oscillation", f"{amount(window['oscillation_m'], 'm')} peak to peak at its end{at_Hz}"),
    ]
    for key, (words, after) in _OF_FORCE.items():
        if (force_N := window.get(key)) is not None and (force_N or key == "force_swing_N"):
            figures.append((words, amount(force_N, "N") + after))
    found = summary.get("stability", {})
    figures += _stability(found)
    if summary["verdict"] == "steady" and "push_N" in found:
        from haploop.launch.stability.looks import PUSH

        hold_N, most_N = found["push_N"] / PUSH, found["blow_N"] or found["push_N"]
        figures.append(("tried", _TRIED.format(amount(hold_N, "N"), amount(most_N, "N"))))
    if window["penetration_mean_m"] is not None:
        depth = f"{amount(window['penetration_mean_m'], 'm')} on average"
        outside = 100 * window["outside_fraction"]
        figures.append(
            ("penetration measured", depth + (f", outside the wall {outside:.0f} % of the time" if outside else ""))
        )
    if (displayed := displayed_stiffness(summary)) is not None:
        beyond = " at the motor; the cable gives way, too" if "cable_heat_J" in summary["energy"] else ""
        figures.append(("displayed stiffness", spring(displayed) + beyond + limited(summary)))
    if happened := count_losses(summary):
        figures.append(("in all", ", ".join(f"{count} {words}" for words, count in happened.items())))
    return figures


def lateness_rows(of: Summary) -> list[tuple[str, str]]:
    """Returns how late the ticks of a run in real time were, or the answers to its device; empty for any other run."""
    if not (late := of.get("lateness")):
        return []
    if "ticks" not in late:
        return [
            ("answers came", "when is not known: the plant was to keep the time, but has reported nothing about it")
        ]
    by = ("median_s", "(median)"), ("percent_99_s", "(99 %)"), ("most_s", "at most")
    words = ", ".join(f"{amount(late[key], 's')} {which}" for key, which in by)
    lost = f"; {amount(late['lost_s'], 's')} of real time lost" if late["lost_s"] else ""
    many = f"{late['late_ticks']} of {late['ticks']} by more than {amount(late['late_s'], 's')}"
    if late.get("clock") == "plant":
        words = f"{words} after the sample"
        many = f"{late['late_ticks']} of {late['ticks']} too late, after {amount(late['late_s'], 's')}"
        return [("answers came", f"{words}; {many}{lost}")]
    return [("ticks late by", f"{words}; {many}{lost}")]


def leak_rows(wall: Summary) -> dict[str, float | None]:
    """Returns the leak of a summary's wall by cause, and what it takes and holds, J; empty for one without a leak."""
    if "leak" not in wall:
        return {}
    causes = LEAK_CAUSES | (_OF_DAMPING if "dissipated_J" in wall else {})
    rows = {f"leak by {words}": wall["leak"][key] for key, words in causes.items()}
    rows |= {LAW_TAKES: wall["dissipated_J"]} if "dissipated_J" in wall else {}
    rows |= {_CHANGED: -wall["changes_J"]} if wall.get("changes_J") else {}
    # The rounding error of a much larger number is zero.
    ideal_J, true_J = wall["ideal_J"], wall["true_J"]
    is_zero = None not in (ideal_J, true_J) and abs(ideal_J) <= 1e-9 * abs(true_J)
    return rows | {HELD: 0.0 if is_zero else ideal_J}


def _books(energy: Summary, control_rate: float, units: Mapping[str, str]) -> Table:
    numbers = ("at work", "true", "sampled")
    table = make_table("energy taken out of the device by", *numbers, numbers=numbers)
    wall = energy["wall"]
    if "leak" in wall:
        table.add_row("wall", "", amount(wall["true_J"], "J"), amount(wall["sampled_J"], "J"))
        for words, value_J in leak_rows(wall).items():
            table.add_row(f"  {words}", "", amount(value_J, "J"), "")
    for element in energy["elements"]:
        values = parameters({"kind": element["kind"], **element["parameters"]}, units)
        ticks = f"{element['from_tick'] / control_rate:g}–{element['to_tick'] / control_rate:g} s"
        name = element["kind"] + (f" ({values})" if values else "")
        table.add_row(name, ticks, amount(element["true_J"], "J"), amount(element["sampled_J"], "J"))
    table.add_section()
    table.add_row("energy in the plant", "", "", "", style="bold")
    residual, moved = energy["residual_J"], energy["moved_J"]
    share = f", {residual / moved:.1e} of what moved" if residual is not None and moved else ""
    rows = {words: energy[key] for key, words in plant_books(energy).items()}
    rows |= {"stored at the start": energy["stored_at_start_J"]} if "stored_at_start_J" in energy else {}
    rows |= {"stored at the end": energy["stored_J"], "moved in total": moved}
    rows |= {} if "unmodelled_work_J" in energy else {f"residual{share}": residual}
    for name, value in rows.items():
        table.add_row(name, "", amount(value, "J"), "")
    return table


def _provisos(found: Summary) -> str:
    return "".join(f", {proviso}" for proviso in found.get("provisos", ()))


def finding_table(finding: Finding, found: Summary) -> RenderableType:
    """Makes the report of a judged run: the word, why, and what it rests on; ``found`` is its ``stability`` entry."""
    from rich.console import Group
    from rich.text import Text

    head = Text.assemble((finding.word, verdict_style(finding.word)), (_provisos(found), "bold yellow"))
    parts: list[RenderableType] = [head, Text(finding.sentence())]
    if tried := by_trial(finding.without):
        parts.append(Text(f"Likely cause: {tried}"))
    if rows := _stability(found):
        parts.append(make_facts(rows))
    return Group(*parts)


_GROWTH = "of the steadier swing {:.3g} +- {:.2g} 1/s, watched for {:g} s"


def _stability(found: Summary) -> list[tuple[str, str]]:
    """Returns what a loop does, held still and pushed at its end; empty if it was not watched to an answer."""
    if found.get("rate_1_s") is None:
        return []
    rows = [("held still and pushed, it swings", swing_words(found))]
    if not rests(found):
        rows.append(("its commanded ripple", f"{amount(found['force_ripple_N'], 'N')} peak to peak above about 30 Hz"))
    settles_s = found.get("settles_s")
    if not rests(found) and settles_s is None:
        rows.append(("growth", _GROWTH.format(found["rate_1_s"], found["error_1_s"], found["watched_s"])))
    if (share := found.get("own_share")) is not None:
        beside = found.get("moved_beside", ("the hand's motion", "noise"))
        own = f"{100 * share:.0f} %" if share >= 0.01 else "less than 1 %"
        rest = f"; the rest is {', '.join([*beside, _REST])}" if share < 0.995 else ""
        rows.append(("of the oscillation", f"{own} is the loop's own{rest}"))
    if settles_s is not None:
        rows.append(("settles within", f"{amount(settles_s, 's')}, to 5 %"))
    if blown := found.get("blown"):
        rows.append(("after a blow", f"of {amount(found['blow_N'], 'N')}: {blown}"))
    if left := found.get("left"):
        rows.append(("not pushed", f"where its run ended: {left}"))
    if deeper := found.get("deeper"):
        rows.append(("held a little harder", f"by {amount(found['deeper_N'], 'N')}: {deeper}"))
    if frictionless := found.get("frictionless"):
        rows.append(("without its friction", frictionless))
    return rows


def swing_words(found: Summary) -> str:
    """Returns size, frequency and feel of the swing that a pushed loop comes to, given a summary's ``stability``."""
    frequency = "" if rests(found) or not found["frequency_Hz"] else f"at {amount(found['frequency_Hz'], 'Hz')}, "
    width = f"{amount(found['width_m'], 'm')} +- {amount(found['spread_m'], 'm', 2)}"
    size = "less than 1 nm" if rests(found) else width
    felt, chaotic = "felt" if found["felt"] else "not felt", ", chaotic" if found["chaotic"] else ""
    return f"{size} peak to peak, {frequency}{felt}{chaotic}"


def rests(found: Summary) -> bool:
    """Tells of a summary's ``stability`` whether what is left of a push is rounding."""
    return found["width_m"] < 1e-9


def program_rows(data: Message) -> list[tuple[str, str]]:
    """Returns role and program of every node that is not haploop's own, from a status or a summary."""
    return [(f"{role} not haploop's own", described(p)) for role, p in data.get("programs", {}).items() if not p["own"]]
