"""Tables and texts that several commands share: Markdown, the terminal, and text that has to fit."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from haploop.tools.figure.style import empty_figure, fit_text
from haploop.tools.render.terminal import console, make_facts, make_table, markdown_table


def printed(table: object, width: int = 100) -> list[str]:
    """Lines of a table on a terminal of this width, without what fills them up."""
    screen = io.StringIO()
    Console(file=screen, width=width).print(table)
    return [line.rstrip() for line in screen.getvalue().splitlines()]


def test_a_markdown_table_has_a_rule_below_its_heads_with_numbers_set_to_the_right() -> None:
    table = markdown_table(("scene", "error", "verdict"), [("tap", "1e-9", "steady"), ("", "–", "")], numbers=(1,))
    assert table.splitlines() == [
        "| scene | error | verdict |",
        "| --- | ---: | --- |",
        "| tap | 1e-9 | steady |",
        "|  | – |  |",
    ]


def test_a_bar_in_a_cell_of_markdown_begins_no_cell_whether_it_comes_escaped_or_not() -> None:
    assert markdown_table(("a|b",), [("c\\|d",)]).splitlines() == ["| a\\|b |", "| --- |", "| c\\|d |"]


def test_a_table_sets_numbers_to_the_right_and_has_a_line_below_its_heads_alone() -> None:
    table = make_table("name", "count", numbers=("count",))
    table.add_row("a", "1")
    table.add_row("b", "200")
    heads, rule, *rows = [line for line in printed(table) if line.strip()]
    assert heads.split() == ["name", "count"]
    assert set(rule.strip()) == {"─"}
    assert [row.split() for row in rows] == [["a", "1"], ["b", "200"]]
    assert len({len(row) for row in rows}) == 1


def test_a_long_word_is_folded_and_a_number_stays_on_one_line_where_a_terminal_is_narrow() -> None:
    table = make_table("what", "count", numbers=("count",))
    table.add_row("controller.dissipation.unidirectional_inertia", "1 234 567")
    lines = printed(table, width=30)
    assert "1 234 567" in "".join(lines)
    assert "".join(line.split()[0] for line in lines if line and "…" not in line)[0:4] == "what"
    shown = "".join("".join(line.replace("1 234 567", "").split()) for line in lines[2:])
    assert "controller.dissipation.unidirectional_inertia" in shown


def test_facts_stand_beside_their_names() -> None:
    assert printed(make_facts([("verdict", "steady"), ("x", "1 mm")])) == ["verdict  steady", "x        1 mm"]


def test_a_pipe_has_no_colours_and_a_fixed_width(capsys: pytest.CaptureFixture[str]) -> None:
    made = console()
    made.print("x" * 150, style="bold red")
    assert (made.width, made.is_terminal) == (100, False)
    assert "\x1b" not in capsys.readouterr().out


@pytest.mark.parametrize(("words", "smaller", "cut"), [("short", False, False), ("w" * 40, True, False)])
def test_a_text_that_is_too_wide_is_made_smaller(words: str, smaller: bool, cut: bool) -> None:
    pytest.importorskip("matplotlib")
    text = empty_figure(6.0, 2.0).text(0.0, 0.5, words, fontsize=12.0)
    width = text.get_window_extent().width
    fit_text(text, 0.85 * width if smaller else width)
    assert (float(text.get_fontsize()) < 12.0) is smaller
    assert text.get_text().endswith("…") is cut


def test_a_text_that_is_much_too_wide_is_cut_off_and_then_fits() -> None:
    pytest.importorskip("matplotlib")
    text = empty_figure(6.0, 2.0).text(0.0, 0.5, "wide " * 60, fontsize=12.0)
    fit_text(text, 300.0)
    assert text.get_text().endswith(" …")
    assert text.get_window_extent().width <= 300.0
    assert float(text.get_fontsize()) == pytest.approx(0.78 * 12.0)
