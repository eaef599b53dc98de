"""Style of all figures: colours, symbols and units as text, headings, and checks of datasets to be drawn."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from matplotlib.ticker import Formatter, LogFormatterSciNotation, LogLocator
from numpy.typing import NDArray

from surfacechem.contracts.units import ZERO_CELSIUS
from surfacechem.errors import InputError, Place, expect
from surfacechem.quantities import GREEK, SUPERSCRIPTS, VARIABLES, raised, spelled
from surfacechem.results.netcdf import Data, DataVariable, read_netcdf, reading, replacing
from surfacechem.tolerances import RUN_EPS

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

# The palette of Okabe and Ito, whose colours colour-blind readers can distinguish.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f")

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

# A curve that changes by less than this part of its size, 9e-10, is constant: the change may be rounding.
FLAT = 1000 * RUN_EPS

# An axis of a constant spans this part of it on each side.
CONSTANT_PART = 0.05

# Units that take a prefix, and the range of the largest value in which they need none.
TAKES_PREFIX = ("J", "N", "Pa", "W", "m", "s")
WITHOUT_PREFIX = (0.1, 1e3)

PREFIXES = {-5: "f", -4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G", 4: "T"}

TITLE_STYLE: Any = {"x": 0.01, "ha": "left", "fontsize": 11, "fontweight": "bold", "parse_math": False}
NOTE_STYLE: Any = {"fontsize": 8, "color": "#555555"}
"""Style of the title of a figure, and of a note above its panels."""

LETTERS_PER_INCH, TITLE_PER_INCH = 16, 9.5
"""Letters per inch: of the notes above the panels, and of the title and the labels of axes."""

POWERS = (-4, 5)
"""Range of the exponent of the largest value of an axis in which its ticks need no power of ten."""

MOST_TICKED_RATIO = 1e5
"""Largest ratio of the ends of a logarithmic axis that has ticks inside its decades."""

MOST_CURVES = 7
"""Largest number of values of a parameter that are drawn as separate curves: the number of colours."""


TOGETHER = "together"
"""Attribute of a sweep with words for the parameters that change together with the one of the axis."""

DOTS = 160
"""Dots per inch of pictures."""

COLUMN_WIDTH = ContextVar("widest", default=6.4)
"""Width of a figure of one column [inch]."""

PHONE_WIDTH = 4.4
"""Width [inch] of a figure that is readable on a phone."""


class Plot(Figure):
    """A figure that notebooks display."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        save(self, buffer, "png")
        return buffer.getvalue()


@contextmanager
def panels(width: float, height: float, rows: int = 1, columns: int = 1, **sharing: Any) -> Iterator[tuple[Plot, Any]]:
    """Open a figure of this size [inch] with axes of shape (rows, columns), in the style of this package."""
    width = min(width, COLUMN_WIDTH.get()) if columns == 1 else width
    with matplotlib.rc_context(STYLE):
        plot = Plot(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(plot)
        yield plot, plot.subplots(rows, columns, squeeze=False, **sharing)


@contextmanager
def narrow() -> Iterator[None]:
    """Draw narrow figures inside this context, for a page on a phone."""
    usual = COLUMN_WIDTH.set(PHONE_WIDTH)
    try:
        yield
    finally:
        COLUMN_WIDTH.reset(usual)


def save(plot: Figure, target: Any, kind: str) -> None:
    """Write a figure as png, svg or pdf; equal figures give equal bytes."""
    metadata: Mapping[str, None] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
    usual, canvas = plot.dpi, plot.canvas
    with matplotlib.rc_context(STYLE):
        plot.dpi = DOTS
        printer: Any = get_registered_canvas_class(kind)(plot)
        getattr(printer, f"print_{kind}")(target, metadata=metadata)  # `savefig` draws twice
        plot.dpi, plot.canvas = usual, canvas


def write(plot: Figure, target: Path) -> None:
    """Save a figure in the format given by the suffix; the file is written whole or not at all."""
    with replacing(target) as temporary:
        save(plot, temporary, target.suffix.lower().removeprefix("."))


def opened(data: Data | xarray.Dataset | str | Path) -> Data:
    """Return a dataset, read from its netCDF file or its store if need be; InputError if the file is none."""
    if isinstance(data, Data):
        return data
    if not isinstance(data, str | Path):
        expect(data, Mapping, "a figure shows a dataset or the path of its file")
        return Data.of(data)
    path = Path(data)
    if path.suffix == ".zarr":
        from surfacechem.results import store

        return Data.of(store.opened(path))
    return reading(path, lambda: read_netcdf(path))


def in_celsius(dataset: Data) -> Data:
    """Return the dataset with its temperatures in degrees Celsius."""
    found = {
        name: replace(each, source=each.values - float(ZERO_CELSIUS), attrs={**each.attrs, "units": "degC"})
        for name, each in dataset.variables.items()
        if each.attrs.get("units") == "K"
    }
    return replace(dataset, variables={**dataset.variables, **found})


def check_variables(
    dataset: Data, numbers: Mapping[str, tuple[str, ...]], texts: Mapping[str, tuple[str, ...]] | None = None
) -> None:
    """Raise InputError if variables to be drawn are missing, or are not numbers in double precision, or texts, over
    these dimensions, as surfacechem writes them.
    """
    for name, dimensions in {**numbers, **(texts or {})}.items():
        if name not in dataset.variables:
            raise InputError(f"has no variable '{name}', as datasets of surfacechem have.", place_of(dataset))
        if dataset[name].dims != dimensions:
            raise InputError(f"{name} does not go over {' and '.join(dimensions)}.", place_of(dataset))
        if name in numbers and dataset[name].kind != "f":
            raise InputError(f"{name} does not hold numbers in double precision.", place_of(dataset))


def evenly_spread(count: int, most: int) -> list[int]:
    """Return at most ``most`` of the numbers below ``count``, evenly spread.

    >>> evenly_spread(100, 4), evenly_spread(3, 7)
    ([0, 33, 66, 99], [0, 1, 2])
    """
    chosen: list[int] = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int)).tolist()
    return chosen


def attribute(dataset: Data, name: str) -> float | None:
    """Return the value of a global attribute; None if there is none."""
    value = dataset.attrs.get(name)
    if value is not None and not isinstance(value, (float, int, np.number)):
        raise InputError(f"the attribute '{name}' is no number.", place_of(dataset))
    return None if value is None else float(value)


def place_of(dataset: Data) -> Place | None:
    """Return the file of a dataset."""
    return Place(dataset.file) if dataset.file else None


def headings(plot: Figure, ax: Axes, dataset: Data, above: float = 0.0, more: str = "") -> None:
    """Write title, end, error, solver and the note ``more``, ``above`` points above the axes."""
    attributes = dataset.attrs
    title = wrap(str(attributes.get("title", "")), int(TITLE_PER_INCH * plot.get_figwidth())) or [""]
    plot.suptitle("\n".join(title), **TITLE_STYLE)
    facts = [str(attributes.get(TOGETHER, "")), str(attributes.get("reason", "")) or _ends(dataset)]
    if (error := error_of(dataset)) is not None:
        exact = str(attributes.get("error_source", "")).startswith("exact")
        exact = exact or any(name.endswith("_exact") for name in dataset)
        kind = "of the checked runs" if "checked_error" in dataset else "(exact solution)" if exact else "(estimate)"
        facts.append("error unknown" if np.isnan(error) else f"error {error:.1e} {kind}")
    if "solver" in attributes and (rtol := attribute(dataset, "rtol")) is not None:
        facts.append(f"{attributes['solver']}, rtol {rtol:g}")
    if "time" in dataset.sizes and dataset.sizes.get("event", 0) > dataset.sizes["time"]:
        facts.append(f"{dataset.sizes['event']} events between {dataset.sizes['time']} outputs")
    place = ax.get_subplotspec()
    columns = place.get_gridspec().ncols if place else 1
    # With several columns the middle of a line over the first one has to be within it, else the layout shifts them.
    room = int(LETTERS_PER_INCH * (plot.get_figwidth() - 0.8) * min(1.0, 2 / columns))
    lines = _wrapped([*facts, more], room)
    more_lines = above + 10 * (len(lines) - 1) + 14 * (len(title) - 1)
    plot.set_figheight(plot.get_figheight() + more_lines / 72)  # the panels keep their height
    ax.set_title("\n".join(lines), loc="left", pad=6 + above, **NOTE_STYLE)


def error_of(dataset: Data, names: Sequence[str] = ()) -> float | None:
    """Return the largest relative error of variables that have one of their own, else that of the dataset, of a store
    that of its checked runs; None if none is told.

    Where a store keeps extremes its error is theirs, far more than that of other variables.
    """
    own = [float(dataset[n].attrs["error"]) for n in names if n in dataset and "error" in dataset[n].attrs]
    extremes = {name for name in dataset if name.endswith(("_max", "_min"))}
    if not own and "checked_error" in dataset and not (names and extremes and extremes.isdisjoint(names)):
        own = [*dataset["checked_error"].values, *dataset["hardest_error"].values]
    return float(np.fmax.reduce(own)) if own else attribute(dataset, "error")


def limit_zoom(set_ends: Callable[[float, float], Any], values: Array, error: float | None) -> None:
    """Set the ends of an axis such that it does not magnify rounding, or what is within the relative error; one that is
    not below 1 says nothing of what is seen.
    """
    known = error if error is not None and error < 1.0 else 0.0
    finite, half = values[np.isfinite(values)], known * largest(values)
    if not len(finite):
        return
    middle = float(finite.min() + finite.max()) / 2
    if not varies(finite):
        half = CONSTANT_PART * abs(middle or 1.0)
    if np.ptp(finite) < 2 * half:
        set_ends(middle - half, middle + half)


WITHOUT_END, STOPPED = ("failed", "refused"), "stopped"
"""Statuses of runs whose last values are no final values, and of runs that ended early."""

STATUS_MARKERS = dict(zip((*WITHOUT_END, STOPPED), "xds", strict=True))
"""Markers of these statuses."""


def _ends(dataset: Data) -> str:
    """Describe the numbers of runs of a store by status; '' if the dataset is no store."""
    words = str(dataset["status"].attrs.get("flag_meanings", "")).split() if "status" in dataset else []
    counts = {word: int(np.count_nonzero(dataset["status"].values == code)) for code, word in enumerate(words)}
    counts |= {"missing": dataset["status"].values.size - sum(counts.values())} if words else {}
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


def has_no_end(dataset: Data, *words: str) -> NDArray[np.bool_]:
    """Return the mask of runs of a sweep with one of these statuses, which a store has as codes."""
    status = dataset["status"]
    codes = str(status.attrs.get("flag_meanings", "")).split()
    return np.isin(status.values, [codes.index(word) if codes else word for word in words])


def mark_without_end(axes: Sequence[Axes], dataset: Data) -> None:
    """Mark failed, refused and stopped runs on the axis of the swept parameter, which then spans the whole sweep."""
    x = dataset[dataset["status"].dims[0]].values
    for word in STATUS_MARKERS:
        found = has_no_end(dataset, word)
        where = found & ~(found.all() and word == STOPPED)
        mark(axes, x[where.reshape(len(x), -1).any(axis=1)], word)


def mark(axes: Sequence[Axes], x: NDArray[np.float64], word: str) -> None:
    """Mark points with one of these statuses on the axis, with a legend, if there are any."""
    for k, ax in enumerate(axes if len(x) else ()):
        kw: Any = {"color": "0.4", "markerfacecolor": "white", "clip_on": False, "zorder": 3}
        across, label = ax.get_xaxis_transform(), "_" if k else word
        ax.plot(x, np.zeros(len(x)), STATUS_MARKERS[word], markersize=5, transform=across, label=label, **kw)
        legend(ax)


MARKER_SIZE, MARKER_SPACING = 3.5, 2
"""Diameter of the markers of runs [points], and number of them that has to fit between two."""


def marker(ax: Axes, count: int) -> str:
    """Return a marker for points so sparse that a line alone would suggest a curve known everywhere; else ''."""
    whole = ax.get_figure(root=True)
    assert whole is not None
    return "o" if count * MARKER_SIZE * (1 + MARKER_SPACING) <= 72 * whole.get_figwidth() else ""


def _wrapped(facts: Sequence[str], room: int) -> list[str]:
    """Return facts in lines of ``room`` letters; only a fact longer than a line is broken itself."""
    lines: list[str] = []
    for fact in filter(None, facts):
        if lines and len(lines[-1]) + 3 + len(fact) <= room:
            lines[-1] += f"   {fact}"
        else:
            lines += wrap(fact, room)
    return lines


def legend(ax: Axes) -> None:
    """Draw the legend next to the axes."""
    _, labels = ax.get_legend_handles_labels()
    if labels:
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), borderaxespad=0.4, handlelength=1.6)


def meaning(values: DataVariable) -> str:
    """Return the meaning of a variable: its long name without details.

    >>> meaning(DataVariable("phi", (), 0.0, {"long_name": "state of bonds: 1 is bonded"}))
    'State of bonds'
    """
    text = re.split(r":| \(-?\d+:", str(values.attrs.get("long_name", values.name)))[0]
    return text[:1].upper() + text[1:]


def quantity_words(values: DataVariable) -> str:
    """Return the symbol of a variable, or words for a time to a value or an event."""
    name = values.name
    if not name.startswith("time_"):
        return symbol(name)
    words = str(values.attrs.get("long_name", name)) if name.startswith("time_to_") else name.replace("_", " ")
    return words[:1].upper() + words[1:]


def is_mode(values: DataVariable) -> bool:
    """True for a mode of the automaton, according to the long name of a variable."""
    return str(values.attrs.get("long_name", "")).startswith("mode (")


def drawn_as(values: DataVariable) -> Any:
    """Return the draw style of a variable between outputs: a step for a mode."""
    return "steps-post" if is_mode(values) else "default"


def draw_curve(ax: Axes, dataset: Data, over: str, values: Array, **look: Any) -> None:
    """Draw values over a variable, dotted where they jump between two outputs at the same time, or with the jump of
    an event between them: a jump has no values in between.
    """
    x, times = dataset.variables[over].values, dataset[dataset.variables[over].dims[0]].values
    leaps = np.abs(np.diff(times)) <= FLAT * np.abs(times[1:])
    if "event_verdict" in dataset and dataset["event_verdict"].dims == ("event",):
        check_variables(dataset, {"event_time": ("event",)})
        moments = dataset["event_time"].values[dataset["event_verdict"].values != ""]
        before = np.searchsorted(times[:-1], moments[(moments >= times[0]) & (moments < times[-1])], side="right") - 1
        leaps[before] |= ~np.append(False, leaps)[before]  # unless the output is the other side of the event
    jumps = 1 + np.flatnonzero(leaps & (values[1:] != values[:-1]))
    (line,) = ax.plot(np.insert(x, jumps, np.nan), np.insert(values, jumps, np.nan), **look)
    if len(jumps):
        sides = np.full(len(x), np.nan)
        sides[[*jumps - 1, *jumps]] = values[[*jumps - 1, *jumps]]
        ax.plot(x, sides, ":", color=line.get_color(), linewidth=0.9, zorder=line.get_zorder() - 0.1)


def unit(values: DataVariable) -> str:
    """Return the unit of a variable in the notation of the CF conventions."""
    return str(values.attrs.get("units", "1"))


def symbol(name: str) -> str:
    r"""Return a variable's name as mathematics.

    >>> symbol("T_1"), symbol("phi")
    ('$T_{1}$', '$\\phi$')
    """
    return f"${spelled(name)}$"


def unit_text(unit: str) -> str:
    """Return a CF unit with superscript powers.

    >>> unit_text("W m-2 K-1")
    'W m⁻² K⁻¹'
    """
    return re.sub(r"(?<=[A-Za-z])-?\d+", lambda m: m[0].translate(SUPERSCRIPTS), unit).replace("degC", "°C")


def prefixed(unit: str, values: Array) -> tuple[str, float]:
    """Return the unit with the prefix that suits the largest of the values, as text, and its size.

    >>> prefixed("Pa", np.array([0.0, 3e6])), prefixed("m s-1", np.array([-2e-8])), prefixed("K", np.array([3e4]))
    (('MPa', 1000000.0), ('nm s⁻¹', 1e-09), ('K', 1.0))
    """
    size = largest(values)
    if unit.partition(" ")[0] not in TAKES_PREFIX or size == 0 or WITHOUT_PREFIX[0] <= size < WITHOUT_PREFIX[1]:
        return unit_text(unit), 1.0
    most = 0 if unit == "s" else max(PREFIXES)
    thousands = min(max(math.floor(math.log10(size) / 3), min(PREFIXES)), most)
    return PREFIXES[thousands] + unit_text(unit), 10.0 ** (3 * thousands)


def largest(values: Array) -> float:
    """Return the largest magnitude of the finite values; 0 if there are none."""
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))


def over_decades(values: Array) -> bool:
    """True for values of a parameter that need a logarithmic axis: positive, over decades and not evenly spaced.

    >>> over_decades(np.array([1e-12, 1e-10, 1e-9])), over_decades(np.linspace(1, 1e4, 9))
    (True, False)
    """
    if len(values) < 3 or values.min() <= 0 or values.max() < 100 * values.min():
        return False
    steps = np.diff(values)
    return bool(np.ptp(steps) > FLAT * np.max(np.abs(steps)))


def draw_parameter(axis: XAxis | YAxis, values: DataVariable, decades: bool | None = None) -> None:
    """Label the axis of a swept parameter with its meaning, or its name if that says more, and unit; logarithmic if the
    values need it, or if ``decades`` is True.
    """
    whole, place = axis.axes.get_figure(root=True), axis.axes.get_subplotspec()
    assert whole is not None
    assert place is not None
    rows, columns = place.get_gridspec().get_geometry()
    room = whole.get_figwidth() / columns if isinstance(axis, XAxis) else whole.get_figheight() / rows
    lines = wrap(parameter_words(values), int(TITLE_PER_INCH * room), break_on_hyphens=False, break_long_words=False)
    words = "\n".join(lines)
    if not (over_decades(values.values) if decades is None else decades):
        label(axis, words, unit(values), values.values)
        return
    text, size = prefixed(unit(values), _middle_of_decades(values.values))
    axis.set_label_text(f"{words} [{text}]")
    make_logarithmic(axis, size=size)


def _middle_of_decades(values: Array) -> Array:
    """Return the geometric middle of the values, by which their prefix is chosen: by the largest, 100 pN/s might be 0.1
    nN/s.
    """
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    return np.sqrt(sizes.min(keepdims=True) * sizes.max(keepdims=True)) if len(sizes) else np.zeros(1)


def parameter_words(values: DataVariable) -> str:
    """Return words for a swept parameter, with its owner.

    >>> said = {"long_name": "rate of change (loading.f.ramp.rate)", "units": "N s-1"}
    >>> parameter_words(DataVariable("rate", (), 1e-9, said))
    'Loading rate of $f$'
    >>> parameter_words(DataVariable("loading_f", (), 1e-9, {"long_name": "value (loading.f.level)"}))
    'Force per bond $f$'
    >>> parameter_words(DataVariable("rate", (), 1e-3, {"long_name": "rate (loading.w_t.ramp.rate)"}))
    'Rate of change of $w_{t}$'
    """
    load = re.search(r"\(loading\.(\w+)\.[\w.-]*rate\)$", str(values.attrs.get("long_name", "")))
    if load:
        kind = "Loading rate" if unit(values).startswith(("N", "Pa")) else "Rate of change"
        return f"{kind} of {symbol(load[1])}"
    words = re.split(r" \(|; ", meaning(values))[0]
    held = re.search(r"\(loading\.(\w+)(\.level)?\)$", str(values.attrs.get("long_name", "")))
    if held and held[1] in VARIABLES:
        text = VARIABLES[held[1]].long_name.partition(",")[0]
        return f"{text[:1].upper()}{text[1:]} {symbol(held[1])}"
    return (values.name.replace("_", " ") if words == "Value" else words) + owner(values)


def owner(values: DataVariable) -> str:
    """Return the owner of a swept parameter, by the path at the end of its long name; '' if its own name contains it.

    >>> owner(DataVariable("C", (), 1.0, {"long_name": "heat capacity per area (bodies.upper.C)"}))
    ' (upper)'
    """
    path = str(values.attrs.get("long_name", "")).rpartition("(")[2].removesuffix(")").split(".")
    return f" ({path[-2]})" if len(path) > 2 and path[-1] == values.name else ""


def parameter_name(name: str) -> str:
    r"""Return the name of a swept parameter: a symbol with its subscript, or words.

    >>> parameter_name("K_0"), parameter_name("mu"), parameter_name("bond_energy"), parameter_name("loading_f")
    ('$K_{0}$', '$\\mu$', 'bond energy', '$f$')
    """
    name = name.removeprefix("loading_")
    head = name.partition("_")[0]
    return symbol(name) if len(head) == 1 or head in GREEK else name.replace("_", " ")


def value_label(values: DataVariable, *places: int) -> str:
    """Label a value of a swept parameter, or several, with name and unit, in the prefix of all values.

    >>> rates = DataVariable("rate", ("rate",), [0, -1e-10, 2e-9], {"units": "N s-1"})
    >>> [value_label(rates, k) for k in range(3)]
    ['rate = 0 pN s⁻¹', 'rate = −100 pN s⁻¹', 'rate = 2000 pN s⁻¹']
    >>> value_label(DataVariable("rate", ("rate",), [1e-13, 1e-7], rates.attrs), 0, 1)
    'rate = 0.1 to 10⁵ pN s⁻¹'
    """
    text, size = prefixed(unit(values), _middle_of_decades(values.values))
    found = []
    for place in places:
        digits, _, power = f"{values.values[place] / size:.4g}".partition("e")
        found.append(raised(f"{digits}·10^{int(power)}").removeprefix("1·") if power else digits)
    return minus(f"{parameter_name(values.name)} = {' to '.join(found)} {'' if text == '1' else text}".rstrip())


def minus(text: str) -> str:
    """Replace hyphens before numbers by minus signs, as at axes.

    >>> minus("rate-and-state-aging at -3e-12 N, x = -.5")
    'rate-and-state-aging at −3e−12 N, x = −.5'
    """
    return re.sub(r"(?<!\w)-(?=[\d.])|(?<=\de)-(?=\d)", "\N{MINUS SIGN}", text)


def member_name(dataset: Data, place: Sequence[int]) -> str:
    """Return the parameters of a run of a sweep, by its index along each dimension."""
    labels = []
    for dim, k in zip(dataset["status"].dims, place, strict=True):
        along = [name for name in dataset.coords if dataset[name].dims == (dim,)] or [dim]
        labels += [value_label(dataset[name], k) for name in along]
    return ", ".join(labels)


def curves_by_second(dataset: Data, values: Array) -> list[tuple[Array, str]]:
    """Return values of a sweep over the first parameter, one curve per value of the second, or for some of many."""
    if values.ndim == 1:
        return [(values, "")]
    second = dataset[dataset["status"].dims[1]]
    chosen = evenly_spread(values.shape[1], MOST_CURVES)
    left = f" ({len(chosen)} of {values.shape[1]})" if len(chosen) < values.shape[1] else ""
    return [(values[:, j], value_label(second, j) + (left if j == chosen[-1] else "")) for j in chosen]


class _Powers(LogFormatterSciNotation):
    """Powers of ten in a unit of some size as plain text, which is set in a tenth of the time of mathematics."""

    def __init__(self, size: float, **settings: Any) -> None:
        super().__init__(**settings)
        self.size = size

    def __call__(self, x: float, pos: Any = None) -> str:
        text = super().__call__(x / self.size, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")
        return raised(text.replace(r"\times", "×").replace("{", "").replace("}", ""))


class _FewDecades(LogLocator):
    """Ticks inside decades, if these are few; each tick takes as long to draw as a curve."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        return super().tick_values(vmin, vmax) if vmax <= MOST_TICKED_RATIO * vmin else np.empty(0)


def make_logarithmic(*axes: XAxis | YAxis, size: float = 1.0) -> None:
    """Make axes logarithmic, with tick labels in a unit of this size."""
    for axis in axes:
        axis.axes.set(**{f"{axis.axis_name}scale": "log"})
        axis.set_major_formatter(_Powers(size))
        axis.set_minor_formatter(_Powers(size, minor_thresholds=(1, 0.4)))
        axis.set_minor_locator(_FewDecades(subs="auto"))


def label(
    axis: XAxis | YAxis, words: str, unit: str, values: Array, between: str = " ", error: float | None = None
) -> None:
    """Label a linear axis with words and unit, and its ticks in the prefix that suits these values; one of y does not
    magnify what is within their relative ``error``.
    """
    if isinstance(axis, YAxis):
        limit_zoom(axis.axes.set_ylim, values, error)
    text, size = prefixed(unit, values)
    power = math.floor(math.log10(largest(values) or 1.0))
    if size == 1.0 and not POWERS[0] <= power < POWERS[1]:
        # As a factor at the end of the axis it could be taken for that of another panel.
        text, size = raised(f"10^{power} {text}").removesuffix(" 1"), 10.0**power
    axis.set_label_text(f"{words}{between}[{text}]")
    if size == 1.0:
        axis.axes.ticklabel_format(axis="x" if isinstance(axis, XAxis) else "y", useOffset=False, scilimits=POWERS)
    else:
        axis.set_major_formatter(lambda value, _: Formatter.fix_minus(f"{value / size:.12g}"))


def label_variable(axis: XAxis | YAxis, values: DataVariable) -> None:
    """Label a linear axis with meaning, symbol and unit of a variable."""
    label(axis, f"{meaning(values)} {symbol(values.name)}", unit(values), values.values)


def varies(values: Array, size: float = 0.0) -> bool:
    """True for a curve that is not constant up to rounding, of itself and of a ``size``."""
    finite = values[np.isfinite(values)]
    if len(finite) < 2:
        return len(finite) == 1
    return bool(np.ptp(finite) > FLAT * np.max(np.abs(finite), initial=size))
