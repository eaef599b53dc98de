"""The outcome of a study of many runs: a table in the terminal, a netCDF file, a figure, and one HTML page of it all.

A study declares what lies along its axes, the variables that are read off there, and the sections of its report; the
dataset, the figure, the page and the files follow. The page needs no other file: its figure is inline SVG, the machine
and the versions are in it. Each file appears whole or not at all.

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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.metadata import version
from io import StringIO
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from surfacechem.errors import InputError, Place
from surfacechem.quantities import raised
from surfacechem.results.netcdf import CONVENTIONS, Column, as_dataset, replacing, save
from surfacechem.runs.listing import plain
from surfacechem.runs.sheet import columns
from surfacechem.studies import mathml

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from surfacechem.compile.typeset import Equation

# Packages whose versions a report states.
LIBRARIES = ("surfacechem", "numpy", "scipy", "numba", "symengine", "cantera", "scikit-sundae", "xarray", "matplotlib")

# The files of a study, in the order in which they are written.
SUFFIXES = (".nc", ".svg", ".png", ".html")


class PageTable(NamedTuple):
    """Rows of texts under a heading; ``marked`` are the numbers of rows that stand out, such as failures."""

    heading: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    marked: Sequence[int] = ()


class PageSection(NamedTuple):
    """A part of a report: paragraphs, the figure and tables under a heading; details are for the page only."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    figure: bool = False
    details: bool = False
    drawings: Sequence[Callable[[], Figure]] = ()
    """Figures of this section alone, each with its words as the first paragraph says them."""
    equations: Sequence[Equation] = ()
    """Equations, which a page typesets without scripts."""
    code: str = ""
    """Text that is shown as it is, of a case for instance."""


@dataclass(frozen=True)
class Page:
    """A study as a reader sees it."""

    title: str
    command: str
    sections: Sequence[PageSection]
    omissions: Sequence[str] = ()
    """Parts that were left out, each with its reason."""
    draw: Callable[[], Figure] | None = None

    def text(self) -> str:
        """The study for a terminal, without its figure."""
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
        """The study as one HTML page that needs no other file."""
        from jinja2 import Environment, FileSystemLoader, StrictUndefined

        loader = FileSystemLoader(Path(__file__).parent)
        environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
        environment.filters |= {"equation": mathml.equation, "raised": raised}
        template = environment.get_template("page.html")
        drawn = [
            [inline_svg(draw(), f"s{i}f{k}-") for k, draw in enumerate(section.drawings)]
            for i, section in enumerate(self.sections)
        ]
        font = mathml.font() if any(section.equations for section in self.sections) else ""
        return template.render(page=self, figures=self._figures(), drawn=drawn, machine=machine(), font=font)

    def write(self, target: Path) -> None:
        """Save it as one HTML file, whole or not at all."""
        text = self.html()
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def _figures(self) -> list[str]:
        """The figure as SVG, and the one that a phone shows in its place if it is narrower."""
        if self.draw is None:
            return []
        from surfacechem.plots.style import narrow

        with narrow():
            slim = self.draw()
        wide = self.draw()
        return [inline_svg(wide), *([inline_svg(slim, "n0-")] if slim.get_figwidth() < wide.get_figwidth() else [])]


def inline_svg(figure: Figure, prefix: str = "f0-") -> str:
    """A figure as an SVG element of a page, whose names begin with a prefix of their own."""
    from surfacechem import plots

    buffer = StringIO()
    plots.save(figure, buffer, "svg")
    text = buffer.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    # Names of the figure must differ from those of the page.
    return re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}", text)


@cache
def machine() -> dict[str, str]:
    """Processor, system, Python and libraries on which a study was made."""
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
    """A variable of a study: the axes that it goes over, and how it is read off what lies at a place of each."""

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
    """The items along each dimension."""
    variables: Sequence[Variable]
    """The variables of the dataset, the coordinates first."""
    sections: Sequence[PageSection]
    omissions: Sequence[str]
    settings: Mapping[str, str | float | int] = field(default_factory=dict)
    """Global attributes of its own."""
    status: str = "finished"
    """'failed' where a study lacks what it is to compare with; else 'finished'."""

    def __repr__(self) -> str:
        """Size in a line."""
        return f"<Study of {self.kind}: {', '.join(f'{name} {len(items)}' for name, items in self.axes.items())}>"

    @property
    def command(self) -> str:
        """The command line that makes the study again."""
        return shlex.join(["surfacechem", self.kind, *self.arguments])

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Every variable of the dataset."""
        found = []
        for name, over, read, unit, text in self.variables:
            values = [read(*place) for place in product(*(self.axes[axis] for axis in over))]
            kind = object if isinstance(values[0], str) else float
            table = np.array(values, dtype=kind).reshape([len(self.axes[axis]) for axis in over])
            found.append(Column(name, over, table, unit, text))
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

        In that of ``precision`` ``dataset.set_index(case="case_name", solver="solver_name")`` lets ``sel`` find cases
        and solvers by name; since ``tolerance`` is also an argument of ``sel``, tolerances are asked for by
        ``sel({"tolerance": 1e-8})``.
        """
        return as_dataset(self.columns, self.attributes)

    def figure(self) -> Figure:
        """The figure of the study, which its dataset alone is enough for.

        Returns
        -------
        matplotlib.figure.Figure
            What ``savefig`` writes.
        """
        from surfacechem.plots.study import figure

        return figure(self.dataset)

    @property
    def page(self) -> Page:
        """The report; ``page.text()`` is its tables, ``page.html()`` all of it."""
        return Page(self.title, self.command, self.sections, self.omissions, self.figure)

    def write(self, path: str | Path) -> list[Path]:
        """Save as netCDF, SVG, PNG and HTML side by side.

        Parameters
        ----------
        path
            What the names of the files begin with.

        Returns
        -------
        list
            The files.

        Raises
        ------
        OutputError
            Where one of them cannot be written.
        """
        from surfacechem import plots

        files, figure = targets(path), self.figure()
        save(files[".nc"], self.columns, self.attributes)
        for suffix in (".svg", ".png"):
            plots.write(figure, files[suffix])
            figure.set_layout_engine("none")  # both have the same, which takes as long to find as to draw
        self.page.write(files[".html"])
        return list(files.values())


def targets(path: str | Path) -> dict[str, Path]:
    """The files of a study by their suffix, side by side; InputError where another suffix is asked for.

    >>> [str(path) for path in targets("a/study.nc").values()]
    ['a/study.nc', 'a/study.svg', 'a/study.png', 'a/study.html']
    """
    target = Path(path)
    stem = target.with_suffix("")
    if target.suffix and target.suffix not in SUFFIXES:
        message = f"a study is written as {', '.join(SUFFIXES)}, not as '{target.suffix}'. Give {stem.name}."
        raise InputError(message, Place(str(path)))
    return {suffix: stem.with_name(stem.name + suffix) for suffix in SUFFIXES}
