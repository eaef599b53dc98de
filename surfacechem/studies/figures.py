"""Figures from lists: runs and sweeps of cases with their exact curves and published data.

A list is a YAML file of figures; each has two axes and some curves. Curves are computed when the figure is drawn; the
caption gives the largest distance from the exact curve.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem import documents
from surfacechem.contracts.units import parse as si
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, refuse_unknown
from surfacechem.format.data_files import CSVText
from surfacechem.format.declarations import (
    REQUIRED,
    Content,
    Context,
    Deferred,
    Entries,
    ListOf,
    Nested,
    OneOf,
    Section,
    Text,
    amount,
    key,
    read,
)
from surfacechem.format.sections import SWEPT
from surfacechem.runs.simulation import load
from surfacechem.solve.contract import Array

if TYPE_CHECKING:
    import xarray

    from surfacechem.plots.style import Plot


log = logging.getLogger(__name__)

SCALES = "linear", "log"

HIDDEN_PART = 1 / 200
"""Fraction of its range by which a curve has to differ from another to be seen next to it."""

EXACT_STYLE: Mapping[str, Any] = {"color": "0.8", "linewidth": 4.5, "zorder": 1}
"""Style of exact curves."""


def _anything(content: Content) -> Entries:
    return Entries(others=Deferred(content), by_scene=True)


# -- sections of a list -----------------------------------------------------------------------------------------------


class AxisSection(Section):
    """an axis of a figure"""

    called = "an axis"

    variable: str = key(Text(), "variable of the dataset, or the name of a swept parameter", REQUIRED)
    name: str = key(Text(), "what stands at the axis", REQUIRED)
    per: Tree | None = key(Deferred(amount("1")), "quantity that counts as one, in the unit of the variable")
    scale: str = key(OneOf("scale", lambda: SCALES), "of the axis", "linear")


class DataSection(Section):
    """published data of a curve"""

    called = "published data"

    file: str = key(
        Text(), "CSV file beside the list; its first line names columns and units; none: numbers of the axis", REQUIRED
    )
    x: str = key(Text(), "column along the axis", REQUIRED)
    y: str = key(Text(), "column of the values", REQUIRED)


class CurveSection(Section):
    """a curve of a figure"""

    called = "a curve"

    label: str = key(Text(), "its name in the legend", "")
    case: str = key(Text(), "the case that is run, by the name of a shipped one or the path of its file", REQUIRED)
    set: Mapping[str, Tree] = key(_anything(amount("[x]")), "other values of the case, by path", {})
    over: Mapping[str, Tree] = key(_anything(SWEPT), "values of a parameter by path: the curve is what runs end at", {})
    until: Mapping[str, Tree] = key(_anything(amount("[x]")), "a ramp and the value at which each run ends", {})
    per: Mapping[str, Tree] = key(
        Entries({axis: key(Deferred(amount("1")), name=axis) for axis in "xy"}), "what counts as one for this curve", {}
    )
    exact: Sequence[Sequence[float]] = key(
        ListOf(ListOf(amount("1"), "[0, 1]", count=2), "[[0, 0], [1, 1]]"), "corners of the exact curve", ()
    )
    data: DataSection | None = key(Nested(DataSection))


class FigureSection(Section):
    """a figure"""

    called = "a figure"

    name: str = key(Text(), "name of its file", REQUIRED)
    title: str = key(Text(), "what it shows", REQUIRED)
    source: str = key(Text(), "where it is published, and for data their licence", "")
    x: AxisSection = key(Nested(AxisSection), default=REQUIRED)
    y: AxisSection = key(Nested(AxisSection), default=REQUIRED)
    curves: Sequence[CurveSection] = key(ListOf(Nested(CurveSection), "- {case: exothermic}"), "its curves", REQUIRED)


class ListSection(Section):
    """a list of figures"""

    called = "a list of figures"

    title: str = key(Text(), "what they have in common", REQUIRED)
    source: str = key(Text(), "where they are published", "")
    figures: Sequence[FigureSection] = key(ListOf(Nested(FigureSection)), "the figures", REQUIRED)


# -- drawing ----------------------------------------------------------------------------------------------------------


class Line(NamedTuple):
    """A computed curve in the units of its axes, shape (n,), with the exact one if known, and data."""

    label: str
    x: Array
    y: Array
    refused: NDArray[np.bool_]
    """Mask of points that violate the second law, although energy is conserved."""
    exact: tuple[Array, Array] | None
    data: tuple[Array, Array] | None

    @property
    def distance(self) -> float:
        """Largest distance from the exact curve, relative to the ranges of the latter; NaN without one."""
        if self.exact is None:
            return np.nan
        spans = [float(np.nanmax(part) - np.nanmin(part)) or 1.0 for part in self.exact]
        line, points = (np.column_stack([x / spans[0], y / spans[1]]) for x, y in (self.exact, (self.x, self.y)))
        line, points = (rows[np.isfinite(rows).all(axis=1)] for rows in (line, points))
        start, step, worst = line[:-1], np.diff(line, axis=0), 0.0
        length = np.maximum(np.sum(step**2, axis=1), np.finfo(float).tiny)
        for point in points:
            # Distance from the line, not along y: at a jump of the curve both of its sides have the same x.
            along = np.clip(np.sum((point - start) * step, axis=1) / length, 0, 1)
            worst = max(worst, float(np.min(np.hypot(*(point - start - along[:, None] * step).T))))
        return worst


def _coincide(one: Line, other: Line) -> bool:
    """True if two curves hide each other."""
    span = float(np.ptp(other.y[np.isfinite(other.y)])) or 1.0
    near = np.interp(one.x, other.x, other.y) - one.y
    return bool(np.nanmax(np.abs(near)) < HIDDEN_PART * span)


class ListFigure(NamedTuple):
    """A figure of a list with its curves."""

    section: FigureSection
    curves: Sequence[Line]

    @property
    def caption(self) -> str:
        """Title, source, and largest distance from the exact curves."""
        known = [curve.distance for curve in self.curves if curve.exact is not None]
        far = [f"Largest distance from the exact curve: {max(known):.0g} of its range."] if known else []
        return " ".join([f"{self.section.title}.", *([f"{self.section.source}."] if self.section.source else []), *far])

    def draw(self) -> Plot:
        """Draw the figure."""
        from surfacechem.plots.style import COLOURS, panels

        with panels(5.4, 3.6) as (plot, ((ax,),)):
            for curve in self.curves:
                if curve.exact is not None:
                    ax.plot(*curve.exact, **EXACT_STYLE)  # wide, so that it is seen below the curves on it
            for i, curve in enumerate(self.curves):
                colour = COLOURS[i % len(COLOURS)]
                shown = np.where(curve.refused, np.nan, curve.y)
                # A curve on top of another is dashed, so that both are seen.
                dashed = any(_coincide(curve, other) for other in self.curves[:i])
                ax.plot(curve.x, shown, "--" if dashed else "-", color=colour, label=curve.label or None)
                if curve.refused.any():
                    ax.plot(curve.x, np.where(curve.refused, curve.y, np.nan), ":", color=colour)
                if curve.data is not None:
                    ax.plot(*curve.data, "o", color=colour, markersize=4)
            self._label(ax)
        return plot

    def _label(self, ax: Any) -> None:
        x, y = self.section.x, self.section.y
        ax.set(xlabel=x.name, ylabel=y.name, xscale=x.scale, yscale=y.scale)
        if any(curve.exact is not None and np.any(curve.exact) for curve in self.curves):
            ax.plot([], [], label="exact", **EXACT_STYLE)
        if any(curve.data is not None and np.any(curve.data) for curve in self.curves):
            ax.plot([], [], "o", color="0.4", markersize=4, label="published")
        if any(curve.refused.any() for curve in self.curves):
            ax.plot([], [], ":", color="0.4", label="breaks the second law")
        if ax.get_legend_handles_labels()[1]:
            ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def lists() -> Path:
    """Return the folder of the lists that come with surfacechem."""
    return documents.cases() / "figures"


def read_list(name: str) -> ListSection:
    """Read a list of figures by the name of a shipped one or by its path."""
    path = Path(name) if Path(name).suffix else lists() / f"{name}.yaml"
    if not document.is_file(path):
        known = [path.stem for path in lists().glob("*.yaml")]
        refuse_unknown([name], known, "no list of figures '{}'", Place(path="LIST"))
    return read(ListSection, document.parse(document.read(path), str(path)), Context())


def pictures(content: ListSection) -> Iterator[ListFigure]:
    """Yield the figures of a list, each when its runs are done."""
    for number, section in enumerate(content.figures):
        log.info("%s", section.name, extra={"done": number, "total": len(content.figures)})
        yield ListFigure(section, [_curve(section, curve) for curve in section.curves])


def write_all(content: ListSection, folder: Path, suffix: str) -> list[tuple[Path, str]]:
    """Draw the figures of a list into a folder; return the files and their captions."""
    from surfacechem.plots import write

    written = []
    for picture in pictures(content):
        written.append((folder / f"{picture.section.name}.{suffix}", picture.caption))
        write(picture.draw(), written[-1][0])
    return written


def _curve(figure: FigureSection, section: CurveSection) -> Line:
    """Compute the line of a case along the axes."""
    folder = Path(section.tree.place.file).parent
    dataset, exact_ends = _computed(section, folder, f"{figure.y.variable}_exact")
    axes = {"x": figure.x, "y": figure.y}
    per = {name: _unit(dataset, axis, section.per.get(name, axis.per)) for name, axis in axes.items()}
    x, y = (_values(dataset, axis) / per[name] for name, axis in axes.items())
    exact = tuple(np.array(section.exact, dtype=float).T) if section.exact else None
    if exact_ends is not None:
        exact = x, exact_ends / per["y"]
    # Energy is conserved at a refused point, so only the verdict on the jump identifies it.
    refused = np.zeros(x.shape, dtype=bool)
    if section.over and "event_verdict" in dataset:
        refused = np.any(dataset["event_verdict"].values == "destroys entropy", axis=-1)
    return Line(section.label, x, y, refused, exact, _data(dataset, figure, section, folder, per))


def _computed(section: CurveSection, folder: Path, exact: str) -> tuple[xarray.Dataset, Array | None]:
    """Compute the run or the sweep of a curve, and the exact values of its variable along it; None if unknown."""
    case = str(folder / section.case) if Path(section.case).suffix else section.case
    over, until = ({path: tree.plain() for path, tree in of.items()} for of in (section.over, section.until))
    try:
        simulation = load(case, {path: tree.plain() for path, tree in section.set.items()})
        dataset = simulation.sweep(over, until or None).dataset if over else simulation.run().dataset
        if exact in dataset:
            return dataset, np.asarray(dataset[exact].values, dtype=float)
        if not over or simulation.case.reference is None:
            return dataset, None
        # A sweep has no exact curves over time: each of its runs is repeated by itself.
        ends = [simulation.run(point).dataset for point in simulation.plan(over).points]
    except InputError as error:
        raise error.at(section.tree.place) from None
    return dataset, np.array([end[exact].values[-1] if exact in end else np.nan for end in ends])


def _values(dataset: xarray.Dataset, axis: AxisSection) -> Array:
    """Return a variable of a run over time, or its values at the ends of the runs of a sweep."""
    refuse_unknown([axis.variable], list(map(str, dataset.variables)), "no variable '{}'", axis.place("variable"))
    values = dataset[axis.variable]
    return np.asarray(values.values if values.ndim == 1 else values.isel(time=-1).values, dtype=float)


def _unit(dataset: xarray.Dataset, axis: AxisSection, per: Tree | None) -> float:
    """Return the value that counts as one along an axis [SI]."""
    if per is None or axis.variable not in dataset.variables:
        return 1.0
    return si(per.plain(), _own_unit(dataset[axis.variable]), per.place, "per")


def _own_unit(values: xarray.DataArray) -> str:
    """Return the unit of a variable in the notation of a case."""
    return re.sub(r"([A-Za-z])(-?\d+)", r"\1^\2", str(values.attrs.get("units", "1")))


def _data(
    dataset: xarray.Dataset, figure: FigureSection, section: CurveSection, folder: Path, per: Mapping[str, float]
) -> tuple[Array, Array] | None:
    """Return the published data of a curve along the same axes."""
    if (given := section.data) is None:
        return None
    path = document.file_in(folder, given.file, given.tree.place)
    if path is None:
        raise given.error(f"no file {given.file} beside the list.", "file")
    table = CSVText(Tree(document.read(path), Place(str(path))))
    found = []
    for name, axis, column in (("x", figure.x, given.x), ("y", figure.y, given.y)):
        # A column without a unit is in the units of the axis.
        shown = (column, "") in table.columns
        unit, scale = ("1", 1.0) if shown else (_own_unit(dataset[axis.variable]), per[name])
        found.append(np.array(table.column(column, unit, column)) / scale)
    return found[0], found[1]
