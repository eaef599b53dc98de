"""Figures of sweeps: rupture under a growing load, many runs, and final values over the swept parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfacechem.errors import InputError, refuse_unknown
from surfacechem.format.plans import RUN_DIMENSION, Plan, recorded_plan
from surfacechem.plots import members, rupture, style
from surfacechem.plots.run import PANELS, Panel, of_kind
from surfacechem.plots.style import MOST_CURVES, symbol, unit, varies

# Largest number of parameters of a grid for curves.
MOST_DRAWN = 2


def figure(dataset: xarray.Dataset, variables: Sequence[str] | None = None, against: str | None = None) -> Figure:
    """Draw a sweep: the load at rupture, else final values; with ``against`` each run over this variable."""
    plan, axes = plan_of(dataset), axes_of(dataset)
    if against:
        return members.trajectories(dataset, axes, variables, against)
    if hides_runs(dataset, axes):
        return members.figure(dataset, plan, axes, variables)
    style.check_variables(dataset, {"time_reached": tuple(axes), **{name: (name,) for name in axes}})
    shown, load = panels(dataset, variables), rupture.load_of(dataset)
    chosen = [name for panel in shown for name in panel.names]
    if load and (not variables or all(load in dataset[name].dims for name in chosen)):
        return rupture.figure(dataset, load, variables)
    if not variables and "lifetime" in dataset and dataset["lifetime"].dims == tuple(axes):
        return rupture.lifetimes(dataset)
    return _final_values(dataset, axes[0], shown)


def _final_values(dataset: xarray.Dataset, axis: str, shown: Sequence[Panel]) -> Figure:
    """Draw values at the ends of the runs over the first parameter, in panels."""
    height = 0.9 + (2.8 if len(shown) == 1 else 1.7) * len(shown)
    with style.panels(6.4, height, len(shown), sharex=True) as (plot, grid):
        for ax, panel in zip(grid[:, 0], shown, strict=True):
            _draw_final(ax, dataset, panel.names)
        style.mark_without_end(grid[:, 0].tolist(), dataset)
        for ax in grid[:, 0]:
            style.legend(ax)
        style.draw_parameter(grid[-1, 0].xaxis, dataset[axis])
        style.headings(plot, grid[0, 0], dataset)
    return plot


def plan_of(dataset: xarray.Dataset) -> Plan:
    """Return the plan of the sweep that a dataset records; InputError if it does not hold its parameters."""
    axes = axes_of(dataset)
    style.check_variables(dataset, {}, {"status": tuple(axes)})
    plan = recorded_plan(dataset.attrs["sweep"])
    known = all(name in dataset.coords for name in axes) and 1 <= len(axes) <= MOST_DRAWN
    if not known and not hides_runs(dataset, axes):
        raise InputError("the dataset does not hold the parameters of a sweep.")
    return plan


def hides_runs(dataset: xarray.Dataset, axes: Sequence[str]) -> bool:
    """True if curves over the first parameter, one for each value of a second one, cannot show the runs."""
    spectral = any(str(name).endswith("_mode") for name in dataset)
    curves = len(axes) == MOST_DRAWN and dataset.sizes[axes[1]] > MOST_CURVES
    return not spectral and (RUN_DIMENSION in axes or len(axes) > MOST_DRAWN or curves)


def axes_of(dataset: xarray.Dataset) -> list[str]:
    """Return the dimensions of the swept parameters."""
    return [str(name) for name in dataset["status"].dims] if "status" in dataset else []


def _numbers(dataset: xarray.Dataset) -> list[str]:
    """Return the names of variables that curves over the swept parameter show; coverages also have their own names."""
    lists = {"event", "species"}
    return [name for name in members.number_names(dataset, axes_of(dataset)) if lists.isdisjoint(dataset[name].dims)]


def panels(dataset: xarray.Dataset, variables: Sequence[str] | None) -> list[Panel]:
    """Return panels of the variables, else of the most probable load at rupture, else of those that vary."""
    known, load = _numbers(dataset), rupture.load_of(dataset)
    refuse_unknown(variables or (), known, "no variable '{}' in the sweep", style.place_of(dataset))
    names = [[name] for name in dict.fromkeys(variables or ())] or ([[f"{load}_mode"]] if load else _dependent(dataset))
    # A store may have only one number per run.
    names = names or [[name] for name in members.varying_numbers(dataset, axes_of(dataset), known)]
    return [Panel("", unit(dataset[group[0]]), group) for group in names]


def _dependent(dataset: xarray.Dataset) -> list[list[str]]:
    """Return temperatures and bonds whose final values depend on the sweep; with several parameters one per panel."""
    axes, found = axes_of(dataset), []
    along = [name for name in _numbers(dataset) if dataset[name].ndim > len(axes)]
    for _, *kind in PANELS[:2]:
        names = [name for name in of_kind(dataset, along, *kind) if varies(members.final_values(dataset, name).ravel())]
        found += [[name] for name in names] if len(axes) > 1 else [names] if names else []
    return found


def _draw_final(ax: Axes, dataset: xarray.Dataset, names: Sequence[str]) -> None:
    """Draw the values at the end of each run."""
    x = dataset[axes_of(dataset)[0]].values
    ends = {name: members.final_values(dataset, name) for name in names}
    at_end = any(dataset[name].ndim > len(axes_of(dataset)) for name in names)
    for name, end in ends.items():
        own = symbol(name) if at_end or len(names) > 1 else ""  # the axis names a single number per run
        for values, label in style.curves_by_second(dataset, end):
            words = label or own if len(names) == 1 else f"{own} {label}".strip()
            kw: Any = {"linestyle": "none"} if style.is_mode(dataset[name]) else {}
            marker = style.marker(ax, 0 if kw else len(x))
            ax.plot(x, values, marker=marker, markersize=style.MARKER_SIZE, label=words, **kw)
    which = ("Final " if members.ends_are_known(dataset, names) else "Last output ") if at_end else ""
    said = f"{which}{style.quantity_words(dataset[names[0]]) if len(names) == 1 else 'value'}"
    style.label(ax.yaxis, said, unit(dataset[names[0]]), np.stack(list(ends.values())))
