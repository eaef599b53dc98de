"""Figures of sweeps: force spectra against the exact formulas, and final values over the swept parameters."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import matplotlib
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from surfacechem.errors import InputError, suggestion
from surfacechem.format.sweep import MOST_AXES
from surfacechem.plots.panels import KINDS, varies
from surfacechem.plots.run import COLOURS, STYLE, Plot, headings, legend, opened, symbol, unit_text
from surfacechem.runs.sweep_dataset import WORDS, recorded_plan

Array = NDArray[np.float64]

PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "μ"), (1e-9, "n"), (1e-12, "p"), (1e-15, "f"))

MOST_CURVES = 7
"""Values of a second parameter that are drawn as curves of their own."""


def figure(data: xarray.Dataset | str | Path, variables: Sequence[str] | None = None) -> Figure:
    """A figure of a sweep, from its dataset or its netCDF file: the load at rupture, else final values."""
    dataset = opened(data, "status", "time_reached")
    if not all(name in dataset.coords for name in _axes(dataset)) or not 1 <= len(_axes(dataset)) <= MOST_AXES:
        raise InputError("the dataset does not hold the parameters of a sweep.")
    panels = _panels(dataset, variables)
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(6.4, 0.9 + (2.8 if len(panels) == 1 else 1.7) * len(panels)), layout="constrained")
        FigureCanvasAgg(plot)
        axes = plot.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0].tolist()
        for ax, draw in zip(axes, panels, strict=True):
            draw(ax)
            legend(ax)
        _parameter_axis(axes, dataset)
        headings(plot, axes[0], dataset)
    return plot


def _panels(dataset: xarray.Dataset, variables: Sequence[str] | None) -> list[Callable[[Axes], None]]:
    known = [
        str(name) for name in dataset.data_vars if dataset[name].dtype.kind == "f" and "event" not in dataset[name].dims
    ]
    for name in variables or ():
        if name not in known:
            raise InputError(f"no variable '{name}' in the sweep.{suggestion(name, known)}")
    if variables:
        return [partial(_draw_final, dataset=dataset, names=[name]) for name in dict.fromkeys(variables)]
    if _load(dataset):
        return [partial(_draw_spectrum, dataset=dataset)]
    states = [[name for name in known if _is_state(dataset, name, *kind)] for _, *kind in KINDS[:2]]
    groups = [[name for name in group if varies(_final(dataset, name).ravel())] for group in states]
    several = len(_axes(dataset)) > 1
    split = [[name] for group in groups for name in group] if several else [group for group in groups if group]
    split = split or [["time_reached"]]
    return [partial(_draw_final, dataset=dataset, names=names) for names in split]


def _is_state(dataset: xarray.Dataset, name: str, unit: str, pattern: str) -> bool:
    along = dataset[name].ndim > len(_axes(dataset))
    return along and dataset[name].attrs.get("units") == unit and re.fullmatch(pattern, name) is not None


def _axes(dataset: xarray.Dataset) -> list[str]:
    """Dimensions of the swept parameters."""
    return [str(name) for name in dataset["status"].dims]


def _load(dataset: xarray.Dataset) -> str:
    """The variable whose values at rupture the dataset holds; empty if there is none."""
    found = [str(name).removesuffix("_mode") for name in dataset.data_vars if str(name).endswith("_mode")]
    return next((name for name in found if all(f"{name}_{which}" in dataset for which in WORDS)), "")


def _curves(dataset: xarray.Dataset, values: Array) -> list[tuple[Array, str]]:
    """Values over the first parameter, a curve for each value of the second, thinned where there are many."""
    if values.ndim == 1:
        return [(values, "")]
    second = dataset[_axes(dataset)[1]]
    chosen = np.unique(np.linspace(0, values.shape[1] - 1, MOST_CURVES).round().astype(int))
    unit = unit_text(str(second.attrs.get("units", "1")))
    name = str(second.name).replace("_", " ")
    return [(values[:, j], f"{name} = {second.values[j]:g} {unit}") for j in chosen]


def _draw_spectrum(ax: Axes, dataset: xarray.Dataset) -> None:
    """Most probable, median and mean load at rupture, the exact ones as lines."""
    load, x = _load(dataset), dataset[_axes(dataset)[0]].values
    scale, unit = _prefixed(dataset[f"{load}_mean"])
    for (which, word), colour, marker in zip(WORDS.items(), COLOURS, "osD", strict=False):
        every = max(1, len(x) // 40)
        for j, (values, label) in enumerate(_curves(dataset, dataset[f"{load}_{which}"].values)):
            (points,) = ax.plot(x[::every], values[::every] / scale, marker, color=colour, markersize=3.5)
            points.set(label=f"{word} {label}".strip(), alpha=1 / (1 + 0.5 * j))
        if f"{load}_{which}_exact" in dataset:
            for values, _ in _curves(dataset, dataset[f"{load}_{which}_exact"].values):
                ax.plot(x, values / scale, color=colour, linewidth=0.9, label="_")
    ax.plot([], [], color="black", linewidth=0.9, label="exact" if f"{load}_mode_exact" in dataset else "_")
    ax.set_ylabel(f"{symbol(load)} at rupture [{unit}]")


def _prefixed(values: xarray.DataArray) -> tuple[float, str]:
    """A power of a thousand that suits the values, and their unit with its prefix."""
    unit = str(values.attrs.get("units", "1"))
    largest = float(np.nanmax(np.abs(values.values), initial=0.0))
    if unit not in ("N", "Pa", "m") or largest == 0.0:
        return 1.0, unit_text(unit)
    return next(((scale, prefix + unit) for scale, prefix in PREFIXES if largest >= scale), (1.0, unit))


def _draw_final(ax: Axes, dataset: xarray.Dataset, names: Sequence[str]) -> None:
    """Values at the end of each run."""
    x = dataset[_axes(dataset)[0]].values
    for name in names:
        for values, label in _curves(dataset, _final(dataset, name)):
            marker = "o" if len(x) < 3 else ""
            ax.plot(x, values, marker=marker, label=f"{symbol(name)} {label}".strip())
    ax.set_ylabel(f"final [{unit_text(str(dataset[names[0]].attrs.get('units', '1')))}]")
    ax.ticklabel_format(axis="y", useOffset=False, scilimits=(-4, 5))


def _final(dataset: xarray.Dataset, name: str) -> Array:
    """The last value that each run reached."""
    values: Array = dataset[name].values
    if values.ndim == len(_axes(dataset)):
        return values
    last = values.shape[-1] - 1 - np.argmax(np.isfinite(values)[..., ::-1], axis=-1)
    return np.asarray(np.take_along_axis(values, last[..., None], axis=-1)[..., 0])


def _parameter_axis(axes: Sequence[Axes], dataset: xarray.Dataset) -> None:
    parameter = dataset[_axes(dataset)[0]]
    meaning = str(parameter.attrs.get("long_name", parameter.name)).partition(" (")[0]
    axes[-1].set_xlabel(f"{meaning[:1].upper()}{meaning[1:]} [{unit_text(str(parameter.attrs.get('units', '1')))}]")
    if recorded_plan(str(dataset.attrs["sweep"])).axes[0].logarithmic:
        for ax in axes:
            ax.set_xscale("log")
