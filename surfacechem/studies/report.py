r"""Result of a study of many runs: a table in the terminal, a netCDF file, a figure, and one HTML page with all of it.

A study declares the items along its axes, the variables at each place, and the sections of its report; dataset, figure,
page and files follow. The page needs no other file: it contains its figure as SVG, the machine and the versions. Each
file is written whole or not at all. Formulas in LaTeX become MathML, which browsers draw without scripts and without
a network.

>>> from surfacechem.studies.report import Page, PageSection, PageTable
>>> table = PageTable(("solver", "error"), [("radau", "1e-10")])
>>> page = Page("A study", "surfacechem precision exothermic", [PageSection("Errors", tables=[table])])
>>> print(page.text())
A study
<BLANKLINE>
Errors
  solver  error
  radau   1e-10
>>> "surfacechem precision exothermic" in page.html()
True
"""

from __future__ import annotations

import os
import platform
import re
import shlex
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from io import StringIO
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from surfacechem.documents.cache_folder import version
from surfacechem.errors import InputError, Place
from surfacechem.quantities import raised
from surfacechem.results.netcdf import CONVENTIONS, Column, Data, replacing, save
from surfacechem.runs.listing import columns, plain

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    import xarray
    from matplotlib.figure import Figure

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
    """Convert a formula; fractions are large with ``display``.

    >>> mathml("a_1")
    '<math><mrow><msub><mi>a</mi><mn>1</mn></msub></mrow></math>'
    """
    from latex2mathml.converter import convert

    words = UPRIGHT_WORD.sub(lambda m: rf"\text{{{m[1].replace(chr(92) + ',', ' ')}}}", latex)
    lines = ALIGNED.sub(r"\\\1{split}", words)
    sized = SIZED_BRACKET.sub(lambda m: rf"\{'left' if m[1] in OPENING_BRACKETS else 'right'}{m[1]}", lines)
    found: str = FUNCTION_NAME.sub(lambda m: SET_OFF.format(m[2], "0" if m[3] else THIN_SPACE), convert(sized.strip()))
    for given, better in SPACING.items():
        found = found.replace(given, better)
    return MATH_TAG.sub('<math displaystyle="true">' if display else "<math>", found, count=1)


def typeset_equation(line: Equation) -> str:
    """Convert an equation with line breaks between terms; a term wider than the page is drawn smaller."""
    found = [mathml(f"{line.left} {line.pieces[0]}", display=True)]
    # A sign at the beginning of a line is spaced like one between two terms.
    found += [mathml(piece, display=True).replace("<mo>", '<mo form="infix">', 1) for piece in line.pieces[1:]]
    widths = [_width(ElementTree.fromstring(formula)) for formula in found]
    return " ".join(f.replace("<math ", f'<math style="--w:{w:.0f}" ', 1) for f, w in zip(found, widths, strict=True))


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


# Packages whose versions a report lists.
LIBRARIES = ("surfacechem", "numpy", "scipy", "numba", "symengine", "cantera", "scikit-sundae", "xarray", "matplotlib")

# The files of a study, in the order in which they are written.
SUFFIXES = (".nc", ".svg", ".png", ".html")


class PageTable(NamedTuple):
    """Rows of texts under a heading; ``marked`` are the indices of highlighted rows, such as failures."""

    heading: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    marked: Sequence[int] = ()


class PageSection(NamedTuple):
    """A part of a report: paragraphs, figure and tables under a heading; details are shown on the page only."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    figure: bool = False
    details: bool = False
    drawings: Sequence[Callable[[], Figure]] = ()
    """Figures of this section, which the first paragraph describes."""
    equations: Sequence[Equation] = ()
    """Equations, which a page typesets without scripts."""
    code: str = ""
    """Text that is shown verbatim, a case for instance."""


class Page(NamedTuple):
    """A study as presented to a reader."""

    title: str
    command: str
    sections: Sequence[PageSection]
    omissions: Sequence[str] = ()
    """Omitted parts, each with its reason."""
    draw: Callable[[], Figure] | None = None

    def text(self) -> str:
        """Return the study for a terminal, without its figure."""
        parts = [self.title]
        for section in self.sections:
            lines = [section.title, *(f"  {line}" for line in section.paragraphs)]
            lines += [f"  {e.text}: {plain(' '.join((e.left, *e.pieces)))}" for e in section.equations]
            lines += [f"  {line}" for line in section.code.splitlines()]
            for table in section.tables:
                lines += [table.caption] if table.caption else []
                lines += [f"  {line}" for line in columns([table.heading, *table.rows])]
            parts += [] if section.details else ["\n".join(lines)]
        if self.omissions:
            parts.append("\n".join(["Left out", *(f"  {line}" for line in self.omissions)]))
        return "\n\n".join(parts)

    def html(self) -> str:
        """Return the study as one HTML page that needs no other file."""
        from jinja2 import Environment, FileSystemLoader, StrictUndefined

        loader = FileSystemLoader(Path(__file__).parent)
        environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
        environment.filters |= {"equation": typeset_equation, "raised": raised}
        template = environment.get_template("page.html")
        drawn = [
            [inline_svg(draw(), f"s{i}f{k}-") for k, draw in enumerate(section.drawings)]
            for i, section in enumerate(self.sections)
        ]
        figures = []
        if self.draw is not None:
            from surfacechem.plots.style import narrow

            with narrow():
                slim = self.draw()
            wide = self.draw()
            figures = [inline_svg(wide)]
            if slim.get_figwidth() < wide.get_figwidth():  # a phone shows this version instead
                figures.append(inline_svg(slim, "n0-"))
        # The font of formulas is a data address, so that the page needs no other file.
        formulas = any(section.equations for section in self.sections)
        font = f"data:font/woff2;base64,{b64encode(FONT.read_bytes()).decode()}" if formulas else ""
        return template.render(page=self, figures=figures, drawn=drawn, machine=machine(), font=font)

    def write(self, target: Path) -> None:
        """Save the page as one HTML file, whole or not at all."""
        text = self.html()
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8", errors="surrogateescape")


def inline_svg(figure: Figure, prefix: str = "f0-") -> str:
    """Return a figure as an SVG element of a page; all its identifiers begin with the prefix."""
    from surfacechem import plots

    buffer = StringIO()
    plots.save(figure, buffer, "svg")
    text = buffer.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    # Identifiers of the figure must differ from those of the page.
    return re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}", text)


@cache
def machine() -> dict[str, str]:
    """Return processor, system, Python and libraries on which a study was made."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8", errors="replace").splitlines() if info.exists() else []
    processor = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return {
        "processor": f"{processor or platform.processor() or platform.machine()}, {os.cpu_count()} cores",
        "system": f"{platform.system()} {platform.machine()}, {python}",
        "versions": ", ".join(f"{name} {version(name)}" for name in LIBRARIES),
    }


class Variable(NamedTuple):
    """A variable of a study: its axes, and the function that reads it from the items at a place."""

    name: str
    over: tuple[str, ...]
    read: Callable[..., float | str]
    unit: str
    text: str


@dataclass(frozen=True, repr=False)
class Study:
    """The result of a study: ``dataset`` is the xarray Dataset, ``page`` the report; ``write`` saves all of it."""

    kind: str
    title: str
    arguments: Sequence[str]
    """Arguments of the command line."""
    axes: Mapping[str, Sequence[Any]]
    """Items along each dimension."""
    variables: Sequence[Variable]
    """Variables of the dataset, the coordinates first."""
    sections: Sequence[PageSection]
    omissions: Sequence[str]
    settings: Mapping[str, str | float | int] = field(default_factory=dict)
    """Global attributes of this study."""
    status: str = "finished"
    """'failed' if a study lacks a reference; else 'finished'."""

    def __repr__(self) -> str:
        """Return the size in a line."""
        return f"<Study of {self.kind}: {', '.join(f'{name} {len(items)}' for name, items in self.axes.items())}>"

    @property
    def command(self) -> str:
        """Command line that repeats the study."""
        return shlex.join(["surfacechem", self.kind, *self.arguments])

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Every variable of the dataset."""
        found = []
        for name, over, read, unit, text in self.variables:
            values = [read(*place) for place in product(*(self.axes[axis] for axis in over))]
            is_text = isinstance(values[0], str)
            table = np.array(values, object if is_text else float).reshape([len(self.axes[axis]) for axis in over])
            found.append(Column(name, over, table, "" if is_text else unit, text))
        return tuple(found)

    @cached_property
    def attributes(self) -> dict[str, str | float | int]:
        """Global attributes: scalars and strings only."""
        return {
            "Conventions": CONVENTIONS,
            "title": self.title,
            "source": "surfacechem",
            "history": f"made by surfacechem {version('surfacechem')}: {self.command}",
            "study": self.kind,
            "command": self.command,
            **self.settings,
            **machine(),
        }

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The study as an xarray Dataset over its axes.

        For ``precision``, ``dataset.set_index(case="case_name", solver="solver_name")`` lets ``sel`` find cases and
        solvers by name; since ``tolerance`` is also an argument of ``sel``, tolerances are selected by
        ``sel({"tolerance": 1e-8})``.
        """
        return Data.of_columns(self.columns, self.attributes).to_xarray()

    def figure(self) -> Figure:
        """Draw the figure of the study, from its dataset alone.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.
        """
        from surfacechem.plots import figure

        return figure(self.dataset)

    @property
    def page(self) -> Page:
        """The report; ``page.text()`` has its tables, ``page.html()`` all of it."""
        return Page(self.title, self.command, self.sections, self.omissions, self.figure)

    def write(self, path: str | Path) -> list[Path]:
        """Save as netCDF, SVG, PNG and HTML files next to each other.

        Parameters
        ----------
        path
            The files without their suffixes.

        Returns
        -------
        list
            The files.

        Raises
        ------
        OutputError
            If one of them cannot be written.
        """
        from surfacechem import plots

        files, figure = targets(path), self.figure()
        save(files[".nc"], self.columns, self.attributes)
        for suffix in (".svg", ".png"):
            plots.write(figure, files[suffix])
            figure.set_layout_engine("none")  # both share the layout, which takes as long as the drawing
        self.page.write(files[".html"])
        return list(files.values())


def targets(path: str | Path) -> dict[str, Path]:
    """Return the files of a study by suffix, all in one folder; InputError for another suffix.

    >>> [str(path) for path in targets("a/study.nc").values()]
    ['a/study.nc', 'a/study.svg', 'a/study.png', 'a/study.html']
    """
    target = Path(path)
    stem = target.with_suffix("")
    if target.suffix and target.suffix not in SUFFIXES:
        message = f"a study is written as {', '.join(SUFFIXES)}, not as '{target.suffix}'. Give {stem.name}."
        raise InputError(message, Place(str(path)))
    return {suffix: stem.with_name(stem.name + suffix) for suffix in SUFFIXES}
