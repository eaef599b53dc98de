"""What a study of many runs hands over: a table in the terminal, a netCDF file, and one HTML page with all of it.

A study is described by a :class:`Page`: title, the command that makes it again, sections of text, tables and figures,
and what was left out with the reason. ``page.html()`` is one file that needs no other: figures are inline SVG, the
machine and the versions are in it. ``page.text()`` is the same for a terminal, without figures. ``write`` saves the
dataset, the figure as SVG and PNG and the page side by side; each file appears whole or not at all.

>>> from surfacechem.studies.report import Page, Section, Table
>>> table = Table(("solver", "error"), [("radau", "1e-10")])
>>> page = Page("A study", "surfacechem precision exothermic", [Section("Errors", tables=[table])])
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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from surfacechem.results.netcdf import Column, replacing, save
from surfacechem.runs.report import columns

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

Attributes: TypeAlias = Mapping[str, str | float | int]

LIBRARIES = ("surfacechem", "numpy", "scipy", "numba", "symengine", "cantera", "scikit-sundae", "xarray", "matplotlib")
"""Packages whose versions a report states."""

SUFFIXES = (".nc", ".svg", ".png", ".html")
"""The files of a study, in the order in which they are written."""

STYLE = """\
body{font:15px/1.5 system-ui,sans-serif;color:#1a1a1a;background:#fff;max-width:72rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem;border-bottom:1px solid #ddd}
table{border-collapse:collapse;font-size:13px;margin:.8rem 0;display:block;overflow-x:auto}
caption{text-align:left;color:#555;padding-bottom:.3rem}
th,td{text-align:left;padding:.15rem .7rem .15rem 0;border-bottom:1px solid #eee;vertical-align:top}
td{font-variant-numeric:tabular-nums}pre{background:#f5f5f5;padding:.6rem;overflow-x:auto}
tr.marked td{color:#b00020}figure{margin:1rem 0}figure svg{max-width:100%;height:auto}
"""


@dataclass(frozen=True)
class Table:
    """Rows of texts under a heading; ``marked`` are the numbers of rows that stand out, such as failures."""

    heading: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    marked: Sequence[int] = ()

    def text(self) -> str:
        """The table in columns, indented."""
        lines = [f"  {line}" for line in columns([self.heading, *self.rows])]
        return "\n".join([*([self.caption] if self.caption else []), *lines])

    def html(self) -> str:
        """The table as HTML."""
        rows = "".join(
            f"<tr{' class=marked' if i in self.marked else ''}>{_cells('td', row)}</tr>\n"
            for i, row in enumerate(self.rows)
        )
        caption = f"<caption>{escape(self.caption)}</caption>" if self.caption else ""
        return f"<table>{caption}<thead><tr>{_cells('th', self.heading)}</tr></thead>\n<tbody>{rows}</tbody></table>"


def _cells(kind: str, row: Sequence[str]) -> str:
    return "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in row)


@dataclass(frozen=True)
class Section:
    """A part of a report: paragraphs, tables and figures under a heading; details are for the page only."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    details: bool = False
    """Whether the terminal does without this section."""

    def text(self) -> str:
        """The section for a terminal."""
        return "\n".join([self.title, *(f"  {line}" for line in self.paragraphs), *(t.text() for t in self.tables)])


@dataclass(frozen=True)
class Page:
    """A study as a reader sees it."""

    title: str
    command: str
    """The command line that makes the study again."""
    sections: Sequence[Section]
    omissions: Sequence[str] = ()
    """What was left out, each with its reason."""
    settings: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """The study for a terminal."""
        parts = [self.title, *(section.text() for section in self.sections if not section.details)]
        if self.omissions:
            parts.append("\n".join(["Left out", *(f"  {line}" for line in self.omissions)]))
        return "\n\n".join(parts)

    def html(self) -> str:
        """The study as one HTML page that needs no other file."""
        return "\n".join(self._html())

    def _html(self) -> Iterator[str]:
        title = escape(self.title)
        yield f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        yield f"<style>\n{STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n<pre>{escape(self.command)}</pre>"
        number = 0
        for section in self.sections:
            yield f"<h2>{escape(section.title)}</h2>"
            yield from (f"<p>{escape(text)}</p>" for text in section.paragraphs)
            for figure in section.figures:
                yield f"<figure>{inline_svg(figure, f'f{number}-')}</figure>"
                number += 1
            yield from (table.html() for table in section.tables)
        yield "<h2>Left out</h2>"
        items = [f"<li>{escape(line)}</li>" for line in self.omissions]
        yield f"<ul>{''.join(items)}</ul>" if items else "<p>Nothing.</p>"
        yield "<h2>Machine and versions</h2>"
        yield Table(("", ""), [*self.settings.items(), *machine().items()]).html()
        yield "</body></html>\n"


def inline_svg(figure: Figure, prefix: str) -> str:
    """A figure as an SVG element whose names differ from those of other figures on the page."""
    from surfacechem.plots import run as plots

    buffer = StringIO()
    plots.save(figure, buffer, "svg")
    text = buffer.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{prefix}', text)
    return re.sub(r'(url\(#|href="#)', rf"\g<1>{prefix}", text)


@cache
def machine() -> dict[str, str]:
    """What a study ran on: processor, system, Python and libraries."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8", errors="replace").splitlines() if info.exists() else []
    processor = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    return {
        "processor": f"{processor or platform.processor() or platform.machine()}, {os.cpu_count()} cores",
        "system": f"{platform.system()} {platform.machine()}, {platform.python_implementation()} "
        f"{platform.python_version()}",
        "versions": ", ".join(f"{name} {version(name)}" for name in LIBRARIES),
    }


def as_dataset(data: Sequence[Column], coordinates: Sequence[str], attributes: Attributes) -> xarray.Dataset:
    """Columns as an xarray Dataset; ``coordinates`` are the names of those that are coordinates."""
    import xarray

    variables = {c.name: (c.dimensions, c.values, c.attributes) for c in data}
    axes = {name: variables.pop(name) for name in coordinates}
    return xarray.Dataset(variables, coords=axes, attrs=dict(attributes))


def targets(path: str | Path) -> dict[str, Path]:
    """The files of a study by their suffix, side by side.

    >>> [str(path) for path in targets("a/study.nc").values()]
    ['a/study.nc', 'a/study.svg', 'a/study.png', 'a/study.html']
    """
    stem = Path(path)
    stem = stem.with_suffix("") if stem.suffix in SUFFIXES else stem
    return {suffix: stem.with_name(stem.name + suffix) for suffix in SUFFIXES}


def write(path: str | Path, data: Sequence[Column], attributes: Attributes, figure: Figure, page: Page) -> list[Path]:
    """Save dataset, figure and page; returns the files."""
    from surfacechem.plots import run as plots

    files = targets(path)
    for suffix, target in files.items():
        if suffix == ".nc":
            save(target, data, attributes)
            continue
        with replacing(target) as temporary:
            if suffix == ".html":
                temporary.write_text(page.html(), encoding="utf-8")
            else:
                plots.save(figure, temporary, suffix.removeprefix("."))
    return list(files.values())
