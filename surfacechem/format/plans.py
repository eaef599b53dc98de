"""Plans of sweeps: which parameters run over which values, and where each run ends."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from surfacechem.documents.document import Tree
from surfacechem.documents.overrides import parameter_path
from surfacechem.errors import InputError, suggestion
from surfacechem.format.declarations import Context, read
from surfacechem.format.sections import LINEAR, MOST_AXES, MOST_RUNS, SWEPT, UNTIL, RangeSection, SweepSection

# Statistics of the load at rupture, with their words, where runs end at a load.
STATISTICS = {"mode": "most probable", "median": "median", "mean": "mean"}


@dataclass(frozen=True)
class Axis:
    """A swept parameter or initial value: its path, its values in SI, and whether they are spaced by ratios."""

    path: str
    values: Sequence[float]
    logarithmic: bool = False

    def __post_init__(self) -> None:
        """Values are at least one, finite and different from each to the next."""
        if not len(self.values) or not np.all(np.isfinite(self.values)):
            raise InputError(f"{self.path} needs finite values, at least one.", path="sweep")
        if len(set(self.values)) != len(self.values):
            raise InputError(f"{self.path} has a value twice.", path="sweep")


@dataclass(frozen=True)
class Plan:
    """What is swept. With ``until`` every run ends where that prescribed variable, a ramp, reaches the value."""

    axes: Sequence[Axis]
    until: tuple[str, float] | None = None

    def __post_init__(self) -> None:
        """One or two parameters, and no more runs than memory holds."""
        if not 1 <= len(self.axes) <= MOST_AXES or len({axis.path for axis in self.axes}) != len(self.axes):
            message = f"a sweep has one or {MOST_AXES} different parameters, not {len(self.axes)}."
            raise InputError(message, path="sweep")
        if math.prod(self.shape) > MOST_RUNS:
            message = f"a sweep of {math.prod(self.shape)} runs is too large; {MOST_RUNS} at most."
            raise InputError(message, path="sweep")

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def points(self) -> list[dict[str, float]]:
        """The swept values of each run by path, the last axis fastest."""
        paths = [axis.path for axis in self.axes]
        return [dict(zip(paths, point, strict=True)) for point in product(*(axis.values for axis in self.axes))]

    @property
    def record(self) -> str:
        """The plan as a dataset records it."""
        axes = [{"path": a.path, "values": list(a.values), "logarithmic": a.logarithmic} for a in self.axes]
        return json.dumps({"axes": axes, "until": list(self.until) if self.until else None})


def recorded_plan(record: object) -> Plan:
    """The plan that a dataset records; InputError where it records none."""

    def numbers(values: Any) -> tuple[float, ...]:
        if not all(isinstance(value, float | int) for value in values):
            raise TypeError(values)
        return tuple(map(float, values))

    try:
        content = json.loads(str(record))
        axes = [Axis(str(a["path"]), numbers(a["values"]), a["logarithmic"] is True) for a in content["axes"]]
        until = content["until"]
        return Plan(axes, (str(until[0]), numbers(until[1:])[0]) if until else None)
    except (LookupError, TypeError, ValueError, RecursionError):
        raise InputError("the attribute 'sweep' is no plan of a sweep.") from None


def plan_of(section: SweepSection, units: Mapping[str, str], until: Mapping[str, float] | None = None) -> Plan:
    """The plan in SI; ``units`` are those of the parameters that may be changed, by path.

    ``until`` goes before what the section says of it.
    """
    ends = until or section.until
    axes = [_axis(path, tree, units) for path, tree in section.over.items()]
    return Plan(axes, next(iter(ends.items())) if ends else None)


def read_sweep(tree: Tree, usual: SweepSection | None = None) -> SweepSection:
    """A sweep; where it does not say how runs end, they end as in the usual one."""
    section = read(SweepSection, tree, Context())
    return section if section.has("until") or usual is None else SweepSection(over=section.over, until=usual.until)


def read_until(tree: Tree) -> Mapping[str, float]:
    """A prescribed variable and the value at which each run ends."""
    return UNTIL.read(tree, "until", Context())


def _axis(path: str, tree: Tree, units: Mapping[str, str]) -> Axis:
    path = parameter_path(path, units)
    if path not in units:
        raise InputError(f"no parameter '{path}' to sweep.{suggestion(path, units)}", tree.place)
    values = SWEPT.read(tree, path, Context(x=units[path]))
    if not isinstance(values, RangeSection):
        return Axis(path, list(values))
    if values.spacing == LINEAR:
        return Axis(path, np.linspace(values.first, values.last, values.points).tolist())
    if not (values.first > 0 and values.last > 0):
        raise values.error("a logarithmic range needs ends above zero.", "spacing")
    return Axis(path, np.geomspace(values.first, values.last, values.points).tolist(), logarithmic=True)
