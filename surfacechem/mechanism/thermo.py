"""Thermo of a species in its standard state: the molar Gibbs energy as one expression of temperature.

Enthalpy, entropy and heat capacity follow by differentiation. Source of the forms: Cantera's species thermo models
constant-cp, NASA7, NASA9 and Shomate (McBride, Zehe & Gordon, NASA/TP-2002-211556; NIST Chemistry WebBook).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from surfacechem.expressions import Expression, log, where
from surfacechem.quantities import GAS_CONSTANT

Form = Callable[[Sequence[float], Expression], Expression]


@dataclass(frozen=True)
class Piece:
    """Coefficients that hold up to the temperature ``top`` [K], which belongs to this piece if ``closed``."""

    top: float
    coefficients: tuple[float, ...]
    closed: bool = True


@dataclass(frozen=True)
class StandardGibbs:
    """Standard molar Gibbs energy over R [K] as a function of temperature.

    >>> water = StandardGibbs("constant-cp", (Piece(1e9, (298.15, -1000.0, 2.0, 0.0)),))
    >>> water(300.0)
    -1600.0
    """

    model: str
    pieces: tuple[Piece, ...]
    shift: float = 0.0
    """What is added to it for each kelvin, by a standard state of another coverage than one."""

    def __call__(self, T: Expression) -> Expression:
        """Value [K] at T [K]."""
        form = FORMS[self.model]
        value = form(self.pieces[-1].coefficients, T)
        for piece in reversed(self.pieces[:-1]):
            below = piece.top >= T if piece.closed else piece.top > T
            value = where(below, form(piece.coefficients, T), value)
        return value + self.shift * T if self.shift else value


def constant_cp(c: Sequence[float], T: Expression) -> Expression:
    """From (T0, h0/R, s0/R, cp/R): h = h0 + cp (T - T0), s = s0 + cp ln(T/T0)."""
    T0, h0, s0, cp = c
    value = h0 - T * s0
    return value + cp * (T - T0 - T * log(T / T0)) if cp else value


def nasa7(c: Sequence[float], T: Expression) -> Expression:
    """From a0..a6 of cp/R = a0 + a1 T + ... + a4 T^4, h/R = ... + a5, s/R = ... + a6."""
    power = c[0] * T * (1 - log(T)) - c[1] * T**2 / 2 - c[2] * T**3 / 6 - c[3] * T**4 / 12 - c[4] * T**5 / 20
    return power + c[5] - c[6] * T


def nasa9(c: Sequence[float], T: Expression) -> Expression:
    """From a0..a8 of cp/R = a0/T^2 + a1/T + a2 + a3 T + ... + a6 T^4, h/R = ... + a7, s/R = ... + a8."""
    inverse = -c[0] / (2 * T) + c[1] * (log(T) + 1) + c[2] * T * (1 - log(T))
    power = -c[3] * T**2 / 2 - c[4] * T**3 / 6 - c[5] * T**4 / 12 - c[6] * T**5 / 20
    return inverse + power + c[7] - c[8] * T


def shomate(c: Sequence[float], T: Expression) -> Expression:
    """From A..G, with t = T / 1000 K and cp = A + B t + C t^2 + D t^3 + E / t^2 [J/(mol K)]."""
    t = T / 1000
    A, B, C, D, E, F, G = c
    h = A * t + B * t**2 / 2 + C * t**3 / 3 + D * t**4 / 4 - E / t + F
    s = A * log(t) + B * t + C * t**2 / 2 + D * t**3 / 3 - E / (2 * t**2) + G
    return 1000 * (h - t * s) / GAS_CONSTANT


FORMS: dict[str, Form] = {"constant-cp": constant_cp, "NASA7": nasa7, "NASA9": nasa9, "Shomate": shomate}


def lower(thermo: Any) -> StandardGibbs | None:
    """Standard Gibbs energy of a Cantera species thermo object; None where its model is not known here."""
    readers = {
        "ConstantCp": _from_constant_cp,
        "NasaPoly2": _from_nasa7,
        "Nasa9PolyMultiTempRegion": _from_nasa9,
        "ShomatePoly2": _from_shomate,
    }
    reader = readers.get(type(thermo).__name__)
    return reader([float(x) for x in thermo.coeffs], float(thermo.max_temp)) if reader else None


MOLAR = GAS_CONSTANT * 1000.0
"""Gas constant per kmol, in which Cantera counts."""


def _from_constant_cp(c: list[float], top: float) -> StandardGibbs:
    return StandardGibbs("constant-cp", (Piece(top, (c[0], c[1] / MOLAR, c[2] / MOLAR, c[3] / MOLAR)),))


def _from_nasa7(c: list[float], top: float) -> StandardGibbs:
    return StandardGibbs("NASA7", _two(c[0], c[8:15], c[1:8], top))


def _from_shomate(c: list[float], top: float) -> StandardGibbs:
    return StandardGibbs("Shomate", _two(c[0], c[1:8], c[8:15], top))


def _two(middle: float, low: list[float], high: list[float], top: float) -> tuple[Piece, ...]:
    if low == high:
        return (Piece(top, tuple(low)),)
    return Piece(middle, tuple(low)), Piece(top, tuple(high))


def _from_nasa9(c: list[float], top: float) -> StandardGibbs:
    regions = [c[1 + 11 * i : 12 + 11 * i] for i in range(int(c[0]))]
    return StandardGibbs("NASA9", tuple(Piece(r[1], tuple(r[2:]), closed=False) for r in regions))
