"""The stability matrix as a reader sees it: one figure, a table of digits kept, the columns of a dataset, a page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch

from surfacechem.netcdf import Column
from surfacechem.plots import STYLE
from surfacechem.stability.matrix import FAILED, LEAST, MOST, OUTCOMES, REFUSED, STEPS, WRONG, Cell, Matrix, Row
from surfacechem.stability.search import Corner
from surfacechem.studyreport import Page, Section, Table

MARKS = {REFUSED: "R", FAILED: "×", WRONG: "!"}
COLOURS = {FAILED: "0.75", WRONG: "#d62728"}

DARK = 8.0
"""Digits above which the colour of a cell is dark."""

MEANING = (
    f"Digits kept are -log10 of the largest relative error; {MOST:g} is rounding. R: ended or refused by physics, for "
    "the right reason, with the digits of the time of its end. ×: failed, and said so. !: an answer that is wrong, to "
    f"less than {LEAST:g} digits."
)


def cell_text(cell: Cell) -> str:
    """A cell in a table.

    >>> cell_text(Cell("solved", 9.87, 20, 300, 1e-4, "in T")), cell_text(Cell("failed", 0.0, 0, 0, 0.0, "stiff"))
    ('9.9', '×')
    """
    digits = f"{cell.digits:.1f}"
    return {REFUSED: f"R {digits}", FAILED: MARKS[FAILED], WRONG: f"! {digits}"}.get(cell.outcome, digits)


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
        rows.append((row.regime.name, span, *(kept(row, j) for j in range(len(matrix.solvers)))))
    caption = f"Least digits kept over all values, at rtol {matrix.rtol:g}"
    return Table(("regime", "from .. to", *matrix.solvers), rows, caption)


def details(row: Row, solvers: Sequence[str]) -> Table:
    """Every cell of a regime, with what was said of the first solver's."""
    rows = [
        (row.regime.label(value), *(cell_text(cell) for cell in cells), str(cells[0].steps), cells[0].reason)
        for value, cells in zip(row.values, row.cells, strict=True)
    ]
    marked = [i for i, cells in enumerate(row.cells) if any(cell.outcome in COLOURS for cell in cells)]
    heading = (row.regime.symbol, *solvers, f"steps of {solvers[0]}", f"{solvers[0]}: where, or why")
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


def page(matrix: Matrix, corners: Sequence[Corner], command: str) -> Page:
    """The report; the terminal shows the summary and the corners."""
    sections = [
        Section("Digits kept", [MEANING], [summary(matrix)], [figure(matrix)]),
        *([Section("Corners", tables=[corners_table(corners)])] if corners else []),
        Section("Every cell", tables=[details(row, matrix.solvers) for row in matrix.rows], details=True),
    ]
    left_out = [f"runs of more than {STEPS} steps, which count as failed"]
    return Page("Stability of the solvers in dangerous regimes", command, sections, left_out)


def figure(matrix: Matrix) -> Figure:
    """Digits kept as a heat map, a panel for each solver and a row for each regime; to the right is more extreme."""
    import matplotlib

    width = max(len(row.values) for row in matrix.rows)
    count, height = len(matrix.solvers), len(matrix.rows)
    with matplotlib.rc_context(STYLE):
        plot = Figure(figsize=(2.2 + 0.23 * width * count, 1.3 + 0.26 * height), layout="constrained")
        FigureCanvasAgg(plot)
        axes = np.atleast_1d(plot.subplots(1, count, sharey=True))
        scale = Normalize(0.0, 14.0)
        for j, (ax, solver) in enumerate(zip(axes, matrix.solvers, strict=True)):
            image = _panel(ax, matrix, j, width, scale)
            ax.set_title(solver, fontsize=9)
            ax.set_xticks([])
        axes[0].set_yticks(range(height), [row.regime.name for row in matrix.rows])
        axes[count // 2].set_xlabel("towards the extreme →")
        plot.colorbar(image, ax=list(axes), label="digits kept", fraction=0.03, pad=0.01)
        words = {"R": "ended for the right reason", "×": "failed, and said so", "!": "wrong"}
        handles = [Patch(facecolor="none", edgecolor="none", label=f"{mark}  {word}") for mark, word in words.items()]
        plot.legend(handles=handles, loc="outside lower center", ncols=3, handlelength=0, frameon=False, fontsize=8)
    return plot


def _panel(ax: Axes, matrix: Matrix, solver: int, width: int, scale: Normalize) -> AxesImage:
    digits = np.full((len(matrix.rows), width), np.nan)
    for i, row in enumerate(matrix.rows):
        for k, cells in enumerate(row.cells):
            cell = cells[solver]
            if cell.outcome in COLOURS:
                ax.add_patch(_box(k, i, COLOURS[cell.outcome]))
            else:
                digits[i, k] = cell.digits
            mark, dark = MARKS.get(cell.outcome, ""), cell.outcome not in COLOURS and cell.digits > DARK
            ax.text(k, i, mark, ha="center", va="center", fontsize=7, color="white" if dark else "black")
    image = ax.imshow(digits, norm=scale, cmap="YlGnBu", aspect="auto")
    ax.grid(visible=False)
    for side in ax.spines.values():
        side.set_visible(False)
    ax.tick_params(length=0)
    return image


def _box(k: int, i: int, colour: str) -> Patch:
    from matplotlib.patches import Rectangle

    return Rectangle((k - 0.5, i - 0.5), 1.0, 1.0, facecolor=colour, edgecolor="none")


def columns(matrix: Matrix) -> list[Column]:
    """The matrix with dimensions regime, decade and solver; where a regime has fewer values, nothing."""
    width = max(len(row.values) for row in matrix.rows)
    shape = (len(matrix.rows), width, len(matrix.solvers))
    values = np.full(shape[:2], np.nan)
    numbers = {name: np.full(shape, np.nan) for name in ("digits", "steps", "residuals", "seconds")}
    words = {name: np.full(shape, "", dtype=object) for name in ("outcome", "reason")}
    for i, row in enumerate(matrix.rows):
        values[i, : len(row.values)] = row.values
        for k, cells in enumerate(row.cells):
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
        *(
            Column(name, everywhere, array, "s" if name == "seconds" else "1", long_names[name])
            for name, array in (*numbers.items(), *words.items())
        ),
    ]
