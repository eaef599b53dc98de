"""Figures of sweeps: many runs as maps, distributions, effects, curves; rupture under a growing load; final values."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from surfacechem.errors import InputError, listed, refuse_unknown
from surfacechem.format.plans import RUN_DIMENSION, STATISTICS, Plan, name_parts, recorded_plan
from surfacechem.plots import style
from surfacechem.plots.style import COLOURS, MOST_CURVES, Array, symbol, unit, varies
from surfacechem.plots.time_series import PANELS, SPIKE_RATIO, Panel, of_kind, wants_log_axis
from surfacechem.results.netcdf import Data, DataVariable

MOST_MEMBERS = 100
"""Largest number of curves of a sample; of more runs an evenly spread subset is drawn."""

MOST_POINTS = 2**20
"""Largest number of runs whose values are drawn; of more an evenly spread subset."""

MOST_PANELS = 3

COUNTED = ("steps", "destroys_entropy")
"""Variables about the solver or the laws instead of the physics."""

NAME_ORDER = (
    *(r"lifetime", r"(phi|theta).*_last", r"T.*_max", r"(phi|T).*(?<!_m..)"),
    *(r"time_to.*", r"time.*", r".*(?<!_m..)", r".*"),
)
"""Order of variables: lifetimes, bonds at the end, largest temperatures, their other values; times to values, of
events; other final values, other extremes.
"""
TELLING = (NAME_ORDER[:-2], NAME_ORDER[:-1], NAME_ORDER)
"""What is drawn: bonds, temperatures and times, else other final values, else any."""

BINS, PARAMETER_BINS = 40, 12
"""Numbers of bins of a distribution, and of bins of a parameter in an effect plot."""

PERCENTILES = (5.0, 50.0, 95.0)
"""Percentiles of a distribution that are drawn."""

SEEN_PART = 0.99
"""Fraction of the largest value of a variable that some output must reach; otherwise a note is written."""


def figure_of_members(dataset: Data, plan: Plan, axes: Sequence[str], variables: Sequence[str] | None = None) -> Figure:
    """Draw a grid of two parameters, a sample, or a grid of more parameters."""
    dataset = with_final_values(dataset, axes)
    known = number_names(dataset, axes)
    refuse_unknown(variables or (), known, "no variable '{}' in the sweep", style.place_of(dataset))
    ruptures = [f"{load}_{which}" for load in filter(None, [load_of(dataset)]) for which in STATISTICS]
    names = list(dict.fromkeys(variables or ruptures)) or varying_numbers(dataset, axes, known)
    if len(dataset[names[0]].dims) > len(axes):
        return curves(dataset, axes, names)
    if len(axes) == 2 and RUN_DIMENSION not in axes:
        return heat_maps(dataset, plan, axes, names)
    return effects(dataset, plan, axes, names)


def number_names(dataset: Data, axes: Sequence[str]) -> list[str]:
    """Return the names of numbers of every run, not only of checked ones, at its end or along it."""
    return [n for n in dataset if dataset[n].kind == "f" and dataset[n].dims[: len(axes)] == tuple(axes)]


def varying_numbers(dataset: Data, axes: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return the numbers that differ between runs: of bonds, temperatures and times, else others."""
    found = sorted(known, key=lambda name: next(k for k, rank in enumerate(NAME_ORDER) if re.fullmatch(rank, name)))
    ends = [name for name in found if len(dataset[name].dims) == len(axes) and not ("error" in name or name in COUNTED)]
    # Of several with the same values, such as a maximum that is the final value, the first; none that is swept itself.
    first = {thinned(in_each_run(dataset, name)).tobytes(): "" for name in parameters_of(dataset)}
    for name in ends:
        # Fractions, of bonds say, are compared with one: those left of broken bonds are rounding.
        if varies(values := subsample(dataset, name), float(unit(dataset[name]) == "1")):
            first.setdefault(values.tobytes(), name)
    shown = [*filter(None, first.values())]
    groups = ([name for name in shown if any(re.fullmatch(rank, name) for rank in ranks)] for ranks in TELLING)
    return next(filter(None, groups), ["time_reached"])[:MOST_PANELS]


def with_final_values(dataset: Data, axes: Sequence[str]) -> Data:
    """Return a dataset of series with the values at the end of each run, if it does not hold any."""
    series = [name for name in series_names(dataset, axes) if name not in dataset.coords]
    if any(name.endswith("_last") for name in dataset):
        return dataset
    last = [name for name in series if not name.endswith(("_exact", "_residual"))]
    final = (DataVariable(f"{n}_last", tuple(axes), final_values(dataset, n), dataset[n].attrs) for n in last)
    return replace(dataset, variables={**dataset.variables, **{each.name: each for each in final}})


def final_values(dataset: Data, name: str) -> Array:
    """Return the value at the end of each run, or at the last output if that is all there is; NaN if the run failed or
    was refused.
    """
    ended = f"{name}_last"
    values: Array = dataset[ended if ended in dataset and dataset[ended].kind == "f" else name].values
    if values.ndim > len(dataset["status"].dims):
        last = values.shape[-1] - 1 - np.argmax(np.isfinite(values)[..., ::-1], axis=-1)
        values = np.take_along_axis(values, last[..., None], axis=-1)[..., 0]
    return np.where(style.has_no_end(dataset, *style.WITHOUT_END), np.nan, values)


def ends_are_known(dataset: Data, names: Sequence[str]) -> bool:
    """True if the last values are those at the ends of all runs, none of which stopped after its last output."""
    return all(f"{name}_last" in dataset for name in names) or not style.has_no_end(dataset, style.STOPPED).any()


def subsample(dataset: Data, name: str) -> Array:
    """Return the values of a variable, of an evenly spread subset if there are many runs."""
    series = len(dataset[name].dims) > len(dataset["status"].dims)
    return thinned(dataset[name].values if series else final_values(dataset, name))


def thinned(values: Array) -> Array:
    """Return the values in a row, of many an evenly spread subset."""
    return np.asarray(values.ravel()[:: -(-values.size // MOST_POINTS)], dtype=float)


def heat_maps(dataset: Data, plan: Plan, axes: Sequence[str], names: Sequence[str]) -> Figure:
    """Draw colours over two parameters, one map per variable; white where a run has no value."""
    x, y = (dataset[name] for name in axes)
    with style.panels(5.6, 0.6 + 3.3 * len(names), len(names), sharex=True) as (plot, grid):
        for ax, name in zip(grid[:, 0], names, strict=True):
            values = np.ma.masked_invalid(final_values(dataset, name))
            image = ax.pcolormesh(x.values, y.values, values.T, shading="nearest", cmap="viridis", rasterized=True)
            style.limit_zoom(image.set_clim, values.compressed(), style.error_of(dataset, [name]))
            bar = plot.colorbar(image, ax=ax)
            style.label(bar.ax.yaxis, style.quantity_words(dataset[name]), unit(dataset[name]), values.compressed())
            style.draw_parameter(ax.yaxis, y, plan.axes[1].logarithmic)
        style.draw_parameter(grid[-1, 0].xaxis, x, plan.axes[0].logarithmic)
        style.headings(plot, grid[0, 0], dataset)
    return plot


def trajectories(dataset: Data, axes: Sequence[str], variables: Sequence[str] | None, against: str) -> Figure:
    """Draw each run of a sweep over one of its variables, or over time."""
    series = series_names(dataset, axes)
    # The dimension along the runs is time or, if a load ends them, the load.
    inner = [dim for name in series for dim in dataset[name].dims if dim not in axes]
    known = [*series, *dict.fromkeys(inner)]
    asked = (*(variables or ()), against)
    if single := next(filter((dataset.variables.keys() - known).__contains__, asked), ""):
        message = f"{single} does not go along the runs. Leave `against` out: the figure is over what is swept."
        raise InputError(message, style.place_of(dataset))
    refuse_unknown(asked, known, "no variable '{}' along the runs of the sweep", style.place_of(dataset))
    usual = [name for _, *kind in PANELS for name in of_kind(dataset, series, *kind)]
    moving = [name for name in usual if name != against and varies(subsample(dataset, name))]
    if not (names := list(dict.fromkeys(variables or moving[:MOST_PANELS]))):
        raise InputError(f"none of the usual variables changes: name some to show over {against}.")
    return curves(dataset, axes, names, against)


def series_names(dataset: Data, axes: Sequence[str]) -> list[str]:
    """Return the names of numbers along the runs of a sweep."""
    many = [n for n, x in dataset.variables.items() if x.kind == "f" and len(x.dims) == len(axes) + 1]
    return [name for name in many if "event" not in dataset[name].dims]


def curves(dataset: Data, axes: Sequence[str], names: Sequence[str], against: str | None = None) -> Figure:
    """Draw series of all runs, or of an evenly spread subset, whose size is noted; over ``against`` instead of time."""
    count = int(np.prod([dataset.sizes[name] for name in axes]))
    members = style.evenly_spread(count, MOST_MEMBERS)
    over = dataset[against or dataset[names[0]].dims[-1]]
    x = np.broadcast_to(over.values, dataset[names[0]].values.shape).reshape(count, -1)[members]
    with style.panels(6.4, 0.9 + 2.2 * len(names), len(names), sharex=True) as (plot, grid):
        for ax, name in zip(grid[:, 0], names, strict=True):
            values = dataset[name].values.reshape(count, -1)[members]
            for line, run, k in zip(values, x, members, strict=True):
                ax.plot(run, line, drawstyle=style.drawn_as(dataset[name]), **line_style(dataset, axes, k))
            error = style.error_of(dataset, [name])
            style.label(ax.yaxis, style.quantity_words(dataset[name]), unit(dataset[name]), values, error=error)
            style.legend(ax)
        style.label(grid[-1, 0].xaxis, {"time": "Time"}.get(over.name, symbol(over.name)), unit(over), x)
        many = RUN_DIMENSION not in axes and count > style.MOST_CURVES
        if many:
            bar = plot.colorbar(colours(dataset, axes), ax=grid[:, 0].tolist())
            parameter = dataset[axes[0]]
            style.label(bar.ax.yaxis, style.parameter_words(parameter), unit(parameter), parameter.values)
        others = ", ".join(style.parameter_words(dataset[name]) for name in axes[1:]) if many else ""
        notes = [f"curves of one colour differ in {others}"] if others else []
        notes += filter(None, (_peaks_between_outputs(dataset, name) for name in names))
        notes += [f"{len(members)} of {count} runs"] if len(members) < count else []
        style.headings(plot, grid[0, 0], dataset, more="   ".join(notes))
    return plot


def _peaks_between_outputs(dataset: Data, name: str) -> str:
    """Describe the largest magnitude of a variable if no output of any run comes near it, as in a brief slip."""
    ends = [dataset[key].values for key in (f"{name}_max", f"{name}_min") if key in dataset]
    reached, shown = max(map(style.largest, ends), default=0.0), style.largest(dataset[name].values)
    if shown >= SEEN_PART * reached:
        return ""
    text, size = style.prefixed(unit(dataset[name]), np.array([reached]))
    return style.minus(f"between outputs, {symbol(name)} reaches {reached / size:.3g} {text}")


def colours(dataset: Data, axes: Sequence[str]) -> ScalarMappable:
    """Return the colour map of the values of a parameter."""
    values = dataset[axes[0]].values
    scale = LogNorm if style.over_decades(values) else Normalize
    return ScalarMappable(scale(values.min(), values.max()), "viridis")


def line_style(dataset: Data, axes: Sequence[str], member: int) -> dict[str, Any]:
    """Return the style of the curve of a run: coloured by its parameter if there is one, with a legend for few runs."""
    shape = dataset["status"].values.shape
    if np.prod(shape) <= style.MOST_CURVES:
        place = [int(k) for k in np.unravel_index(member, shape)]
        return {"color": COLOURS[member], "linewidth": 1.3, "label": style.member_name(dataset, place)}
    if RUN_DIMENSION in axes:
        return {"color": COLOURS[0], "linewidth": 0.7, "alpha": 0.35}
    value = dataset[axes[0]].values[np.unravel_index(member, shape)[0]]
    return {"color": colours(dataset, axes).to_rgba(value), "linewidth": 0.9}


def arranged(dataset: Data) -> Data:
    """Return a sweep with its parameters in the order of the plan, and its runs in the order of their values."""
    plan = recorded_plan(dataset.attrs["sweep"])
    coords = sorted(parameters_of(dataset), key=lambda name: [*plan.paths, ""].index(path_of(name, plan)))
    found = replace(dataset, coords=[*coords, *(name for name in dataset.coords if name not in coords)])
    found = _along_first(found, coords) if plan.zipped else found
    for axis in {*axes_of(found)}.intersection(coords):
        if found[axis].kind == "f" and np.any(np.diff(values := found[axis].values) < 0):
            order, variables = np.argsort(values), dict(found.variables)
            for name, each in found.variables.items():
                if axis in each.dims:
                    variables[name] = replace(each, source=np.take(each.values, order, each.dims.index(axis)))
            found = replace(found, variables=variables)
    return found


def _along_first(dataset: Data, together: Sequence[str]) -> Data:
    """Return a sweep of parameters that change together, along the first one that differs in each run if there is one;
    an attribute tells the others.
    """
    count = dataset.sizes[RUN_DIMENSION]
    first = next((name for name in together if len({*dataset[name].values.tolist()}) == count), "")
    if not first:
        return dataset
    variables = {
        name: replace(each, dims=tuple(first if dim == RUN_DIMENSION else dim for dim in each.dims))
        for name, each in dataset.variables.items()
    }
    ends = np.argsort(dataset[first].values)[[0, -1]]
    words = [style.value_label(dataset[name], *ends) for name in together if name != first]
    told = {style.TOGETHER: f"along with {listed(words, 3)}"} if words else {}
    return replace(dataset, variables=variables, attrs={**dataset.attrs, **told})


def parameters_of(dataset: Data) -> list[str]:
    """Return the names of the swept parameters in the dataset."""
    axes = axes_of(dataset)
    return [name for name in dataset.coords if len(dataset[name].dims) == 1 and dataset[name].dims[0] in axes]


def in_each_run(dataset: Data, parameter: str) -> Array:
    """Return the value of a swept parameter in each run, shape as the runs."""
    values, status = dataset[parameter], dataset["status"]
    own = [dataset.sizes[axis] if axis in values.dims else 1 for axis in status.dims]
    return np.broadcast_to(values.values.reshape(own), status.source.shape)


def effects(dataset: Data, plan: Plan, axes: Sequence[str], names: Sequence[str]) -> Figure:
    """Draw the distribution of each variable, and its median and band over each parameter, for all values of others."""
    parameters = parameters_of(dataset)
    drawn = plan.sample.draws if plan.sample else {}
    ratios = {axis.path: axis.logarithmic for axis in plan.axes}
    ratios |= {path: draw.over_decades for path, draw in drawn.items()}
    decades = {parameter: ratios.get(path_of(parameter, plan)) for parameter in parameters}
    with style.panels(
        2.2 + 2.0 * len(parameters), 0.8 + 2.1 * len(names), len(names), 1 + len(parameters), sharey="row"
    ) as (plot, grid):
        for row, name in zip(grid, names, strict=True):
            whole, values = dataset[name], subsample(dataset, name)
            distribution(row[0], values)
            error = style.error_of(dataset, [name])
            style.label(row[0].yaxis, style.quantity_words(whole), unit(whole), values, error=error)
            for ax, parameter in zip(row[1:], parameters, strict=True):
                effect(ax, thinned(in_each_run(dataset, parameter)), values)
        for column, parameter in zip(grid.T[1:], parameters, strict=True):
            for ax in column:
                style.draw_parameter(ax.xaxis, dataset[parameter], decades[parameter])
                ax.xaxis.label.set(fontsize=8, visible=ax is column[-1])
        grid[-1, 0].set_xlabel("runs")
        style.headings(plot, grid[0, 0], dataset, more="5, 50 and 95 % of the runs")
    return plot


def path_of(parameter: str, plan: Plan) -> str:
    """Return the path of a swept parameter by its name in the dataset, a tail of the path; '' if none fits."""
    wanted = parameter.removesuffix("_swept")
    parts = {path: name_parts(path) for path in plan.paths}
    return next((path for path, p in parts.items() if wanted in ("_".join(p[k:]) for k in range(len(p)))), "")


def distribution(ax: Axes, values: Array) -> None:
    """Draw a histogram along the axis of the values, with the median and the band."""
    known = values[np.isfinite(values)]
    if len(known):
        ax.hist(known, bins=BINS, orientation="horizontal", color=COLOURS[0], alpha=0.6)
        for level, width in zip(np.percentile(known, PERCENTILES), (0.8, 1.6, 0.8), strict=True):
            ax.axhline(level, color="black", linewidth=width)


def effect(ax: Axes, over: Array, values: Array) -> None:
    """Draw median and band of the values in bins of a parameter with equal numbers of runs, or at each value."""
    known = np.isfinite(values) & np.isfinite(over)
    over, values = over[known], values[known]
    if not len(over):
        return
    if len(places := np.unique(over)) > PARAMETER_BINS:
        ends = np.unique(np.quantile(over, np.linspace(0, 1, PARAMETER_BINS + 1)))
        part = np.clip(np.searchsorted(ends, over, side="right") - 1, 0, len(ends) - 2)
        places = np.array([np.median(over[part == k]) for k in range(len(ends) - 1)])
    else:
        part = np.searchsorted(places, over)
    low, middle, high = np.array([np.percentile(values[part == k], PERCENTILES) for k in range(len(places))]).T
    ax.fill_between(places, low, high, color=COLOURS[1], alpha=0.25, linewidth=0)
    ax.plot(places, middle, color=COLOURS[1], marker="o", markersize=2.5)


def load_of(dataset: Data) -> str:
    """Return the load under whose growth the bonds of a sweep rupture; '' for other sweeps."""
    names = (name.removesuffix("_mode") for name in dataset if name.endswith("_mode"))
    loads = [load for load in names if all(f"{load}_{which}" in dataset for which in STATISTICS)]
    return loads[0] if loads else ""


MARKERS = "osD"

NEGLIGIBLE_LIFETIME, NEGLIGIBLE_DENSITY = 0.01, 0.01
"""Fraction of the shortest lifetime within which hardly a bond breaks, and of the lowest peak of densities on a
logarithmic axis that is drawn.
"""

PANEL_HEIGHT, LINE_WIDTH = 2.3, 1.2
"""Height of a panel [inch], and width of a curve over the load [points]."""

MOST_LARGE_MARKERS = 30
"""Number of points from which on large markers would hide each other."""


def figure_of_rupture(dataset: Data, load: str, variables: Sequence[str] | None = None) -> Figure:
    """Draw the spectrum, the distribution p(f) for some runs, and the lifetime; or ``variables`` over the load."""
    series = (f"density_{load}", "lifetime")
    held = all(name in dataset and load in dataset[name].dims for name in series)  # a store may keep no series
    names = variables or ("", *(series if held else ()))
    with style.panels(6.4, 0.7 + PANEL_HEIGHT * len(names), len(names)) as (plot, grid):
        for ax, name in zip(grid[:, 0], names, strict=True):
            if name:
                _draw_series(ax, dataset, load, name)
            else:
                # Most probable, median and mean load at rupture, the exact ones as rings.
                mean = dataset[f"{load}_mean"]
                text, size = style.prefixed(unit(mean), mean.values)
                _draw_statistics(ax, dataset, {f"{load}_{which}": word for which, word in STATISTICS.items()}, size)
                ax.set_ylabel(f"{symbol(load)} at rupture [{text}]")
            style.legend(ax)
        for ax in grid[2:, 0] if not variables else ():
            ax.sharex(grid[1, 0])
            if legend := ax.get_legend():
                legend.remove()  # the colours are those of the distributions
        note = grid[0, 0].get_title("right")  # beside the headings there is no room for it
        grid[0, 0].set_title("", loc="right")
        style.headings(plot, grid[0, 0], dataset, more=note)
    return plot


def _draw_over(ax: Axes, dataset: Data, load: str, values: Array, scale: Callable[[Array], Array] = np.asarray) -> None:
    """Draw values of some runs over the load, of many evenly spread over those whose most probable load is positive; as
    one curve if they coincide on this scale.
    """
    modes, x = dataset[f"{load}_mode"].values, dataset[load].values
    # At low loading rates most bonds break before the load grows, and their peak at zero would dwarf all others.
    inside = np.argwhere(modes > x[0])
    places = inside if len(inside) >= MOST_CURVES else np.argwhere(np.full(modes.shape, True))
    members = places[style.evenly_spread(len(places), MOST_CURVES)].tolist()
    notes = [f"{len(members)} of {modes.size} runs"] if len(members) < modes.size else []
    shown = np.array([values[tuple(place)] for place in members])
    if len(members) > 1 and _coincide(scale(shown)):
        ax.plot(x, np.fmin.reduce(shown), color="black", linewidth=LINE_WIDTH)
        notes.append("their curves coincide" if notes else "the curves of all runs coincide")
    else:
        for place, curve, colour in zip(members, shown, COLOURS, strict=False):
            ax.plot(x, curve, color=colour, linewidth=LINE_WIDTH, label=style.member_name(dataset, place))
    style.label_variable(ax.xaxis, dataset[load])
    ax.set_title(", ".join(notes), loc="right", **style.NOTE_STYLE)


def _coincide(curves: Array) -> bool:
    """True if curves nowhere differ by more than the width of their line, where they are known."""
    low, high = np.fmin.reduce(curves), np.fmax.reduce(curves)
    apart, range_ = np.fmax.reduce(high - low), np.fmax.reduce(high) - np.fmin.reduce(low)
    return bool(apart * 72 * PANEL_HEIGHT <= LINE_WIDTH * range_)


def _draw_series(ax: Axes, dataset: Data, load: str, name: str) -> None:
    """Draw a variable over the load; the distribution of the load at rupture is drawn until all bonds are broken."""
    values = dataset[name].values
    if name == f"density_{load}":
        text, size = style.prefixed(unit(dataset[load]), dataset[load].values)
        _draw_over(ax, dataset, load, np.maximum(values * size, 0.0))
        ax.set_ylabel(f"$p$({symbol(load)}) [1/{text}]")
        peaks = [style.largest(np.asarray(line.get_ydata())) for line in ax.get_lines()]
        if max(peaks) > SPIKE_RATIO * min(peaks) > 0:
            style.make_logarithmic(ax.yaxis)
            ax.set_ylim(bottom=NEGLIGIBLE_DENSITY * min(peaks))
    elif name == "lifetime":
        _draw_over(ax, dataset, load, values, np.log)
        ax.set_ylabel(rf"Lifetime $\tau$({symbol(load)}) [s]")
        style.make_logarithmic(ax.yaxis)
    else:
        _draw_over(ax, dataset, load, values)
        style.label(ax.yaxis, symbol(name), unit(dataset[name]), values)


def _draw_statistics(ax: Axes, dataset: Data, words: Mapping[str, str], size: float) -> None:
    """Draw results of each run over the swept parameter, by name with their labels in the legend, in one colour for
    each or for each value of a second parameter; exact values as black dots, as they are known at these points only.
    """
    parameter = dataset[dataset["status"].dims[0]]
    style.draw_parameter(ax.xaxis, parameter)
    x = parameter.values
    large = 3.5 if len(x) < MOST_LARGE_MARKERS else 2.0
    several = len(dataset["status"].dims) > 1
    for name, marker, own in zip(words, MARKERS, COLOURS, strict=False):
        drawn = style.curves_by_second(dataset, final_values(dataset, name))
        for (values, _), colour in zip(drawn, COLOURS, strict=False):
            ax.plot(x, values / size, marker, color=colour if several else own, markersize=large)
    for (_, label), colour in zip(drawn if several else (), COLOURS, strict=False):
        ax.plot([], [], color=colour, label=label)
    for word, marker, colour in zip(words.values(), MARKERS, COLOURS, strict=False):
        ax.plot([], [], marker, color="black" if several else colour, markersize=large, label=word)
    exact = [f"{name}_exact" for name in words if f"{name}_exact" in dataset]
    for k, name in enumerate(exact):
        for j, (values, _) in enumerate(style.curves_by_second(dataset, final_values(dataset, name))):
            label = "_" if j + k else "exact"
            ax.plot(x, values / size, "o", color="black", markersize=large / 3, label=label)


def lifetimes(dataset: Data) -> Figure:
    """Draw the lifetime over the swept parameter, the exact one as dots, and the survival over time of some runs."""
    with style.panels(6.4, 5.3, 2) as (plot, grid):
        above, below = grid[:, 0]
        _draw_statistics(above, dataset, {"lifetime": "runs"}, 1.0)
        above.set_ylabel(r"Lifetime $\tau$ [s]")
        style.make_logarithmic(above.yaxis)
        # The survival over time, of runs evenly spread over those with a known lifetime.
        known = np.argwhere(np.isfinite(dataset["lifetime"].values))
        chosen = style.evenly_spread(len(known), MOST_CURVES)
        times, survival, last = (dataset[name].values for name in ("time", "survival", "time_reached"))
        for place, colour in zip(known[chosen], COLOURS, strict=False):
            # A run ends when all bonds have broken: NaN after its end is a survival of zero.
            values = np.nan_to_num(survival[tuple(place)])
            below.plot(times, values, color=colour, label=style.member_name(dataset, place))
        lifetimes, begin = np.sort(dataset["lifetime"].values[tuple(known.T)]), 0.0
        if wants_log_axis(times) or style.over_decades(lifetimes):
            style.make_logarithmic(below.xaxis)
            begin = max(times[times > 0][0], NEGLIGIBLE_LIFETIME * lifetimes[0])
        below.set(xlim=(begin, last.max()), xlabel="Time [s]", ylabel="Survival $S$ [1]")
        for ax in (above, below):
            style.legend(ax)
        style.headings(plot, above, dataset)
    return plot


# Largest number of parameters of a grid for curves.
MOST_DRAWN = 2


def figure(dataset: Data, variables: Sequence[str] | None = None, against: str | None = None) -> Figure:
    """Draw a sweep: the load at rupture, else final values; with ``against`` each run over this variable."""
    dataset = arranged(dataset)
    plan, axes = plan_of(dataset), axes_of(dataset)
    if against:
        return trajectories(dataset, axes, variables, against)
    if hides_runs(dataset, axes):
        return figure_of_members(dataset, plan, axes, variables)
    style.check_variables(dataset, {"time_reached": tuple(axes), **{name: (name,) for name in axes}})
    shown, load = panels(dataset, variables), load_of(dataset)
    chosen = [name for panel in shown for name in panel.names]
    if load and (not variables or all(load in dataset[name].dims for name in chosen)):
        return figure_of_rupture(dataset, load, variables)
    if not variables and "lifetime" in dataset and dataset["lifetime"].dims == tuple(axes):
        return lifetimes(dataset)
    return _final_values(dataset, axes[0], shown)


def _final_values(dataset: Data, axis: str, shown: Sequence[Panel]) -> Figure:
    """Draw values at the ends of the runs over the first parameter, in panels."""
    height = 0.9 + (2.8 if len(shown) == 1 else 1.7) * len(shown)
    with style.panels(6.4, height, len(shown), sharex=True) as (plot, grid):
        for ax, panel in zip(grid[:, 0], shown, strict=True):
            _draw_final(ax, dataset, panel.names)
        style.mark_without_end(grid[:, 0].tolist(), dataset)
        style.draw_parameter(grid[-1, 0].xaxis, dataset[axis])
        style.headings(plot, grid[0, 0], dataset)
    return plot


def plan_of(dataset: Data) -> Plan:
    """Return the plan of the sweep that a dataset records; InputError if it does not hold its parameters."""
    axes = axes_of(dataset)
    style.check_variables(dataset, {}, {"status": tuple(axes)})
    plan = recorded_plan(dataset.attrs["sweep"])
    if not axes or not (hides_runs(dataset, axes) or {*axes} <= {*dataset.coords}):
        raise InputError("the dataset does not hold the parameters of a sweep.")
    return plan


def hides_runs(dataset: Data, axes: Sequence[str]) -> bool:
    """True if curves over the first parameter, one for each value of a second one, cannot show the runs."""
    many = len(axes) == MOST_DRAWN and dataset.sizes[axes[1]] > MOST_CURVES and not load_of(dataset)
    return RUN_DIMENSION in axes or len(axes) > MOST_DRAWN or many


def axes_of(dataset: Data) -> list[str]:
    """Return the dimensions of the swept parameters."""
    return [*dataset["status"].dims] if "status" in dataset else []


def panels(dataset: Data, variables: Sequence[str] | None) -> list[Panel]:
    """Return panels of the variables, else of the most probable load at rupture, else of those that vary."""
    axes, load = axes_of(dataset), load_of(dataset)
    # Coverages also have their own names.
    known = [name for name in number_names(dataset, axes) if {"event", "species"}.isdisjoint(dataset[name].dims)]
    refuse_unknown(variables or (), known, "no variable '{}' in the sweep", style.place_of(dataset))
    names = [f"{load}_mode"] if load and not variables else variables
    groups = [[name] for name in dict.fromkeys(names or ())] or _dependent(dataset, axes, known)
    # A store may have only one number per run.
    groups = groups or [[name] for name in varying_numbers(dataset, axes, known)]
    return [Panel("", unit(dataset[group[0]]), group) for group in groups]


def _dependent(dataset: Data, axes: Sequence[str], known: Sequence[str]) -> list[list[str]]:
    """Return temperatures and bonds whose final values depend on the sweep; with several parameters one per panel."""
    found, along = [], [name for name in known if len(dataset[name].dims) > len(axes)]
    swept = [in_each_run(dataset, name).tobytes() for name in parameters_of(dataset)]
    for _, *kind in PANELS[:2]:
        ends = {name: final_values(dataset, name).ravel() for name in of_kind(dataset, along, *kind)}
        names = [name for name, values in ends.items() if varies(values) and values.tobytes() not in swept]
        found += [[name] for name in names] if len(axes) > 1 else [names] if names else []
    return found


def _draw_final(ax: Axes, dataset: Data, names: Sequence[str]) -> None:
    """Draw the values at the end of each run."""
    x = dataset[axes_of(dataset)[0]].values
    ends = {name: final_values(dataset, name) for name in names}
    at_end = any(len(dataset[name].dims) > len(axes_of(dataset)) for name in names)
    for name, end in ends.items():
        own = symbol(name) if at_end or len(names) > 1 else ""  # the axis names a single number per run
        for values, label in style.curves_by_second(dataset, end):
            words = label or own if len(names) == 1 else f"{own} {label}".strip()
            kw: Any = {"linestyle": "none"} if style.is_mode(dataset[name]) else {}
            marker = style.marker(ax, 0 if kw else len(x))
            ax.plot(x, values, marker=marker, markersize=style.MARKER_SIZE, label=words, **kw)
    which = ("Final " if ends_are_known(dataset, names) else "Last output ") if at_end else ""
    said = f"{which}{style.quantity_words(dataset[names[0]]) if len(names) == 1 else 'value'}"
    values, error = np.stack(list(ends.values())), style.error_of(dataset, names)
    style.label(ax.yaxis, said, unit(dataset[names[0]]), values, error=error)
    style.legend(ax)
