r"""Formulas in LaTeX as MathML, which browsers draw without scripts and without a network.

>>> mathml("a_1")
'<math><mrow><msub><mi>a</mi><mn>1</mn></msub></mrow></math>'
"""

from __future__ import annotations

import re
from base64 import b64encode
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from surfacechem.compile.typeset import Equation

UPRIGHT_WORD = re.compile(r"\\mathrm\{([^{}]{2,})\}")
"""Upright words, which are text instead of a product of letters."""

MATH_TAG = re.compile(r"<math [^>]*>")

ALIGNED = re.compile(r"\\(begin|end)\{aligned\}")
"""Environment of aligned lines, which the converter knows by another name."""

SIZED_BRACKET = re.compile(r"\\[bB]igg?(?:[lr]?)(\\[{}]|\\[lr]angle|[][()])")
"""Brackets of a given size; here their size follows from their content."""

OPENING_BRACKETS = ("(", "[", r"\{", r"\langle")

FUNCTION_NAME = re.compile(r"<m([io])>([a-z]{2,})</m\1>(?=((?:<mrow>)?<mo [^>]*>(?:&#x00028;|\[|&#x0007B;))?)")
"""Name of a function, and the bracket that may follow it."""

THIN_SPACE = "0.167em"
SET_OFF = f'<mo form="prefix" lspace="{THIN_SPACE}" rspace="{{1}}">{{0}}</mo>'
"""Space between a function and the preceding term and, without a bracket, its argument."""

SPACING = {
    "<mo>&#x02202;</mo>": "<mi>&#x02202;</mi>",  # a partial derivative is no binary operator
    "<mo>&#x0002F;</mo>": '<mo lspace="0" rspace="0">&#x0002F;</mo>',
    '<mo stretchy="false">&#x0007C;</mo>': '<mo stretchy="false" lspace="0" rspace="0">&#x0007C;</mo>',
    'width="negativethinmathspace"': 'width="-0.167em"',
}

SCRIPT_SIZE = 0.75
"""Size of an index or exponent relative to its base."""

LETTER_WIDTH, OPERATOR_WIDTH, BRACKET_WIDTH, MARGIN_WIDTH = 0.56, 1.3, 0.4, 0.25
"""Upper estimates of the widths of parts of a formula [em]."""

FONT = Path(__file__).with_name("stix-two-math.woff2")
"""Letters, signs and brackets of STIX Two Math that formulas need."""


class Typeset(str):
    """LaTeX text that a page typesets; as a string it is the source."""

    def __html__(self) -> str:
        """Return the formula as MathML, for templates, which would escape a text."""
        return mathml(self)


def mathml(latex: str, *, display: bool = False) -> str:
    """Convert a formula; fractions are large with ``display``."""
    from latex2mathml.converter import convert

    words = UPRIGHT_WORD.sub(lambda m: rf"\text{{{m[1].replace(chr(92) + ',', ' ')}}}", latex)
    lines = ALIGNED.sub(r"\\\1{split}", words)
    sized = SIZED_BRACKET.sub(lambda m: rf"\{'left' if m[1] in OPENING_BRACKETS else 'right'}{m[1]}", lines)
    found: str = FUNCTION_NAME.sub(lambda m: SET_OFF.format(m[2], "0" if m[3] else THIN_SPACE), convert(sized.strip()))
    for given, better in SPACING.items():
        found = found.replace(given, better)
    return MATH_TAG.sub('<math displaystyle="true">' if display else "<math>", found, count=1)


def equation(line: Equation) -> str:
    """Convert an equation with line breaks between terms; a term wider than the page is drawn smaller."""
    first = mathml(f"{line.left} {line.pieces[0]}", display=True)
    # A sign at the beginning of a line is spaced like one between two terms.
    rest = [mathml(piece, display=True).replace("<mo>", '<mo form="infix">', 1) for piece in line.pieces[1:]]
    return " ".join(map(_fitted, [first, *rest]))


def font() -> str:
    """Return the font of formulas as a data address, so that a page needs no other file."""
    return f"data:font/woff2;base64,{b64encode(FONT.read_bytes()).decode()}"


def _fitted(formula: str) -> str:
    wide = _width(ElementTree.fromstring(formula))
    return formula.replace("<math ", f'<math style="--w:{wide:.0f}" ', 1)


def _width(element: Element) -> float:
    """Estimate the width of an element [em] from above."""
    tag = str(element.tag)
    parts: list[float] = [_width(part) for part in element]
    if tag in ("mi", "mn", "mtext", "ms"):
        return LETTER_WIDTH * len(element.text or "")
    if tag == "mo":
        name = LETTER_WIDTH * len(element.text or "") + MARGIN_WIDTH
        return BRACKET_WIDTH if element.get("fence") else max(name, OPERATOR_WIDTH)
    if tag == "mfrac":
        return max(parts) + MARGIN_WIDTH
    if tag in ("msub", "msup", "msubsup", "munder", "mover", "munderover"):
        return parts[0] + (SCRIPT_SIZE * max(parts[1:]) if tag.startswith("ms") else 0.0)
    if tag == "mtable":
        rows = [[_width(cell) + 2 * MARGIN_WIDTH for cell in row] for row in element]
        return sum((max(column) for column in zip(*rows, strict=True)), 0.0)
    return sum(parts)
