"""Figures of runs: states, fluxes and balances over time, the exact solution dashed where the dataset has one.

Only Matplotlib's object-oriented interface is used: nothing here opens windows or changes global settings.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from numpy.typing import NDArray

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.plots import annotations as marks
from surfacechem.plots.panels import Panel, chosen, curves, merged, profiles, unit, usual, varies
from surfacechem.results.netcdf import reading

Array = NDArray[np.float64]

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f")
"""The palette of Okabe and Ito, which colour-blind readers can tell apart."""

STYLE: Any = {
    "axes.grid": True,
    "axes.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.size": 9.0,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "mathtext.fontset": "dejavusans",
    "svg.hashsalt": "surfacechem",
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
}
DECADES = 1e3
"""Times that span more than this go on a logarithmic axis, unless they are evenly spaced."""

PROFILE_TIMES = 6
"""Times at which profiles are drawn, evenly spread over the outputs."""

OVER = {
    "tolerance": ("tolerance",),
    **{f"{name}_name": (name,) for name in ("event", "case", "solver", "variable")},
    "event_time": ("event",),
}
"""What some variables go over."""

TEXTS = (
    *("event_name", "event_reason", "event_verdict", "status", "reason", "case_name", "solver_name", "variable_name"),
    *("title", "case_text", "reference", "regime", "solver", "outcome", "symbol"),
)
"""Variables that hold words."""

NUMBER = (float, int, np.number)
NUMBERS = ("error", "rtol", "energy_error", "entropy_error", "site_error")
"""Attributes of which figures need the value."""

LEAST = 1e-18
"""Residuals below this are drawn as this."""

GREEK = ("alpha", "beta", "epsilon", "eta", "kappa", "lambda", "mu", "phi", "rho", "sigma", "tau", "theta")


class Plot(Figure):
    """A figure that notebooks show by themselves."""

    def _repr_png_(self) -> bytes:
        from io import BytesIO

        buffer = BytesIO()
        save(self, buffer, "png")
        return buffer.getvalue()


RESIDUALS = {"energy_residual": "energy_error", "entropy_residual": "entropy_error", "site_residual": "site_error"}
"""Residuals and the attributes that hold their largest relative values."""


def figure(
    data: xarray.Dataset | str | Path, variables: Sequence[str] | None = None, against: str | None = None
) -> Figure:
    """A figure of a run, from its dataset or its netCDF file.

    ``variables`` are shown instead of the usual choice; over the variable ``against`` instead of time.
    """
    dataset = opened(data, "time")
    if variables and set(variables) & set(profiles(dataset)):
        return _across(dataset, variables)
    panels = chosen(dataset, variables) if variables else usual(dataset)
    if against is not None:
        panels = _others(dataset, panels, against)
    balances = not variables and against is None and any(name in dataset for name in RESIDUALS)
    rows = len(panels) + balances
    if rows == 0 or dataset.sizes.get("time", 0) == 0:
        raise InputError("there is nothing to plot: the dataset holds no output times or none of its variables varies.")
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(6.4, 0.9 + (2.6 if against else 1.55) * rows), layout="constrained")
        FigureCanvasAgg(plot)
        axes = plot.subplots(rows, 1, sharex=True, squeeze=False)[:, 0].tolist()
        for ax, panel in zip(axes, panels, strict=False):
            _draw(ax, dataset, panel, against or "time")
        if balances:
            _draw_balances(axes[-1], dataset)
        _variable_axis(axes[-1], dataset, against) if against else _time_axis(axes, dataset)
        headings(plot, axes[0], dataset)
    return plot


def _across(dataset: xarray.Dataset, names: Sequence[str]) -> Figure:
    """Temperatures across bodies at several times, the contact in the middle."""
    for name in names:
        if name not in profiles(dataset):
            raise InputError(f"{name} goes over time, a profile over places; show them in figures of their own.")
    shown = np.unique(np.linspace(0, dataset.sizes["time"] - 1, PROFILE_TIMES).round().astype(int))
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(6.4, 3.4), layout="constrained")
        FigureCanvasAgg(plot)
        ax = plot.subplots()
        for j, i in enumerate(shown.tolist()):
            colour = matplotlib.colormaps["viridis"](j / max(len(shown) - 1, 1) * 0.9)
            for name in names:
                side = -1e3 if name == "profile_1" else 1e3
                label = f"{float(dataset.time[i]):.3g} s" if name == names[0] else None
                values = dataset[name].values[i]
                ax.plot(side * dataset[f"x_{name[-1]}"].values, values, color=colour, label=label)
        ax.set_xlabel("Distance from the contact [mm], body 1 to the left")
        ax.set_ylabel("Temperature [K]")
        legend(ax)
        headings(plot, ax, dataset)
    return plot


def _others(dataset: xarray.Dataset, panels: Sequence[Panel], against: str) -> list[Panel]:
    """The panels without the variable that is their axis."""
    known = curves(dataset)
    if against not in known:
        raise InputError(f"no variable '{against}' over time in the dataset.{suggestion(against, known)}")
    rest = [replace(panel, names=tuple(name for name in panel.names if name != against)) for panel in panels]
    return [panel for panel in rest if panel.names]


def _variable_axis(ax: Axes, dataset: xarray.Dataset, name: str) -> None:
    text = str(dataset[name].attrs.get("long_name", name)).split(":")[0]
    ax.set_xlabel(f"{text[:1].upper()}{text[1:]} {symbol(name)} [{unit_text(unit(dataset, name))}]")
    ax.ticklabel_format(axis="x", useOffset=False, scilimits=(-3, 5))


def save(plot: Figure, target: Any, kind: str) -> None:
    """Write a figure as png, svg or pdf; the same figure gives the same bytes."""
    metadata: Mapping[str, None] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
    with matplotlib.rc_context(STYLE):
        plot.savefig(target, format=kind, dpi=160, metadata=metadata)


def opened(data: xarray.Dataset | str | Path, *needed: str) -> xarray.Dataset:
    """A dataset, read from its netCDF file if need be; InputError where it is none that surfacechem could have written.

    ``needed`` are variables without which there is nothing to draw.
    """
    if isinstance(data, xarray.Dataset):
        source = data.encoding.get("source")
        dataset, place = data, Place(str(source)) if source else None
    else:
        dataset, place = _read(Path(data)), Place(str(data))
    for name in needed:
        if name not in dataset.variables:
            raise InputError(f"has no variable '{name}', as datasets of surfacechem have.", place)
    return dataset


def _read(path: Path) -> xarray.Dataset:
    """A dataset from its file; InputError where a variable or attribute is of no kind that is written."""
    place = Place(str(path))

    def load() -> xarray.Dataset:
        with xarray.open_dataset(path, engine="netcdf4") as file:
            return file.load()

    dataset = reading(path, load)
    for name, values in dataset.variables.items():
        wanted = OVER.get(str(name), values.dims)
        if name == "time" and "sweep" not in dataset.attrs:  # a sweep may end each run at a time of its own
            wanted = ("time",)
        if values.dims != wanted:
            raise InputError(f"{name} does not go over {' and '.join(map(str, wanted))}.", place)
        if (values.dtype.kind != "f" and name not in TEXTS) or (name == "time" and not np.isfinite(values).all()):
            raise InputError(f"{name} does not hold numbers in double precision.", place)
        for key, value in values.attrs.items():
            if not isinstance(value, (str, *NUMBER)):
                raise InputError(f"the attribute '{key}' of {name} is no text or number.", place)
    for name, value in dataset.attrs.items():
        if not isinstance(value, NUMBER if name in NUMBERS else (str, *NUMBER)):
            raise InputError(
                f"the attribute '{name}' is no {'number' if name in NUMBERS else 'text or number'}.", place
            )
    return dataset


def _draw(ax: Axes, dataset: xarray.Dataset, panel: Panel, over: str) -> None:
    t = dataset[over].values
    for names in merged(dataset, panel.names):
        ax.plot(t, dataset[names[0]].values, label=" = ".join(map(symbol, names)), marker="o" if len(t) == 1 else "")
    exact = [name for name in panel.names if f"{name}_exact" in dataset]
    for j, name in enumerate(exact):
        values = dataset[f"{name}_exact"].values
        ax.plot(t, values, "--", color="black", linewidth=0.9, label="exact" if j == 0 else "_")
    unit = unit_text(panel.unit)
    ax.set_ylabel(f"{panel.title} [{unit}]" if panel.title else f"[{unit}]")
    ax.ticklabel_format(axis="y", useOffset=False, scilimits=(-4, 5))
    _margins(ax, dataset, panel.names)
    legend(ax)


def _margins(ax: Axes, dataset: xarray.Dataset, names: Sequence[str]) -> None:
    """A curve that is constant up to rounding is drawn as a line, not as noise blown up to the panel's height."""
    values = np.concatenate([dataset[name].values for name in names])
    values = values[np.isfinite(values)]
    if len(values) and not varies(values):
        middle = float(values.mean())
        ax.set_ylim(middle - 0.05 * abs(middle or 1.0), middle + 0.05 * abs(middle or 1.0))


def legend(ax: Axes) -> None:
    """The legend beside the axes."""
    _, labels = ax.get_legend_handles_labels()
    if labels:
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), borderaxespad=0.4, handlelength=1.6)


def _draw_balances(ax: Axes, dataset: xarray.Dataset) -> None:
    t = dataset["time"].values
    for name, attribute in RESIDUALS.items():
        if name not in dataset:
            continue
        relative = np.abs(dataset[name].values)
        worst = float(np.max(relative, initial=0.0))
        if worst > 0:
            relative = relative / worst * float(dataset.attrs.get(attribute, worst))
        ax.plot(t, np.maximum(relative, LEAST), label=name.partition("_")[0], linewidth=1.2)
    ax.set_yscale("log")
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, LEAST), max(high, 1e-12))
    ax.set_ylabel("Balance residual [1]")
    legend(ax)


def _time_axis(axes: Sequence[Axes], dataset: xarray.Dataset) -> None:
    times = dataset["time"].values
    axes[-1].set_xlabel("Time [s]")
    if logarithmic(times):
        for ax in axes:
            ax.set_xscale("log")
            ax.set_xlim(times[times > 0][0], times[-1])
    marks.bands(axes, dataset)
    marks.events(axes, dataset)


def logarithmic(times: Array) -> bool:
    """Whether the times want a logarithmic axis: they span decades and most of them are not in the last one.

    >>> logarithmic(np.logspace(-6, 2, 50)), logarithmic(np.linspace(0, 5, 100_001))
    (True, False)
    """
    after = times[times > 0]
    if len(after) < 2 or after[-1] / after[0] <= DECADES:
        return False
    return bool(np.mean(after > 0.1 * after[-1]) < 0.6)


def headings(plot: Figure, ax: Axes, dataset: xarray.Dataset) -> None:
    """Title, how it ended, error and solver."""
    attributes = dataset.attrs
    plot.suptitle(str(attributes.get("title", "")), x=0.01, ha="left", fontsize=11, fontweight="bold")
    facts = [str(attributes.get("reason", ""))]
    if "error" in attributes:
        exact = str(attributes.get("error_source", "")).startswith("exact") or any(map(_is_exact, dataset))
        source = "exact solution" if exact else "estimate"
        facts.append(f"error {attributes['error']:.1e} ({source})")
    if "solver" in attributes and "rtol" in attributes:
        facts.append(f"{attributes['solver']}, rtol {attributes['rtol']:g}")
    if dataset.sizes.get("event", 0) > dataset.sizes.get("time", 0):
        facts.append(f"{dataset.sizes['event']} events between {dataset.sizes.get('time', 0)} outputs")
    ax.set_title("   ".join(fact for fact in facts if fact), loc="left", fontsize=8, color="#555555")


def _is_exact(name: object) -> bool:
    return str(name).endswith("_exact")


def symbol(name: str) -> str:
    r"""A variable's name in mathematics.

    >>> symbol("T_1"), symbol("phi"), symbol("D_coulomb"), symbol("R_linear_affinity")
    ('$T_{1}$', '$\\phi$', '$D_{\\mathrm{coulomb}}$', '$R_{\\mathrm{linear\\ affinity}}$')
    """
    head, _, subscript = name.partition("_")
    base = f"\\{head}" if head in GREEK else (head if len(head) == 1 else rf"\mathrm{{{head}}}")
    if not subscript:
        return f"${base}$"
    words = subscript.replace("_", r"\ ")
    inside = words if len(words) <= 2 else r"\mathrm{" + words + "}"
    return f"${base}_{{{inside}}}$"


def unit_text(unit: str) -> str:
    """A CF unit with its powers raised.

    >>> unit_text("W m-2 K-1")
    'W m$^{-2}$ K$^{-1}$'
    """
    return re.sub(r"([A-Za-z])(-?\d+)", r"\1$^{\2}$", unit)
