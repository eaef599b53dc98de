"""Figures of two curved surfaces: their profiles, the traction between them, and the force over the approach."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfacechem.plots import style
from surfacechem.plots.style import Array
from surfacechem.tolerances import NEGLIGIBLE, SQRT_EPS

FIELDS = ("gap", "traction")
"""Fields that have a figure of their own."""

ROWS, HEIGHT = 3, 2.3
"""Panels, and the height of each [inch]."""

BEYOND = 1.5
"""So much farther than the traction is felt the surfaces are drawn."""


def figure(dataset: xarray.Dataset) -> Figure:
    """The surfaces, the traction on them at several times, and the force over the approach."""
    with style.panels(6.4, 0.9 + HEIGHT * ROWS, ROWS) as (plot, grid):
        draw(grid[:, 0].tolist(), dataset)
        style.headings(plot, grid[0, 0], dataset)
    return plot


def carries(dataset: xarray.Dataset) -> bool:
    """Whether a run is one of two curved surfaces, with their fields."""
    return {*FIELDS, "opposite_z", "approach", "force"} <= set(dataset)


def draw_below(axes: Sequence[Axes], dataset: xarray.Dataset) -> None:
    """The surfaces on the last axes of a figure; the others share theirs."""
    for ax in axes[: -ROWS - 1]:
        ax.sharex(axes[-ROWS - 1])
        ax.tick_params(labelbottom=False)
    draw(axes[-ROWS:], dataset)


def draw(axes: Sequence[Axes], dataset: xarray.Dataset) -> None:
    """The same on axes of a figure, one below the other."""
    even = _around(dataset)
    _draw_profiles(axes[0], dataset, even)
    if even:
        _draw_tractions(axes[1], dataset)
    else:
        _draw_field(axes[1], dataset)
    _draw_force(axes[2], dataset)


def _around(dataset: xarray.Dataset) -> bool:
    """Whether nothing changes about the axis."""
    gap = dataset["gap"].values
    return bool(np.ptp(gap, axis=2).max() <= SQRT_EPS * np.abs(gap).max())


def _section(dataset: xarray.Dataset) -> tuple[Array, int]:
    """Distances along a section through the nearest point [m], and which column of the points it is."""
    column = int(np.unravel_index(np.argmin(dataset["gap"].values[0]), dataset["gap"].shape[1:])[1])
    x, y = (dataset[f"surface_{axis}"].values[:, column] for axis in "xy")
    return (np.hypot(x, y) if _around(dataset) else x if np.ptp(x) > np.ptp(y) else y), column


def _reach(dataset: xarray.Dataset, along: Array, column: int) -> float:
    """Distance to which the traction is felt [m]."""
    size = np.abs(dataset["traction"].values[:, :, column]).max(axis=0)
    # Bodies are much larger than what acts between them, of which nothing would be seen at their size.
    felt = np.abs(along[size > NEGLIGIBLE * size.max()])
    return BEYOND * float(felt.max(initial=0.0)) or float(np.abs(along).max())


def _chosen(dataset: xarray.Dataset) -> Iterator[tuple[int, Any, str]]:
    """Times that are drawn, with colour and words: the least and the largest approach and some between."""
    approach = dataset["approach"].values
    # Runs linger where little changes: approaches are spread by their rank, not by time.
    order = np.argsort(approach)
    for k in dict.fromkeys(order[np.linspace(0, len(order) - 1, 4).round().astype(int)].tolist()):
        share = float(np.mean(approach < approach[k]))
        text, size = style.prefixed("m", approach)
        yield k, matplotlib.colormaps["viridis"](share * 0.9), f"$g_n$ = {approach[k] / size:.3g} {text}"


def _draw_profiles(ax: Axes, dataset: xarray.Dataset, even: bool) -> None:
    """Section through both bodies; the upper one at several approaches."""
    along, column = _section(dataset)
    reach = _reach(dataset, along, column)
    text, size = style.prefixed("m", np.array([reach]))
    signs = (1, -1) if even else (1,)
    for sign in signs:
        ax.plot(
            sign * along, dataset["surface_z"].values[:, column], color="black", label="body 1" if sign > 0 else "_"
        )
    heights = [dataset["surface_z"].values[np.abs(along) <= reach, column]]
    for k, colour, label in _chosen(dataset):
        x, y, z = (dataset[f"opposite_{axis}"].values[k, :, column] for axis in "xyz")
        across = np.hypot(x, y) if even else x if np.ptp(x) > np.ptp(y) else y
        for sign in signs:
            ax.plot(sign * across, z, color=colour, label=label if sign > 0 else "_")
        heights.append(z[np.abs(across) <= reach])
    drawn = np.concatenate(heights)
    margin = 0.05 * max(float(np.ptp(drawn)), float(np.abs(drawn).max()))
    ends = (-reach, reach) if even else (max(-reach, float(along.min())), min(reach, float(along.max())))
    ax.set(xlim=ends, ylim=(drawn.min() - margin, drawn.max() + margin))
    ax.set_ylabel(f"Height [{style.prefixed('m', drawn)[0]}]")
    ax.set_xlabel(f"Distance {'from the axis' if even else 'along a section'} [{text}]")
    style.label_ticks(ax.xaxis, size)
    style.label_ticks(ax.yaxis, style.prefixed("m", drawn)[1])
    style.legend(ax)


def _draw_tractions(ax: Axes, dataset: xarray.Dataset) -> None:
    """Traction over the distance from the axis at several approaches."""
    along, column = _section(dataset)
    reach = _reach(dataset, along, column)
    shown = np.abs(along) <= reach
    values = dataset["traction"].values[:, :, column]
    for k, colour, _ in _chosen(dataset):
        ax.plot(along[shown], values[k][shown], color=colour)
        ax.plot(-along[shown], values[k][shown], color=colour)
    text, size = style.prefixed("Pa", values[:, shown])
    ax.set(xlim=(-reach, reach), ylabel=f"Traction [{text}]")
    style.label_ticks(ax.yaxis, size)
    text, size = style.prefixed("m", np.array([reach]))
    ax.set_xlabel(f"Distance from the axis [{text}]")
    style.label_ticks(ax.xaxis, size)


def _draw_field(ax: Axes, dataset: xarray.Dataset) -> None:
    """Traction over the surface where it is the largest."""
    values = dataset["traction"].values
    k = int(np.argmax(np.abs(values).max(axis=(1, 2))))
    text, size = style.prefixed("Pa", values[k])
    x, y = (dataset[f"surface_{axis}"].values for axis in "xy")
    # White is no traction, whatever the least and the largest are.
    most = float(np.abs(values[k]).max()) / size
    mesh = ax.pcolormesh(x, y, values[k] / size, cmap="RdBu_r", vmin=-most, vmax=most, shading="gouraud")
    ax.figure.colorbar(mesh, ax=ax, label=f"Traction [{text}]")
    text, size = style.prefixed("m", np.concatenate([x.ravel(), y.ravel()]))
    ax.set(xlabel=f"x [{text}]", ylabel=f"y [{text}]", aspect="equal")
    for axis in (ax.xaxis, ax.yaxis):
        style.label_ticks(axis, size)


def _draw_force(ax: Axes, dataset: xarray.Dataset) -> None:
    """Force over the approach, and what the local law gives."""
    approach, force = dataset["g_n"].values, dataset["t_n"].values
    ax.plot(approach, force, label="force")
    if "local_difference" in dataset:
        local = dataset["force"].values + dataset["local_difference"].values
        ax.plot(dataset["approach"].values, local, "o", color="black", markersize=4, label="local law")
    for axis, values, unit, words in ((ax.xaxis, approach, "m", "Approach"), (ax.yaxis, force, "N", "Force")):
        text, size = style.prefixed(unit, values)
        axis.set_label_text(f"{words} [{text}]")
        style.label_ticks(axis, size)
    style.legend(ax)
