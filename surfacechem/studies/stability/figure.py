"""The stability matrix at a glance, from the dataset of a study alone."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from surfacechem.plots.run import STYLE, Plot, opened
from surfacechem.studies.stability.matrix import FAILED, REFUSED, SENSITIVE, WRONG

MARKS = {REFUSED: "R", FAILED: "×", WRONG: "!", SENSITIVE: "~"}
COLOURS = {FAILED: "0.75", WRONG: "#d62728", SENSITIVE: "#f0c36d"}
WORDS = {
    REFUSED: "ended for the right reason",
    FAILED: "failed, and said so",
    WRONG: "wrong",
    SENSITIVE: "too sensitive for the tolerance",
}

POSSIBLE = "possible"
"""Heading of the digits that rounding of the data leaves to any solver."""

DARK = 8.0
"""Digits above which the colour of a cell is dark."""

SCALE = Normalize(0.0, 14.0)


def figure(data: xarray.Dataset | str | Path) -> Figure:
    """The figure of a study, from its dataset or its netCDF file: digits as a heat map, a panel for those that the
    problem's condition leaves and one for those that each solver keeps, a row for each regime; to the right is more
    extreme.
    """
    dataset = opened(data, "regime", "decade", "solver", "digits", "outcome")
    height, width, count = (dataset.sizes[name] for name in ("regime", "decade", "solver"))
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(2.2 + 0.23 * width * (count + 1), 1.3 + 0.26 * height), layout="constrained")
        FigureCanvasAgg(plot)
        axes = np.atleast_1d(plot.subplots(1, count + 1, sharey=True))
        image = _image(axes[0], dataset["possible"].values)
        for ax, solver in zip(axes[1:], dataset["solver"].values, strict=True):
            _panel(ax, dataset.sel(solver=solver))
        for ax, name in zip(axes, (POSSIBLE, *dataset["solver"].values), strict=True):
            ax.set_title(str(name), fontsize=9)
            ax.set_xticks([])
        axes[0].set_yticks(range(height), dataset["regime"].values.tolist())
        axes[(count + 1) // 2].set_xlabel("towards the extreme →")
        plot.colorbar(image, ax=list(axes), label="digits", fraction=0.03, pad=0.01)
        handles = [
            Patch(facecolor="none", edgecolor="none", label=f"{MARKS[name]}  {word}") for name, word in WORDS.items()
        ]
        plot.legend(handles=handles, loc="outside lower center", ncols=4, handlelength=0, frameon=False, fontsize=8)
    return plot


def _panel(ax: Axes, cells: xarray.Dataset) -> None:
    """Digits that a solver keeps."""
    digits, outcomes = cells["digits"].values.copy(), cells["outcome"].values
    for i, k in np.argwhere(np.isfinite(digits)):
        outcome = str(outcomes[i, k])
        dark = outcome not in COLOURS and digits[i, k] > DARK
        ax.text(k, i, MARKS.get(outcome, ""), ha="center", va="center", fontsize=7, color="white" if dark else "black")
        if outcome in COLOURS:
            ax.add_patch(Rectangle((k - 0.5, i - 0.5), 1.0, 1.0, facecolor=COLOURS[outcome], edgecolor="none"))
            digits[i, k] = np.nan
    _image(ax, digits)


def _image(ax: Axes, digits: NDArray[np.float64]) -> AxesImage:
    image = ax.imshow(digits, norm=SCALE, cmap="YlGnBu", aspect="auto")
    ax.grid(visible=False)
    for side in ax.spines.values():
        side.set_visible(False)
    ax.tick_params(length=0)
    return image
