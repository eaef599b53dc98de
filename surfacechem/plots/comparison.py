"""Several runs, or several sweeps of one parameter, in one figure: one colour each, named by their differences."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain, cycle
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from surfacechem.documents import document
from surfacechem.documents.document import parameter_path
from surfacechem.errors import InputError
from surfacechem.plots import style, sweep, time_series
from surfacechem.plots.style import COLOURS, symbol, unit
from surfacechem.plots.time_series import Panel
from surfacechem.results.dataset import changes_of
from surfacechem.results.netcdf import Data

LINE_STYLES = ("-", "--", ":", "-.")
"""Line styles of the variables of a panel; the colour identifies the dataset."""

TEXT_KEYS = ("title", "description", "source", "reference")
"""Keys of a case that do not describe its scene."""

LONG_NUMBER = re.compile(r"\b\d\.?\d{7,}(?:e[+-]?\d+)?|\b\d+\.\d{7,}(?:e[+-]?\d+)?")

LONG_LABEL = 40
"""Length of a label [letters] above which two do not fit side by side."""

MOST_DIFFERENCES = 4
"""Largest number of parameters in a legend; with more, titles or files identify the datasets better."""


def figure(datasets: Sequence[Data], variables: Sequence[str] | None = None, against: str | None = None) -> Figure:
    """Draw several datasets, all of runs or all of sweeps over the same parameter."""
    datasets = [sweep.arranged(each) if "sweep" in each.attrs else each for each in datasets]
    over, panels = _content(datasets, variables, against)
    if not panels:
        raise InputError("there is nothing to plot: none of the variables varies.")
    shown = [over, *(name for panel in panels for name in panel.names)]
    names, colours = _labels_with_coincidences(datasets, shown), colours_of(len(datasets))
    # A dataset that needs a logarithmic axis is unreadable on a linear one; others can be read on both.
    begin = min(filter(None, [time_series.first_shown(dataset, panels, over) for dataset in datasets]), default=None)
    with style.panels(6.4, 1.2 + 0.17 * len(datasets) + 1.7 * len(panels), len(panels), sharex=True) as (plot, grid):
        for ax, panel in zip(grid[:, 0], panels, strict=True):
            _draw(ax, datasets, panel, over, colours, begin)
        _label_axis(grid[:, 0].tolist(), datasets, over, begin)
        handles = [Line2D([], [], color=colour, label=name) for colour, name in zip(colours, names, strict=True)]
        plot.legend(handles=handles, loc="outside lower left", ncols=1 if len(max(names, key=len)) > LONG_LABEL else 2)
        titles = {str(dataset.attrs.get("title", "")) for dataset in datasets}
        title = titles.pop() if len(titles) == 1 else f"{len(datasets)} datasets"
        plot.suptitle(title, **style.TITLE_STYLE)
    return plot


def _content(datasets: Sequence[Data], variables: Sequence[str] | None, against: str | None) -> tuple[str, list[Panel]]:
    """Return the variable along the axis, and the panels."""
    sweeps = ["sweep" in dataset.attrs for dataset in datasets]
    if any("study" in dataset.attrs for dataset in datasets) or any(sweeps) != all(sweeps):
        raise InputError("a figure takes runs or sweeps, not both.")
    if not any(sweeps):
        for dataset in datasets:
            style.check_variables(dataset, {"time": ("time",)})
        return against or "time", _merge_panels([time_series.panels(each, variables, against) for each in datasets])
    axes = [*dict.fromkeys(tuple(sweep.axes_of(each)) for each in datasets)]
    if len(axes) > 1 or len(axes[0]) > 1:
        given = ", and over ".join(" by ".join(names) for names in axes)
        raise InputError(f"sweeps share a figure where all are over one parameter, the same; these are over {given}.")
    return axes[0][0], _merge_panels([sweep.panels(each, variables) for each in datasets])


def colours_of(count: int) -> list[str]:
    """Return colours that do not repeat."""
    if count <= len(COLOURS):
        return list(COLOURS[:count])
    return [to_hex(colour) for colour in matplotlib.colormaps["viridis"](np.linspace(0, 0.9, count))]


def labels(datasets: Sequence[Data]) -> list[str]:
    r"""Label each dataset by its differences from the others: parameters and solver, else the title, else the file.

    >>> cases = [f"interface: {{friction: [coulomb: {{mu: {mu}}}]}}" for mu in (0.3, 0.6)]
    >>> labels([Data({}, {"case": text, "solver": "radau"}) for text in cases])
    ['$\\mu$ = 0.3', '$\\mu$ = 0.6']
    """
    known = [_settings(dataset) for dataset in datasets]
    every = dict.fromkeys(chain.from_iterable(known))
    paths = [path for path in every if len({each.get(path) for each in known}) > 1]
    texts = [str(dataset.attrs.get("title", "")).replace("$", r"\$") for dataset in datasets]
    # More differences than fit into a legend are those of different cases, which differ in their titles.
    if 0 < len(paths) <= MOST_DIFFERENCES:
        names = _short(paths)
        texts = [", ".join(f"{name} = {each.get(path, 'not given')}" for path, name in names.items()) for each in known]
    # Datasets that still have the same name are named by their files.
    files = [Path(dataset.file).stem or f"dataset {k}" for k, dataset in enumerate(datasets, 1)]
    return [text if texts.count(text) == 1 else file for text, file in zip(texts, files, strict=True)]


def _short(paths: Sequence[str]) -> dict[str, str]:
    """Return the last parts of paths that make them unique, or the symbol for them."""
    last = [path.rpartition(".")[2] for path in paths]
    return {
        path: style.parameter_name(name) if last.count(name) == 1 else " ".join(path.split(".")[-2:])
        for path, name in zip(paths, last, strict=True)
    }


def _settings(dataset: Data) -> dict[str, str]:
    """Return the values of the case of a dataset by path, as written, with the changes of the run."""
    text, attributes = str(dataset.attrs.get("case", "")), dataset.attrs
    every = document.parse(text).walk() if text else ()
    found = {each.place.path: str(each.value) for each in every if not isinstance(each.value, dict | list)}
    # A run from Python may differ from its case; the dataset records the changes separately.
    for path, (value, si) in changes_of(attributes).items():
        text, size = style.prefixed(si, np.array([value]))
        found[parameter_path(path, found)] = f"{value / size:g} {text}".removesuffix(" 1").rstrip()
    found |= {name: str(attributes[name]) for name in ("solver", "rtol") if name in attributes}
    return {path: _short_number(value) for path, value in found.items() if path.partition(".")[0] not in TEXT_KEYS}


def _short_number(text: str) -> str:
    """Shorten a number, with its unit if it has one, to the digits that a legend needs.

    >>> _short_number("6.6666666666666667e15 1/J/s"), _short_number("radau"), _short_number("-0.1 MPa")
    ('6.66667e+15 1/J/s', 'radau', '−0.1 MPa')
    """
    return style.minus(LONG_NUMBER.sub(lambda m: f"{float(m[0]):.6g}", text))


def _merge_panels(found: Sequence[Sequence[Panel]]) -> list[Panel]:
    """Merge panels of all datasets with the same title and unit."""
    names: dict[tuple[str, str], dict[str, None]] = {}
    for panel in (panel for each in found for panel in each):
        names.setdefault((panel.title, panel.unit), {}).update(dict.fromkeys(panel.names))
    return [Panel(*key, list(several)) for key, several in names.items()]


def _labels_with_coincidences(datasets: Sequence[Data], shown: Sequence[str]) -> list[str]:
    """Return the labels of datasets, with a note on those whose curves are hidden below others."""
    names = labels(datasets)
    held = [[each[name].values.tobytes() if name in each else b"" for name in shown] for each in datasets]
    twins = [held.index(values) for values in held]
    return [names[k] + (f", the same as {names[j]}" if j < k else "") for k, j in enumerate(twins)]


def _draw(
    ax: Axes, datasets: Sequence[Data], panel: Panel, over: str, colours: Sequence[str], begin: float | None
) -> None:
    """Draw the variables of a panel, each in its line style, for all datasets that have them."""
    drawn = []
    for dataset, colour in zip(datasets, colours, strict=False):
        for name, dash in zip(panel.names, cycle(LINE_STYLES), strict=False):
            if name in dataset:
                values = sweep.final_values(dataset, name) if "sweep" in dataset.attrs else dataset[name].values
                drawn.append(values if begin is None else values[dataset[over].values >= begin])
                points = "sweep" in dataset.attrs or len(values) < 3
                kw: Any = {"marker": style.marker(ax, len(values)), "markersize": style.MARKER_SIZE} if points else {}
                kw["drawstyle"] = style.drawn_as(dataset[name])
                style.draw_curve(ax, dataset, over, values, color=colour, linestyle=dash, linewidth=1.3, **kw)
    words = panel.title or ", ".join(map(symbol, panel.names[:2]))
    error = max(style.error_of(each, panel.names) or 0.0 for each in datasets)
    style.label(ax.yaxis, words, panel.unit, np.concatenate(drawn), error=error)
    several = panel.names if len(panel.names) > 1 else ()
    for name, dash in zip(several, cycle(LINE_STYLES), strict=False):
        ax.plot([], [], color="black", linestyle=dash, linewidth=1.3, label=symbol(name))
    style.legend(ax)


def _label_axis(axes: Sequence[Axes], datasets: Sequence[Data], over: str, begin: float | None) -> None:
    """Label the shared axis: time, over decades from ``begin`` on, a variable, or the swept parameter."""
    first, values = datasets[0][over], np.concatenate([dataset[over].values for dataset in datasets])
    if over == "time":
        time_series.label_time(axes, values, unit(first), begin)
    elif "sweep" in datasets[0].attrs:
        style.draw_parameter(axes[-1].xaxis, first)
    else:
        style.label(axes[-1].xaxis, f"{style.meaning(first)} {symbol(first.name)}", unit(first), values)
