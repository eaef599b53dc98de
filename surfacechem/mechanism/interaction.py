r"""Thermo of species that depends on coverages: Cantera's ``thermo: coverage-dependent-surface``.

The enthalpy and entropy of species k change with the coverages of species j,

.. math:: g_k^{ex} = \sum_j \left[ h_{kj}(\theta_j) - T s_{kj}(\theta_j)
          + \theta_j^2 \int_{T_r}^T \left( 1 - \frac{T}{T'} \right) (a_{kj} \ln T' + b_{kj})\,dT' \right],
          \quad T_r = 298.15\,\mathrm{K}

They derive from one potential only if the order in which coverages change is irrelevant,
:math:`\partial g_k / \partial n_j = \partial g_j / \partial n_k`. A dependence on the own coverage always does; one on
another coverage does if it is linear and the other species has the same dependence on this one, per site.

The entries are read from ``coverage-dependencies``.

Source: Cantera's CoverageDependentSurfPhase; Maxwell's relation of a potential of several variables.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from surfacechem.expressions import Expression, log, where
from surfacechem.mechanism.source import Source
from surfacechem.quantities import KILO
from surfacechem.tolerances import EQUAL

REFERENCE_T = 298.15
"""Reference temperature [K] of heat capacities."""


@dataclass(frozen=True)
class PiecewisePolynomial:
    """A continuous piecewise polynomial of one coverage, zero at zero coverage.

    ``pieces`` holds for each piece the coverage at which it begins and its coefficients of the powers of the coverage.

    >>> PiecewisePolynomial.through([0.0, 0.5, 1.0], [0.0, 1.0, 3.0])(0.75)
    2.0
    >>> PiecewisePolynomial.polynomial([2.0, 1.0]).integral(1.0)
    1.3333333333333333
    """

    pieces: tuple[tuple[float, tuple[float, ...]], ...] = ()

    @classmethod
    def polynomial(cls, coefficients: Sequence[float]) -> PiecewisePolynomial:
        """Return a polynomial from the coefficients of the first power and up."""
        return cls(((0.0, (0.0, *coefficients)),) if any(coefficients) else ())

    @classmethod
    def through(cls, coverages: Sequence[float], values: Sequence[float]) -> PiecewisePolynomial:
        """Return the piecewise linear function through points."""
        lines = []
        for x, y, x_2, y_2 in zip(coverages, values, coverages[1:], values[1:], strict=False):
            slope = (y_2 - y) / (x_2 - x)
            lines.append((x, (y - slope * x, slope)))
        return cls(tuple(lines) if any(values) else ())

    @property
    def slope(self) -> float | None:
        """The slope of a straight line through zero; None for any other curve."""
        if not self.pieces:
            return 0.0
        slopes = [coefficients[1] for _, coefficients in self.pieces]
        # Straight up to rounding of the coefficients, which a file may give with nine digits.
        size = EQUAL * max(map(abs, slopes))
        straight = all(abs(c) <= size for _, coefficients in self.pieces for c in (coefficients[0], *coefficients[2:]))
        return slopes[0] if straight and max(slopes) - min(slopes) <= size else None

    def __call__(self, theta: Expression) -> Expression:
        """Return the value at a coverage."""
        rows = [(start, _power_sum(c, theta)) for start, c in self.pieces]
        value: Expression = rows[0][1] if rows else 0.0
        for start, row in rows[1:]:
            value = where(theta >= start, row, value)
        return value

    @property
    def integral(self) -> PiecewisePolynomial:
        """The integral from zero coverage."""
        pieces: list[tuple[float, tuple[float, ...]]] = []
        for start, c in self.pieces:
            whole = (0.0, *(value / (power + 1) for power, value in enumerate(c)))
            past = _power_sum(pieces[-1][1], start) if pieces else 0.0
            pieces.append((start, (past - _power_sum(whole, start), *whole[1:])))
        return PiecewisePolynomial(tuple(pieces))


def _power_sum(coefficients: Sequence[float], theta: Expression) -> Expression:
    value: Expression = 0.0
    for coefficient in reversed(coefficients):
        value = value * theta + coefficient
    return value


@dataclass(frozen=True)
class Interaction:
    """Dependence of the enthalpy [J/mol] and entropy [J/(mol K)] of a species on one coverage."""

    on: str
    """The species with the coverage."""
    variable: str
    """Name of its coverage."""
    enthalpy: PiecewisePolynomial = PiecewisePolynomial()
    entropy: PiecewisePolynomial = PiecewisePolynomial()
    a: float = 0.0
    b: float = 0.0

    def gibbs(self, T: Expression, theta: Expression) -> Expression:
        """Gibbs energy [J/mol]."""
        return self.enthalpy(theta) - T * self.entropy(theta) + self._capacity(T) * theta**2

    def integral(self, T: Expression, theta: Expression) -> Expression:
        """Return the integral of the Gibbs energy over the coverage."""
        return self.enthalpy.integral(theta) - T * self.entropy.integral(theta) + self._capacity(T) * theta**3 / 3

    @property
    def slopes(self) -> tuple[float, float] | None:
        """Enthalpy and entropy per coverage if both are linear and there is no heat capacity; else None."""
        h, s = self.enthalpy.slope, self.entropy.slope
        return None if h is None or s is None or self.a or self.b else (h, s)

    def _capacity(self, T: Expression) -> Expression:
        """Return the Gibbs energy of the heat capacity a ln T + b, at a coverage of one."""
        if not (self.a or self.b):
            return 0.0

        def enthalpy(t: Expression) -> Expression:
            return t * (self.a * log(t) - self.a + self.b)

        def entropy(t: Expression) -> Expression:
            return log(t) * (self.a * log(t) + 2 * self.b) / 2

        return enthalpy(T) - enthalpy(REFERENCE_T) - T * (entropy(T) - entropy(REFERENCE_T))


KEY = "coverage-dependencies"

MODEL_KEYS = {
    "linear": ("enthalpy", "entropy"),
    "polynomial": ("enthalpy-coefficients", "entropy-coefficients"),
    "piecewise-linear": (
        *("enthalpy-low", "enthalpy-high", "enthalpy-change"),
        *("entropy-low", "entropy-high", "entropy-change"),
    ),
    "interpolative": ("enthalpy-coverages", "enthalpies", "entropy-coverages", "entropies"),
}
"""Keys of each model."""

CAPACITY_KEYS = ("heat-capacity-a", "heat-capacity-b")

COEFFICIENTS = 4
"""Number of coefficients of a polynomial in Cantera."""

PAIRED_KEYS = (
    *(("heat-capacity-a", "heat-capacity-b"), ("enthalpy-coverages", "enthalpies"), ("entropy-coverages", "entropies")),
    *(("enthalpy-low", "enthalpy-high", "enthalpy-change"), ("entropy-low", "entropy-high", "entropy-change")),
)
"""Groups of keys of which each requires the others."""


def interactions(source: Source, entry: Any, variables: Mapping[str, str]) -> tuple[Interaction, ...]:
    """Return the dependences of a species' thermo on coverages; ``variables`` has their names by species."""
    found = []
    for name, node in (entry.get(KEY) or {}).items():
        read = partial(_numbers, source, entry, node)
        h, s = _curve(node, read, "enthalpy", "enthalpies"), _curve(node, read, "entropy", "entropies")
        a, b = (read(key)[0] if key in node else 0.0 for key in CAPACITY_KEYS)
        found.append(Interaction(str(name), variables[str(name)], h, s, a, b))
    return tuple(found)


def _numbers(source: Source, entry: Any, node: Any, key: str) -> list[float]:
    """Return one or several values, in J, mol and K."""
    import cantera

    # Keys of energies begin with "enthalp", those of entropies do not.
    value, unit = node[key], "J/kmol" if key.startswith("enthalp") else "J/kmol/K"
    declared: Any = {**source.defaults(entry), **(node.get("units") or {})}
    units = cantera.UnitSystem(declared)
    found = [float(units.convert_to(x, unit)) / KILO for x in (value if isinstance(value, list) else [value])]
    if not all(map(math.isfinite, found)):
        raise source.error(f"species {entry['name']}: {KEY}: {key} must be finite, got {value}.", node, key)
    return found


def _curve(node: Any, read: Callable[[str], list[float]], kind: str, many: str) -> PiecewisePolynomial:
    """Return the enthalpy or the entropy as a function of the coverage."""
    for key in (kind, f"{kind}-coefficients"):
        if key in node:
            return PiecewisePolynomial.polynomial(read(key))
    if many in node:
        return PiecewisePolynomial.through([float(x) for x in node[f"{kind}-coverages"]], read(many))
    if f"{kind}-change" in node:
        knot, low, high = float(node[f"{kind}-change"]), read(f"{kind}-low")[0], read(f"{kind}-high")[0]
        return PiecewisePolynomial.through([0.0, knot, 1.0], [0.0, low * knot, low * knot + (1 - knot) * high])
    return PiecewisePolynomial()
