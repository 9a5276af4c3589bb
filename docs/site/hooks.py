"""Hooks of the documentation's build: pages from elsewhere in the repository, pages generated from code, links.

MkDocs calls the functions whose names begin with ``on_``. Links that lead to no page, such as those to source files,
become plain text: the site stands by itself.
"""

from __future__ import annotations

import posixpath
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
import reference

HOUSE = Path(__file__).parents[2]
# Pages that lie outside of docs/, by their path within the site.
ELSEWHERE = {
    "index.md": "README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
    "protocol.md": "protocol/README.md",
    "examples.md": "examples/README.md",
}
# What README says of the site, and what the site says in its place.
_MADE = "`make docs`, which makes these pages a site, with a reference that is generated from the code"
_HERE = ", ".join(f"[{page}](docs/reference/{page}.md)" for page in ("scene", "commands", "summary", "log", "api"))
_PICTURE = re.compile(r"(?<!\[)(!\[[^\]]*\]\(([^)\s]+)\))")
_LINK = re.compile(r"(!?)\[((?:[^\]\[]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
# A command or a name in a sentence that is short enough to stand in one line of a phone.
_SHORT = re.compile(r"<code>([^<>]{1,28})</code>")
# A role of Sphinx, which Markdown shows as it is written.
_ROLE = re.compile(r":[a-z]+:<code[^>]*>[^<]*</code>")


def on_files(files: Files, config: Any) -> Files:
    """Adds the pages from elsewhere and those that are generated."""
    for page, path in ELSEWHERE.items():
        files.append(File.generated(config, page, content=(HOUSE / path).read_text(encoding="utf-8")))
    for page, make in reference.PAGES.items():
        files.append(File.generated(config, page, content=make()))
    return files


def on_page_content(html: str, page: Any = None, **_: Any) -> str:
    """Returns the page with its short pieces of code marked as whole: a browser would break them after every hyphen.

    Raises ValueError where a docstring has a role of Sphinx, which would stand there as it is written.
    """
    if role := _ROLE.search(html):
        where = page.file.src_uri if page else "a page"
        raise ValueError(f"{where} shows {role[0]!r}; in the docstring write the name in two backticks on either side.")
    return _SHORT.sub(r'<code class="whole">\1</code>', html)


def on_post_build(config: Any) -> None:
    """Removes the theme's page of errors: its links are those of a server's root, and lead nowhere from the disk."""
    Path(config["site_dir"], "404.html").unlink(missing_ok=True)


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Returns the page with its links leading to pages of the site, and every picture a link to its full size."""
    here = page.file.src_uri
    folder = posixpath.dirname(ELSEWHERE.get(here, f"docs/{here}"))
    pages = {path: name for name, path in ELSEWHERE.items()}

    def led(match: re.Match[str]) -> str:
        picture, text, link = match.groups()
        text = _LINK.sub(led, text)
        target, _, anchor = link.partition("#")
        if "://" in link or not target:
            return match[0]
        path = posixpath.normpath(posixpath.join(folder, target))
        found = pages.get(path) or (path.removeprefix("docs/") if path.startswith("docs/") else "")
        if not found or files.get_file_from_path(found) is None:
            if picture or not (HOUSE / path).exists():
                return match[0]  # which the build then complains of
            return text
        relative = posixpath.relpath(found, posixpath.dirname(here) or ".")
        return f"{picture}[{text}]({relative}{'#' * bool(anchor)}{anchor})"

    if here == "index.md":
        if _MADE not in markdown:
            raise ValueError(f"README.md no longer says {_MADE!r}, in whose place the site names its reference.")
        markdown = markdown.replace(_MADE, f"the reference: {_HERE}")
    parts = re.split(r"(^```.*?^```$)", markdown, flags=re.MULTILINE | re.DOTALL)
    linked = (part if part.startswith("```") else _LINK.sub(led, _PICTURE.sub(r"[\1](\2)", part)) for part in parts)
    return "".join(linked)
