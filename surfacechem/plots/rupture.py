"""Figures of rupture: the load at rupture over the swept parameter, its distributions, lifetimes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfacechem.format.plans import STATISTICS
from surfacechem.plots import style
from surfacechem.plots.members import final_values
from surfacechem.plots.run import wants_log_axis
from surfacechem.plots.style import COLOURS, MOST_CURVES, Array, symbol, unit


def load_of(dataset: xarray.Dataset) -> str:
    """Return the load under whose growth the bonds of a sweep rupture; '' for other sweeps."""
    names = (str(name).removesuffix("_mode") for name in dataset.data_vars if str(name).endswith("_mode"))
    loads = [load for load in names if all(f"{load}_{which}" in dataset for which in STATISTICS)]
    return loads[0] if loads else ""


MARKERS = "osD"

NEGLIGIBLE_LIFETIME = 0.01
"""Fraction of the shortest lifetime within which hardly a bond breaks."""

PANEL_HEIGHT, LINE_WIDTH = 2.3, 1.2
"""Height of a panel [inch], and width of a curve over the load [points]."""

MOST_LARGE_MARKERS = 30
"""Number of points from which on large markers would hide each other."""


def figure(dataset: xarray.Dataset, load: str, variables: Sequence[str] | None = None) -> Figure:
    """Draw the spectrum, the distribution p(f) for some runs, and the lifetime; or ``variables`` over the load."""
    series = (f"density_{load}", "lifetime")
    held = all(name in dataset and load in dataset[name].dims for name in series)  # a store may keep no series
    names = variables or ("", *(series if held else ()))
    with style.panels(6.4, 0.7 + PANEL_HEIGHT * len(names), len(names)) as (plot, grid):
        for ax, name in zip(grid[:, 0], names, strict=True):
            if name:
                _draw_series(ax, dataset, load, name)
            else:
                # Most probable, median and mean load at rupture, the exact ones as lines.
                mean = dataset[f"{load}_mean"]
                text, size = style.prefixed(unit(mean), mean.values)
                _draw_statistics(ax, dataset, {f"{load}_{which}": word for which, word in STATISTICS.items()}, size)
                ax.set_ylabel(f"{symbol(load)} at rupture [{text}]")
            style.legend(ax)
        for ax in grid[2:, 0] if not variables else ():
            ax.sharex(grid[1, 0])
            if legend := ax.get_legend():
                legend.remove()  # the colours are those of the distributions
        style.headings(plot, grid[0, 0], dataset)
    return plot


def _members(dataset: xarray.Dataset, load: str) -> list[tuple[tuple[int, ...], str]]:
    """Return indices and names of some runs, evenly spread over those whose most probable load is positive."""
    modes = dataset[f"{load}_mode"].values
    # At low loading rates most bonds break before the load grows, and their peak at zero would dwarf all others.
    inside = np.argwhere(modes > dataset[load].values[0])
    places = inside if len(inside) else np.argwhere(np.isfinite(modes))
    chosen = places[style.evenly_spread(len(places), MOST_CURVES)]
    return [(tuple(at), style.member_name(dataset, at)) for at in chosen.tolist()]


def _draw_over(
    ax: Axes, dataset: xarray.Dataset, load: str, values: Array, scale: Callable[[Array], Array] = np.asarray
) -> None:
    """Draw values of some runs over the load; as one curve if they coincide on this scale."""
    members = _members(dataset, load)
    notes = [f"{len(members)} of {dataset['status'].size} runs"] if len(members) < dataset["status"].size else []
    shown = np.array([values[place] for place, _ in members])
    if len(members) > 1 and _coincide(scale(shown)):
        ax.plot(dataset[load].values, np.fmin.reduce(shown), color="black", linewidth=LINE_WIDTH)
        notes.append("their curves coincide" if notes else "the curves of all runs coincide")
    else:
        for (place, label), colour in zip(members, COLOURS, strict=False):
            ax.plot(dataset[load].values, values[place], color=colour, linewidth=LINE_WIDTH, label=label)
    style.label_variable(ax.xaxis, dataset[load])
    ax.set_title(", ".join(notes), loc="right", **style.NOTE_STYLE)


def _coincide(curves: Array) -> bool:
    """True if curves nowhere differ by more than the width of their line, where they are known."""
    low, high = np.fmin.reduce(curves), np.fmax.reduce(curves)
    apart, range_ = np.fmax.reduce(high - low), np.fmax.reduce(high) - np.fmin.reduce(low)
    return bool(apart * 72 * PANEL_HEIGHT <= LINE_WIDTH * range_)


def _draw_series(ax: Axes, dataset: xarray.Dataset, load: str, name: str) -> None:
    """Draw a variable over the load; the distribution of the load at rupture is drawn until all bonds are broken."""
    values = dataset[name].values
    if name == f"density_{load}":
        text, size = style.prefixed(unit(dataset[load]), dataset[load].values)
        _draw_over(ax, dataset, load, np.maximum(values * size, 0.0))
        ax.set_ylabel(f"$p$({symbol(load)}) [1/{text}]")
    elif name == "lifetime":
        _draw_over(ax, dataset, load, values, np.log)
        ax.set_ylabel(rf"Lifetime $\tau$({symbol(load)}) [s]")
        style.make_logarithmic(ax.yaxis)
    else:
        _draw_over(ax, dataset, load, values)
        style.label(ax.yaxis, symbol(name), unit(dataset[name]), values)


def _draw_statistics(ax: Axes, dataset: xarray.Dataset, words: Mapping[str, str], size: float) -> None:
    """Draw results of each run over the swept parameter, by name with their labels in the legend, in one colour for
    each or for each value of a second parameter; exact values as lines.
    """
    parameter = dataset[str(dataset["status"].dims[0])]
    style.draw_parameter(ax.xaxis, parameter)
    x, large = parameter.values, 3.5 if len(parameter) < MOST_LARGE_MARKERS else 2.0
    seconds = [label for _, label in style.curves_by_second(dataset, dataset[next(iter(words))].values)]
    for k, (name, marker) in enumerate(zip(words, MARKERS, strict=False)):
        for fmt, end in ((marker, ""), ("-", "_exact")):
            if name + end in dataset:
                for j, (values, _) in enumerate(style.curves_by_second(dataset, final_values(dataset, name + end))):
                    colour = COLOURS[j if len(seconds) > 1 else k]
                    ax.plot(x, values / size, fmt, color=colour, markersize=large, linewidth=0.9, label="_")
    for label, colour in zip(seconds if len(seconds) > 1 else (), COLOURS, strict=False):
        ax.plot([], [], color=colour, label=label)
    for word, marker, colour in zip(words.values(), MARKERS, COLOURS, strict=False):
        ax.plot([], [], marker, color="black" if len(seconds) > 1 else colour, markersize=large, label=word)
    ax.plot([], [], color="black", linewidth=0.9, label="exact" if any(f"{n}_exact" in dataset for n in words) else "_")


def lifetimes(dataset: xarray.Dataset) -> Figure:
    """Draw the lifetime over the swept parameter, the exact one as a line, and the survival over time of some runs."""
    with style.panels(6.4, 5.3, 2) as (plot, grid):
        above, below = grid[:, 0]
        _draw_statistics(above, dataset, {"lifetime": "runs"}, 1.0)
        above.set_ylabel(r"Lifetime $\tau$ [s]")
        style.make_logarithmic(above.yaxis)
        _draw_survival(below, dataset)
        for ax in (above, below):
            style.legend(ax)
        style.headings(plot, above, dataset)
    return plot


def _draw_survival(ax: Axes, dataset: xarray.Dataset) -> None:
    """Draw the survival over time of runs evenly spread over those with a known lifetime."""
    known = np.argwhere(np.isfinite(dataset["lifetime"].values))
    chosen = style.evenly_spread(len(known), MOST_CURVES)
    times, survival = dataset["time"].values, dataset["survival"].values
    for place, colour in zip(known[chosen], COLOURS, strict=False):
        # A run ends when all bonds have broken: NaN after its end is a survival of zero.
        values = np.nan_to_num(survival[tuple(place)])
        ax.plot(times, values, color=colour, label=style.member_name(dataset, place))
    lifetimes = np.sort(dataset["lifetime"].values[tuple(known.T)])
    if wants_log_axis(times) or style.over_decades(lifetimes):
        style.make_logarithmic(ax.xaxis)
        begin = max(times[times > 0][0], NEGLIGIBLE_LIFETIME * lifetimes[0])
        ax.set_xlim(begin, dataset["time_reached"].values.max())
    else:
        ax.set(xlim=(0, dataset["time_reached"].values.max()))
    ax.set(xlabel="Time [s]", ylabel="Survival $S$ [1]")
