"""Figures of sweeps: force spectra against the exact formulas, and final values over the swept parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfacechem.errors import InputError, suggestion
from surfacechem.format.plans import RUN, STATISTICS, recorded_plan
from surfacechem.plots import members, style
from surfacechem.plots.run import KINDS, of_kind
from surfacechem.plots.style import COLOURS, Array, meaning, symbol, unit, unit_text, varies

PREFIXES = tuple((10.0 ** (-3 * k), prefix) for k, prefix in enumerate(["", "m", "μ", "n", "p", "f"]))

# Parameters of a grid that are drawn.
MOST_DRAWN = 2

# Values of a second parameter that are drawn as curves of their own.
MOST_CURVES = 7


def figure(dataset: xarray.Dataset, variables: Sequence[str] | None = None) -> Figure:
    """The figure of a sweep: the load at rupture, else final values."""
    axes = _axes(dataset) if "status" in dataset else []
    style.check(dataset, {}, {"status": tuple(axes)})
    plan = recorded_plan(dataset.attrs["sweep"])
    if are_many(dataset, axes):
        return members.figure(dataset, plan, variables)
    if not all(name in dataset.coords for name in axes) or not 1 <= len(axes) <= MOST_DRAWN:
        raise InputError("the dataset does not hold the parameters of a sweep.")
    style.check(dataset, {"time_reached": tuple(axes), **{name: (name,) for name in axes}})
    panels = _panels(dataset, variables)
    height = 0.9 + (2.8 if len(panels) == 1 else 1.7) * len(panels)
    with style.panels(6.4, height, len(panels), sharex=True) as (plot, grid):
        for ax, draw in zip(grid[:, 0], panels, strict=True):
            draw(ax)
            style.legend(ax)
            if plan.axes[0].logarithmic:
                ax.set_xscale("log")
        parameter = dataset[axes[0]]
        grid[-1, 0].set_xlabel(f"{meaning(parameter, ' (')} [{unit_text(unit(parameter))}]")
        style.headings(plot, grid[0, 0], dataset)
    return plot


def are_many(dataset: xarray.Dataset, axes: Sequence[str]) -> bool:
    """Whether curves over the first parameter, one for each value of another, do not show the runs."""
    spectral = any(str(name).endswith("_mode") for name in dataset)
    curves = len(axes) == MOST_DRAWN and dataset.sizes[axes[1]] > MOST_CURVES
    return not spectral and (RUN in axes or len(axes) > MOST_DRAWN or curves)


def _axes(dataset: xarray.Dataset) -> list[str]:
    """Dimensions of the swept parameters."""
    return [str(name) for name in dataset["status"].dims]


def _numbers(dataset: xarray.Dataset) -> list[str]:
    """Names of the numbers that each run has at its end or along it."""
    return [str(n) for n, v in dataset.data_vars.items() if v.dtype.kind == "f" and "event" not in v.dims]


def _panels(dataset: xarray.Dataset, variables: Sequence[str] | None) -> list[Callable[[Axes], None]]:
    """The panels of the variables, else of the load at rupture, else of what depends on the sweep."""
    known = _numbers(dataset)
    for name in variables or ():
        if name not in known:
            raise InputError(f"no variable '{name}' in the sweep.{suggestion(name, known)}")
    load = next((name.removesuffix("_mode") for name in known if name.endswith("_mode")), "")
    if not variables and {f"{load}_{which}" for which in STATISTICS} <= set(known):
        return [partial(_draw_spectrum, dataset=dataset, load=load)]
    groups = [[name] for name in dict.fromkeys(variables or ())] or _dependent(dataset) or [["time_reached"]]
    return [partial(_draw_final, dataset=dataset, names=names) for names in groups]


def _dependent(dataset: xarray.Dataset) -> list[list[str]]:
    """Temperatures and bonds whose final values depend on what is swept; each alone where that has several axes."""
    axes, groups = _axes(dataset), []
    along = [name for name in _numbers(dataset) if dataset[name].ndim > len(axes)]
    for _, *kind in KINDS[:2]:
        names = [name for name in of_kind(dataset, along, *kind) if varies(_final(dataset, name).ravel())]
        groups += [[name] for name in names] if len(axes) > 1 else [names] if names else []
    return groups


def _curves(dataset: xarray.Dataset, values: Array) -> list[tuple[Array, str]]:
    """Values over the first parameter, a curve for each value of the second, thinned where there are many."""
    if values.ndim == 1:
        return [(values, "")]
    second = dataset[_axes(dataset)[1]]
    chosen = np.unique(np.linspace(0, values.shape[1] - 1, MOST_CURVES).round().astype(int))
    name = str(second.name).replace("_", " ")
    return [(values[:, j], f"{name} = {second.values[j]:g} {unit_text(unit(second))}") for j in chosen]


def _draw_spectrum(ax: Axes, dataset: xarray.Dataset, load: str) -> None:
    """Most probable, median and mean load at rupture, the exact ones as lines."""
    x, mean = dataset[_axes(dataset)[0]].values, dataset[f"{load}_mean"]
    # A power of a thousand that suits the loads, and their unit with its prefix.
    largest, own = float(np.nanmax(np.abs(mean.values), initial=0.0)), unit(mean)
    usable = PREFIXES if own in ("N", "Pa", "m") and largest > 0 else ()
    scale, prefix = next(((scale, prefix) for scale, prefix in usable if largest >= scale), (1.0, ""))
    every = max(1, len(x) // 40)
    for (which, word), colour, marker in zip(STATISTICS.items(), COLOURS, "osD", strict=False):
        for j, (values, label) in enumerate(_curves(dataset, dataset[f"{load}_{which}"].values)):
            (points,) = ax.plot(x[::every], values[::every] / scale, marker, color=colour, markersize=3.5)
            points.set(label=f"{word} {label}".strip(), alpha=1 / (1 + 0.5 * j))
        if f"{load}_{which}_exact" in dataset:
            for values, _ in _curves(dataset, dataset[f"{load}_{which}_exact"].values):
                ax.plot(x, values / scale, color=colour, linewidth=0.9, label="_")
    ax.plot([], [], color="black", linewidth=0.9, label="exact" if f"{load}_mode_exact" in dataset else "_")
    ax.set_ylabel(f"{symbol(load)} at rupture [{prefix}{unit_text(own)}]")


def _draw_final(ax: Axes, dataset: xarray.Dataset, names: Sequence[str]) -> None:
    """Values at the end of each run."""
    x = dataset[_axes(dataset)[0]].values
    for name in names:
        for values, label in _curves(dataset, _final(dataset, name)):
            marker = "o" if len(x) < 3 else ""
            ax.plot(x, values, marker=marker, label=f"{symbol(name)} {label}".strip())
    ax.set_ylabel(f"final [{unit_text(unit(dataset[names[0]]))}]")
    ax.ticklabel_format(axis="y", useOffset=False, scilimits=(-4, 5))


def _final(dataset: xarray.Dataset, name: str) -> Array:
    """The last value that each run reached."""
    values: Array = dataset[name].values
    if values.ndim == len(_axes(dataset)):
        return values
    last = values.shape[-1] - 1 - np.argmax(np.isfinite(values)[..., ::-1], axis=-1)
    return np.asarray(np.take_along_axis(values, last[..., None], axis=-1)[..., 0])
