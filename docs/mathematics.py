"""Formulas of the pages as MathML, which a browser draws without a script and without a network."""

import html
import logging
import re
from typing import Any

from surfacechem.studies.report import mathml

MARKED = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.+?)\\[)\]]</\1>', re.DOTALL)
"""Formulas that Markdown has marked."""

DOLLARS = re.compile(r"\$\$(.+?)\$\$|\$([^$<>\n]+?)\$", re.DOTALL)
"""Formulas in the text of notebooks, which their converter leaves as they are."""

CODE = re.compile(r"(<(?:pre|code|script|style)\b.*?</(?:pre|code|script|style)>)", re.DOTALL)

SCRIPTS = re.compile(r'<script (?:src=""|type="text/x-mathjax-config"|type="module")>.*?</script>', re.DOTALL)
"""Scripts that the converter of notebooks adds to fetch MathJax and Mermaid."""

FETCHED = re.compile(r"""<(?:script|link|img)\b[^>]*(?:src|rel="stylesheet" href)="?https?:|import\(["']https?:""")
"""References that a page would load from a network."""

LOG = logging.getLogger("mkdocs.hooks.mathematics")


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Draw the formulas of a page."""
    drawn = MARKED.sub(lambda m: _mathml(m[3], display=m[2] == "["), content)
    if page.file.src_path.endswith(".py"):
        parts = CODE.split(SCRIPTS.sub("", drawn))
        parts[::2] = [DOLLARS.sub(lambda m: _mathml(m[1] or m[2], display=bool(m[1])), part) for part in parts[::2]]
        drawn = "".join(parts)
    return drawn


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Warn of a page that loads something from a network, or has a formula that is not drawn."""
    if found := FETCHED.search(output):
        LOG.warning("%s loads %s", page.file.src_path, output[found.start() : found.end() + 60])
    if "arithmatex" in output:
        LOG.warning("%s has a formula that is not drawn", page.file.src_path)
    return output


def _mathml(latex: str, *, display: bool) -> str:
    """A formula; a wide one scrolls by itself."""
    found = mathml(html.unescape(latex), display=display)
    return f'<div class="formula">{found}</div>' if display else found
