"""Fluids of CoolProp, by their names there: pure and pseudo-pure fluids, mixtures, incompressible liquids.

CoolProp: Bell, Wronski, Quoilin & Lemort (2014), doi 10.1021/ie4033999.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts import fits
from surfacechem.contracts.terms import Fluid, FluidRange
from surfacechem.documents.cache_folder import cached, fingerprint, version
from surfacechem.errors import InputError

Array = NDArray[np.float64]

SATURATION_DISTANCE = 1e-5
"""Relative distance from saturation at which the range of properties ends."""

CRITICAL_DISTANCE = 0.1
"""Relative distance from the critical pressure within which properties may have no fit."""

PROPERTY_WORDS = {
    "k_m": "conductivity",
    "eta_m": "viscosity",
    "rho_m": "density",
    "cp_m": "heat capacity",
    "gamma_m": "ratio of heat capacities",
    "capacity_m": "heat capacity",
}

Getter = Callable[[str], Array]

PROPERTIES: Mapping[str, Callable[[Getter, Array], Array]] = {
    "k_m": lambda get, _: get("L"),
    "eta_m": lambda get, _: get("V"),
    "rho_m": lambda get, _: get("D"),
    "cp_m": lambda get, _: get("C"),
    "gamma_m": lambda get, _: get("C") / get("O"),
    "capacity_m": lambda get, T: get("D") * get("C") / T,
}
"""Properties from CoolProp's letters; the last one is rho c_p / T, whose integrals are entropy and energy."""


@dataclass(frozen=True)
class CoolPropFluid(Fluid):
    """A fluid at a constant pressure [Pa].

    >>> CoolPropFluid("Water", 101325.0).range(300.0).reason_high
    'Water at 101325 Pa boils'
    """

    name: str
    pressure: float

    def range(self, T: float) -> FluidRange:
        """Return the range of temperatures around T [K] in one phase; InputError if there are no properties at T."""
        low, high, boils, condenses = _limits(self)
        if not low <= T <= high:
            span = f"CoolProp's range is {low:g} to {high:g} K"
            raise InputError(f"{self.title} has no properties at {T:g} K: {span}.")
        end = f"{self.title} has no known properties"
        # A saturation temperature above T is the upper end, one below T the lower end.
        if boils is not None and boils > T:
            return FluidRange(low, boils * (1 - SATURATION_DISTANCE), end, f"{self.title} boils")
        if condenses is not None and condenses < T:
            dew = condenses * (1 + SATURATION_DISTANCE)
            return FluidRange(max(dew, low), high, f"{self.title} condenses" if dew > low else end, end)
        if boils is not None:
            raise InputError(f"{self.title} is a mixture of liquid and vapour at {T:g} K.")
        return FluidRange(low, high, end, end)

    def check(self) -> None:
        """Raise InputError unless CoolProp knows the fluid."""
        _limits(self)

    @property
    def title(self) -> str:
        """The fluid and its pressure in words."""
        return f"{self.name} at {self.pressure:g} Pa"

    def fit(self, quantity: str, low: float, high: float, target: float = fits.FIT_ACCURACY) -> tuple[fits.Piece, ...]:
        """Fit a property between two temperatures [K] to a relative accuracy; InputError if CoolProp has none."""
        return _fit(self, quantity, low, high, target)

    @property
    def remark(self) -> str:
        """Remark on the cost of a mixture without saturation at its pressure, so that its phase is unknown."""
        if len(self.name.split("&")) == 1 or any(_limits(self)[2:]):
            return ""
        slow = f"{self.name} is a mixture, of which CoolProp needs some 20 to 50 ms for each value"
        remedy = "Give the properties that matter as numbers where that is too long."
        return f"{slow}: each property takes seconds to fit, once on a machine. {remedy}"

    def critical_remark(self) -> str:
        """Return advice if the critical pressure is so close that properties are not smooth; else empty."""
        critical = self._asked("Pcrit")
        if critical is None or abs(self.pressure / critical - 1) > CRITICAL_DISTANCE:
            return ""
        jump = "within a tenth of it CoolProp's properties jump from temperature to temperature"
        remedy = "Give them as numbers under `interface.medium`, or another pressure."
        return f" The critical pressure is {critical:.6g} Pa; {jump}. {remedy}"

    def values(self, quantity: str, T: Array) -> Array:
        """Return CoolProp's values of a property at temperatures [K]."""
        return PROPERTIES[quantity](lambda letter: self._properties(letter, T), T)

    def _properties(self, letter: str, T: Array) -> Array:
        call, given, (boils, condenses) = _coolprop().PropsSI, "T", _limits(self)[2:]
        # For a mixture, which has two saturation temperatures, with the phase: CoolProp's search for it would take a
        # hundred times longer than a property.
        if boils != condenses and condenses is not None and T.min() >= condenses:
            given = "T|gas"
        elif boils != condenses and boils is not None and T.max() <= boils:
            given = "T|liquid"
        try:
            found = np.asarray(call(letter, given, T, "P", self.pressure, self.name), dtype=float)
        except ValueError:
            found = np.full(T.shape, np.inf)
        for bad in T[~np.isfinite(found)]:
            try:  # CoolProp gives the reason for a single value only
                value = call(letter, given, float(bad), "P", self.pressure, self.name)
                reason = f"no finite value at {bad:g} K, but {value}."
            except ValueError as error:
                reason = _reason(error)
            raise InputError(f"{self.title}: {reason}")
        return found

    def limits(self) -> list[float | None]:
        """Return the limits of the properties and the temperatures of boiling and condensing, if any [K]."""
        boils, condenses = (self._asked("T", "P", self.pressure, "Q", quality) for quality in (0, 1))
        coolprop, low, high = _coolprop(), self._call("Tmin"), self._call("Tmax")
        freezes = self._asked("T_freeze") or 0.0
        with suppress(ValueError):  # mixtures, substances without a melting line, and pressures beyond its ends
            melting = coolprop.AbstractState("?", self.name).melting_line
            freezes = float(melting(coolprop.iT, coolprop.iP, self.pressure))
        # CoolProp's minimum may belong to the liquid, which a vapour below the triple pressure does not reach.
        if freezes * (1 + SATURATION_DISTANCE) > low:
            low = freezes * (1 + SATURATION_DISTANCE)
        elif self.pressure < (self._asked("p_triple") or 0.0):
            low *= 1 + SATURATION_DISTANCE
        # Of a mixture near its critical point CoolProp finds only one of them.
        if boils is not None and condenses is None:
            condenses = self._end("gas", high, boils)
        elif condenses is not None and boils is None:
            boils = self._end("liquid", low, condenses)
        return [low, high, boils, condenses]

    def _asked(self, *question: str | float) -> float | None:
        """Return a number of the fluid from CoolProp: a constant, or its temperature at saturation; None if it has
        none.
        """
        try:
            return float(_coolprop().PropsSI(*question, self.name))
        except ValueError:
            return None

    def _end(self, phase: str, inside: float, outside: float) -> float | None:
        """Return the temperature [K] at which a phase ends, by bisection; None if ``inside`` is in another phase."""
        state = partial(_coolprop().PhaseSI, "T")
        if state(inside, "P", self.pressure, self.name) != phase:
            return None
        while abs(inside - outside) > SATURATION_DISTANCE * inside:
            middle = (inside + outside) / 2
            if state(middle, "P", self.pressure, self.name) == phase:
                inside = middle
            else:
                outside = middle
        return inside

    def _call(self, letter: str) -> float:
        try:
            return float(_coolprop().PropsSI(letter, "T", 0, "P", 0, self.name))
        except ValueError as error:
            close = difflib.get_close_matches(self.name, _coolprop().FluidsList(), n=1)
            hint = f"Did you mean '{close[0]}'?" if close else _reason(error)
            raise InputError(f"CoolProp knows no fluid '{self.name}'. {hint}") from None


@cache
def _limits(fluid: CoolPropFluid) -> tuple[float, float, float | None, float | None]:
    mark = fingerprint(fluid, "limits", version("CoolProp"))
    low, high, boils, condenses = cached(mark, [Path(__file__)], fluid.limits)
    return low, high, boils, condenses


@cache
def _fit(fluid: CoolPropFluid, quantity: str, low: float, high: float, target: float) -> tuple[fits.Piece, ...]:
    def find() -> list[Any] | str:
        try:
            found = fits.fit(lambda T: fluid.values(quantity, T), low, high, target)
        except fits.NoFitError as error:
            return str(error)
        return [[piece.low, piece.high, piece.coefficients] for piece in found]

    mark = fingerprint(fluid, quantity, low, high, target, version("CoolProp"))
    found = cached(mark, [Path(fits.__file__)], find)
    if isinstance(found, str):
        message = f"the {PROPERTY_WORDS[quantity]} of {fluid.title} cannot be fitted: {found}"
        raise InputError(message + fluid.critical_remark())
    return tuple(fits.Piece(low, high, tuple(coefficients)) for low, high, coefficients in found)


def _coolprop() -> Any:
    from CoolProp import CoolProp

    return CoolProp


def _reason(error: ValueError) -> str:
    """Return CoolProp's error message without the call that it repeats."""
    return re.sub(r"\s*:? *PropsSI\(.*", "", str(error), flags=re.DOTALL).strip().rstrip(".") + "."
