"""Plans of sweeps: functions from the number of a run to its parameters and its end.

A plan is a product of dimensions: one for each parameter of a grid, one for parameters that change together, and one
for the draws of a sample of uncertain parameters. It has no list of its runs, so that a plan of a billion runs costs no
memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.units import QUANTITY, parse, plain_values
from surfacechem.documents.document import OVERRIDE, Tree, parameter_path
from surfacechem.errors import PATHS, InputError, Place, refuse_unknown
from surfacechem.format import data_files
from surfacechem.format.declarations import Context, keys, read
from surfacechem.format.sections import (
    GRID,
    LINEAR,
    MOST_AXES,
    NOTHING_SWEPT,
    SWEEP_END,
    SWEPT,
    DistributionSection,
    RangeSection,
    SweepSection,
    TableSection,
    UniformSection,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]

HALF_SPACING = 2.0**-53
"""Offset of numbers in [0, 1), so that none is zero: there the quantile of a normal distribution is infinite."""

FEISTEL_ROUNDS = 6
"""Rounds of a permutation: four make it indistinguishable from a random one, two more cost little."""


def _uniform(u: Array, low: float, high: float, logarithmic: bool = False) -> Array:
    if not logarithmic:
        return low + (high - low) * u
    return np.asarray(np.exp(np.log(low) + np.log(high / low) * u))


QUANTILES: Mapping[str, Callable[..., Any]] = {
    "Uniform": _uniform,
    "Normal": lambda u, mean, std: mean + std * _standard_normal(u),
    "Lognormal": lambda u, median, sigma: median * np.exp(sigma * _standard_normal(u)),
    "Drawn": lambda u, values, source: np.take(values, np.minimum((u * len(values)).astype(np.int64), len(values) - 1)),
}
"""Values below which the fractions ``u`` of all draws lie, by kind of distribution: uniform between two values or, if
``logarithmic``, between their logarithms; normal; lognormal, by the standard deviation of the logarithm; over the rows
of a table.
"""


def _standard_normal(u: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri(u))


class Distribution(NamedTuple):
    """Probability distribution of the value of a parameter: its kind, with the numbers that belong to it."""

    kind: str
    numbers: Mapping[str, Any]

    @property
    def source(self) -> str:
        """Name of a random number shared by all parameters with this source; empty if each has its own."""
        return str(self.numbers.get("source", ""))

    @property
    def over_decades(self) -> bool:
        """True if the distribution is one of ratios of values."""
        return self.kind == "Lognormal" or bool(self.numbers.get("logarithmic"))

    def at(self, u: Array) -> Array:
        """Return quantiles."""
        return np.asarray(QUANTILES[self.kind](u, **self.numbers))

    @property
    def record(self) -> dict[str, Any]:
        """Entries from which the distribution can be restored."""
        return {"kind": self.kind, **self.numbers}


class Sample(NamedTuple):
    """A number of draws of parameters by path, as functions of the index of a run, the method and the seed."""

    draws: Mapping[str, Distribution]
    runs: int
    method: str
    seed: int = 0

    def at(self, index: Index) -> dict[str, Array]:
        """Return the values of the runs with these numbers, by path."""
        # Columns of one table share a dimension, so that they are taken from the same row.
        sources = list(dict.fromkeys(draw.source or path for path, draw in self.draws.items()))
        own, where = np.unique(index, return_inverse=True)
        u = SAMPLERS[self.method](own, self.runs, len(sources), self.seed)[where] + HALF_SPACING
        return {path: draw.at(u[:, sources.index(draw.source or path)]) for path, draw in self.draws.items()}

    def of(self, path: str, index: Index) -> Array:
        """Return the values of one parameter."""
        return self.at(index)[path]

    @property
    def record(self) -> dict[str, Any]:
        """Entries from which the sample can be restored."""
        draws = {path: draw.record for path, draw in self.draws.items()}
        return {"draws": draws, "runs": self.runs, "method": self.method, "seed": self.seed}


def recorded_sample(content: Mapping[str, Any]) -> Sample:
    """Restore a sample from its record; LookupError, TypeError or ValueError if that is invalid."""
    draws = {}
    for path, record in content["draws"].items():
        draws[str(path)] = Distribution(str(record["kind"]), {name: record[name] for name in record if name != "kind"})
        draws[str(path)].at(np.array([0.5]))  # an unknown kind, or other numbers than its own
    runs, seed = int(content["runs"]), int(content["seed"])
    return Sample(draws, runs, [*SAMPLERS][[*SAMPLERS].index(content["method"])], seed)


# -- numbers in [0, 1), one row for each of the increasing indices and one column per dimension ------------------------


def _blocks(index: Index) -> Iterator[tuple[int, int]]:
    """Yield start and length of each block of consecutive indices."""
    starts = np.flatnonzero(np.diff(index, prepend=-2) != 1)
    yield from zip(index[starts].tolist(), np.diff(starts, append=len(index)).tolist(), strict=True)


def _random(index: Index, runs: int, dimensions: int, seed: int) -> Array:
    rows = []
    for first, count in _blocks(index):
        bits = np.random.Philox(key=seed)
        before = first * dimensions
        bits.advance(before // 4)  # a step of this generator makes four numbers; the surplus is dropped below
        numbers = np.random.Generator(bits).random(before % 4 + count * dimensions)
        rows.append(numbers[before % 4 :].reshape(count, dimensions))
    return np.concatenate(rows)


def _sobol(index: Index, runs: int, dimensions: int, seed: int) -> Array:
    """Return scrambled Sobol' points, of which each block of 2^k is evenly spread.

    Source: Owen (1998), J. Complexity 14, 466-489; as in SciPy.
    """
    from scipy.stats.qmc import Sobol

    engine = Sobol(dimensions, rng=np.random.default_rng(seed))
    rows, done = [], 0
    for first, count in _blocks(index):
        if first > done:
            engine.fast_forward(first - done)
        # The first point separately, as the library warns if the first call is not for a power of two.
        rows += [engine.random(1)] if first == 0 else []
        rows += [engine.random(left)] if (left := count - (first == 0)) else []
        done = first + count
    return np.concatenate(rows)


def _latin(index: Index, runs: int, dimensions: int, seed: int) -> Array:
    """Return a Latin hypercube: each of as many equal parts of a parameter's range as there are runs has one draw."""
    places = np.column_stack([permuted(index, runs, 1000 * seed + k) for k in range(dimensions)])
    return (places + _random(index, runs, dimensions, seed)) / runs


SAMPLERS: Mapping[str, Callable[[Index, int, int, int], Array]] = {
    "sobol": _sobol,
    "latin-hypercube": _latin,
    "random": _random,
}


def permuted(index: Index, count: int, key: int) -> Index:
    """Return the images of these numbers under a pseudorandom permutation of those below ``count``, without a table.

    A Feistel network permutes the numbers below a power of four, and is repeated until the result is below the count.
    Source: Black & Rogaway (2002), Ciphers with arbitrary finite domains, doi 10.1007/3-540-45760-7_9.
    """
    half = max(1, ((count - 1).bit_length() + 1) // 2)
    mask, shift = np.uint64((1 << half) - 1), np.uint64(half)
    x = index.astype(np.uint64)
    walking = np.ones(len(x), dtype=bool)
    # At most three quarters of the numbers lie outside, so that this ends after few rounds.
    while walking.any():
        # Each turn changes one half by a function of the other and is invertible: the map is a permutation.
        left, right = x[walking] >> shift, x[walking] & mask
        for turn in range(FEISTEL_ROUNDS):
            left, right = right, left ^ (hashed(right, key * FEISTEL_ROUNDS + turn) & mask)
        x[walking] = left << shift | right
        walking = x >= count
    return x.astype(np.int64)


def hashed(x: NDArray[np.uint64], key: int) -> NDArray[np.uint64]:
    """Hash numbers: every bit of the result depends on all bits of x and of the key.

    Source: Steele, Lea & Flood (2014), Fast splittable pseudorandom number generators, doi 10.1145/2714064.2660195.
    """
    x = x + np.uint64((key + 1) * 0x9E3779B97F4A7C15 % 2**64)
    x = (x ^ x >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ x >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
    return x ^ x >> np.uint64(31)


SURVIVAL = "survival"
"""Word in `until`, instead of a load: each run ends when its survival falls to the value."""

# Statistics of the load at rupture, with their words, of runs that end at a load.
STATISTICS = {"mode": "most probable", "median": "median", "mean": "mean"}

INTEGRATED_PATHS = ("surface.bodies.", "surface.laws.", "surface.heat.", "surface.approach.", "surface.accuracy")
"""Prefixes of the paths of parameters of integrals over surfaces."""

INTEGRATED = "shapes and laws of the gap are in integrals that are made once; give each value a run, by --set."
TABULATED = "it is a table of times, which is no number. Sweep a value or a ramp; give each table a run, by --set."
"""Reasons why parameters cannot be swept."""

RUN_DIMENSION = "run"
"""The dimension along which several parameters change together."""


@dataclass(frozen=True)
class EvenlySpaced:
    """Values from the first to the last, at equal distances or ratios; they are not stored."""

    first: float
    last: float
    count: int
    logarithmic: bool = False

    def __len__(self) -> int:
        """Return the number of values."""
        return self.count

    def at(self, index: Index) -> Array:
        """Return the values with these numbers, as NumPy's linspace and geomspace."""
        first, last = (np.log10(x) if self.logarithmic else x for x in (self.first, self.last))
        step = (last - first) / max(self.count - 1, 1)
        values = np.asarray(index * step + first, dtype=float)
        values = np.power(10.0, values) if self.logarithmic else values
        # Both ends are exact; a power of ten would round them.
        values[index == self.count - 1] = self.last
        values[index == 0] = self.first
        return values


@dataclass(frozen=True)
class LazyArray:
    """Array of values that are computed only when a slice is read."""

    at: Callable[[Index], Array]
    count: int

    @property
    def shape(self) -> tuple[int]:
        """Shape of the array."""
        return (self.count,)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the array."""
        return np.dtype(float)

    def __getitem__(self, part: slice) -> Array:
        """Return the values of a slice."""
        return self.at(np.arange(*part.indices(self.count)))


def name_parts(path: str) -> list[str]:
    """Return the components of a path, as parts of a name.

    >>> name_parts("interface.bonding[2].k-off.level")
    ['interface', 'bonding_2', 'k_off']
    """
    return [p.replace("-", "_").replace("[", "_").strip("]") for p in path.removesuffix(".level").split(".")]


@dataclass(frozen=True)
class Axis:
    """A swept parameter or initial value: its path, its values in SI, and whether they are spaced by ratios."""

    path: str
    values: Sequence[float] | EvenlySpaced
    logarithmic: bool = False

    def __post_init__(self) -> None:
        """Check that there are values, and that they are finite."""
        ends = self.at(np.array([0, -1]) % len(self)) if isinstance(self.values, EvenlySpaced) else self.values
        if not len(self) or not np.all(np.isfinite(ends)):
            raise InputError(f"{self.path} needs finite values, at least one.", path="sweep")

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self.values)

    def at(self, index: Index) -> Array:
        """Return the values with these numbers."""
        return self.values.at(index) if isinstance(self.values, EvenlySpaced) else self._listed[index]

    @cached_property
    def _listed(self) -> Array:
        return np.asarray(self.values, dtype=float)

    @property
    def has_equals(self) -> bool:
        """True if a value occurs twice."""
        if isinstance(self.values, EvenlySpaced):
            return len(self) > 1 and self.values.first == self.values.last
        return len(set(self.values)) != len(self)

    @property
    def record(self) -> dict[str, Any]:
        """Entries from which the axis can be restored."""
        if isinstance(self.values, EvenlySpaced):
            return {"path": self.path, **vars(self.values)}
        return {"path": self.path, "values": list(self.values), "logarithmic": self.logarithmic}


@dataclass(frozen=True)
class Plan:
    """Plan of a sweep. With ``until`` every run ends when this prescribed variable, a ramp, reaches the value, or when
    the survival of its bonds has fallen to it.
    """

    axes: Sequence[Axis] = ()
    until: tuple[str, float] | None = None
    zipped: bool = False
    """True if the values of the axes change together, instead of as a grid."""
    sample: Sample | None = None
    places: Mapping[str, Place] = field(default_factory=dict, compare=False)
    """Places of the swept parameters and of the end of the runs in the input, by path."""
    units: Mapping[str, tuple[str, float, float]] = field(default_factory=dict, compare=False)
    """Units in which the input gives the swept parameters, by path: name, zero and one, these in SI."""

    def __post_init__(self) -> None:
        """Check that parameters are distinct and not too many, and that zipped ones have equally many values."""
        if not self.paths or len(self.axes) > MOST_AXES or len(set(self.paths)) != len(self.paths):
            message = f"a sweep has different parameters, {MOST_AXES} at most; not {', '.join(self.paths) or 'none'}."
            raise InputError(message, path="sweep")
        if self.zipped and len({len(axis) for axis in self.axes}) > 1:
            counts = ", ".join(f"{len(axis)} of {axis.path}" for axis in self.axes)
            raise InputError(f"`combine: zip` needs as many values of each parameter, not {counts}.", path="sweep")
        if self.zipped and self.sample:
            raise InputError("a sample goes with a grid of values, not with `combine: zip`.", path="sweep")
        for axis in () if self.zipped else self.axes:
            if axis.has_equals:
                raise InputError(f"{axis.path} has a value twice.", path="sweep")

    @property
    def paths(self) -> list[str]:
        """Paths of all parameters."""
        return [*(axis.path for axis in self.axes), *(self.sample.draws if self.sample else ())]

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each dimension: of the grid, or of the parameters that change together; then the draws
        of the sample.
        """
        grid = (len(self.axes[0]),) if self.zipped else tuple(len(axis) for axis in self.axes)
        return (*grid, *((self.sample.runs,) if self.sample else ()))

    @property
    def size(self) -> int:
        """Number of runs."""
        return math.prod(self.shape)

    def at(self, index: Index) -> dict[str, Array]:
        """Return the parameters of the runs with these numbers, by path; the last dimension varies fastest."""
        places = np.unravel_index(np.asarray(index, dtype=np.int64), self.shape)
        grid = [places[0]] * len(self.axes) if self.zipped else places
        values = {axis.path: axis.at(place) for axis, place in zip(self.axes, grid, strict=False)}
        return values | (self.sample.at(places[-1]) if self.sample else {})

    def picked(self, index: Index) -> Plan:
        """Return the plan of a subset of the runs, whose values change together."""
        axes = [Axis(path, values.tolist()) for path, values in self.at(index).items()]
        return Plan(axes, self.until, zipped=True)

    @property
    def points(self) -> list[dict[str, float]]:
        """Swept values of each run by path; the last dimension varies fastest."""
        values = self.at(np.arange(self.size))
        return [dict(zip(values, row, strict=True)) for row in zip(*(x.tolist() for x in values.values()), strict=True)]

    def told(self, path: str, *values: float) -> str:
        """Return a value of a parameter, or the ends of its range, in the unit of the input.

        >>> Plan([Axis("T", [298.15])], units={"T": ("degC", 273.15, 274.15)}).told("T", 298.15, 300.15)
        '25 to 27 degC'
        """
        unit, zero, one = self.units.get(path, ("1", 0.0, 1.0))
        return f"{' to '.join(f'{(value - zero) / (one - zero):g}' for value in values)} {unit}".removesuffix(" 1")

    def located(self, error: InputError) -> InputError:
        """Return an error about a swept parameter with its place in the input, if known."""
        place = self.places.get(error.place.path) if error.place and not error.place.file else None
        return InputError(error.message, place) if place else error

    @property
    def load(self) -> str:
        """Prescribed variable whose value ends every run; '' if there is none."""
        return self.until[0] if self.until and self.until[0] != SURVIVAL else ""

    @property
    def record(self) -> str:
        """The plan as recorded in a dataset."""
        content = {"axes": [axis.record for axis in self.axes], "until": list(self.until) if self.until else None}
        more = {"zipped": True} if self.zipped else {}
        return json.dumps({**content, **more, **({"sample": self.sample.record} if self.sample else {})})


def recorded_plan(record: object) -> Plan:
    """Restore the plan that a dataset records; InputError if it records none."""

    def numbers(values: Any) -> tuple[float, ...]:
        if not all(isinstance(value, float | int) for value in values):
            raise TypeError(values)
        return tuple(map(float, values))

    def axis(content: Any) -> Axis:
        logarithmic = content["logarithmic"] is True
        if "values" in content:
            return Axis(str(content["path"]), numbers(content["values"]), logarithmic)
        first, last = numbers((content["first"], content["last"]))
        return Axis(str(content["path"]), EvenlySpaced(first, last, int(content["count"]), logarithmic), logarithmic)

    try:
        content = json.loads(str(record))
        until, sample = content["until"], content.get("sample")
        return Plan(
            [axis(each) for each in content["axes"]],
            (str(until[0]), numbers(until[1:])[0]) if until else None,
            content.get("zipped") is True,
            recorded_sample(sample) if sample else None,
        )
    except (AttributeError, LookupError, TypeError, ValueError, RecursionError):
        raise InputError("the attribute 'sweep' is no plan of a sweep.") from None


def split_arrays(over: Mapping[str, object]) -> tuple[dict[str, object], dict[str, Array]]:
    """Return the values as in a case, and separately numbers that are not read entry by entry: arrays, ranges, and
    columns of tables and datasets. One that says its unit is a list of texts with that unit.
    """
    if not isinstance(over, Mapping):
        raise InputError(f"`over` takes values by path, {{'initial.T': [290, 300]}}, not {over!r}.", path="sweep.over")
    lists, arrays = dict(over), {}
    for path, values in over.items():
        if isinstance(values, Collection) and not isinstance(values, str | list | tuple | Mapping):
            lists[path] = plain_values(values)
            array = np.asarray(lists[path])
            if array.ndim == 1 and array.dtype.kind in "iuf":
                lists[path], arrays[path] = [], array.astype(float)
    return lists, arrays


def plan_of(
    section: SweepSection,
    units: Mapping[str, str],
    until: Mapping[str, float] | None = None,
    arrays: Mapping[str, Array] | None = None,
    tables: Iterable[str] = (),
) -> Plan:
    """Return the plan in SI; ``units`` are those of the changeable parameters, by path, ``tables`` paths of histories.

    ``until`` and ``arrays``, values in SI, override those of the section.
    """
    arrays = arrays or {}
    if not section.over and section.sample is None:
        raise section.error(NOTHING_SWEPT)
    _refuse_fixed(section, tables)
    axes = [_axis(path, tree, units, arrays.get(path)) for path, tree in section.over.items()]
    sample, trees = None, dict(zip((axis.path for axis in axes), section.over.values(), strict=True))
    if (drawn := section.sample) is not None:
        known = {_known(path, tree, units): tree for path, tree in drawn.of.items()}
        trees |= known
        draws = {path: _distribution(path, tree, units[path]) for path, tree in known.items()}
        sample = Sample(draws, drawn.runs, drawn.method, drawn.seed)
    ends = until or section.until
    paths = dict(trees)
    trees["sweep.until"] = Tree(None, Place(OVERRIDE)) if until else section.tree.value.get("until", section.tree)
    places = {path: replace(tree.place, path="") for path, tree in trees.items()}  # messages contain the path anyway
    told = {path: _scale(tree, units[path]) for path, tree in paths.items()}
    return Plan(axes, next(iter(ends.items())) if ends else None, section.combine != GRID, sample, places, told)


def _scale(tree: Tree, unit: str) -> tuple[str, float, float]:
    """Return the unit of the first quantity of a tree, else that in SI, with its zero and its one in SI."""
    found = (QUANTITY.fullmatch(each.value) for each in tree.walk() if isinstance(each.value, str))
    name = next((quantity[2] for quantity in found if quantity and quantity[2]), unit)
    return name, parse(f"0 {name}", unit), parse(f"1 {name}", unit)


def read_sweep(tree: Tree, usual: SweepSection | None = None) -> SweepSection:
    """Read a sweep; keys that are left out are taken from ``usual``."""
    section = read(SweepSection, data_files.with_files(tree, str(Path.cwd())), Context())
    if usual is not None:
        for name in keys(SweepSection):
            if not section.has(name):
                setattr(section, name, getattr(usual, name))
        section.tree = section.tree._replace(value={**usual.tree.mapping(), **section.tree.mapping()})
    return section


def read_until(tree: Tree) -> Mapping[str, float]:
    """Read a prescribed variable and the value at which each run ends."""
    return SWEEP_END.read(tree, "until", Context())


def _refuse_fixed(section: SweepSection, tables: Iterable[str]) -> None:
    """Raise InputError for a parameter that no run of a sweep can change."""
    fixed = dict.fromkeys(INTEGRATED_PATHS, INTEGRATED) | {f"{path}.": TABULATED for path in tables}
    for path, tree in {**section.over, **(section.sample.of if section.sample else {})}.items():
        if why := next((why for start, why in fixed.items() if f"{path}.".startswith(start)), ""):
            raise tree.error(f"{path} cannot be swept: {why}")


def _known(path: str, tree: Tree, units: Mapping[str, str]) -> str:
    """Return the path of a parameter; InputError if there is none."""
    path = parameter_path(path, units)
    refuse_unknown([path], units, "no parameter '{}' to sweep", tree.place, PATHS)
    return path


def _axis(path: str, tree: Tree, units: Mapping[str, str], array: Array | None) -> Axis:
    path = _known(path, tree, units)
    if array is not None and len(array) and np.isfinite(array).all():
        # Equally spaced values are a range, so that neither a plan nor its record stores each of them.
        spaced = EvenlySpaced(float(array[0]), float(array[-1]), len(array))
        if np.array_equal(spaced.at(np.arange(len(array))), array):
            return Axis(path, spaced)
    if array is not None:
        return Axis(path, array.tolist())
    values = SWEPT.read(tree, path, Context(x=units[path]))
    if not isinstance(values, RangeSection):
        return Axis(path, list(values))
    if values.points == 1 and values.first != values.last:
        raise values.error("a range of one value has one end; give two `points`, or a list.", "points")
    logarithmic = _logarithmic(values)
    return Axis(path, EvenlySpaced(values.first, values.last, values.points, logarithmic), logarithmic)


def _logarithmic(values: RangeSection | UniformSection) -> bool:
    """True if a range is spaced by ratios; InputError if its ends are not positive."""
    if values.spacing != LINEAR and not (values.first > 0 and values.last > 0):
        raise values.error("a logarithmic range needs ends above zero.", "spacing")
    return values.spacing != LINEAR


def _distribution(path: str, tree: Tree, unit: str) -> Distribution:
    section = read(DistributionSection, tree, Context(x=unit))
    given = {name: kind for name, kind in section.values.items() if kind is not None}
    if len(given) != 1:
        kinds = "uniform, normal, lognormal and table"
        raise tree.error(f"a distribution is one of {kinds}, `normal: {{mean: ..., std: ...}}`.")
    ((name, kind),) = given.items()
    if isinstance(kind, TableSection):
        return _column(kind, path, unit)
    if not isinstance(kind, UniformSection):
        return Distribution(name.capitalize(), kind.values)
    if not kind.first < kind.last:
        raise kind.error(f"the values from {kind.first:g} to {kind.last:g} do not increase.")
    return Distribution("Uniform", {"low": kind.first, "high": kind.last, "logarithmic": _logarithmic(kind)})


def _column(table: TableSection, path: str, unit: str) -> Distribution:
    """Return a column of a table; all columns of the same text are drawn by the same row."""
    if not table.csv:
        raise table.error("the table needs a `file`.")
    variable = path.rpartition(".")[2]
    content = data_files.CSVText(table.tree.value["csv"], renamed=True)
    values = content.column(table.column or variable, unit, variable)
    if not values:
        raise table.error("the table has no rows.")
    return Distribution("Drawn", {"values": values, "source": sha256(table.csv.encode()).hexdigest()[:12]})
