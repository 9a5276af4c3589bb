"""The documents: every file, folder, module and make target that they name exists."""

from __future__ import annotations

import ast
import importlib.util
import re
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer.main

from haploop.controller.dissipation import registry
from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.schema import whole_schema
from haploop.tools.cli.app import app
from helpers.documented import command_lines

HOUSE = Path(__file__).parents[1]
DOCUMENTS = [HOUSE / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "protocol/README.md")]
DOCUMENTS += sorted((HOUSE / "docs").rglob("*.md"))
# Pages of the site that its build generates.
GENERATED = set(re.findall(r'"(reference/\w+\.md)"', (HOUSE / "docs/site/reference.py").read_text(encoding="utf-8")))
FOR_USERS = [path for path in DOCUMENTS if path.name not in ("CHANGELOG.md", "CONTRIBUTING.md")]
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
    missing = [document.parent / link for link in local if not (document.parent / link).exists()]
    generated = [HOUSE / "docs" / page for page in GENERATED]
    assert [link for link in missing if link.resolve() not in generated] == []


def anchors_of(text: str) -> set[str]:
    """The anchors that headings and ids give a page."""
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", head).strip().lower() for head in heads]
    return {re.sub(r"[^\w\- ]", "", head).replace(" ", "-") for head in plain} | set(re.findall(r'id="([^"]+)"', text))


def test_every_anchor_that_a_document_links_to_is_in_the_page():
    lost = []
    for document in (*DOCUMENTS, HOUSE / "examples/README.md"):
        for file, anchor in re.findall(r"\]\(([^):#]*)#([^)]+)\)", document.read_text(encoding="utf-8")):
            page = document.parent / file if file else document
            if page.suffix == ".md" and page.exists() and anchor not in anchors_of(page.read_text(encoding="utf-8")):
                lost.append(f"{document.name}: {file}#{anchor}")
    assert lost == []


@pytest.fixture
def hooks() -> Any:
    """Loads the hooks of the site's build."""
    pytest.importorskip("mkdocs", reason="the site needs mkdocs: pip install 'haploop[docs]'")
    place = importlib.util.spec_from_file_location("site_hooks", HOUSE / "docs/site/hooks.py")
    assert place
    assert place.loader
    hooks = importlib.util.module_from_spec(place)
    place.loader.exec_module(hooks)
    return hooks


def test_the_site_has_no_page_whose_links_lead_nowhere_from_the_disk(hooks: Any, tmp_path: Path):
    (tmp_path / "404.html").touch()
    (tmp_path / "index.html").touch()
    hooks.on_post_build({"site_dir": str(tmp_path)})
    assert [path.name for path in tmp_path.iterdir()] == ["index.html"]


def test_a_page_that_shows_a_role_of_sphinx_is_no_page_of_the_site(hooks: Any):
    assert "run" in hooks.on_page_content("<p>as <code>run</code>: see</p>")
    page = SimpleNamespace(file=SimpleNamespace(src_uri="reference/api.md"))
    with pytest.raises(ValueError, match=r"api.md shows ':meth:<code>run</code>'"):
        hooks.on_page_content("<p>as :meth:<code>run</code></p>", page=page)


def test_every_picture_of_readme_and_site_is_a_link_to_its_full_size(hooks: Any):
    files = SimpleNamespace(get_file_from_path=lambda path: path if (HOUSE / "docs" / path).exists() else None)
    seen = 0
    for name in ("index.md", "viewers.md", "paper_claims.md"):
        text = (HOUSE / hooks.ELSEWHERE.get(name, f"docs/{name}")).read_text(encoding="utf-8")
        page = SimpleNamespace(file=SimpleNamespace(src_uri=name))
        pictures = re.findall(
            r"(\[?)!\[[^\]]*\]\(([^)]+)\)(?:\]\(([^)]+)\))?", hooks.on_page_markdown(text, page, {}, files)
        )
        assert pictures
        assert [picture for picture in pictures if picture[0] != "[" or picture[1] != picture[2]] == []
        assert all((HOUSE / "docs" / where).exists() for _, where, _ in pictures)
        seen += len(pictures)
    assert seen > 15
    assert not re.search(r"(?<!\[)!\[", (HOUSE / "README.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["notebook.ipynb", "plotjuggler_layout.xml", "foxglove_layout.json"])
def test_a_file_that_the_guides_offer_is_part_of_the_site(name):
    left_out = re.search(r"^exclude_docs: \|\n((?:  .*\n)+)", (HOUSE / "mkdocs.yml").read_text(encoding="utf-8"), re.M)
    assert left_out
    assert not any(Path(name).match(pattern.strip()) for pattern in left_out[1].splitlines())


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_make_target_that_a_document_names_is_one(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    assert set(re.findall(r"(?:`|^)make ([a-z]+)", text, re.MULTILINE)) <= TARGETS


def test_the_drawing_of_the_architecture_names_folders_that_exist() -> None:
    drawing = (HOUSE / "docs/architecture.svg").read_text(encoding="utf-8")
    paths = [path for path in named(drawing) if "..." not in path]
    assert len(paths) >= 5
    assert [path for path in paths if not exists(path)] == []


def test_the_drawing_of_the_loop_names_every_table_of_a_scene_and_no_other() -> None:
    drawing = (HOUSE / "docs/pictures/loop.svg").read_text(encoding="utf-8")
    drawn = {name.partition(".")[0] for name in re.findall(r"\[([a-z.]+)\]", drawing)}
    plain = {"title", "extends", "duration", "seed", "diverged_beyond"}
    assert drawn == whole_schema(registry())["properties"].keys() - plain


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


def wrong_words(line: str) -> list[str]:
    """What is no command or no option of it in a line such as ``haploop run my.toml --view   # comment``."""
    words = shlex.split(line.partition("   #")[0].partition(" | ")[0], comments=True)[1:]
    commands: Any = typer.main.get_command(app)
    if not words or words[0].startswith("-"):
        return []
    command = commands.commands.get(words[0])
    if command is None:
        return [words[0]]
    known = {word for one in command.params for word in (*one.opts, *one.secondary_opts)} | {"--help", "-h"}
    return [word for word in words[1:] if word.startswith("--") and word.partition("=")[0] not in known]


@pytest.mark.slow
@pytest.mark.parametrize("document", FOR_USERS, ids=lambda path: path.name)
def test_every_command_that_a_document_shows_is_one_and_takes_its_options(document: Path) -> None:
    lines = command_lines(document.read_text(encoding="utf-8"))
    assert {line: wrong for line in lines if (wrong := wrong_words(line))} == {}


def test_a_command_or_an_option_that_is_none_is_found() -> None:
    assert wrong_words("haploop dance my.toml") == ["dance"]
    assert wrong_words("haploop run my.toml --set a=1 --slowly   # --not-this") == ["--slowly"]
    assert command_lines("```\nhaploop run a \\\n  --view\n```\n") == ["haploop run a    --view"]


def test_every_scene_sweep_and_device_that_readme_runs_comes_with_haploop_or_was_made_before() -> None:
    lines = command_lines((HOUSE / "README.md").read_text(encoding="utf-8"))
    of = {"run": "scenes", "advise": "scenes", "sweep": "sweeps", "check": "scenes"}
    named = [(words[1], words[2]) for line in lines if (words := shlex.split(line))[1] in of]
    assert len(named) >= 4
    assert [name for command, name in named if name not in bundled(of[command])] == []


@pytest.mark.parametrize("document", FOR_USERS, ids=lambda path: path.name)
def test_every_python_block_of_a_document_compiles_and_imports_what_there_is(document: Path) -> None:
    for block in re.findall(r"^```python\n(.*?)^```", document.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("haploop"):
                module = importlib.import_module(node.module or "")
                assert [each.name for each in node.names if not hasattr(module, each.name)] == [], node.module
