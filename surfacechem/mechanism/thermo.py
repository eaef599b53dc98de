r"""Thermo of surface species: the standard state, its dependence on coverages, and the free energy of their mixture.

The molar Gibbs energy of a species in its standard state is one expression of temperature; enthalpy, entropy and heat
capacity follow by differentiation. Source of the forms: Cantera's species thermo models constant-cp, NASA7, NASA9 and
Shomate (McBride, Zehe & Gordon, NASA/TP-2002-211556; NIST Chemistry WebBook). The thermodynamics of the species follows
from the free energy of their ideal mixture.

With Cantera's ``thermo: coverage-dependent-surface`` the enthalpy and entropy of species k change with the coverages of
species j,

.. math:: g_k^{ex} = \sum_j \left[ h_{kj}(\theta_j) - T s_{kj}(\theta_j)
          + \theta_j^2 \int_{T_r}^T \left( 1 - \frac{T}{T'} \right) (a_{kj} \ln T' + b_{kj})\,dT' \right],
          \quad T_r = 298.15\,\mathrm{K}

They derive from one potential only if the order in which coverages change is irrelevant,
:math:`\partial g_k / \partial n_j = \partial g_j / \partial n_k`. A dependence on the own coverage always does; one on
another coverage does if it is linear and the other species has the same dependence on this one, per site. The entries
are read from ``coverage-dependencies``. Source: Cantera's CoverageDependentSurfPhase; Maxwell's relation of a potential
of several variables.
"""

from __future__ import annotations

import inspect
import math
import re
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import chain, count
from typing import Any, ClassVar, NamedTuple, Self, cast

from surfacechem.contracts.terms import Law, Potential, option, parameter
from surfacechem.expressions import Expression, by_ranges, log, mixing, polynomial, where
from surfacechem.mechanism.source import Source
from surfacechem.quantities import AVOGADRO, BOLTZMANN, GAS_CONSTANT, KILO
from surfacechem.tolerances import EQUAL

Bind = Callable[[Any, str, str], Any]
"""Function that binds a law, or a species, once: it gets it, its path in a case and the suffix of its parameters'
names."""


class GibbsForm(Law):
    """Standard molar Gibbs energy over R [K] as a function of temperature."""

    contract = "thermo"
    formula = "over_R"

    @abstractmethod
    def over_R(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""


class ConstantCp(GibbsForm):
    """Constant heat capacity: h = h0 + cp0 (T - T0), s = s0 + cp0 ln(T/T0).

    >>> round(ConstantCp(h0=-8314.462618, s0=16.628925236).over_R(300.0), 6)
    -1600.0
    """

    T0: float = parameter("K", "temperature at which h0 and s0 hold", default=298.15, above=0)
    h0: float = parameter("J/mol", "enthalpy at T0", default=0.0)
    s0: float = parameter("J/(mol K)", "entropy at T0", default=0.0)
    cp0: float = parameter("J/(mol K)", "heat capacity", default=0.0)

    def over_R(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        value = self.h0 / GAS_CONSTANT - T * (self.s0 / GAS_CONSTANT)
        # Without a heat capacity T0 does not enter.
        return value + self.cp0 / GAS_CONSTANT * (T - self.T0 - T * log(T / self.T0)) if self.cp0 != 0 else value


class Series(GibbsForm):
    """A heat capacity that is a sum of powers of temperature, with constants of enthalpy and entropy as last numbers.

    Coefficients are numbers in formulas, so that those of a reaction can be summed. One that a case changes becomes a
    parameter.
    """

    powers: ClassVar[tuple[int, ...]]
    """Power of each coefficient of the heat capacity."""
    scale: ClassVar[float] = 1.0
    """Unit of temperature [K] in the powers."""
    unit: ClassVar[float] = 1.0
    """The gas constant in the unit of the coefficients."""

    free: frozenset[str] = option("coefficients that are parameters", default=frozenset())

    @classmethod
    def of(cls, coefficients: Sequence[float]) -> Self:
        """Return the form with these coefficients, in the order of its parameters."""
        names = (name for name, _ in cls.specs())
        return cls(**cast(dict[str, Any], dict(zip(names, coefficients, strict=True))))

    def over_R(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        *coefficients, h, s = (getattr(self, name) for name, _ in self.specs())
        t = T / self.scale if self.scale != 1 else T
        value = h - s * t
        for c, p in zip(coefficients, self.powers, strict=True):
            # The integral of t^p, less t times that of t^(p - 1).
            special = {0: t * (1 - log(t)), -1: log(t) + 1}
            value += c * special[p] if p in special else -c * t ** (p + 1) / (p * (p + 1))
        return self.scale * value / self.unit if self.scale != 1 else value

    def given(self, numbers: Mapping[str, float]) -> Self:
        """Return the same form with other coefficients, as parameters."""
        return replace(super().given(numbers), free=self.free | set(numbers))

    def is_default(self, name: str) -> bool:
        """True if a coefficient is a number in the formula."""
        return name not in self.free


class Nasa7(Series):
    """cp/R = a0 + a1 T + ... + a4 T^4, h/R = ... + a5, s/R = ... + a6."""

    powers = 0, 1, 2, 3, 4

    a0: float = parameter("1", "constant part of cp/R")
    a1: float = parameter("1/K", "coefficient of T in cp/R")
    a2: float = parameter("1/K^2", "coefficient of T^2 in cp/R")
    a3: float = parameter("1/K^3", "coefficient of T^3 in cp/R")
    a4: float = parameter("1/K^4", "coefficient of T^4 in cp/R")
    a5: float = parameter("K", "constant part of h/R")
    a6: float = parameter("1", "constant part of s/R")


class Nasa9(Series):
    """cp/R = a0/T^2 + a1/T + a2 + a3 T + ... + a6 T^4, h/R = ... + a7, s/R = ... + a8."""

    powers = -2, -1, 0, 1, 2, 3, 4

    a0: float = parameter("K^2", "coefficient of 1/T^2 in cp/R")
    a1: float = parameter("K", "coefficient of 1/T in cp/R")
    a2: float = parameter("1", "constant part of cp/R")
    a3: float = parameter("1/K", "coefficient of T in cp/R")
    a4: float = parameter("1/K^2", "coefficient of T^2 in cp/R")
    a5: float = parameter("1/K^3", "coefficient of T^3 in cp/R")
    a6: float = parameter("1/K^4", "coefficient of T^4 in cp/R")
    a7: float = parameter("K", "constant part of h/R")
    a8: float = parameter("1", "constant part of s/R")


class Shomate(Series):
    """cp = A + B t + C t^2 + D t^3 + E / t^2 with t = T / 1000 K, h = 1000 K (A t + ... - E / t + F), s = ... + G."""

    powers, scale, unit = (0, 1, 2, 3, -2), 1000.0, GAS_CONSTANT

    A: float = parameter("J/(mol K)", "constant part of cp")
    B: float = parameter("J/(mol K)", "coefficient of t in cp")
    C: float = parameter("J/(mol K)", "coefficient of t^2 in cp")
    D: float = parameter("J/(mol K)", "coefficient of t^3 in cp")
    E: float = parameter("J/(mol K)", "coefficient of 1/t^2 in cp")
    F: float = parameter("J/(mol K)", "constant part of h over 1000 K")
    G: float = parameter("J/(mol K)", "constant part of s")


class ThermoRange(NamedTuple):
    """A form valid up to the temperature ``top`` [K], which belongs to this range if ``closed``."""

    top: float
    form: GibbsForm
    closed: bool = True


class StandardGibbs(NamedTuple):
    """Standard molar Gibbs energy over R [K] as a function of temperature, in one or several ranges.

    >>> water = StandardGibbs((ThermoRange(1e9, ConstantCp(h0=-8314.462618, s0=16.628925236)),))
    >>> round(water(300.0), 6)
    -1600.0
    """

    pieces: tuple[ThermoRange, ...]
    shift: float = 0.0
    """Constant added per kelvin, for a standard state at a coverage other than one."""

    def __call__(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        # From the top down, as conditions nest; beyond the ends the outer forms extrapolate.
        value = self.pieces[-1].form.over_R(T)
        for piece in reversed(self.pieces[:-1]):
            below = piece.top >= T if piece.closed else piece.top > T
            value = where(below, piece.form.over_R(T), value)
        return value + self.shift * T if self.shift else value

    @property
    def ranges(self) -> dict[str, GibbsForm]:
        """The forms by the names of their ranges; a single form has an empty name."""
        several = len(self.pieces) > 1
        return {f"range_{k}" if several else "": piece.form for k, piece in enumerate(self.pieces, start=1)}

    def with_forms(self, forms: Sequence[GibbsForm]) -> StandardGibbs:
        """Return a copy with other forms in its ranges."""
        pairs = zip(self.pieces, forms, strict=True)
        return self._replace(pieces=tuple(piece._replace(form=form) for piece, form in pairs))


TWO_RANGES: Mapping[str, tuple[type[Series], int, int]] = {"NasaPoly2": (Nasa7, 8, 1), "ShomatePoly2": (Shomate, 1, 8)}
"""Cantera's models with two ranges: the form, and the first coefficient of the lower and of the upper range."""


def lower(thermo: Any) -> StandardGibbs:
    """Return the standard Gibbs energy of a Cantera species thermo object."""
    model, top, c = type(thermo).__name__, float(thermo.max_temp), [float(x) for x in thermo.coeffs]
    if model == "ConstantCp":
        h0, s0, cp0 = (x / KILO for x in c[1:])
        return StandardGibbs((ThermoRange(top, ConstantCp(T0=c[0], h0=h0, s0=s0, cp0=cp0)),))
    if model == "Nasa9PolyMultiTempRegion":
        regions = [c[1 + 11 * i : 12 + 11 * i] for i in range(int(c[0]))]
        return StandardGibbs(tuple(ThermoRange(r[1], Nasa9.of(r[2:]), closed=False) for r in regions))
    form, *starts = TWO_RANGES[model]
    low, high = (c[start : start + 7] for start in starts)
    # Cantera repeats a single range.
    below = () if low == high else (ThermoRange(c[0], form.of(low)),)
    return StandardGibbs((*below, ThermoRange(top, form.of(high))))


REFERENCE_T = 298.15
"""Reference temperature [K] of heat capacities."""


class PiecewisePolynomial(NamedTuple):
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
        if not self.pieces:
            return 0.0
        *below, last = [polynomial(theta, c) for _, c in self.pieces]
        ends = [start for start, _ in self.pieces[1:]]
        return by_ranges(theta, list(zip(ends, below, strict=True)), last)

    @property
    def integral(self) -> PiecewisePolynomial:
        """The integral from zero coverage."""
        pieces: list[tuple[float, tuple[float, ...]]] = []
        for start, c in self.pieces:
            whole = (0.0, *(value / (power + 1) for power, value in enumerate(c)))
            past = polynomial(start, pieces[-1][1]) if pieces else 0.0
            pieces.append((start, (past - polynomial(start, whole), *whole[1:])))
        return PiecewisePolynomial(tuple(pieces))


class Interaction(NamedTuple):
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

CAPACITY_KEYS = ("heat-capacity-a", "heat-capacity-b")

MODEL_KEYS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "linear": (("enthalpy",), ("entropy",)),
    "polynomial": (("enthalpy-coefficients",), ("entropy-coefficients",)),
    "piecewise-linear": (
        ("enthalpy-low", "enthalpy-high", "enthalpy-change"),
        ("entropy-low", "entropy-high", "entropy-change"),
    ),
    "interpolative": (("enthalpy-coverages", "enthalpies"), ("entropy-coverages", "entropies")),
}
"""Keys of each model, in groups of which each key requires the others."""

COEFFICIENTS = 4
"""Number of coefficients of a polynomial in Cantera."""


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


class Formula:
    """A formula whose argument names are known only after a mechanism is read."""

    def __init__(self, names: Iterable[str], evaluate: Callable[[Mapping[str, Expression]], Expression]) -> None:
        self.evaluate = evaluate
        self.__signature__ = _signature(tuple(dict.fromkeys(names)))

    def __call__(self, **values: Expression) -> Expression:
        """Evaluate at the named values."""
        return self.evaluate(values)


@lru_cache(maxsize=1024)  # a reaction states several formulas of the same variables
def _signature(names: tuple[str, ...]) -> inspect.Signature:
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Signature([inspect.Parameter(name, keyword) for name in names])


SPECIES_PATH = "interface.mechanism.species"
"""Path at which a case changes parameters of species."""


class BondSpring(Law):
    """Elasticity of a bond across the gap."""

    contract = "elasticity"
    formula = "energy"

    stiffness: float = parameter("N/m", "stiffness of the bond", at_least=0)
    rest_length: float = parameter("m", "length without force", default=0.0)

    def energy(self, g_n: Expression) -> Expression:
        """Elastic energy [J] of one bond.

        >>> round(BondSpring(stiffness=1e-3).energy(2e-9), 33)
        2e-21
        """
        return self.stiffness * (g_n - self.rest_length) ** 2 / 2


class Species(NamedTuple):
    """A surface species: names in the mechanism and of its coverage, sites, thermo and elasticity.

    ``interactions`` are the dependences of its thermo on coverages.
    """

    name: str
    variable: str
    sites: float
    gibbs: StandardGibbs
    spring: BondSpring | None = None
    interactions: tuple[Interaction, ...] = ()
    fixed: bool = False
    """True if its parameters cannot change, because Cantera uses those of the file."""

    @property
    def path(self) -> str:
        """Path at which a case changes its parameters."""
        return f"{SPECIES_PATH}.{self.name}"

    def bound(self, bind: Bind) -> Species:
        """Return the species with symbols for the parameters of its thermo and its spring."""
        if self.fixed:
            return self
        end = self.variable.removeprefix("theta")
        spring = bind(self.spring, self.path, end) if self.spring else None
        paths = [(form, ".".join(filter(None, (self.path, key))), key) for key, form in self.gibbs.ranges.items()]
        forms = [bind(form, path, f"{end}_{key}" if key else end) for form, path, key in paths]
        return self._replace(gibbs=self.gibbs.with_forms(forms), spring=spring)

    @property
    def amount(self) -> str:
        """Name of the amount per reference area at full coverage [1/m^2]."""
        return f"N_{self.variable}"

    @property
    def concentration(self) -> str:
        """Name of the amount per current area at full coverage [1/m^2]."""
        return f"n_{self.variable}"


class IdealMixture(Potential):
    r"""Free energy of species that share the sites of a surface and mix ideally.

    .. math:: \Psi = \sum_k N_k \theta_k \left[ g_k(T) + w_k(g_n) + k_B T (\ln \theta_k - 1) \right], \quad
              \frac{1}{N_k} \frac{\partial \Psi}{\partial \theta_k} = g_k(T) + w_k(g_n) + k_B T \ln \theta_k

    :math:`w_k = \tfrac12 k_b (g_n - l_0)^2` is the elastic energy of species that are springs across the gap,
    :math:`N_k` is the amount of species k at full coverage, the site density over the sites that k takes. If the
    thermo of species depends on coverages, the energy of their interactions is added, see
    :mod:`surfacechem.mechanism.thermo`. Source: Kee, Coltrin, Glarborg & Zhu, Chemically Reacting Flow (2018),
    ch. 11; the chemical potentials, enthalpies, entropies and heat capacities of Cantera's ideal-surface and
    coverage-dependent-surface phases. 0 <= theta_k <= 1.
    """

    species: tuple[Species, ...] = option("species of the surface phase")
    temperatures: tuple[float, float] = option("range of the species' thermodynamic data [K]")

    def with_parts(self, bind: Bind) -> Self:
        """Return the mixture with symbols for the parameters of its species."""
        return self.bind({"species": tuple(bind(item, item.path, "") for item in self.species)})

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Temperature range of the thermodynamic data."""
        return {"T_c": self.temperatures}

    @property
    def energy(self) -> Formula:  # type: ignore[override]
        """Free energy [J/m^2] as a function of temperature, coverages and amounts at full coverage."""
        names = (name for species in self.species for name in (species.variable, species.amount))
        gap = ("g_n",) if any(species.spring for species in self.species) else ()
        return Formula(("T_c", *gap, *names), self._energy)

    def _energy(self, values: Mapping[str, Expression]) -> Expression:
        T = values["T_c"]
        total: Expression = 0
        around: Expression = 0
        seen: set[frozenset[str]] = set()
        for species in self.species:
            theta, amount = values[species.variable], values[species.amount]
            elastic = species.spring.energy(values["g_n"]) if species.spring else 0
            # Mixing is proportional to T: as a separate term it cancels from the internal energy.
            total += amount * theta * (BOLTZMANN * species.gibbs(T) + elastic)
            total += amount * BOLTZMANN * T * (mixing(theta) - theta)
            for interaction in species.interactions:
                other, pair = values[interaction.variable], frozenset((species.name, interaction.on))
                if interaction.on == species.name:
                    around += amount * interaction.integral(T, theta)
                elif pair not in seen:  # each pair counts once
                    around += amount * theta * interaction.gibbs(T, other)
                seen.add(pair)
        return total + around / AVOGADRO if seen else total


def unpaired_dependence(species: Sequence[Species]) -> tuple[str, str] | None:
    """Return the first species with a dependence on another that derives from no potential, and the other; or None."""
    by_name = {item.name: item for item in species}
    pairs = [(item, x, by_name[x.on]) for item in species for x in item.interactions if x.on != item.name]
    # Maxwell: d g_k / d n_j = d g_j / d n_k, where n is a coverage over the number of sites of the species.
    for item, interaction, other in pairs:
        back = next((x for x in other.interactions if x.on == item.name), Interaction(item.name, item.variable))
        ours, theirs = interaction.slopes, back.slopes
        if ours is None or theirs is None:
            return item.name, other.name
        for slope, same in zip(ours, theirs, strict=True):
            x, y = slope / item.sites, same / other.sites
            if abs(x - y) > EQUAL * max(abs(x), abs(y)):
                return item.name, other.name
    return None


def word(name: str) -> str:
    """Return a Cantera name as part of the name of a quantity.

    >>> word("Li+[elyt]")
    'Li_elyt'
    """
    return re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_") or "species"


def identifiers(names: Iterable[str], prefix: str = "theta_") -> dict[str, str]:
    """Return a unique valid name of the coverage (or other variable) of each species.

    >>> identifiers(["free(s)", "bond(s)", "free-s"])
    {'free(s)': 'theta_free_s', 'bond(s)': 'theta_bond_s', 'free-s': 'theta_free_s_2'}
    """
    result: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        base = f"{prefix}{word(name)}"
        result[name] = next(n for n in chain((base,), (f"{base}_{i}" for i in count(2))) if n not in taken)
        taken.add(result[name])
    return result
