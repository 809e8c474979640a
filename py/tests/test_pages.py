"""The pages of the documentation: their code runs and prints what they say; the generated ones hold everything."""

from __future__ import annotations

import sys

import furuta
import pytest
from command_line import ROOT
from pages import BLOCK, run

sys.path.insert(0, str(ROOT / "py/docs"))

PAGES = [
    page
    for page in sorted((ROOT / "docs").glob("*.md"))
    if any(block[3] for block in BLOCK.finditer(page.read_text()))
]


LONG = {"papers.md", "my-rig.md"}
"""Pages whose commands take a minute."""


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.name, marks=[pytest.mark.long] if page.name in LONG else []) for page in PAGES],
)
def test_the_code_of_a_page_prints_what_it_says(page, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("pandas")
    text = page.read_text()
    if "import gymnasium" in text:
        pytest.importorskip("gymnasium")
    if "furuta.campaign(" in text:
        pytest.importorskip("pyarrow")
        pytest.importorskip("cloudpickle")
    assert text.count("```python\n") + text.count("```sh\n") == sum(1 for _ in BLOCK.finditer(text))
    for done in run(text, tmp_path):
        assert done.as_said(), f"{done.code}\nprints\n{done.printed}"


def test_a_page_that_is_wrong_is_found(tmp_path):
    right, wrong = run(
        "```python\nprint(1)\n```\n\n```text\n1\n```\n\n```python\nprint(2)\n```\n\n```text\n3\n```\n", tmp_path
    )
    assert right.as_said() and not wrong.as_said()


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
