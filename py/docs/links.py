"""Links that leave the folder docs: what they lead to becomes a page. One link serves GitHub and the site."""

from __future__ import annotations

import pathlib
import posixpath
import re

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[2]
APART = "repository"  # of the site, for pages from outside docs
ALWAYS = ["DESIGN.md", "CHANGELOG.md"]
LINK = re.compile(r"(\]\()([^)\s#]+)")
CODE = re.compile(r"^(```+).*?^\1|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def is_local(link: str) -> bool:
    return not link.startswith(("http:", "https:", "mailto:", "/")) and "::" not in link


def in_repository(page: str) -> str:
    """The path in the repository of a page of the site."""
    return page.removeprefix(f"{APART}/") if page.startswith(f"{APART}/") else f"docs/{page}"


def site_page(path: str) -> str:
    """The page of the site that shows a path of the repository."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    return f"{APART}/{path}" + ("" if path.endswith((".md", ".png", ".svg")) else ".md")


def outside_code(text: str, change) -> str:
    """The text with `change` applied to what is not code."""
    parts, end = [], 0
    for code in CODE.finditer(text):
        parts += [change(text[end : code.start()]), code[0]]
        end = code.end()
    return "".join([*parts, change(text[end:])])


def targets(path: str, text: str) -> set[str]:
    """The paths of the repository, outside docs, to which a file of it links."""
    found = set()
    outside_code(text, lambda part: found.update(link[2] for link in LINK.finditer(part)) or part)
    paths = {posixpath.normpath(posixpath.join(posixpath.dirname(path), link)) for link in found if is_local(link)}
    return {path for path in paths if not path.startswith("docs/") and (ROOT / path).exists()}


def shown(path: str) -> str:
    """A file or folder of the repository as Markdown."""
    if (ROOT / path).is_dir():
        names = sorted(f"- `{each.name}`" for each in (ROOT / path).iterdir())
        return f"# {path}\n\n" + "\n".join(names) + "\n"
    text = (ROOT / path).read_text()
    if path.endswith(".md"):
        return text
    language = {"rs": "rust", "py": "python", "toml": "toml", "h": "c"}.get(path.rsplit(".", 1)[-1], "text")
    return f"# {path}\n\n````{language}\n{text}\n````\n"


def on_files(files, config):
    wanted = [
        *ALWAYS,
        *(
            path
            for page in (ROOT / "docs").rglob("*.md")
            for path in targets(str(page.relative_to(ROOT)), page.read_text())
        ),
    ]
    added = set()
    while wanted:
        path = wanted.pop()
        if path in added:
            continue
        added.add(path)
        files.append(File.generated(config, site_page(path), content=shown(path)))
        if path.endswith(".md"):
            wanted += targets(path, shown(path))
    return files


def on_page_markdown(markdown, page, config, files):
    here = page.file.src_uri

    def moved(link: re.Match[str]) -> str:
        if not is_local(link[2]):
            return link[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(in_repository(here)), link[2]))
        if here.startswith(f"{APART}/") or not path.startswith("docs/"):
            return link[1] + posixpath.relpath(site_page(path), posixpath.dirname(here))
        return link[0]

    return outside_code(markdown, lambda part: LINK.sub(moved, part))
