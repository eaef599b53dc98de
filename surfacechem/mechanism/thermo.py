"""Thermo of a species in its standard state: the molar Gibbs energy as one expression of temperature.

Enthalpy, entropy and heat capacity follow by differentiation. Source of the forms: Cantera's species thermo models
constant-cp, NASA7, NASA9 and Shomate (McBride, Zehe & Gordon, NASA/TP-2002-211556; NIST Chemistry WebBook).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, cast

from surfacechem.contracts.terms import Law, option, parameter
from surfacechem.expressions import Expression, log, where
from surfacechem.quantities import GAS_CONSTANT, KILO

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
    """A form of many coefficients, which are numbers in formulas, so that those of a reaction can be summed.

    A coefficient that a case changes becomes a parameter.
    """

    free: frozenset[str] = option("coefficients that are parameters", default=frozenset())

    @classmethod
    def of(cls, coefficients: Sequence[float]) -> Self:
        """Return the form with these coefficients, in the order of its parameters."""
        names = (name for name, _ in cls.specs())
        return cls(**cast(dict[str, Any], dict(zip(names, coefficients, strict=True))))

    def given(self, numbers: Mapping[str, float]) -> Self:
        """Return the same form with other coefficients, as parameters."""
        return replace(super().given(numbers), free=self.free | set(numbers))

    def is_default(self, name: str) -> bool:
        """True if a coefficient is a number in the formula."""
        return name not in self.free


class Nasa7(Series):
    """cp/R = a0 + a1 T + ... + a4 T^4, h/R = ... + a5, s/R = ... + a6."""

    a0: float = parameter("1", "constant part of cp/R")
    a1: float = parameter("1/K", "coefficient of T in cp/R")
    a2: float = parameter("1/K^2", "coefficient of T^2 in cp/R")
    a3: float = parameter("1/K^3", "coefficient of T^3 in cp/R")
    a4: float = parameter("1/K^4", "coefficient of T^4 in cp/R")
    a5: float = parameter("K", "constant part of h/R")
    a6: float = parameter("1", "constant part of s/R")

    def over_R(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        power = self.a0 * T * (1 - log(T)) - self.a1 * T**2 / 2 - self.a2 * T**3 / 6
        return power - self.a3 * T**4 / 12 - self.a4 * T**5 / 20 + self.a5 - self.a6 * T


class Nasa9(Series):
    """cp/R = a0/T^2 + a1/T + a2 + a3 T + ... + a6 T^4, h/R = ... + a7, s/R = ... + a8."""

    a0: float = parameter("K^2", "coefficient of 1/T^2 in cp/R")
    a1: float = parameter("K", "coefficient of 1/T in cp/R")
    a2: float = parameter("1", "constant part of cp/R")
    a3: float = parameter("1/K", "coefficient of T in cp/R")
    a4: float = parameter("1/K^2", "coefficient of T^2 in cp/R")
    a5: float = parameter("1/K^3", "coefficient of T^3 in cp/R")
    a6: float = parameter("1/K^4", "coefficient of T^4 in cp/R")
    a7: float = parameter("K", "constant part of h/R")
    a8: float = parameter("1", "constant part of s/R")

    def over_R(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        inverse = -self.a0 / (2 * T) + self.a1 * (log(T) + 1) + self.a2 * T * (1 - log(T))
        power = -self.a3 * T**2 / 2 - self.a4 * T**3 / 6 - self.a5 * T**4 / 12 - self.a6 * T**5 / 20
        return inverse + power + self.a7 - self.a8 * T


class Shomate(Series):
    """cp = A + B t + C t^2 + D t^3 + E / t^2 with t = T / 1000 K, h = 1000 K (A t + ... - E / t + F), s = ... + G."""

    A: float = parameter("J/(mol K)", "constant part of cp")
    B: float = parameter("J/(mol K)", "coefficient of t in cp")
    C: float = parameter("J/(mol K)", "coefficient of t^2 in cp")
    D: float = parameter("J/(mol K)", "coefficient of t^3 in cp")
    E: float = parameter("J/(mol K)", "coefficient of 1/t^2 in cp")
    F: float = parameter("J/(mol K)", "constant part of h over 1000 K")
    G: float = parameter("J/(mol K)", "constant part of s")

    def over_R(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        t = T / 1000
        h = self.A * t + self.B * t**2 / 2 + self.C * t**3 / 3 + self.D * t**4 / 4 - self.E / t + self.F
        s = self.A * log(t) + self.B * t + self.C * t**2 / 2 + self.D * t**3 / 3 - self.E / (2 * t**2) + self.G
        return 1000 * (h - t * s) / GAS_CONSTANT


@dataclass(frozen=True)
class ThermoRange:
    """A form valid up to the temperature ``top`` [K], which belongs to this range if ``closed``."""

    top: float
    form: GibbsForm
    closed: bool = True


@dataclass(frozen=True)
class StandardGibbs:
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
        return replace(self, pieces=tuple(replace(piece, form=form) for piece, form in pairs))


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
