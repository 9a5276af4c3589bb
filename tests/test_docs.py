"""The documents: every file, folder, module and make target that they name exists."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
DOCUMENTS = [HOUSE / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "protocol/README.md")]
DOCUMENTS += sorted((HOUSE / "docs").glob("*.md"))
TARGETS = set(re.findall(r"^([a-z]+):", (HOUSE / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
# Files that a page tells to write.
EXAMPLES = {
    "nodes/haploop/controller/dissipation/my_element.py",
    "nodes/haploop/controller/estimators/alpha_beta.py",
    "nodes/haploop/plant/integrators/heun.py",
    "nodes/haploop/plant/sensing/offset.py",
    "tools/haploop/tools/studies/choi2022/figures/figure_N.py",
}
ROOTS = {"protocol": "protocol", "launch": "launch", "tools": "tools"} | dict.fromkeys(
    ("plant", "controller", "logger", "view"), "nodes"
)


def named(text: str) -> set[str]:
    """The paths in backticks or plain code that begin with a folder of this repository."""
    return set(re.findall(r"(?<![\w/.\-])((?:nodes|protocol|launch|tools|tests|docs)/[\w./\-]*)", text))


def exists(path: str) -> bool:
    """Whether a path is one from the top, or one within ``haploop``, as ``plant/motion/one_mass.py``."""
    first, _, rest = path.partition("/")
    inside = HOUSE / ROOTS.get(first, first) / "haploop" / first / rest
    return path in EXAMPLES or (HOUSE / path).exists() or inside.exists()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_path_that_a_document_names_exists(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    without_links = re.sub(r"\]\([^)]*\)", "]", text)
    assert [path for path in sorted(named(without_links)) if not exists(path.rstrip("."))] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_of_a_document_leads_to_a_file(document: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", document.read_text(encoding="utf-8"))
    local = [link for link in links if "://" not in link]
    assert [link for link in local if not (document.parent / link).exists()] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_make_target_that_a_document_names_is_one(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    assert set(re.findall(r"(?:`|^)make ([a-z]+)", text, re.MULTILINE)) <= TARGETS


def test_the_drawing_of_the_architecture_names_folders_that_exist() -> None:
    drawing = (HOUSE / "docs/architecture.svg").read_text(encoding="utf-8")
    paths = [path for path in named(drawing) if "..." not in path]
    assert len(paths) >= 5
    assert [path for path in paths if not exists(path)] == []


def test_the_quick_tests_are_files_that_exist() -> None:
    quick = re.search(
        r"^QUICK := (.*?)\n\n", (HOUSE / "Makefile").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    assert quick
    folders, _, files = quick[1].partition("$(patsubst")
    names = files.partition("\\\n")[2].rstrip(")").replace("\\\n", " ").split()
    assert all((HOUSE / folder).is_dir() for folder in folders.split())
    assert names
    assert all((HOUSE / f"tests/physics/{name}.py").is_file() for name in names)


@pytest.mark.parametrize(
    "document", [*(path for path in DOCUMENTS if path.name != "CHANGELOG.md"), HOUSE / "Makefile"], ids=lambda p: p.name
)
def test_every_module_that_a_document_starts_or_imports_exists(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    modules = set(re.findall(r"(?:from|-m) (haploop(?:\.[a-z_0-9]+)+)", text))
    examples = {path.split("/", 1)[1].removesuffix(".py").replace("/", ".") for path in EXAMPLES}
    assert [module for module in modules - examples if not importlib.util.find_spec(module)] == []
