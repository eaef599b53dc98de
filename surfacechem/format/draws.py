"""Samples of uncertain parameters: their distributions, and the draws of each run as functions of its index."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

HALF_SPACING = 2.0**-53
"""Offset of numbers in [0, 1), so that none is zero: there the quantile of a normal distribution is infinite."""

FEISTEL_ROUNDS = 6
"""Rounds of a permutation: four make it indistinguishable from a random one, two more cost little."""


class Distribution(ABC):
    """Probability distribution of the value of a parameter."""

    source: str = ""
    """Name of a random number shared by all parameters with this source; empty if each has its own."""

    @abstractmethod
    def at(self, u: Array) -> Array:
        """Return quantiles: the values below which the fractions ``u`` of all draws lie."""

    @property
    def over_decades(self) -> bool:
        """True if the distribution is one of ratios of values."""
        return False

    @property
    def record(self) -> dict[str, Any]:
        """Entries from which the distribution can be restored."""
        return {"kind": type(self).__name__, **asdict(self)}  # type: ignore[call-overload]


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform distribution between two values, or of the logarithm between theirs."""

    low: float
    high: float
    logarithmic: bool = False

    @property
    def over_decades(self) -> bool:
        return self.logarithmic

    def at(self, u: Array) -> Array:
        if not self.logarithmic:
            return self.low + (self.high - self.low) * u
        return np.asarray(np.exp(np.log(self.low) + np.log(self.high / self.low) * u))


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal distribution, by its mean and standard deviation."""

    mean: float
    std: float

    def at(self, u: Array) -> Array:
        return self.mean + self.std * _standard_normal(u)


@dataclass(frozen=True)
class Lognormal(Distribution):
    """Lognormal distribution, by its median and the standard deviation of the logarithm."""

    median: float
    sigma: float

    @property
    def over_decades(self) -> bool:
        return True

    def at(self, u: Array) -> Array:
        return np.asarray(self.median * np.exp(self.sigma * _standard_normal(u)))


@dataclass(frozen=True)
class Drawn(Distribution):
    """Uniform distribution over the rows of a table; columns of one table are drawn by the same row."""

    values: tuple[float, ...]
    source: str = ""

    def at(self, u: Array) -> Array:
        return np.array(self.values)[np.minimum((u * len(self.values)).astype(np.int64), len(self.values) - 1)]


TYPES: Mapping[str, Callable[..., Distribution]] = {kind.__name__: kind for kind in (Uniform, Normal, Lognormal, Drawn)}


def _standard_normal(u: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri(u))


@dataclass(frozen=True)
class Sample:
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
        given = {name: tuple(value) if isinstance(value, list) else value for name, value in record.items()}
        draws[str(path)] = TYPES[str(given.pop("kind"))](**given)
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
