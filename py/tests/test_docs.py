"""What README and docs tell a reader to run is there: every file of a command, every target of a link."""

from __future__ import annotations

import itertools
import os
import pathlib
import re
import shlex

import pytest
from command_line import ROOT

BUILT = {"target", ".venv", "out", "dist", "site", "node_modules"}
PAGES = sorted(
    path
    for path in ROOT.rglob("*.md")
    if not set(path.relative_to(ROOT).parts[:-1]) & BUILT
    and not any(p.startswith(".") for p in path.relative_to(ROOT).parts)
)
# What a command of a page names by these is written by it.
WRITES = {
    "--output",
    "--log",
    "--write-rig",
    "--write-controller",
    "--report",
    "--plot",
    "--json-file",
    "--out",
    "--markdown",
    "--csv",
    ">",
}
PROGRAMS = {"furuta", "cargo", "python", "python3", "pip", "make", "bash", ".venv/bin/python", "target/release/furuta"}
RECORDS = (".csv", ".mcap", ".toml")
# Of a reader, whose own rig the page is about.
YOURS = {"my-rig.toml", "killed.mcap"}
PLACEHOLDER = re.compile(r"[A-Z_]+(\.[a-z]+)?$|.*<[a-z-]+>")


def braces(word: str) -> list[str]:
    """`a{1,2}b` as the shell expands it."""
    if not (found := re.search(r"\{([^{}]*,[^{}]*)\}", word)):
        return [word]
    before, after = word[: found.start()], word[found.end() :]
    return list(itertools.chain.from_iterable(braces(before + part + after) for part in found[1].split(",")))


def commands(text: str) -> list[list[str]]:
    """The words of each command in fenced blocks, then of those within a line, variables and braces expanded."""
    found, variables = [], {}
    blocks = re.findall(r"^```(?:sh|bash|console)?\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    inline = [
        code.replace("\n", " ")
        for code in re.findall(
            r"(?<!`)`([^`]+)`(?!`)", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
        )
    ]
    for block in [*blocks, *inline]:
        for line in block.replace("\\\n", " ").splitlines():
            line = re.sub(r"^\$ ", "", line)
            try:
                words = shlex.split(line, comments=True)
            except ValueError:  # printed text, or a script over several lines
                words = line.split()
            while words and (assigned := re.fullmatch(r"([A-Z]+)=(\S+)", words[0])):
                variables[assigned[1]] = assigned[2]
                words = words[1:]
            if not words or words[0] not in PROGRAMS:
                continue
            words = [re.sub(r"\$\{?([A-Z]+)\}?", lambda name: variables.get(name[1], name[0]), word) for word in words]
            found.append([part for word in words for part in braces(word)])
    return found


def missing(text: str) -> list[str]:
    """The words of a page's commands that name a file of the repository, or one that a command before should have
    written, and there is none."""
    top = {path.name for path in ROOT.iterdir()} - BUILT
    absent, written = [], set()
    for words in commands(text):
        outputs = {word for before, word in itertools.pairwise(words) if before in WRITES}
        if "convert" in words[:2]:
            outputs |= set(words[3:4])
        for word in words[1:]:
            if "=" in word and word.startswith("--"):
                word = word.split("=", 1)[1]
            if word in outputs | YOURS or PLACEHOLDER.fullmatch(word) or word.startswith(("/", "http")):
                continue
            parts = pathlib.PurePath(word).parts
            in_tree = len(parts) > 1 and (parts[0] in top or parts[0] == "..")
            if (in_tree and not (ROOT / word).exists()) or (
                len(parts) == 1 and word.endswith(RECORDS) and word not in written and not (ROOT / word).exists()
            ):
                absent.append(word)
        written |= outputs
    return absent


def test_what_is_missing_is_found():
    page = (
        "```\nQ=examples/qube-servo-2\nfuruta diagnose $Q/chirp-{plus,minus}-9.csv \\\n"
        "    --rig $Q/rig.toml --log a.mcap\nfuruta replay a.mcap b.mcap\n```\n"
    )
    assert missing(page) == [
        "examples/qube-servo-2/chirp-plus-9.csv",
        "examples/qube-servo-2/chirp-minus-9.csv",
        "b.mcap",
    ]


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=lambda page: str(page.relative_to(ROOT))
)
def test_every_file_of_a_command_is_there(page):
    assert missing(page.read_text()) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page):
    text = re.sub(r"^```.*?^```|`[^`\n]+`", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    links = [
        link
        for link in re.findall(r"\]\(([^)#\s]+)", text)
        if not link.startswith(("http", "mailto")) and "::" not in link
    ]
    assert [link for link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_page_needs_a_folder_beside_the_project(page):
    assert "../shared" not in page.read_text()
    outside = [word for words in commands(page.read_text()) for word in words if word.startswith("..")]
    assert all(ROOT in pathlib.Path(os.path.normpath(page.parent / word)).parents for word in outside), outside
