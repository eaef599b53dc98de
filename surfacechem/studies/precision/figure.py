"""Run time against error, a row for each case, from the dataset of a study alone."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from surfacechem.plots.run import COLOURS, STYLE, Plot, opened
from surfacechem.studies.precision.columns import LABELS

AXES = {
    "error_max": "largest relative error",
    "error_event": "error of the times of events",
    "energy_error": "energy residual",
}
"""What is drawn on x."""

NEEDED = (
    *LABELS.values(),
    *("tolerance", "status", *AXES, "uncertainty_max", "uncertainty_event"),
    *("run_seconds", "run_seconds_median", "stepping_seconds"),
)
"""Variables that are read."""

MARKERS = "osD^vPX"

SMALLEST = 1e-17
"""Errors below this are drawn as this."""

FAILED, BELOW, INSIDE = "failed", "below the uncertainty of the reference", "inside the library's own steps"


def figure(data: xarray.Dataset | str | Path) -> Figure:
    """The figure of a study, from its dataset or its netCDF file.

    Bars reach from the least to the median time. Dashed lines are the times inside a library's own steps, without what
    an adapter adds for events and outputs. Hollow marks in the shaded region are below the uncertainty of the
    reference; crosses at the right edge are failed solves, at the time that they took to fail.
    """
    dataset = opened(data, *NEEDED).set_index(LABELS)
    columns = [name for name in AXES if bool((dataset[name] > 0).any())]
    columns = columns or ["energy_error"]
    rows = dataset.sizes["case"]
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(0.6 + 3.2 * len(columns), 0.7 + 2.6 * rows), layout="constrained")
        FigureCanvasAgg(plot)
        grid = plot.subplots(rows, len(columns), sharey="row", squeeze=False)
        for i in range(rows):
            for j, name in enumerate(columns):
                _draw(grid[i, j], dataset.isel(case=i), name)
                grid[i, j].set_xlabel(AXES[name] if i == rows - 1 else "")
            grid[i, 0].set_ylabel("run time [s]")
            grid[i, 0].set_title(str(dataset["case"].values[i]), loc="left")
        plot.legend(handles=_legend(dataset), loc="outside lower center", ncols=4)
    return plot


def _draw(ax: Axes, case: xarray.Dataset, name: str) -> None:
    ax.set(xscale="log", yscale="log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_formatter(NullFormatter())  # labels within a decade would overlap
    limit = float(case[name.replace("error_", "uncertainty_")]) if name.startswith("error_") else np.nan
    for k, solver in enumerate(case["solver"].values):
        _draw_solver(ax, case.sel(solver=solver), name, limit, k)
    if np.isfinite(limit):
        ax.axvspan(SMALLEST, max(limit, SMALLEST), color="0.5", alpha=0.12, linewidth=0)
        drawn = case[name].values[np.isfinite(case[name].values)]
        low = min([limit, *drawn])
        ax.set_xlim(left=max(low / 3, SMALLEST / 2))


def _draw_solver(ax: Axes, case: xarray.Dataset, name: str, limit: float, k: int) -> None:
    x, y = np.maximum(case[name].values, SMALLEST), case["run_seconds"].values
    shown = np.isfinite(x) & np.isfinite(y) & ((case[name].values > 0) | np.isfinite(limit))
    colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
    middle = case["run_seconds_median"].values
    ax.plot(x[shown], y[shown], color=colour, linewidth=1.0)
    inside = case["stepping_seconds"].values
    stepped = shown & np.isfinite(inside)
    ax.plot(x[stepped], inside[stepped], "--", color=colour, linewidth=0.8, alpha=0.8)
    # Single precision may round the median of a few equal times below them.
    spread = np.array([np.zeros(shown.sum()), np.maximum(middle - y, 0.0)[shown]])
    ax.errorbar(x[shown], y[shown], spread, fmt="none", ecolor=colour, elinewidth=0.6, alpha=0.6)
    for below, fill in ((True, "white"), (False, colour)):
        some = shown & ((x < limit) == below)
        ax.plot(x[some], y[some], marker, color=colour, markerfacecolor=fill, markersize=4.5)
    lost = (case["status"].values == "failed") & np.isfinite(y)
    edge = np.full(int(lost.sum()), 0.985)
    ax.plot(edge, y[lost], "x", color=colour, markersize=5, transform=ax.get_yaxis_transform())


def _legend(dataset: xarray.Dataset) -> list[Line2D]:
    status = dataset["status"]
    handles = []
    for k, solver in enumerate(dataset["solver"].values):
        colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
        out = bool((status.sel(solver=solver) == "omitted").all())
        label = f"{solver} (left out)" if out else str(solver)
        handles.append(Line2D([], [], color=colour, marker=marker, markersize=4.5, linewidth=1.0, label=label))
    if bool(np.isfinite(dataset["stepping_seconds"]).any()):
        handles.append(Line2D([], [], color="0.4", linestyle="--", linewidth=0.8, label=INSIDE))
    grey = {"color": "0.4", "linestyle": "none"}
    if bool((status == FAILED).any()):
        handles.append(Line2D([], [], marker="x", label=FAILED, **grey))  # type: ignore[arg-type]
    if any(bool((dataset[f"error_{kind}"] < dataset[f"uncertainty_{kind}"]).any()) for kind in ("max", "event")):
        handles.append(Line2D([], [], marker="o", markerfacecolor="white", label=BELOW, **grey))  # type: ignore[arg-type]
    return handles
