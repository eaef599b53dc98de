"""Overlays on the curves of a run: events as thin lines with their names, modes and stages as bands."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import xarray
from matplotlib.axes import Axes

from surfacechem.plots import style

FEW = 8
"""Up to this many events, or spans of a mode, have their names written to them."""

MANY = 60
"""Above this many lines nothing could be told from them."""

WIDE = 0.09
"""Part of the run that a stage must last for its name to fit."""


def is_mode(values: xarray.DataArray) -> bool:
    """True for a mode of the automaton, as the long name of a variable says."""
    return str(values.attrs.get("long_name", "")).startswith("mode (")


def events(axes: Sequence[Axes], dataset: xarray.Dataset) -> None:
    """Thin vertical lines at the events; ends of stages show as bands."""
    if "event_time" not in dataset:
        return
    named = {"event_name": ("event",)} if "event_name" in dataset else {}
    style.check(dataset, {"event_time": ("event",)}, named)
    times = dataset["event_time"].values
    names = dataset["event_name"].values.astype(str) if named else np.full(times.shape, "")
    moments = dict(zip(times.tolist(), names.tolist(), strict=True))
    for moment in moments if len(moments) <= MANY else ():
        for ax in axes:
            ax.axvline(moment, color="black", linewidth=0.6, linestyle=":")
    told = {t: name for t, name in moments.items() if not name.startswith("end of ")}
    for moment, name in told.items() if len(told) <= FEW else ():
        _write(axes[0], moment, name, rotation=90, ha="right", va="top", y=0.97)


def bands(axes: Sequence[Axes], dataset: xarray.Dataset) -> None:
    """The stages of a programme; else spans of time in which a mode is not what it was at the start."""
    modes = [str(name) for name, values in dataset.data_vars.items() if is_mode(values) and values.dims == ("time",)]
    if dataset.sizes["time"] < 2:
        return
    if "stage" not in modes:
        for name in modes:
            first, *rest = _spans(dataset, name)
            _shade(axes, [span for span in rest if span[2] != first[2]])
        return
    spans, length = _spans(dataset, "stage"), float(np.ptp(dataset["time"].values))
    words = dict(re.findall(r"(-?\d+): ([^,)]+)", str(dataset["stage"].attrs["long_name"])))
    _shade(axes, [span for span in spans if span[2] % 2])
    for start, end, value in spans:
        if end - start > WIDE * length:
            _write(axes[0], (start + end) / 2, words.get(f"{value:.0f}", ""), ha="center", va="bottom", y=0.02)


def _shade(axes: Sequence[Axes], spans: Sequence[tuple[float, float, float]]) -> None:
    for start, end, _ in spans if len(spans) <= MANY else ():
        for ax in axes:
            ax.axvspan(start, end, color="black", alpha=0.05, linewidth=0)


def _spans(dataset: xarray.Dataset, name: str) -> list[tuple[float, float, float]]:
    """Start, end and value of a mode between events; what lies between two outputs is too short to be seen."""
    times, values = dataset["time"].values, dataset[name].values.astype(float)
    known = dataset["event_time"].values if "event_time" in dataset else np.empty(0)
    changes = [j for j in range(1, len(values)) if values[j] != values[j - 1]]
    edges = [float(times[0])]
    for j in changes:
        inside = known[(known >= times[j - 1]) & (known <= times[j])]
        edges.append(float(inside[-1]) if len(inside) else float(times[j]))
    ends = [*edges[1:], float(times[-1])]
    return list(zip(edges, ends, (float(values[j]) for j in [0, *changes]), strict=True))


def _write(ax: Axes, x: float, text: str, y: float, **how: object) -> None:
    """A small word at a time, at a height relative to the panel."""
    if text:
        where = ax.get_xaxis_transform()
        ax.text(x, y, text, transform=where, fontsize=7, color="#555555", clip_on=True, **how)  # type: ignore[arg-type]
