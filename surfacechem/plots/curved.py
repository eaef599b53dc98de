"""Figures of two curved surfaces: their profiles, the traction between them, and the force over the approach."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from surfacechem.plots import style
from surfacechem.plots.style import Array
from surfacechem.results.netcdf import Data
from surfacechem.tolerances import NEGLIGIBLE, SQRT_EPS

FIELDS = ("gap", "traction")
"""Fields that are drawn in a separate figure."""

ROWS, HEIGHT = 3, 2.3
"""Number of panels, and the height of each [inch]."""

PANEL_SPACING = 0.08
"""Space above and below each [inch]: twice the usual."""

PROFILE_REACH = 1.5
"""Ratio of the drawn distance to that over which the traction is significant."""


def figure(dataset: Data) -> Figure:
    """Draw the surfaces, the traction on them at several times, and the force over the approach."""
    with style.panels(6.4, 0.9 + HEIGHT * ROWS, ROWS) as (plot, grid):
        draw(grid[:, 0].tolist(), dataset)
        style.headings(plot, grid[0, 0], dataset)
    return plot


def has_surfaces(dataset: Data) -> bool:
    """True if the dataset is of a run of two curved surfaces, with their fields."""
    return {*FIELDS, "opposite_z", "approach", "force"} <= set(dataset)


def draw(axes: Sequence[Axes], dataset: Data) -> None:
    """Draw the panels on axes of a figure, one below the other."""
    # Each panel has its own x axis, whose label needs space above the panel below.
    engine: Any = axes[0].figure.get_layout_engine()
    engine.set(h_pad=PANEL_SPACING)
    even, (along, at) = _is_axisymmetric(dataset), _section(dataset)
    reach = _reach(dataset, along, at)
    _draw_profiles(axes[0], dataset, even, along, at, reach)
    if even:
        _draw_tractions(axes[1], dataset, along, at, reach)
    else:
        _draw_field(axes[1], dataset)
    # The force over the approach, and that of the local law.
    approach, force = dataset["g_n"].values, dataset["t_n"].values
    style.draw_curve(axes[2], dataset, "g_n", force, label="force")
    if "local_difference" in dataset:
        local = dataset["force"].values + dataset["local_difference"].values
        axes[2].plot(dataset["approach"].values, local, "o", color="black", markersize=4, label="local law")
    style.label(axes[2].xaxis, "Approach", "m", approach)
    style.label(axes[2].yaxis, "Force", "N", force)
    style.legend(axes[2])


def _is_axisymmetric(dataset: Data) -> bool:
    """True if the gap does not change around the axis."""
    gap = dataset["gap"].values
    return bool(np.ptp(gap, axis=2).max() <= SQRT_EPS * np.abs(gap).max())


def _is_facing(dataset: Data) -> NDArray[np.bool_]:
    """Return the mask of points on the side nearest to the other body: from above a closed body hides itself."""
    from scipy.ndimage import label

    x, y = (dataset[f"surface_{axis}"].values for axis in "xy")
    (x_u, x_v), (y_u, y_v) = np.gradient(x), np.gradient(y)
    area = x_u * y_v - x_v * y_u
    area *= np.sum(area * np.abs(dataset["traction"].values).max(axis=0))
    parts, _ = label(area >= -SQRT_EPS * np.abs(area).max())
    return np.asarray(parts == parts[np.unravel_index(np.argmin(dataset["gap"].values[0]), parts.shape)])


def _section(dataset: Data) -> tuple[Array, Any]:
    """Return distances along a section through the nearest point [m], and the indices of its points."""
    column = int(np.unravel_index(np.argmin(dataset["gap"].values[0]), dataset["gap"].values.shape[1:])[1])
    x, y = (dataset[f"surface_{axis}"].values for axis in "xy")
    rows = np.flatnonzero(_is_facing(dataset)[:, column])
    if _is_axisymmetric(dataset):
        return np.hypot(x, y)[rows, column], (rows, column)
    columns, last = np.full(len(rows), column), x.shape[1] - 1
    if max(np.ptp(ends[:, [0, -1]], axis=1).max() for ends in (x, y)) <= SQRT_EPS * np.ptp(x):
        # Beyond the axis the section continues along the opposite column.
        rows, columns = np.append(rows[::-1], rows), np.append(np.full(len(rows), (column + last // 2) % last), columns)
    at = rows, columns
    return x[at] if np.ptp(x[at]) > np.ptp(y[at]) else y[at], at


def _reach(dataset: Data, along: Array, at: Any) -> float:
    """Return the distance over which the traction is significant [m]."""
    size = np.abs(dataset["traction"].values[:, *at]).max(axis=0)
    # Bodies are much larger than the range of their interaction, which would be invisible at their scale.
    felt = np.abs(along[size > NEGLIGIBLE * size.max()])
    whole = float(np.abs(along).max())
    return min(PROFILE_REACH * float(felt.max(initial=0.0)), whole) or whole


def _drawn_times(dataset: Data) -> Iterator[tuple[int, Any, str]]:
    """Yield the times that are drawn, with colour and label: the least and the largest approach and some between."""
    approach = dataset["approach"].values
    # Runs may rest for long: approaches are spread by their rank, not by time.
    order = np.argsort(approach)
    for k in order[style.evenly_spread(len(order), 4)].tolist():
        share = float(np.mean(approach < approach[k]))
        text, size = style.prefixed("m", approach)
        yield k, matplotlib.colormaps["viridis"](share * 0.9), f"$g_n$ = {approach[k] / size:.3g} {text}"


def _draw_profiles(ax: Axes, dataset: Data, even: bool, along: Array, at: Any, reach: float) -> None:
    """Draw a section through both bodies, the upper one at several approaches."""
    signs = (1, -1) if even else (1,)
    for sign in signs:
        ax.plot(sign * along, dataset["surface_z"].values[at], color="black", label="body 1" if sign > 0 else "_")
    heights = [dataset["surface_z"].values[at][np.abs(along) <= reach]]
    for k, colour, label in _drawn_times(dataset):
        x, y, z = (dataset[f"opposite_{axis}"].values[k][at] for axis in "xyz")
        across = np.hypot(x, y) if even else x if np.ptp(x) > np.ptp(y) else y
        for sign in signs:
            ax.plot(sign * across, z, color=colour, label=label if sign > 0 else "_")
        heights.append(z[np.abs(across) <= reach])
    drawn = np.concatenate(heights)
    margin = 0.05 * max(float(np.ptp(drawn)), float(np.abs(drawn).max()))
    ends = (-reach, reach) if even else (max(-reach, float(along.min())), min(reach, float(along.max())))
    ax.set(xlim=ends, ylim=(drawn.min() - margin, drawn.max() + margin))
    style.label(ax.yaxis, "Height", "m", drawn)
    style.label(ax.xaxis, f"Distance {'from the axis' if even else 'along a section'}", "m", np.array([reach]))
    style.legend(ax)


def _draw_tractions(ax: Axes, dataset: Data, along: Array, at: Any, reach: float) -> None:
    """Draw the traction over the distance from the axis at several approaches."""
    shown = np.abs(along) <= reach
    values = dataset["traction"].values[:, *at]
    for k, colour, _ in _drawn_times(dataset):
        ax.plot(along[shown], values[k][shown], color=colour)
        ax.plot(-along[shown], values[k][shown], color=colour)
    ax.set_xlim(-reach, reach)
    style.label(ax.yaxis, "Traction", "Pa", values[:, shown])
    style.label(ax.xaxis, "Distance from the axis", "m", np.array([reach]))


def _draw_field(ax: Axes, dataset: Data) -> None:
    """Draw the traction over the surface at the time when it is largest."""
    facing = _is_facing(dataset)
    seen: Any = np.ix_(facing.any(axis=1), facing.any(axis=0))
    values = dataset["traction"].values[:, *seen]
    k = int(np.argmax(np.abs(values).max(axis=(1, 2))))
    text, size = style.prefixed("Pa", values[k])
    x, y = (dataset[f"surface_{axis}"].values[seen] for axis in "xy")
    # White is zero traction: the colour scale is symmetric.
    most = float(np.abs(values[k]).max()) / size
    colours: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -most, "vmax": most}
    # Rasterized, since a vector graphic would contain every triangle.
    mesh = ax.pcolormesh(x, y, values[k] / size, shading="gouraud", rasterized=True, **colours)
    ax.figure.colorbar(mesh, cax=ax.inset_axes((1.05, 0, 0.05, 1)), label=f"Traction [{text}]")
    ax.set_aspect("equal")
    # The drawn part is a square around all significant tractions, cut to the surface.
    felt = np.abs(values[k]) >= NEGLIGIBLE * np.abs(values[k]).max()
    ends = [(float(part[felt].min()), float(part[felt].max())) for part in (x, y)]
    half = PROFILE_REACH / 2 * max(b - a for a, b in ends)
    shown = [
        np.clip([(a + b) / 2 - half, (a + b) / 2 + half], part.min(), part.max())
        for part, (a, b) in zip((x, y), ends, strict=True)
    ]
    ax.set(xlim=shown[0], ylim=shown[1])
    style.label(ax.xaxis, "x", "m", shown[0])
    style.label(ax.yaxis, "y", "m", shown[1])
