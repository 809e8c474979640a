"""Formulas between dollar signs, as GitHub has them, become MathML: no script, no font from elsewhere."""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(content, page, config, files):
    def as_mathml(formula: re.Match[str]) -> str:
        kind, text = formula.groups()
        made = convert(html.unescape(text).strip(), display="block" if kind == "div" else "inline")
        return f'<{kind} class="formula">{made}</{kind}>'

    return FORMULA.sub(as_mathml, content)
