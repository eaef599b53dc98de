"""Figures of quantities at given states, over what the states differ in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray
from matplotlib.figure import Figure

from surfacechem.errors import InputError, refuse_unknown
from surfacechem.plots import style

POINT = "point"

SHOWN = ("Pa", "W m-2", "N", "W")
"""Units of what is shown if nothing is asked for: tractions and heat fluxes."""

MOST = 4


def figure(dataset: xarray.Dataset, variables: Sequence[str] | None = None, against: str | None = None) -> Figure:
    """Each of the variables, else tractions and heat fluxes that differ, over ``against``, else over the first that
    differs.
    """
    known = [str(n) for n, x in dataset.data_vars.items() if x.dims == (POINT,) and x.dtype.kind == "f"]
    asked = [*(variables or ()), *filter(None, [against])]
    refuse_unknown(asked, known, "no variable '{}' at the states", style.place(dataset))
    # Quantities, no derivatives, that are not the same at all states.
    differing = [name for name in known if len(np.unique(dataset[name].values)) > 1 and "_by_" not in name]
    if not differing:
        raise InputError("a figure needs states that differ.", style.place(dataset))
    over = against or differing[0]
    names = variables or _usual(dataset, [name for name in differing if name != over])
    with style.panels(6.4, 0.7 + 1.9 * len(names), len(names), sharex=True) as (plot, grid):
        for ax, name in zip(grid[:, 0], names, strict=True):
            order = np.argsort(dataset[over].values, kind="stable")
            ax.plot(dataset[over].values[order], dataset[name].values[order], "o-", markersize=3)
            style.label(ax.yaxis, style.symbol(name), style.unit(dataset[name]), dataset[name].values)
        words = f"{style.meaning(dataset[over])} {style.symbol(over)}"
        style.label(grid[-1, 0].xaxis, words, style.unit(dataset[over]), dataset[over].values)
        style.headings(plot, grid[0, 0], dataset)
    return plot


def _usual(dataset: xarray.Dataset, names: Sequence[str]) -> Sequence[str]:
    """Tractions and heat fluxes among these, or where there are none the first."""
    return ([name for name in names if style.unit(dataset[name]) in SHOWN] or names)[:MOST]
