"""The section ``sweep`` of a case: which parameters run over which values, and where each run ends."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from surfacechem.documents.document import Tree
from surfacechem.documents.overrides import parameter_path
from surfacechem.errors import InputError, suggestion
from surfacechem.format.fields import choice, items, mapping, number, whole
from surfacechem.format.run import SPACINGS
from surfacechem.quantities import INTERNAL, VARIABLES

MOST_AXES = 2
MOST_RUNS = 1_000_000


@dataclass(frozen=True)
class Axis:
    """A swept parameter or initial value: its path, its values in SI, and whether they are spaced by ratios."""

    path: str
    values: Sequence[float]
    logarithmic: bool = False

    def __post_init__(self) -> None:
        """Values are at least one, finite and different from each to the next."""
        if not len(self.values) or not np.all(np.isfinite(self.values)):
            raise InputError(f"sweep: {self.path} needs finite values, at least one.")
        if len(set(self.values)) != len(self.values):
            raise InputError(f"sweep: {self.path} has a value twice.")


@dataclass(frozen=True)
class Plan:
    """What is swept. With ``until`` every run ends where that prescribed variable, a ramp, reaches the value."""

    axes: Sequence[Axis]
    until: tuple[str, float] | None = None

    def __post_init__(self) -> None:
        """One or two parameters, and no more runs than memory holds."""
        if not 1 <= len(self.axes) <= MOST_AXES or len({axis.path for axis in self.axes}) != len(self.axes):
            raise InputError(f"a sweep has one or {MOST_AXES} different parameters, not {len(self.axes)}.")
        if math.prod(self.shape) > MOST_RUNS:
            raise InputError(f"a sweep of {math.prod(self.shape)} runs is too large; {MOST_RUNS} at most.")

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def points(self) -> list[dict[str, float]]:
        """The swept values of each run by path, the last axis fastest."""
        paths = [axis.path for axis in self.axes]
        return [dict(zip(paths, point, strict=True)) for point in product(*(axis.values for axis in self.axes))]


SWEEP_KEYS = ("over", "until")
RANGE_KEYS = ("from", "to", "points", "spacing")


@dataclass(frozen=True)
class Section:
    """A sweep as read; units of the values are known once the scene is assembled."""

    over: Mapping[str, Tree]
    until: tuple[str, Tree] | None

    def plan(self, units: Mapping[str, str]) -> Plan:
        """The plan in SI; ``units`` are those of the parameters that may be changed, by path."""
        until = (
            (self.until[0], number(self.until[1], VARIABLES[self.until[0]].unit, self.until[0])) if self.until else None
        )
        return Plan([_axis(path, tree, units) for path, tree in self.over.items()], until)


def read_sweep(tree: Tree, usual: Section | None = None) -> Section:
    """The section ``sweep``; where it does not say how runs end, they end as in the usual one."""
    fields = mapping(tree, SWEEP_KEYS)
    over = mapping(fields.get("over"))
    if not over:
        raise tree.error(
            "a sweep needs `over`, for example `over: {loading.f.ramp.rate: {from: 1 pN/s, to: 1 nN/s, points: 31}}`."
        )
    for values in over.values():
        if isinstance(values.value, dict):
            mapping(values, RANGE_KEYS)
    return Section(over, read_until(fields["until"]) if "until" in fields else usual.until if usual else None)


def read_until(tree: Tree) -> tuple[str, Tree]:
    """A prescribed variable and the value at which each run ends."""
    fields = mapping(tree)
    if len(fields) != 1:
        raise tree.error("`until` is one prescribed variable and its value, for example `until: {f: 200 pN}`.")
    ((name, value),) = fields.items()
    choice(Tree(name, value.place), "variable", [variable for variable in VARIABLES if variable not in INTERNAL])
    return name, value


def _axis(path: str, tree: Tree, units: Mapping[str, str]) -> Axis:
    path = parameter_path(path, units)
    if path not in units:
        raise InputError(f"no parameter '{path}' to sweep.{suggestion(path, units)}", tree.place)
    unit = units[path]
    if not isinstance(tree.value, dict):
        return Axis(path, [number(item, unit, path) for item in items(tree, "[1, 2, 3]")])
    fields = mapping(tree, RANGE_KEYS)
    for key in ("from", "to", "points"):
        if key not in fields:
            raise tree.error(f"a range needs `{key}`.")
    first, last = (number(fields[key], unit, path) for key in ("from", "to"))
    points = whole(fields["points"], "points", 1, MOST_RUNS)
    spacing = choice(fields["spacing"], "spacing", SPACINGS) if "spacing" in fields else "linear"
    if spacing == "linear":
        return Axis(path, np.linspace(first, last, points).tolist())
    if not (first > 0 and last > 0):
        raise fields["spacing"].error("a logarithmic range needs ends above zero.")
    return Axis(path, np.geomspace(first, last, points).tolist(), logarithmic=True)
