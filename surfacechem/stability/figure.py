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

from surfacechem.plots import STYLE, Plot, opened
from surfacechem.stability.matrix import FAILED, REFUSED, WRONG

MARKS = {REFUSED: "R", FAILED: "×", WRONG: "!"}
COLOURS = {FAILED: "0.75", WRONG: "#d62728"}
WORDS = {REFUSED: "ended for the right reason", FAILED: "failed, and said so", WRONG: "wrong"}

DARK = 8.0
"""Digits above which the colour of a cell is dark."""

SCALE = Normalize(0.0, 14.0)


def figure(data: xarray.Dataset | str | Path) -> Figure:
    """The figure of a study, from its dataset or its netCDF file: digits kept as a heat map, a panel for each solver
    and a row for each regime; to the right is more extreme.
    """
    dataset = opened(data, "regime", "decade", "solver", "digits", "outcome")
    height, width, count = (dataset.sizes[name] for name in ("regime", "decade", "solver"))
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(2.2 + 0.23 * width * count, 1.3 + 0.26 * height), layout="constrained")
        FigureCanvasAgg(plot)
        axes = np.atleast_1d(plot.subplots(1, count, sharey=True))
        for ax, solver in zip(axes, dataset["solver"].values, strict=True):
            image = _panel(ax, dataset.sel(solver=solver))
            ax.set_title(str(solver), fontsize=9)
            ax.set_xticks([])
        axes[0].set_yticks(range(height), dataset["regime"].values.tolist())
        axes[count // 2].set_xlabel("towards the extreme →")
        plot.colorbar(image, ax=list(axes), label="digits kept", fraction=0.03, pad=0.01)
        handles = [
            Patch(facecolor="none", edgecolor="none", label=f"{MARKS[name]}  {word}") for name, word in WORDS.items()
        ]
        plot.legend(handles=handles, loc="outside lower center", ncols=3, handlelength=0, frameon=False, fontsize=8)
    return plot


def _panel(ax: Axes, cells: xarray.Dataset) -> AxesImage:
    digits, outcomes = cells["digits"].values.copy(), cells["outcome"].values
    for i, k in np.argwhere(np.isfinite(digits)):
        outcome = str(outcomes[i, k])
        dark = outcome not in COLOURS and digits[i, k] > DARK
        ax.text(k, i, MARKS.get(outcome, ""), ha="center", va="center", fontsize=7, color="white" if dark else "black")
        if outcome in COLOURS:
            ax.add_patch(Rectangle((k - 0.5, i - 0.5), 1.0, 1.0, facecolor=COLOURS[outcome], edgecolor="none"))
            digits[i, k] = np.nan
    image = ax.imshow(digits, norm=SCALE, cmap="YlGnBu", aspect="auto")
    ax.grid(visible=False)
    for side in ax.spines.values():
        side.set_visible(False)
    ax.tick_params(length=0)
    return image
