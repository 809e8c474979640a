"""The pages of the documentation: their code runs and prints what they say; the generated ones hold everything."""

from __future__ import annotations

import re
import sys

import furuta
import pytest
from command_line import ROOT
from pages import BLOCK, LONG, run

sys.path.insert(0, str(ROOT / "py/docs"))

PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    if any(">>>" not in block[2] for block in BLOCK.finditer(page.read_text()))
]
"""Pages with code; what is a session (`>>>`) is run as doctest by `test_package.py`."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_code_of_a_page_prints_what_it_says(page, tmp_path):
    as_it_says(page, tmp_path, long=False)


@pytest.mark.long
@pytest.mark.parametrize("page", [page for page in PAGES if LONG in page.read_text()], ids=lambda page: page.name)
def test_the_whole_page_prints_what_it_says(page, tmp_path):
    as_it_says(page, tmp_path, long=True)


def as_it_says(page, folder, *, long):
    pytest.importorskip("matplotlib")
    pytest.importorskip("pandas")
    text = page.read_text()
    if "import gymnasium" in text:
        pytest.importorskip("gymnasium")
    if "furuta.campaign(" in text:
        pytest.importorskip("pyarrow")
        pytest.importorskip("cloudpickle")
    assert text.count("```python\n") + text.count("```sh\n") == sum(1 for _ in BLOCK.finditer(text))
    for done in run(text, folder, long=long):
        assert done.as_said(), f"{done.code}\nprints\n{done.printed}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_block_prints_stands_below_it(page):
    for block in BLOCK.finditer(page.read_text()):
        if block[1] == "python" and re.search(r"^(?:    )*print\(", block[2], re.MULTILINE):
            assert block[3] is not None, block[2]


def test_files_in_pages_are_read():
    """Of a controller, and of a rig that has a law of its own."""
    rig, seen = furuta.Rig.load("qube-servo-2"), 0
    for page in PAGES + [ROOT / "docs/own-hypothesis.md", ROOT / "docs/controllers.md"]:
        for text in re.findall(r"^```toml\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL):
            # What is left out of a law for the sake of brevity is no law.
            if "[hypothesis" in text and "parameters" not in text:
                continue
            seen += 1
            if text.startswith("[controller]"):
                furuta.Controller.from_toml(text, rig, 0.002)
            else:
                read = furuta.Rig.from_toml(f"{rig.to_toml()}\n{text}")
                assert read.effects or "[effects" not in text
    assert seen > 1


def test_names_of_c_are_in_the_exported_file():
    text = (ROOT / "docs/export.md").read_text()
    (block,) = re.findall(r"^```c\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    exported = furuta.Controller.from_toml("", furuta.Rig.load("qube-servo-2"), 0.002).to_c()
    names = set(re.findall(r"\b(?:furuta|FURUTA)_\w+", block))
    assert len(names) > 3 and all(re.search(rf"\b{name}\b", exported) for name in names), names


def test_a_page_that_is_wrong_is_found(tmp_path):
    right, wrong = run(
        "```python\nprint(1)\n```\n\n```text\n1\n```\n\n```python\nprint(2)\n```\n\n```text\n3\n```\n", tmp_path
    )
    assert right.as_said() and not wrong.as_said()


def test_what_takes_long_is_run_only_where_asked(tmp_path):
    page = (
        "```python\nx = 1\n```\n\n<!-- long -->\n```python\nx += 1\n```\n\n"
        "```python\nprint(x)\n```\n\n```text\n2\n```\n"
    )
    for long in (False, True):
        (tmp_path / str(long)).mkdir()
        *_, last = run(page, tmp_path / str(long), long=long)
        assert last.as_said() == long


def test_the_reference_has_every_public_name_once():
    reference = pytest.importorskip("reference")
    named = " ".join(names for _, names in reference.GROUPS.values()).split()
    public = {name for name in furuta.__all__ if name not in ("papers", "plot", "__version__")}
    public |= {f"{module}.{name}" for module in ("papers", "plot") for name in getattr(furuta, module).__all__}
    # furuta.gym is no part of `import furuta`.
    assert sorted(name for name in named if not name.startswith("gym.")) == sorted(public)


def test_every_effect_has_a_section_and_is_seen_in_its_picture():
    pytest.importorskip("matplotlib")
    import effects

    text = "".join(effects.pages().values())
    for id in furuta.catalogue():
        assert f"{{ #{id} }}" in text
        _, without, having = effects.runs(id)
        count = 2 * 3.1416 / 2048
        assert abs(having - without).max() > 4 * count, id
