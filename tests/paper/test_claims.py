"""Claims, the page they are told on, and the figures they belong to."""

import re
from pathlib import Path

import numpy as np
import pytest

from haploop.tools.studies.choi2022.command import paper
from haploop.tools.studies.choi2022.figures import maker, numbers
from haploop.tools.studies.choi2022.figures.claims import (
    ASSUMING,
    FAILS,
    HOLDS,
    RARE,
    RARE_BELOW,
    VERDICTS,
    Claim,
    Finding,
    claims_of,
    texts_of,
)
from haploop.tools.studies.choi2022.figures.page import claims_page, made, page
from haploop.tools.studies.choi2022.figures.work import Work

DOCS = Path(__file__).parents[2] / "docs"
CLAIM = Claim("III, Fig. 4", "inertia dissipates | stores", "dissipates")


def test_an_assumption_belongs_to_two_verdicts_alone() -> None:
    assert VERDICTS == ("holds", "holds under a stated assumption", "rare", "does not hold here")
    for verdict, assumption in zip(VERDICTS, ("", "slow", "slow", ""), strict=True):
        assert Finding(CLAIM, verdict, "1 J", assumption).verdict == verdict
    for verdict, assumption in [(HOLDS, "slow"), (ASSUMING, ""), (RARE, ""), (FAILS, "slow"), ("perhaps", "")]:
        with pytest.raises(ValueError, match="verdict"):
            Finding(CLAIM, verdict, "1 J", assumption)  # pyright: ignore[reportArgumentType]


def test_a_claim_holds_or_holds_under_its_assumption_or_fails_with_the_numbers_in_its_own_words() -> None:
    claim = Claim("III", "slowly", "", "{energy} J", "slower than {limit:.0f} Hz")
    computed = {"energy": 2, "limit": 80.0}
    assert claim.holds_if(True, True, **computed) == Finding(claim, HOLDS, "2 J")
    assert claim.holds_if(False, True, **computed) == Finding(claim, ASSUMING, "2 J", "slower than 80 Hz")
    assert claim.holds_if(False, **computed) == Finding(claim, FAILS, "2 J")


def test_a_claim_that_holds_in_fewer_than_one_of_twenty_interpretations_is_rare_and_no_holds() -> None:
    found = [Finding.by_share(CLAIM, "1 J", share, "slow").verdict for share in (RARE_BELOW, 0.049, 0.0)]
    assert found == [ASSUMING, RARE, RARE]
    assert Finding.by_share(CLAIM, "1 J", 0.0, "").verdict == FAILS


def test_what_is_kept_of_a_finding_reads_back_to_it() -> None:
    for finding in (Finding(CLAIM, HOLDS, "1"), Finding(CLAIM, ASSUMING, "2", "slow"), Finding(CLAIM, FAILS, "3")):
        assert Finding.from_dict(finding.as_dict(), {CLAIM.name: CLAIM}) == finding


def test_the_page_tells_every_finding_by_section_and_what_was_not_made() -> None:
    kept = {}
    for number, name in ((6, "heat"), (5, "only_stored"), (3, "generates")):
        finding = Finding(claims_of(number)[name], HOLDS, "a | b")
        kept[number] = {
            "title": f"title {number}", "small": False, "caption": "seen", "notes": ["#### Note"],
            "files": [f"figure_{number}.png", f"figure_{number}.npz"], "findings": [finding.as_dict()],
            "answer": f"answer {number}", "supports": number != 6,
            "seen": {f"figure_{number}.png": f"seen on {number}"},
        }  # fmt: skip
    text, first = claims_page(kept, "paper/"), page(kept, "paper/")
    rows = [line for line in text.splitlines() if line.startswith("| “")]
    assert [row.split("#figure-")[1][0] for row in rows] == ["3", "5", "6"]
    assert all(row.replace("\\|", "").count("|") == 5 for row in rows)  # a bar within a cell is escaped
    assert "![title 3](paper/figure_3.png)" in text
    assert "`figure_3.npz`" in text
    assert "#### Note" in text
    assert text.index(rows[0]) < text.index("seen on 3")
    # What holds is said before what does not, on the first page alone.
    assert first.index("answer 3") < first.index("answer 5") < first.index("What hangs") < first.index("answer 6")
    assert "answer" not in text
    assert "Of 3 claims 3 hold" in first
    assert "4 (" in next(line for line in text.splitlines() if line.startswith("Not made here"))
    assert "trial" not in text + first
    assert "trial" in page({3: kept[3] | {"small": True}})


@pytest.mark.parametrize("number", numbers())
def test_every_figure_has_a_title_and_claims_of_its_own(number: int) -> None:
    claims = claims_of(number)
    assert callable(maker(number))
    assert texts_of(number)["title"]
    assert len(set(claims.values())) == len(claims) > 0
    assert all(claim.place and claim.quote for claim in claims.values())


def test_no_claim_is_made_twice() -> None:
    claims = [claim for number in numbers() for claim in claims_of(number).values()]
    assert len(set(claims)) == len(claims)


def test_a_figure_that_is_not_there_is_refused_with_those_that_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        paper([1], tmp_path / "out", small=True, workers=1)
    assert left.value.code == 2
    assert "no figure 1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_directory_that_cannot_be_used_is_refused_before_anything_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "answers").write_text("a file where a folder has to be", encoding="utf-8")
    with pytest.raises(SystemExit) as left:
        paper([3], tmp_path, small=True, workers=1)
    assert left.value.code == 2
    assert "cannot be used" in capsys.readouterr().err
    assert not (tmp_path / "figure_3.png").exists()


def test_data_of_a_figure_reads_back(tmp_path: Path) -> None:
    work = Work(tmp_path, 3)
    work.data("some", {"x_m": [1.0, 2.0]})
    assert np.load(tmp_path / "some.npz")["x_m"].tolist() == [1.0, 2.0]


def test_the_pages_in_the_documentation_are_those_of_the_findings_beside_their_pictures() -> None:
    """After a change of words: python -m haploop.tools.studies.choi2022.command docs/paper docs."""
    kept = made(DOCS / "paper")
    assert (DOCS / "paper.md").read_text(encoding="utf-8") == page(kept, "paper/")
    assert (DOCS / "paper_claims.md").read_text(encoding="utf-8") == claims_page(kept, "paper/")


def test_the_first_page_is_read_in_five_minutes() -> None:
    """1200 words at 240 a minute; links and pictures count as words here."""
    assert len((DOCS / "paper.md").read_text(encoding="utf-8").split()) <= 1200


def test_the_pages_in_the_documentation_tell_every_claim_of_their_figures_and_show_their_pictures() -> None:
    text = (DOCS / "paper_claims.md").read_text(encoding="utf-8")
    told = [int(number) for number in re.findall(r'id="figure-(\d+)"', text)]
    assert {3, 4, 5, 6} <= set(told)
    for number in told:
        missing = [claim.quote for claim in claims_of(number).values() if claim.quote not in text]
        assert missing == []
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text + (DOCS / "paper.md").read_text(encoding="utf-8"))
    assert len(pictures) >= len(told)
    assert all((DOCS / picture).is_file() for picture in pictures)
    assert "--small" not in text
