"""Terminal output: sheets with colours and fitting columns, and progress bars after two seconds.

Files and pipes get plain text, and a line of progress now and then. Rich is imported only when a terminal shows
something.
"""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

import typer

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    from surfacechem.runs.listing import Sheet
    from surfacechem.studies.report import Page, PageTable

BAR_DELAY = 2.0
"""Seconds after which a progress bar appears."""

LINE_EVERY = 30.0
"""Seconds after which a file or a log gets another line of progress: a choice, ten lines in five minutes."""

COLOURS = {"finished": "green", "stopped": "yellow", "failed": "red", "warning": "yellow", "refused": "yellow"}
"""Colours of labels; others are cyan."""

NAME = 40
"""Number of letters from which on the first cell of a row may be broken, as it is no name."""

ALARM = "ENTROPY DESTROYED"

LOGGER = "surfacechem"


def is_terminal(stream: TextIO) -> bool:
    """True if a stream is a terminal with more than plain text."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def show(*sheets: Sheet) -> None:
    """Print sheets, with a line between them."""
    if not is_terminal(sys.stdout):
        typer.echo("\n\n".join(map(str, sheets)))
        return
    from rich.console import Console

    console = Console(highlight=False)
    for number, sheet in enumerate(sheets):
        console.print(*([""] if number else []), *_rendered(sheet), sep="\n")


def show_page(page: Page) -> None:
    """Print a report; on a terminal its tables have fitting columns, and failures are red."""
    if not is_terminal(sys.stdout):
        typer.echo(page.text())
        return
    from rich.console import Console
    from rich.text import Text

    console = Console(highlight=False)
    console.print(Text(page.title, style="bold"))
    for section in page.sections:
        console.print("", Text(section.title, style="bold cyan"), *map(Text, section.paragraphs), sep="\n")
        if not section.details:
            console.print(*map(_table, section.tables), sep="\n")
    if page.omissions:
        console.print("", Text("Left out", style="bold yellow"), *map(Text, page.omissions), sep="\n")


def _table(table: PageTable) -> RenderableType:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    shown = Table(title=table.caption or None, title_justify="left", title_style="dim", box=SIMPLE_HEAD, pad_edge=False)
    for name in table.heading:
        shown.add_column(Text(name), overflow="fold")
    for number, row in enumerate(table.rows):
        shown.add_row(*map(Text, row), style="red" if number in table.marked else "")
    return shown


def _rendered(sheet: Sheet) -> Iterator[RenderableType]:
    """Yield the parts of a sheet for rich; texts are wrapped next to their labels."""
    from rich.text import Text

    if sheet.title:
        yield Text(sheet.title, style="bold")
    if sheet.facts:
        facts = (
            (Text(label, style=COLOURS.get(label, "cyan")), Text(text, style="bold red" if ALARM in text else ""))
            for label, text in sheet.facts
            if text
        )
        yield _grid(facts, indent=2)
    for heading, rows in sheet.tables.items():
        if heading and rows:
            yield Text(heading, style="bold")
        if rows:
            cells = ((Text(row[0], style="cyan", no_wrap=len(row[0]) < NAME), *map(Text, row[1:])) for row in rows)
            yield _grid(cells, indent=2 if heading or sheet.title else 0)


def _grid(rows: Iterable[Sequence[Text]], indent: int) -> RenderableType:
    """Return rows in columns, indented by so many letters."""
    from rich.padding import Padding
    from rich.table import Table

    grid = Table.grid(padding=(0, 2))
    for row in rows:
        grid.add_row(*row)
    return Padding(grid, (0, 0, 0, indent))


class ProgressBar(logging.Handler):
    """Progress of a command, from the numbers ``done`` and ``total`` of the package's log messages: after some time a
    bar on a terminal, elsewhere a line now and then.
    """

    def __init__(self, talk: bool | None) -> None:
        super().__init__(logging.INFO)
        self.wanted, self.verbose = talk is None, talk is True
        self.begun = time.monotonic()
        self.due = BAR_DELAY if is_terminal(sys.stderr) else LINE_EVERY
        self.words, self.done, self.total = "", 0, 0
        self.shown: Any = None

    def tell(self, words: str, done: int = 0, total: int = 0) -> None:
        """Set the current activity and its progress; nothing is drawn before :meth:`tick`."""
        self.words, self.done, self.total = words, done, total
        if self.verbose:
            self._line()

    def _line(self) -> None:
        counted = f" ({self.done}/{self.total})" if self.total else ""
        typer.echo(f"{time.monotonic() - self.begun:8.2f} s  {self.words}{counted}", err=True)

    def emit(self, record: logging.LogRecord) -> None:
        self.tell(record.getMessage(), getattr(record, "done", 0), getattr(record, "total", 0))

    def tick(self) -> None:
        """Draw the last progress."""
        if not self.wanted or time.monotonic() - self.begun < self.due:
            return
        if not is_terminal(sys.stderr):
            self.due += LINE_EVERY
            return self._line()
        # Rich is imported only now, so that brief commands do not wait for it.
        if self.shown is None:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

            parts = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[counted]}")
            times = TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()
            self.shown = Progress(*parts, *times, console=Console(stderr=True), transient=True)
            self.shown.add_task("", counted="")
            self.shown.start()
        counted = f"{self.done}/{self.total}" if self.total else ""
        (task,) = self.shown.task_ids
        self.shown.update(task, description=self.words, completed=self.done, total=self.total or None, counted=counted)

    def close(self) -> None:
        """Remove the bar."""
        if self.shown is not None:
            self.shown.stop()
            self.shown = None
        super().close()


@contextmanager
def progress_bar(talk: bool | None) -> Iterator[ProgressBar]:
    """Show log messages of the package as a progress bar inside this context; with ``talk`` True as lines with times on
    stderr, with False not at all.
    """
    bar, logger = ProgressBar(talk), logging.getLogger(LOGGER)
    level = logger.level
    logger.addHandler(bar)
    # Without a listener messages are not even formatted.
    if bar.wanted or bar.verbose:
        logger.setLevel(logging.INFO)
    try:
        yield bar
    finally:
        bar.close()
        logger.removeHandler(bar)
        logger.setLevel(level)
