"""Figures of studies: run time over error for solvers and tolerances, and correct digits in difficult regimes."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import NullFormatter

from surfacechem.plots import style
from surfacechem.plots.style import COLOURS, Array
from surfacechem.results.netcdf import Data
from surfacechem.tolerances import EPS


def figure(dataset: Data) -> Figure:
    """Draw the figure of a study, by the attribute that names its kind."""
    return stability(dataset) if str(dataset.attrs["study"]) == "stability" else precision(dataset)


# -- run time against error --------------------------------------------------------------------------------------------

# Variables with the labels along a dimension; CF allows only numbers as coordinate variables.
LABEL_VARIABLES = {"case": "case_name", "solver": "solver_name", "variable": "variable_name"}

# Variables on x, with their labels.
ERRORS = {
    "error_max": "largest relative error",
    "error_event": "error of the times of events",
    "energy_error": "energy residual",
}

RUN_TIMES = ("run_seconds", "run_seconds_median", "stepping_seconds")

POINT_DIMENSIONS, CASE_DIMENSIONS = ("case", "solver", "tolerance"), ("case",)
NUMBER_DIMENSIONS = {
    "tolerance": ("tolerance",),
    **dict.fromkeys((*ERRORS, *RUN_TIMES), POINT_DIMENSIONS),
    **dict.fromkeys(("uncertainty_max", "uncertainty_event"), CASE_DIMENSIONS),
}
# Variables that are read, with their dimensions.
TEXT_DIMENSIONS = {"status": POINT_DIMENSIONS, **{name: (dimension,) for dimension, name in LABEL_VARIABLES.items()}}

# Errors below this are drawn as this: it is below the last digit, so that an error of zero has a distinct place on a
# logarithmic axis.
LEAST_ERROR = EPS / 16

SOLVER_COLOURS = (*COLOURS, "black")
"""Colours of solvers, one more than there are markers, so that no pair of both is repeated early."""

BELOW, STEPPING = "below the uncertainty of the reference", "inside the library's own steps"


def precision(dataset: Data) -> Figure:
    """Draw run time over error, one row per case.

    Bars reach from the least to the median time. Dashed lines are the times inside a library's own steps, without those
    of an adapter for events and outputs. Hollow marks in the shaded region are below the uncertainty of the reference;
    crosses at the right edge are failed solves, at the time until the failure.
    """
    style.check_variables(dataset, NUMBER_DIMENSIONS, TEXT_DIMENSIONS)
    drawn = [name for name in ERRORS if (dataset[name].values > 0).any()] or ["energy_error"]
    rows, solvers = dataset.sizes["case"], dataset.sizes["solver"]
    markers = list(zip(cycle(SOLVER_COLOURS), "osD^vPX" * solvers, strict=False))
    with style.panels(0.6 + 3.2 * len(drawn), 0.7 + 2.6 * rows, rows, len(drawn), sharey="row") as (plot, grid):
        for i in range(rows):
            for ax, name in zip(grid[i], drawn, strict=True):
                style.make_logarithmic(ax.xaxis, ax.yaxis)
                for axis in (ax.xaxis, ax.yaxis):
                    axis.set_minor_formatter(NullFormatter())  # labels within a decade would overlap
                own = name.startswith("error_")
                limit = float(dataset[name.replace("error_", "uncertainty_")].values[i]) if own else np.nan
                for k in range(solvers):
                    cells = {each: dataset[each].values[i, k] for each in (*ERRORS, *RUN_TIMES, "status")}
                    _draw_solver(ax, cells, name, limit, *markers[k])
                # The axis ends at three times the largest.
                finite = dataset[name].values[i][np.isfinite(3 * dataset[name].values[i])]
                if positive := finite[finite > 0].tolist():  # Matplotlib's margins of a single value may have no width
                    ax.set_xlim(max(min(positive), LEAST_ERROR) / 3, 3 * max(*positive, LEAST_ERROR))
                if np.isfinite(limit):
                    ax.axvspan(LEAST_ERROR, max(limit, LEAST_ERROR), color="0.5", alpha=0.12, linewidth=0)
                    ax.set_xlim(left=max(min([limit, *finite]) / 3, LEAST_ERROR / 2))
                ax.set_xlabel(ERRORS[name] if i == rows - 1 else "")
            grid[i, 0].set_ylabel("run time [s]")
            grid[i, 0].set_title(str(dataset["case_name"].values[i]), loc="left")
        plot.legend(handles=_legend(dataset, markers), loc="outside lower center", ncols=4)
    return plot


def _draw_solver(ax: Axes, cells: Mapping[str, Array], name: str, limit: float, colour: str, marker: str) -> None:
    x, y = np.maximum(cells[name], LEAST_ERROR), cells["run_seconds"]
    shown = np.isfinite(x) & np.isfinite(y) & ((cells[name] > 0) | np.isfinite(limit))
    ax.plot(x[shown], y[shown], color=colour, linewidth=1.0)
    inside = cells["stepping_seconds"]
    stepped = shown & np.isfinite(inside)
    ax.plot(x[stepped], inside[stepped], "--", color=colour, linewidth=0.8, alpha=0.8)
    # Single precision may round the median of a few equal times below them.
    spread = np.array([np.zeros(shown.sum()), np.maximum(cells["run_seconds_median"] - y, 0.0)[shown]])
    ax.errorbar(x[shown], y[shown], spread, fmt="none", ecolor=colour, elinewidth=0.6, alpha=0.6)
    for below, fill in ((True, "white"), (False, colour)):
        some = shown & ((x < limit) == below)
        ax.plot(x[some], y[some], marker, color=colour, markerfacecolor=fill, markersize=4.5)
    lost = y[(cells["status"] == "failed") & np.isfinite(y)]
    ax.plot(np.full(len(lost), 0.985), lost, "x", color=colour, markersize=5, transform=ax.get_yaxis_transform())


def _legend(dataset: Data, markers: list[tuple[str, str]]) -> list[Line2D]:
    status, handles = dataset["status"].values, []
    for k, (colour, marker) in enumerate(markers[: dataset.sizes["solver"]]):
        out = " (left out)" if bool((status[:, k] == "omitted").all()) else ""
        label = f"{dataset['solver_name'].values[k]}{out}"
        handles.append(Line2D([], [], color=colour, marker=marker, markersize=4.5, linewidth=1.0, label=label))
    below = (
        dataset[f"error_{kind}"].values < dataset[f"uncertainty_{kind}"].values[:, None, None]
        for kind in ("max", "event")
    )
    marks: list[tuple[bool, str, dict[str, Any]]] = [
        (bool(np.isfinite(dataset["stepping_seconds"].values).any()), STEPPING, {"linestyle": "--", "linewidth": 0.8}),
        (bool((status == "failed").any()), "failed", {"marker": "x", "linestyle": "none"}),
        (any(bool(b.any()) for b in below), BELOW, {"marker": "o", "markerfacecolor": "white", "linestyle": "none"}),
    ]
    return handles + [Line2D([], [], color="0.4", label=label, **how) for there, label, how in marks if there]


# -- digits kept -------------------------------------------------------------------------------------------------------

# Marks of the outcomes other than a solution.
OUTCOME_MARKS = {"refused": "R", "failed": "×", "wrong": "!", "sensitive": "~"}

# Colours of the outcomes whose digits are meaningless.
OUTCOME_COLOURS = {"failed": "0.75", "wrong": "#d62728", "sensitive": "#f0c36d"}

OUTCOMES = {
    "refused": "ended for the right reason",
    "failed": "failed, and said so",
    "wrong": "wrong",
    "sensitive": "too sensitive for the tolerance",
}

# Digits above which the colour of a cell is dark.
DARK_DIGITS = 8.0


def stability(dataset: Data) -> Figure:
    """Draw digits as a heat map, one row per regime: possible digits by the problem's condition, then those of each
    solver; regimes become more extreme to the right.
    """
    cell = ("regime", "decade", "solver")
    numbers = {"decade": ("decade",), "possible": cell[:2], "digits": cell}
    style.check_variables(dataset, numbers, {"regime": ("regime",), "solver": ("solver",), "outcome": cell})
    height, width, count = (dataset.sizes[name] for name in cell)
    size = 2.2 + 0.23 * width * (count + 1), 1.3 + 0.26 * height
    with style.panels(*size, 1, count + 1, sharey=True) as (plot, (axes,)):
        titles = ["possible", *map(str, dataset["solver"].values)]
        for j, (ax, title) in enumerate(zip(axes, titles, strict=True)):
            digits = (dataset["digits"].values[:, :, j - 1] if j else dataset["possible"].values).copy()
            outcomes = dataset["outcome"].values[:, :, j - 1].astype(str)
            for i, k in np.argwhere(np.isfinite(digits)) if j else ():
                dark = outcomes[i, k] not in OUTCOME_COLOURS and digits[i, k] > DARK_DIGITS
                how: Any = {"ha": "center", "va": "center", "fontsize": 7, "color": "white" if dark else "black"}
                ax.text(k, i, OUTCOME_MARKS.get(outcomes[i, k], ""), **how)
                if outcomes[i, k] in OUTCOME_COLOURS:
                    colour = OUTCOME_COLOURS[outcomes[i, k]]
                    ax.add_patch(Rectangle((k - 0.5, i - 0.5), 1.0, 1.0, facecolor=colour, edgecolor="none"))
                    digits[i, k] = np.nan
            image = ax.imshow(digits, norm=Normalize(0.0, 14.0), cmap="YlGnBu", aspect="auto")
            ax.set_title(title, fontsize=9)
            ax.grid(visible=False)
            ax.set_xticks([])
            ax.tick_params(length=0)
            ax.spines[:].set_visible(False)
        axes[0].set_yticks(range(height), dataset["regime"].values.astype(str).tolist())
        axes[(count + 1) // 2].set_xlabel("towards the extreme →")
        plot.colorbar(image, ax=list(axes), label="digits", fraction=0.03, pad=0.01)
        nothing: Any = {"facecolor": "none", "edgecolor": "none"}
        handles = [Patch(label=f"{OUTCOME_MARKS[name]}  {text}", **nothing) for name, text in OUTCOMES.items()]
        columns = min(4, max(1, int(size[0] / 1.9)))  # the longest of the texts takes 1.9 inches
        kw: Any = {"ncols": columns, "handlelength": 0, "frameon": False, "fontsize": 8}
        plot.legend(handles=handles, loc="outside lower center", **kw)
    return plot
