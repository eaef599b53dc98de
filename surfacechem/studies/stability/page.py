"""The stability matrix as a reader sees it: one figure, a table of digits kept, the columns of a dataset, a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.results.netcdf import Column
from surfacechem.solve import names as known_solvers
from surfacechem.studies.report import Page, Section, Table
from surfacechem.studies.stability.figure import COLOURS, MARKS
from surfacechem.studies.stability.matrix import FAILED, LEAST, MOST, OUTCOMES, STEPS, Cell, Matrix, Row, digits_left
from surfacechem.studies.stability.search import Corner

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Stability of the solvers in dangerous regimes"

MEANING = (
    f"Digits kept are -log10 of the largest relative error; {MOST:g} is rounding. R: ended or refused by physics, for "
    "the right reason, with the digits of the time of its end. ×: failed, and said so. !: an answer that is wrong, to "
    f"less than {LEAST:g} digits. ~: so few digits, too, but the problem leaves no more at this tolerance. Its "
    "condition number is the relative change of the answer over that of the data: what rounding of the data, or a "
    "tolerance, changes by itself. Possible digits are those that rounding leaves."
)


def cell_text(cell: Cell) -> str:
    """A cell in a table.

    >>> cell_text(Cell("solved", 9.87, 20, 300, 1e-4, "in T")), cell_text(Cell("failed", 0.0, 0, 0, 0.0, "stiff"))
    ('9.9', '×')
    """
    if cell.outcome == FAILED:
        return MARKS[FAILED]
    return " ".join([*([MARKS[cell.outcome]] if cell.outcome in MARKS else []), f"{cell.digits:.1f}"])


def kept(row: Row, solver: int) -> str:
    """The least digits of all answers of a solver in a row, and how many cells it failed or got wrong."""
    cells = [cells[solver] for cells in row.cells]
    answers = [cell.digits for cell in cells if cell.outcome not in COLOURS]
    parts = [f"{min(answers):.1f}" if answers else "none"]
    parts += [f"{n} {word}" for word in COLOURS if (n := sum(cell.outcome == word for cell in cells))]
    return ", ".join(parts)


def summary(matrix: Matrix) -> Table:
    """A line for each regime: the range of its parameter, and what each solver keeps."""
    rows = []
    for row in matrix.rows:
        label = row.regime.label
        span = f"{row.regime.symbol}: {label(row.values[0])} .. {label(row.values[-1])}"
        worst = max((cells[0].condition for cells in row.cells if math.isfinite(cells[0].condition)), default=math.nan)
        told = condition_texts(worst, matrix.rtol)
        rows.append((row.regime.name, span, *told, *(kept(row, j) for j in range(len(matrix.solvers)))))
    caption = f"Least digits kept over all values, at rtol {matrix.rtol:g}, and the largest condition number"
    return Table(("regime", "from .. to", *condition_headings(matrix.rtol), *matrix.solvers), rows, caption)


def condition_headings(rtol: float) -> tuple[str, str, str]:
    """Headings of a condition number, the digits that are possible, and those that it leaves at the tolerance."""
    return "condition", "possible", f"at rtol {rtol:g}"


def condition_texts(condition: float, rtol: float) -> tuple[str, str, str]:
    """A condition number, the digits that are possible, and those that it leaves at the tolerance.

    >>> condition_texts(5e11, 1e-10), condition_texts(math.nan, 1e-10)
    (('5e+11', '4.0', '0.0'), ('', '', ''))
    """
    if not math.isfinite(condition):
        return "", "", ""
    changes = (np.finfo(float).eps, rtol)
    possible, left = (f"{digits_left(condition, change):.1f}" for change in changes)
    return f"{condition:.0e}", possible, left


def details(row: Row, solvers: Sequence[str], rtol: float) -> Table:
    """Every cell of a regime, with what was said of the first solver's."""
    rows = [
        (
            row.regime.label(value),
            *condition_texts(cells[0].condition, rtol),
            *(cell_text(cell) for cell in cells),
            str(cells[0].steps),
            cells[0].reason,
        )
        for value, cells in zip(row.values, row.cells, strict=True)
    ]
    marked = [i for i, cells in enumerate(row.cells) if any(cell.outcome in COLOURS for cell in cells)]
    of_first = (f"steps of {solvers[0]}", f"{solvers[0]}: where, or why")
    heading = (row.regime.symbol, *condition_headings(rtol), *solvers, *of_first)
    return Table(heading, rows, row.regime.title, marked)


def corners_table(corners: Sequence[Corner]) -> Table:
    """The worst corner of each regime that was searched."""
    rows = [
        (
            corner.regime.name,
            f"{corner.tried}",
            f"{corner.unsolved}",
            f"{cell_text(corner.cell)} {corner.cell.reason}",
            ", ".join(f"{name} = {value:.3g}" for name, value in corner.point.items()),
        )
        for corner in corners
    ]
    return Table(("regime", "points", "not solved", "worst", "where"), rows, "Worst corners that a search has found")


def page(matrix: Matrix, corners: Sequence[Corner], command: str, figure: Figure, left_out: Sequence[str]) -> Page:
    """The report; the terminal shows the summary and the corners."""
    sections = [
        Section("Digits kept", [MEANING], [summary(matrix)], [figure]),
        *([Section("Corners", tables=[corners_table(corners)])] if corners else []),
        Section("Every cell", tables=[details(row, matrix.solvers, matrix.rtol) for row in matrix.rows], details=True),
    ]
    return Page(TITLE, command, sections, left_out)


def omissions(matrix: Matrix, searched: bool) -> list[str]:
    """What the study could have had and has not, each with its reason."""
    found = []
    every, taken = (
        sum(len(values) for values in each)
        for each in zip(*((r.regime.values, r.values) for r in matrix.rows), strict=True)
    )
    if taken < every:
        found.append(f"{every - taken} of {every} values of the regimes, for the sake of time")
    others = [name for name in known_solvers if name not in matrix.solvers]
    found += [f"the solvers {', '.join(others)}, which were not asked for"] if others else []
    found += [] if searched else ["the search for worst corners, which was not asked for"]
    full = sum(cell.steps >= STEPS for row in matrix.rows for cells in row.cells for cell in cells)
    found += [f"what lies beyond {STEPS} steps of a run: {full} took as many, and count as failed"] if full else []
    return found


def columns(matrix: Matrix) -> list[Column]:
    """The matrix with dimensions regime, decade and solver; where a regime has fewer values, nothing."""
    width = max(len(row.values) for row in matrix.rows)
    shape = (len(matrix.rows), width, len(matrix.solvers))
    values, conditions, possible = (np.full(shape[:2], np.nan) for _ in range(3))
    numbers = {name: np.full(shape, np.nan) for name in ("digits", "steps", "residuals", "seconds")}
    words = {name: np.full(shape, "", dtype=object) for name in ("outcome", "reason")}
    for i, row in enumerate(matrix.rows):
        values[i, : len(row.values)] = row.values
        for k, cells in enumerate(row.cells):
            conditions[i, k], possible[i, k] = cells[0].condition, cells[0].possible
            for j, cell in enumerate(cells):
                for name, array in (*numbers.items(), *words.items()):
                    array[i, k, j] = getattr(cell, name)
    names = np.array([row.regime.name for row in matrix.rows], dtype=object)
    everywhere = ("regime", "decade", "solver")
    long_names = {
        "digits": "-log10 of the largest relative error, of values or of the time of the end",
        "steps": "steps",
        "residuals": "evaluations of the equations",
        "seconds": "run time",
        "outcome": f"what came of it: {', '.join(OUTCOMES)}",
        "reason": "where the error is largest, or why the run ended",
    }
    return [
        Column("regime", ("regime",), names, "1", "regime"),
        Column("decade", ("decade",), np.arange(float(width)), "1", "number of the value, from mild to extreme"),
        Column("solver", ("solver",), np.array(matrix.solvers, dtype=object), "1", "solver"),
        Column("symbol", ("regime",), np.array([r.regime.symbol for r in matrix.rows], dtype=object), "1", "parameter"),
        Column("value", ("regime", "decade"), values, "1", "value of the parameter"),
        Column("condition", ("regime", "decade"), conditions, "1", "relative change of the answer over its data's"),
        Column("possible", ("regime", "decade"), possible, "1", "digits that rounding of the data leaves"),
        *(
            Column(name, everywhere, array, "s" if name == "seconds" else "1", long_names[name])
            for name, array in (*numbers.items(), *words.items())
        ),
    ]
