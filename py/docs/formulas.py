"""Formulas between dollar signs, as GitHub has them, become MathML: no script, no font from elsewhere."""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
NAMED = re.compile("<mi>(sin|cos)</mi>")


def on_page_content(content, page, config, files):
    def as_mathml(formula: re.Match[str]) -> str:
        kind, text = formula.groups()
        made = convert(html.unescape(text).strip(), display="block" if kind == "div" else "inline")
        made = NAMED.sub(r'<mo lspace="0.17em" rspace="0.17em">\1</mo>', made)
        return f'<{kind} class="formula">{made}</{kind}>'

    return FORMULA.sub(as_mathml, content)
