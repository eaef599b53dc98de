"""Figure of a mechanism: equilibrium constants and rates over temperature, and over force where one acts."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from surfacechem.plots.run import COLOURS, STYLE, Plot
from surfacechem.studies.mechanisms.rate_tables import Curves
from surfacechem.studies.mechanisms.sheet import Span, reference

Array = NDArray[np.float64]

POINTS = 200


def figure(curves: Curves, temperatures: Span, forces: Span) -> Figure:
    """Rates (left) and equilibrium constants (right), over temperature and in a second row over force."""
    rows = 2 if curves.loaded else 1
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(7.2, 0.6 + 2.5 * rows), layout="constrained")
        FigureCanvasAgg(plot)
        axes = plot.subplots(rows, 2, squeeze=False)
        T = temperatures.values(POINTS)
        _row(axes[0], curves, T, T, np.zeros(1), "Temperature [K]")
        if curves.loaded:
            f = forces.values(POINTS)
            shown, label = reference(temperatures), f"Force on {curves.pulled or 'a bond'} [pN]"
            _row(axes[1], curves, f * 1e12, np.array([shown]), f, label)
            axes[1][0].set_title(f"at {shown:g} K", loc="left", fontsize=8, color="#555555")
        handles, labels = axes[0][0].get_legend_handles_labels()
        plot.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 3))
        plot.suptitle(f"Phase {curves.mechanism.phase}", x=0.01, ha="left", fontsize=11, fontweight="bold")
    return plot


def _row(axes: tuple[Axes, Axes], curves: Curves, x: Array, T: Array, f: Array, label: str) -> None:
    rates, constants = axes
    for j, (name, law) in enumerate(curves.laws.items()):
        colour = COLOURS[j % len(COLOURS)]
        reverse = curves.log_reverse(name, T, f)
        _line(rates, x, curves.log_forward(name, T, f), "-", colour, f"{name}: {law.equation}")
        if reverse is not None:
            _line(rates, x, reverse, "--", colour, f"{name}, reverse")
        _line(constants, x, curves.log_equilibrium(name, T, f), "-", colour, "_")
    for ax, text in ((rates, "Rate per bond [1/s]"), (constants, "K [1]")):
        ax.set_xlabel(label)
        ax.set_ylabel(f"log$_{{10}}$ {text}")


def _line(ax: Axes, x: Array, logarithm: Array, style: str, colour: str, label: str) -> None:
    values = np.broadcast_to(logarithm, x.shape) / math.log(10)
    ax.plot(x, values, style, color=colour, label=label, marker="o" if len(x) == 1 else "")
