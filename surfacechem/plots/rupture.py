"""Figures of ruptures under a growing load: the load at rupture over what is swept, its distributions, lifetimes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfacechem.format.plans import STATISTICS
from surfacechem.plots import style
from surfacechem.plots.style import COLOURS, MOST_CURVES, Array, symbol, unit


def load_of(dataset: xarray.Dataset) -> str:
    """The load at whose growth the bonds of a sweep break; '' for other sweeps."""
    names = (str(name).removesuffix("_mode") for name in dataset.data_vars if str(name).endswith("_mode"))
    loads = [load for load in names if all(f"{load}_{which}" in dataset for which in STATISTICS)]
    return loads[0] if loads else ""


def figure(dataset: xarray.Dataset, load: str, variables: Sequence[str] | None = None) -> Figure:
    """The spectrum, the distribution p(f) at some of its places and the lifetime against the load, or ``variables``
    over the load.
    """
    draws: list[Callable[[Axes], None]] = [
        partial(_draw_series, dataset=dataset, load=load, name=n) for n in variables or ()
    ]
    if not variables:
        over = [partial(_draw_density, dataset=dataset, load=load), partial(_draw_lifetime, dataset=dataset, load=load)]
        draws = [partial(_draw_spectrum, dataset=dataset, load=load), *(over if has_series(dataset, load) else ())]
    with style.panels(6.4, 0.7 + 2.3 * len(draws), len(draws)) as (plot, grid):
        for ax, draw in zip(grid[:, 0], draws, strict=True):
            draw(ax)
            style.legend(ax)
        for ax in grid[2:, 0] if not variables else ():
            ax.sharex(grid[1, 0])
            ax.get_legend().remove()  # the colours are those of the distributions
        if not variables and style.over_decades(dataset[str(dataset["status"].dims[0])].values):
            grid[0, 0].set_xscale("log")
        style.headings(plot, grid[0, 0], dataset)
    return plot


def has_series(dataset: xarray.Dataset, load: str) -> bool:
    """Whether a dataset holds what its runs were at each load, too."""
    return all(name in dataset and load in dataset[name].dims for name in (f"density_{load}", "lifetime"))


def _members(dataset: xarray.Dataset, load: str) -> list[tuple[tuple[int, ...], str]]:
    """Places of some runs, evenly spread over those whose most probable load is inside the range, with their names."""
    modes = dataset[f"{load}_mode"].values
    # At slow loads most bonds break before there is any load, and their peak at zero would dwarf all others.
    inside = np.argwhere(modes > dataset[load].values[0])
    places = inside if len(inside) else np.argwhere(np.isfinite(modes))
    chosen = places[np.unique(np.linspace(0, len(places) - 1, MOST_CURVES).round().astype(int))] if len(places) else []
    return [(tuple(at), style.member_name(dataset, at)) for at in np.asarray(chosen, dtype=int).tolist()]


def _draw_over(ax: Axes, dataset: xarray.Dataset, load: str, values: Array, below: float = 0.0) -> None:
    """Values of some runs over the load."""
    text, size = style.prefixed(unit(dataset[load]), dataset[load].values)
    members = _members(dataset, load)
    for k, ((place, label), colour) in enumerate(zip(members, COLOURS, strict=False)):
        # Curves that coincide, as lifetimes do, are seen below each other.
        width = 1.2 + below * (len(members) - 1 - k)
        ax.plot(dataset[load].values / size, values[place], color=colour, linewidth=width, label=label)
    ax.set_xlabel(f"{style.meaning(dataset[load])} {symbol(load)} [{text}]")
    if len(members) < dataset["status"].size:
        ax.set_title(f"{len(members)} of {dataset['status'].size} runs", loc="right", fontsize=8, color="#555555")


def _draw_density(ax: Axes, dataset: xarray.Dataset, load: str) -> None:
    """The distribution of the load at rupture, up to where all bonds are broken."""
    text, size = style.prefixed(unit(dataset[load]), dataset[load].values)
    _draw_over(ax, dataset, load, np.maximum(dataset[f"density_{load}"].values * size, 0.0))
    ax.set_ylabel(f"$p$({symbol(load)}) [1/{text}]")


def _draw_lifetime(ax: Axes, dataset: xarray.Dataset, load: str) -> None:
    _draw_over(ax, dataset, load, dataset["lifetime"].values, below=0.7)
    ax.set(ylabel=rf"Lifetime $\tau$({symbol(load)}) [s]", yscale="log")


def _draw_series(ax: Axes, dataset: xarray.Dataset, load: str, name: str) -> None:
    """A variable over the load."""
    if name == f"density_{load}":
        return _draw_density(ax, dataset, load)
    if name == "lifetime":
        return _draw_lifetime(ax, dataset, load)
    values = dataset[name].values
    _draw_over(ax, dataset, load, values)
    text, size = style.prefixed(unit(dataset[name]), values)
    ax.set_ylabel(f"{symbol(name)} [{text}]")
    style.label_ticks(ax.yaxis, size)
    return None


def _draw_spectrum(ax: Axes, dataset: xarray.Dataset, load: str) -> None:
    """Most probable, median and mean load at rupture, the exact ones as lines."""
    parameter, mean = dataset[str(dataset["status"].dims[0])], dataset[f"{load}_mean"]
    text, size = style.prefixed(unit(mean), mean.values)
    words, scale = style.parameter_unit(parameter)
    x = parameter.values / scale
    ax.set_xlabel(f"{style.parameter_words(parameter)} [{words}]")
    for (which, word), colour, marker in zip(STATISTICS.items(), COLOURS, "osD", strict=False):
        for j, (values, label) in enumerate(style.by_second(dataset, dataset[f"{load}_{which}"].values)):
            (points,) = ax.plot(x, values / size, marker, color=colour, markersize=3.5)
            points.set(label=f"{word} {label}".strip(), alpha=1 / (1 + 0.5 * j))
        if f"{load}_{which}_exact" in dataset:
            for values, _ in style.by_second(dataset, dataset[f"{load}_{which}_exact"].values):
                ax.plot(x, values / size, color=colour, linewidth=0.9, label="_")
    ax.plot([], [], color="black", linewidth=0.9, label="exact" if f"{load}_mode_exact" in dataset else "_")
    ax.set_ylabel(f"{symbol(load)} at rupture [{text}]")
