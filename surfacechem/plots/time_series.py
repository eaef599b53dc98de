"""Figures of runs: states, fluxes and balances over time, with exact solutions dashed; and of quantities at given
states, over the quantity in which these differ.

Events are thin lines with their names, stages and modes are bands; a curve is dotted at a jump.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfacechem.errors import InputError, refuse_unknown
from surfacechem.plots import curved, style
from surfacechem.plots.style import Array, meaning, symbol, unit, varies
from surfacechem.results.netcdf import Data
from surfacechem.tolerances import EPS, RUN_EPS

# Panels of the default figure: title, and patterns of the unit and of the names.
PANELS: tuple[tuple[str, str, str], ...] = (
    ("Temperature", "K|degC", r".*"),
    ("Bonding", "1", r"(?!formed_|departure_|x_|.*_residual$|J_c$|n_c$|gamma_m$|ln_theta$|drive$).*"),
    ("Mole fraction", "1", r"x_\w+"),
    ("Potential", "V", r"V_\w+"),
    ("Current", "A m-2", r"[ij]_\w+"),
    ("Film", "m", "d_m"),
    ("Growth", "m s-1", r"growth_\w+"),
    ("Gap", "m", r"g_\w*"),
    ("Displacement", "m", r"u_t2?"),
    ("Velocity", "m s-1", r"(?!growth_)\w+"),
    ("Traction", "Pa", r"(?!.*_nominal$).*"),
    ("Heat flux", "W m-2", r"q_(?!m$|t$|.*_nominal$)\w+"),
    ("Dissipation", "W m-2", r"D_\w+"),
    ("Force per bond", "N", r"f"),
    # Of a pair of bodies with curved surfaces.
    ("Force", "N", r"t_(?!.*_nominal$)\w+"),
    ("Heat flow", "W", r"q_(?!m$|t$|.*_nominal$)\w+"),
    ("Dissipated power", "W", r"D_\w+"),
)

# Residuals and the attributes that hold their largest relative values.
RESIDUALS = {"energy_residual": "energy_error", "entropy_residual": "entropy_error", "site_residual": "site_error"}

# Residuals below this, far below the last digit of the balanced total, are drawn as this.
LEAST_DRAWN = EPS / 256

# Residuals that stay below this are rounding of the last digit, and need no panel.
ROUNDED_RESIDUAL = 4 * EPS

# Dashes of exact solutions, with gaps that show the colour of the run below.
DASHES = (0, (3, 5))

# Times that span more than this go on a logarithmic axis, unless they are evenly spaced.
LOG_AXIS_RATIO = 1e3

# Part of the run that is too short to be visible on a linear axis, and part of its range by which a quantity has to
# change within it to get a logarithmic one, which begins at LOG_AXIS_PART of the run at the earliest.
EARLY_PART, EARLY_CHANGE, LOG_AXIS_PART = 1 / 200, 0.3, 1 / 1e7

# So many events in the last decade of time, if they are the majority, would be crowded on a logarithmic axis.
MOST_IN_LAST_DECADE = 3

# Unit of heat fluxes.
FLUX = "W m-2"

# A flux whose range is so many times larger with the time before EARLY_PART than without would be a spike and a line at
# zero.
SPIKE_RATIO = 20.0

# A title of so many letters does not fit next to a panel; one of ONE_LINE_LETTERS needs a second line for its unit.
MOST_TITLE_LETTERS, ONE_LINE_LETTERS = 24, 14

# Names of temperature profiles across bodies, functions of time and place.
PROFILE = re.compile("profile_[12]")

# Number of times at which profiles are drawn, evenly spread over the outputs.
PROFILE_TIMES = 6

# Part of the width of a panel within which lines of events are merged.
EVENT_SPACING = 1 / 120

# Largest number of events with names above them, and largest number of lines of events.
MOST_NAMED_EVENTS, MOST_EVENT_LINES = 8, 60

# Line styles of events whose names repeat, the most frequent name first.
EVENT_LINE_STYLES = ("dotted", "dashed", "dashdot")

# Rows of names above the first panel; width of a letter and of the margins of panels [inch], space between two names in
# widths of the panel, and height of a row in points.
NAME_ROWS, LETTER_INCHES, SIDE_WIDTH, NAME_SPACING, NAME_ROW_HEIGHT = 3, 0.06, 1.7, 0.02, 9.0

# Number of curves of a panel with distinct colours: the largest ones.
MOST_COLOURED = len(style.COLOURS) - 1

# Largest number of names in a label of coinciding curves.
MOST_NAMES = 3

# Units of the quantities shown by default for given states, tractions and heat fluxes, and largest number of panels.
UNITS_AT_STATES, MOST_PANELS_AT_STATES = ("Pa", "W m-2", "N", "W"), 4


class Panel(NamedTuple):
    """Curves that share an axis."""

    title: str
    unit: str
    names: Sequence[str]


def figure(dataset: Data, variables: Sequence[str] | None = None, against: str | None = None) -> Figure:
    """Draw a run; ``variables`` are shown instead of the default choice, over ``against`` instead of time."""
    style.check_variables(dataset, {"time": ("time",)})
    if not np.isfinite(dataset["time"].values).all():
        raise InputError("time does not hold finite numbers.", style.place_of(dataset))
    if variables and any(map(PROFILE.fullmatch, variables)):
        return _across(dataset, variables)
    if variables and set(variables) <= set(curved.FIELDS) and curved.has_surfaces(dataset):
        return curved.figure(dataset)
    against = None if against == "time" else against
    shown = panels(dataset, variables, against)
    usual = not variables and against is None
    balances = usual and _balances_err(dataset)
    if len(shown) + balances == 0 or dataset.sizes["time"] == 0:
        raise InputError("there is nothing to plot: the dataset holds no output times or none of its variables varies.")
    below = curved.ROWS if usual and curved.has_surfaces(dataset) else 0
    return _stacked(dataset, shown, against, balances, below)


def _balances_err(dataset: Data) -> bool:
    """True if a balance closes to less than the last digit, or if its largest residual is unknown."""
    largest = [style.attribute(dataset, error) for name, error in RESIDUALS.items() if name in dataset]
    return any(error is None or not error < ROUNDED_RESIDUAL for error in largest)


def _stacked(dataset: Data, shown: Sequence[Panel], against: str | None, balances: bool, below: int) -> Figure:
    """Draw panels that share an axis, the balances, and rows of surfaces below, if any."""
    rows = len(shown) + balances
    height = 0.9 + (2.6 if against else 1.55) * rows + curved.HEIGHT * below
    with style.panels(6.4, height, rows + below, sharex=not below) as (plot, grid):
        axes = grid[:rows, 0].tolist()
        if below:
            for ax in axes[:-1]:
                ax.sharex(axes[-1])
                ax.tick_params(labelbottom=False)
            curved.draw(grid[rows:, 0].tolist(), dataset)
        first = first_shown(dataset, shown, against or "time")
        for ax, panel in zip(axes, shown, strict=False):
            _draw(ax, dataset, panel, against or "time", first)
        if balances:
            _draw_balances(axes[-1], dataset)
        above, more = _draw_axis(axes, dataset, against, first)
        style.headings(plot, axes[0], dataset, above, more)
    return plot


def at_states(dataset: Data, variables: Sequence[str] | None, against: str | None) -> Figure:
    """Draw variables at given states, by default tractions and heat fluxes that differ, over ``against``, by default
    the first quantity that differs.
    """
    known = curves(dataset, "point")
    asked = [*(variables or ()), *filter(None, [against])]
    refuse_unknown(asked, known, "no variable '{}' at the states", style.place_of(dataset))
    # Quantities, without derivatives, that differ between states.
    differing = [name for name in known if len(np.unique(dataset[name].values)) > 1 and "_by_" not in name]
    if not differing:
        raise InputError("a figure needs states that differ.", style.place_of(dataset))
    over = against or differing[0]
    names = variables or _usual_at_states(dataset, [name for name in differing if name != over])
    refused = dataset["admissible"].values == 0
    look = "o-" if _are_path(dataset, over) else "o"
    with style.panels(6.4, 0.7 + 1.9 * len(names), len(names), sharex=True) as (plot, grid):
        order = np.argsort(dataset[over].values, kind="stable")
        for ax, name in zip(grid[:, 0], names, strict=True):
            values = np.where(refused, np.nan, dataset[name].values)
            ax.plot(dataset[over].values[order], values[order], look, markersize=3)
            style.label(ax.yaxis, symbol(name), unit(dataset[name]), values)
        style.mark(grid[:, 0].tolist(), dataset[over].values[refused], "refused")
        style.label_variable(grid[-1, 0].xaxis, dataset[over])
        style.headings(plot, grid[0, 0], dataset, more=f"{refused.sum()} refused" if refused.any() else "")
    return plot


def _are_path(dataset: Data, over: str) -> bool:
    """True if states follow each other, those of a grid do not: a line would join what is not beside each other."""
    given = {over, *(name.rpartition("_by_")[2] for name in dataset if "_by_" in name)}
    steps = [np.diff(dataset[name].values) for name in given]
    return all((step >= 0).all() or (step <= 0).all() for step in steps)


def _usual_at_states(dataset: Data, names: Sequence[str]) -> Sequence[str]:
    """Return the tractions and heat fluxes among the names; without any the first names."""
    return ([name for name in names if unit(dataset[name]) in UNITS_AT_STATES] or names)[:MOST_PANELS_AT_STATES]


def first_shown(dataset: Data, panels: Sequence[Panel], over: str = "time") -> float | None:
    """Return the time at which a logarithmic axis begins; None if a linear one is sufficient, or it is not of time."""
    if over != "time":
        return None
    times = dataset["time"].values
    # Fluxes follow from changes of states: their initial values are no reason for a logarithmic axis.
    names = [name for panel in panels if panel.unit != FLUX for name in panel.names if name in dataset]
    moments = np.array([t for t, _ in _event_times(dataset)])
    late = int(np.sum(moments > times[-1] / 10))
    crowded = late >= MOST_IN_LAST_DECADE and 2 * late > len(moments) and not wants_log_axis(times)
    if crowded or not wants_log_axis(times, [dataset[name].values for name in names]):
        return None
    return float(max(times[times > 0][0], LOG_AXIS_PART * times[-1]))


def curves(dataset: Data, over: str = "time") -> list[str]:
    """Return the names of numbers that are functions of time, or of another dimension, only."""
    return [name for name in dataset if dataset[name].dims == (over,) and dataset[name].kind == "f"]


def of_kind(dataset: Data, names: Sequence[str], units: str, pattern: str) -> list[str]:
    """Return the names that a panel of the default figure shows; modes are shown as bands, exact values dashed."""
    fitting = [name for name in names if re.fullmatch(units, unit(dataset[name])) and re.fullmatch(pattern, name)]
    return [name for name in fitting if not (name.endswith("_exact") or style.is_mode(dataset[name]))]


def panels(dataset: Data, variables: Sequence[str] | None, against: str | None) -> list[Panel]:
    """Return panels of the variables by unit, or of all that vary by kind, without the variable of the axis."""
    known = curves(dataset)
    asked = (*(variables or ()), *filter(None, [against]))
    refuse_unknown(asked, known, "no variable '{}' over time in the dataset", style.place_of(dataset))
    shown, found = [name for name in dict.fromkeys(variables or known) if name != against], []
    if not variables:
        return _by_kind(dataset, shown)
    for wanted in dict.fromkeys(unit(dataset[name]) for name in shown):
        group = [name for name in shown if unit(dataset[name]) == wanted]
        title = meaning(dataset[group[0]]) if len(group) == 1 else ""
        found.append(Panel(title if len(title) < MOST_TITLE_LETTERS else "", wanted, group))
    return found


def _by_kind(dataset: Data, known: Sequence[str]) -> list[Panel]:
    panels = []
    for title, units, pattern in PANELS:
        names = of_kind(dataset, known, units, pattern)
        if title == "Heat flux" and {"q_1", "q_2"} & set(names):
            names = [name for name in names if name in ("q_1", "q_2")]
        elif title == "Bonding" and any(name.startswith("theta_") for name in names):
            title = "Coverage"
        # A quantity below the last digit of another one of its unit is rounding.
        sizes = {
            name: style.largest(dataset[name].values) for name in known if re.fullmatch(units, unit(dataset[name]))
        }
        felt = EPS * max(sizes.values(), default=0.0)
        if any(varies(dataset[name].values) and sizes[name] > felt for name in names):
            panels.append(Panel(title, unit(dataset[names[0]]), names))
    return panels


def _across(dataset: Data, names: Sequence[str]) -> Figure:
    """Draw temperatures across bodies at several times, with the contact in the middle."""
    for name in names:
        if not PROFILE.fullmatch(name) or name not in dataset:
            raise InputError(f"{name} goes over time, a profile over places; show them in figures of their own.")
    shown = style.evenly_spread(dataset.sizes["time"], PROFILE_TIMES)
    times, shown_unit = dataset["time"].values, style.unit_text(unit(dataset[names[0]]))
    with style.panels(6.4, 3.4) as (plot, ((ax,),)):
        for j, i in enumerate(shown):
            colour = matplotlib.colormaps["viridis"](j / max(len(shown) - 1, 1) * 0.9)
            for name in names:
                side = -1e3 if name == "profile_1" else 1e3  # [mm]
                label = f"{times[i]:.3g} s" if name == names[0] else None
                ax.plot(side * dataset[f"x_{name[-1]}"].values, dataset[name].values[i], color=colour, label=label)
        ax.set(xlabel="Distance from the contact [mm], body 1 to the left", ylabel=f"Temperature [{shown_unit}]")
        style.legend(ax)
        style.headings(plot, ax, dataset)
    return plot


def _draw(ax: Axes, dataset: Data, panel: Panel, over: str, first: float | None) -> None:
    """Draw the curves of a panel, with the unit that suits their visible part from ``first`` on."""
    t = dataset[over].values
    _draw_curves(ax, dataset, panel, over)
    start = first or 0.0
    if first is None and over == "time" and panel.unit == FLUX:
        start = _show_behind_spike(ax, dataset, panel)
    drawn = _finite_values(dataset, panel, t >= start if start else slice(None))
    words = panel.title or ", ".join(map(symbol, panel.names[:MOST_NAMES]))
    between, error = " " if len(panel.title) < ONE_LINE_LETTERS else "\n", style.error_of(dataset, panel.names)
    style.label(ax.yaxis, words, panel.unit, drawn, between, error)
    style.legend(ax)


def _finite_values(dataset: Data, panel: Panel, rows: Any = slice(None)) -> Array:
    """Return the finite values that a panel shows, at some of its points."""
    values = np.concatenate([dataset[name].values[rows] for name in panel.names])
    return np.asarray(values[np.isfinite(values)])


def _show_behind_spike(ax: Axes, dataset: Data, panel: Panel) -> float:
    """Limit a panel of fluxes to their range after an initial spike that would hide all else, and note the size of the
    spike; return the time at which that range begins, 0 without a spike.
    """
    t = dataset["time"].values
    start = float(EARLY_PART * t[-1])
    whole, late = _finite_values(dataset, panel), _finite_values(dataset, panel, t >= start)
    if not (late.size and np.ptp(whole) > SPIKE_RATIO * np.ptp(late) > 0):
        return 0.0
    margin, largest = 0.1 * np.ptp(late), style.largest(whole)
    ax.set_ylim(late.min() - margin, late.max() + margin)
    text, size = style.prefixed(panel.unit, np.array([largest]))
    told = f"{largest / size:.2g} {text} at the start"
    ax.annotate(told, (0.98, 0.95), xycoords="axes fraction", va="top", ha="right", color="0.4", fontsize=8)
    return start


def _draw_curves(ax: Axes, dataset: Data, panel: Panel, over: str) -> None:
    """Draw the curves of a panel, and the exact ones; of many the largest in colours and the rest in grey."""
    groups, marker = group_coinciding(dataset, panel.names), "o" if dataset.sizes["time"] == 1 else ""
    rest: list[list[str]] = []
    if len(groups) > len(style.COLOURS):
        # Curves of traces cannot be distinguished next to large ones and need no colours.
        groups.sort(key=lambda names: -style.largest(dataset[names[0]].values))
        groups, rest = groups[:MOST_COLOURED], groups[MOST_COLOURED:]
    for names in groups:
        label = " = ".join([*map(symbol, names[:MOST_NAMES]), *(["..."] if len(names) > MOST_NAMES else [])])
        drawstyle = style.drawn_as(dataset[names[0]])
        style.draw_curve(ax, dataset, over, dataset[names[0]].values, label=label, marker=marker, drawstyle=drawstyle)
    for k, names in enumerate(rest):
        label = "_" if k else f"{len(rest)} smaller"
        kw = {"label": label, "marker": marker, "color": "0.75", "linewidth": 0.8, "zorder": 1}
        style.draw_curve(ax, dataset, over, dataset[names[0]].values, **kw)
    known = curves(dataset, *dataset.variables[over].dims)
    exact = [f"{name}_exact" for name in panel.names if f"{name}_exact" in known]
    for k, name in enumerate(exact):
        kw = {"label": "_" if k else "exact", "linestyle": DASHES, "color": "black", "linewidth": 0.9}
        style.draw_curve(ax, dataset, over, dataset[name].values, **kw)


def group_coinciding(dataset: Data, names: Sequence[str]) -> list[list[str]]:
    """Group names whose curves coincide, so that none hides another."""
    groups: list[tuple[Array, list[str]]] = []
    for name in names:
        values = dataset[name].values
        twin = next((g for first, g in groups if np.allclose(first, values, rtol=style.FLAT, atol=0.0)), None)
        if twin is None:
            groups.append((values, [name]))
        else:
            twin.append(name)
    return [group for _, group in groups]


def _draw_balances(ax: Axes, dataset: Data) -> None:
    """Draw residuals, scaled such that the largest is the relative value in their attributes."""
    known = curves(dataset)
    for name in (name for name in RESIDUALS if name in known):
        relative, largest = np.abs(dataset[name].values), style.attribute(dataset, RESIDUALS[name])
        worst = float(np.max(relative, initial=0.0))
        relative = relative / worst * largest if worst > 0 and largest is not None else relative
        ax.plot(dataset["time"].values, np.maximum(relative, LEAST_DRAWN), label=name.partition("_")[0], linewidth=1.2)
    style.make_logarithmic(ax.yaxis)
    low, high = ax.get_ylim()
    ax.set(ylim=(min(low, LEAST_DRAWN), max(high, RUN_EPS)), ylabel="Balance residual [1]")
    style.legend(ax)


def _draw_axis(axes: Sequence[Axes], dataset: Data, against: str | None, first: float | None) -> tuple[float, str]:
    """Draw the shared axis with bands of modes and lines at events: a variable, or time, logarithmic from ``first`` on.

    Return the height in points that names need above the panels, and a text on the events that have none there.
    """
    times, moments = dataset["time"].values, _event_times(dataset)
    if against:
        style.label_variable(axes[-1].xaxis, dataset[against])
        return 0.0, _most_frequent([name for _, name in _named_events(moments)], {})
    label_time(axes, times, "s", first)
    stages = _draw_bands(axes, dataset) if len(times) > 1 else []
    width = float(axes[0].figure.bbox.width / axes[0].figure.dpi)
    below = _write_rows(axes[0], width, stages, 0)
    rows, more = _draw_events(axes, width, moments, below)
    return NAME_ROW_HEIGHT * (below + rows), more


def label_time(axes: Sequence[Axes], times: Array, unit: str, first: float | None) -> None:
    """Label the shared axis of time; with ``first`` it is logarithmic from there on, and earlier values are ignored."""
    if first is None:
        style.label(axes[-1].xaxis, "Time", unit, times)
        return
    axes[-1].set_xlabel("Time [s]")
    for ax in axes:
        drawn = [np.asarray(line.get_ydata())[np.asarray(line.get_xdata()) >= first] for line in ax.get_lines()]
        seen = np.concatenate([values[np.isfinite(values)] for values in drawn])
        if ax.get_yscale() == "linear" and varies(seen):
            margin = 0.05 * np.ptp(seen)
            ax.set_ylim(seen.min() - margin, seen.max() + margin)
        style.make_logarithmic(ax.xaxis)
        ax.set_xlim(first, float(times.max()))


def _event_times(dataset: Data) -> list[tuple[float, str]]:
    """Return times and names of the events; the reason replaces the name if that is the variable that passes zero."""
    if "event_time" not in dataset:
        return []
    named = {name: ("event",) for name in ("event_name", "event_reason") if name in dataset}
    style.check_variables(dataset, {"event_time": ("event",)}, named)
    texts = [dataset[name].values.astype(str).tolist() for name in named] or [[""] * dataset.sizes["event"]]
    quantities = [name for name in curves(dataset) if not style.is_mode(dataset[name])]
    events = zip(dataset["event_time"].values.tolist(), texts[0], texts[-1], strict=True)
    return [(t, why if name.partition(" ")[0] in quantities else name) for t, name, why in events]


def _named_events(moments: Sequence[tuple[float, str]]) -> list[tuple[float, str]]:
    """Return times and names of the events that have a name; ends of stages are shown as bands."""
    return [(t, name) for t, name in moments if name and not name.startswith("end of ")]


def _draw_events(
    axes: Sequence[Axes], width: float, moments: Sequence[tuple[float, str]], below: int
) -> tuple[int, str]:
    """Draw thin vertical lines at the events, one for several that are close; return the rows of names above the
    panels, and a text on the events that have none there.
    """
    named = _named_events(moments)
    places = _merge_close_events(axes[0], named)
    if len(places) > MOST_EVENT_LINES:
        return 0, _most_frequent([name for _, name in named], {})
    names = Counter(text for _, text in places)
    repeat = 1 < len(names) < names.total()
    lines = dict(zip([name for name, _ in names.most_common()], EVENT_LINE_STYLES, strict=False)) if repeat else {}
    ends = _merge_close_events(axes[0], [(t, "") for t, _ in moments if t not in dict(named)])
    for (moment, text), ax in product([*places, *ends], axes):
        ax.axvline(moment, color="black", linewidth=0.6, linestyle=lines.get(text, EVENT_LINE_STYLES[0]))
    if len(names) == 1 and len(places) > 1:
        return _numbered(axes[0], width, places, below)
    rows = _write_rows(axes[0], width, places, below) if len(places) <= MOST_NAMED_EVENTS else 0
    return rows, "" if rows else _most_frequent([name for _, name in named], lines)


def _merge_close_events(ax: Axes, events: Sequence[tuple[float, str]]) -> list[tuple[float, str]]:
    """Return times and names of events; those that a figure cannot separate, a slip and its stop say, are merged."""
    found: list[tuple[float, list[str]]] = []
    last = -np.inf
    for t, at, name in _positions_across_panel(ax, events):
        if at - last > EVENT_SPACING:
            found.append((t, []))
            last = at
        if name not in found[-1][1]:
            found[-1][1].append(name)
    return [(t, " and ".join(names)) for t, names in found]


def _positions_across_panel(ax: Axes, items: Sequence[tuple[float, str]]) -> list[tuple[float, float, str]]:
    """Return values of x, their positions from 0 at the left to 1 at the right of a panel, and their texts, sorted."""
    ax.get_xlim()  # this call computes the limits from the drawn curves
    items = sorted(items)
    points = np.array([(x, 0.0) for x, _ in items]).reshape(-1, 2)
    places = (ax.transScale + ax.transLimits).transform(points)[:, 0].tolist()
    return [(x, place, text) for (x, text), place in zip(items, places, strict=True)]


def _numbered(ax: Axes, width: float, places: Sequence[tuple[float, str]], below: int) -> tuple[int, str]:
    """Write names above the panels if they fit side by side, else numbers with a text on the name that all share."""
    text = places[0][1]
    if rows := _write_rows(ax, width, places, below, lanes=1):
        return rows, ""
    rows = _write_rows(ax, width, [(t, str(k)) for k, (t, _) in enumerate(places, 1)], below, lanes=1)
    return rows, f"1 to {len(places)}: {text}" if rows else f"{len(places)} {text}"


def _most_frequent(names: Sequence[str], lines: Mapping[str, str]) -> str:
    """Describe the counts of the most frequent events, and their line styles."""
    counts = Counter(names).most_common(MOST_NAMES)
    kinds = {name: f" ({line})" for name, line in lines.items()}
    return ", ".join(f"{f'{count} ' if count > 1 else ''}{name}{kinds.get(name, '')}" for name, count in counts)


def _draw_bands(axes: Sequence[Axes], dataset: Data) -> list[tuple[float, str]]:
    """Draw bands: every other stage of a programme, with middles and names of all as the result; else the times in
    which a mode differs from its initial value.
    """
    modes = [name for name in curves(dataset) if style.is_mode(dataset[name])]
    staged, named = "stage" in modes, []
    for name in ["stage"] if staged else modes:
        spans = _mode_spans(dataset, name)
        shaded = [span for span in spans if (span[2] % 2 if staged else span[2] != spans[0][2])]
        for (start, end, _), ax in product(shaded if len(shaded) <= MOST_EVENT_LINES else (), axes):
            ax.axvspan(start, end, color="black", alpha=0.05, linewidth=0)
        words = dict(re.findall(r"(-?\d+): ([^,)]+)", str(dataset[name].attrs["long_name"])))
        named += [((start + end) / 2, words.get(f"{value:.0f}", "")) for start, end, value in spans if staged]
    return named


def _mode_spans(dataset: Data, name: str) -> list[tuple[float, float, float]]:
    """Return start, end and value of a mode between events; changes between two outputs are too brief to be visible."""
    times, values = dataset["time"].values, dataset[name].values.astype(float)
    known = dataset["event_time"].values if "event_time" in dataset else np.empty(0)
    changes = [j for j in range(1, len(values)) if values[j] != values[j - 1]]
    edges = [float(times[0])]
    for j in changes:
        inside = known[(known >= times[j - 1]) & (known <= times[j])]
        edges.append(float(inside[-1] if len(inside) else times[j]))
    return list(zip(edges, [*edges[1:], float(times[-1])], values[[0, *changes]].tolist(), strict=True))


def _write_rows(ax: Axes, width: float, items: Sequence[tuple[float, str]], below: int, lanes: int = NAME_ROWS) -> int:
    """Write small texts above a panel, each over its time, in rows without overlap; return the number of rows. Nothing
    is written if there is no room for all.
    """
    placed: list[tuple[float, int, str]] = []
    ends = [0.0] * lanes
    letter = LETTER_INCHES / (width - SIDE_WIDTH)
    for _, at, text in _positions_across_panel(ax, items):
        half = letter * len(text) / 2
        middle = min(max(at, half), 1 - half)
        lane = next((k for k, end in enumerate(ends) if middle - half >= end), None)
        if lane is None:
            return 0
        ends[lane] = middle + half + NAME_SPACING
        placed.append((middle, lane, text))
    for middle, lane, text in placed:
        above = (0, NAME_ROW_HEIGHT * (below + lane) + 2)
        ax.annotate(
            text, (middle, 1.0), above, "axes fraction", "offset points", ha="center", va="bottom", fontsize=7,
            color="#555555",
        )  # fmt: skip
    return 1 + max((lane for _, lane, _ in placed), default=-1)


def wants_log_axis(times: Array, quantities: Sequence[Array] = ()) -> bool:
    """True for times that need a logarithmic axis: they have a constant ratio, or span decades and quantities change
    much in a part too short to be visible.

    >>> t = np.append(0.0, np.logspace(-6, 2, 50))
    >>> wants_log_axis(t), wants_log_axis(np.linspace(0, 5, 100_001))
    (True, False)
    >>> t = np.append(t, np.linspace(1, 90, 10))
    >>> wants_log_axis(np.sort(t), [np.exp(-np.sort(t))]), wants_log_axis(np.sort(t), [np.exp(-1000 * np.sort(t))])
    (False, True)
    """
    after = times[times > 0]
    if len(after) < 2 or after[-1] / after[0] <= LOG_AXIS_RATIO:
        return False
    ratios = after[1:] / after[:-1]
    if np.ptp(ratios) < style.FLAT * ratios[0]:
        return True
    # A jump at the start of the run, such as that of the direction of friction, needs no logarithmic axis.
    early = (times > 0) & (times <= EARLY_PART * times[-1])
    return any(np.ptp(values[early]) > EARLY_CHANGE * np.ptp(values) for values in quantities if varies(values))
