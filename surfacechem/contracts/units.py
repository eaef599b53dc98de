"""Quantities with units: ``"10 pN"`` to SI, with the dimension checked.

A number is in SI units already; a text is "value unit". The usual units are converted by a table of factors to SI,
without the 0.15 s for importing Pint; Pint does all others and the messages, and is imported when it is needed.

>>> parse("1 kJ/m^2/K", "J/(m^2 K)")
1000.0
>>> parse("25 degC", "K")
298.15
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache
from itertools import chain, repeat
from numbers import Real
from typing import Any

import numpy as np

from surfacechem.errors import InputError, Place, suggestion

ZERO_CELSIUS = Decimal("273.15")
"""0 degC in K."""

POWER_TOWER = re.compile(r"[\d²³⁰-⁹]\s*\)*\s*(?:\^|\*\*)|(?:\^|\*\*)(?!\s*[-+(\d])")
"""Powers of powers, such as 9^9^9, whose evaluation would not end, and powers of numbers."""

_FACTOR = re.compile(r"([^\W\d_]+|%|1)(?:(?:\^|\*\*)([-+]?\d+))?")
_PRODUCT = re.compile(rf"{_FACTOR.pattern}((\s*\*\s*|\s+){_FACTOR.pattern})*")

_BASE_UNITS: Mapping[str, Mapping[str, int]] = {
    "1": {},
    "m": {"m": 1},
    "g": {"g": 1},
    "s": {"s": 1},
    "K": {"K": 1},
    "A": {"A": 1},
    "mol": {"mol": 1},
    "rad": {"rad": 1},
    "Hz": {"s": -1},
    "N": {"g": 1, "m": 1, "s": -2},
    "Pa": {"g": 1, "m": -1, "s": -2},
    "J": {"g": 1, "m": 2, "s": -2},
    "W": {"g": 1, "m": 2, "s": -3},
    "V": {"g": 1, "m": 2, "s": -3, "A": -1},
    "F": {"g": -1, "m": -2, "s": 4, "A": 2},
}
"""Powers of the base units in each unit; grams, not kilograms, since prefixes apply to the gram."""

_KILOGRAM = Decimal(1000)
_PREFIXES = {"G": 9, "M": 6, "k": 3, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9, "p": -12}
_PREFIXED = ("m", "g", "s", "mol", "Hz", "N", "Pa", "J", "W", "A", "V", "F")
THERMAL_ENERGY = Decimal("1.380649e-23") * Decimal("298.15")
"""kT [J] at 25 degC, a unit of the energy of single bonds: 4.116 pN nm."""

ELECTRON_VOLT = Decimal("1.602176634e-19")
"""J (exact, SI 2019)."""

_DERIVED_UNITS: Mapping[str, tuple[Decimal | int, str]] = {
    "min": (60, "s"),
    "minute": (60, "s"),
    "h": (3600, "s"),
    "hour": (3600, "s"),
    "day": (86400, "s"),
    "cm": (Decimal("0.01"), "m"),
    "kT": (THERMAL_ENERGY, "J"),
    "bar": (100_000, "Pa"),
    "atm": (101_325, "Pa"),
    "torr": (Decimal(101_325) / 760, "Pa"),
    "eV": (ELECTRON_VOLT, "J"),
    "meV": (ELECTRON_VOLT / 1000, "J"),
    "ppm": (Decimal("1e-6"), "1"),
    "percent": (Decimal("0.01"), "1"),
    "%": (Decimal("0.01"), "1"),
}
"""Units that are multiples of another unit."""


def _table() -> dict[str, tuple[Decimal, Mapping[str, int]]]:
    """Return the factor to base units and their powers for every known name."""
    found = {}
    for name, powers in _BASE_UNITS.items():
        # One newton is a thousand g m/s^2.
        factor = Decimal(1) if name == "g" else _KILOGRAM ** powers.get("g", 0)
        found[name] = (factor, powers)
        if name in _PREFIXED:
            found |= {prefix + name: (factor.scaleb(power), powers) for prefix, power in _PREFIXES.items()}
    return found | {name: (found[base][0] * number, found[base][1]) for name, (number, base) in _DERIVED_UNITS.items()}


KNOWN = _table()


class _LeftToPintError(Exception):
    """The text has to be parsed by Pint."""


@lru_cache(maxsize=1024)
def si_factor(given: str, target: str) -> Decimal | None:
    """Return the factor from one unit to another; None if either is unusual or their dimensions differ."""
    try:
        (ours, powers), (theirs, wanted) = _parsed(given), _parsed(target)
    except _LeftToPintError:
        return None
    return ours / theirs if powers == wanted else None


def _parsed(text: str) -> tuple[Decimal, dict[str, int]]:
    """Return the factor and the powers of the base units of a text."""
    value, powers = Decimal(1), Counter[str]()
    for name, power in si_factors(text):
        if name not in KNOWN:
            raise _LeftToPintError
        number, own = KNOWN[name]
        value = value * number**power if power > 0 else value / number**-power
        for base, n in own.items():
            powers[base] += n * power
    return value, {base: power for base, power in powers.items() if power}


def si_factors(text: str) -> list[tuple[str, int]]:
    """Return the names in a product or quotient of units, each with its power.

    >>> si_factors("W/(m^2 K)")
    [('W', 1), ('m', -2), ('K', -1)]
    """
    if POWER_TOWER.search(text):
        raise _LeftToPintError
    found = []
    for sign, side in zip(chain([1], repeat(-1)), text.split("/"), strict=False):
        inside = side.strip()
        if inside[:1] + inside[-1:] == "()":
            inside = inside[1:-1]
        elif sign < 0 and _FACTOR.fullmatch(inside) is None:  # "J/m^2 K" is ambiguous to a reader
            raise _LeftToPintError
        if _PRODUCT.fullmatch(inside) is None:
            raise _LeftToPintError
        found += [(name, sign * int(power or 1)) for name, power in _FACTOR.findall(inside)]
    return found


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
QUANTITY = re.compile(rf"({_NUMBER})\s*(.*)", re.DOTALL)
_NOT_FINITE = re.compile(r"[-+]?\.?(?:inf|nan)", re.IGNORECASE)

_EXPONENT = re.compile(r"(?:\^|\*\*)\s*\(?\s*[-+]?\s*\d{1,2}(?![\d.])")
_POWER = re.compile(r"(?<![A-Za-z0-9_µμ])([A-Za-zµμ]+)([-+]\d|[2-4])(?![\w.])")
"""Powers in the notation of CF conventions and many papers: s-1, W m-2 K-1, um2."""

_MOST_CHARACTERS = 100
"""Largest number of characters of a quantity."""

DIMENSION_UNITS = {
    "a pure number": "1",
    "an angle": "rad",
    "a length": "m",
    "an area": "m^2",
    "a volume": "m^3",
    "a time": "s",
    "a rate": "1/s",
    "a velocity": "m/s",
    "an acceleration": "m/s^2",
    "a mass": "kg",
    "a force": "N",
    "a pressure": "Pa",
    "a pressure rate": "Pa/s",
    "a stiffness per area": "Pa/m",
    "a viscosity": "Pa s",
    "a temperature": "K",
    "a temperature rate": "K/s",
    "an inverse temperature": "1/K",
    "an energy": "J",
    "a power": "W",
    "an energy per area": "J/m^2",
    "a molar energy": "J/mol",
    "a heat flux": "W/m^2",
    "a heat capacity": "J/K",
    "a heat capacity per area": "J/(m^2 K)",
    "a thermal conductance": "W/(m^2 K)",
    "a thermal conductivity": "W/(m K)",
    "a number per area": "1/m^2",
    "a molar amount per area": "mol/m^2",
    "a rate per area": "1/(m^2 s)",
    "a rate constant per energy": "1/(J s)",
    "a rate constant per energy and area": "1/(J s m^2)",
    "an inverse length": "1/m",
    "an amount of substance": "mol",
    "an electric charge": "coulomb",
    "a capacitance": "farad",
    "a capacitance per area": "F/m^2",
    "an electric potential": "V",
    "an electric current": "A",
    "an electric current per area": "A/m^2",
}
"""Dimensions in words, for messages, each with a unit of that dimension."""

_HINT = ' Write it like "J/(m^2 K)" or "1/um^2".'

PER_PARTICLE = {"electron_volt", "millielectron_volt", "kiloelectron_volt", "kT"}
"""Energies per particle, accepted where a molar energy is required."""

SUGGESTED_UNITS = (
    *("K", "degC", "degF", "m", "mm", "um", "nm", "pm", "s", "ms", "us", "ns", "min", "h", "day", "kg", "g", "percent"),
    *("N", "mN", "uN", "nN", "pN", "Pa", "kPa", "MPa", "GPa", "bar", "J", "kJ", "MJ", "mJ", "uJ", "eV", "meV", "kcal"),
    *("W", "kW", "MW", "mW", "mol", "kmol", "rad", "deg", "Hz", "kHz", "meter", "second", "kelvin", "joule", "watt"),
)
"""Units for the suggestion after a misspelt one."""


def parse(
    value: object, unit: str, place: Place | None = None, name: str = "the value", *, difference: bool = False
) -> float:
    """Return the value in SI; InputError unless it is finite and either a number or a text with a unit that fits.

    ``name`` is the quantity that needs the value, for the message. ``difference`` marks an interval, for which a
    temperature scale with an offset has no meaning.

    >>> parse("3 nm/s", "m", name="g_n")
    Traceback (most recent call last):
        ...
    surfacechem.errors.InputError: 3 nm/s is a velocity; g_n needs a length [m].
    """
    try:
        number = _number(value, unit, name, difference)
    except InputError as error:
        raise (error.at(place) if place else error) from None
    if not math.isfinite(number):
        raise InputError(f"{name} must be finite, got {_short(str(value)[:60])}.", place)
    return number


def _number(value: object, unit: str, name: str, difference: bool) -> float:
    if getattr(value, "ndim", None) == 0:  # a zero-dimensional array, as from indexing xarray
        value = plain_values(value)
    if isinstance(value, Real) and not isinstance(value, bool):
        return _as_float(value)
    if not isinstance(value, str):
        raise InputError(f"{name} needs {dimension(unit)}, got {_kind(value)}.")
    text = value.strip()
    if _NOT_FINITE.fullmatch(text):
        raise InputError(f"{name} must be finite, got {text}.")
    found = QUANTITY.fullmatch(text) if len(text) <= _MOST_CHARACTERS else None
    if found is None or found[2][:1] in ("-", "+", ","):  # as of 280-340 K or 0,5 mm
        point = " Decimals follow a point." if found and found[2][0] == "," else ""
        raise InputError(f"{_short(text)} is not a number with a unit; {name} needs {dimension(unit)}.{point}")
    return _converted(found[1], found[2], unit, name, difference) if found[2] else float(found[1])


def plain_values(array: Any) -> Any:
    """Return the numbers of an array of NumPy, xarray or Pint; where it says its unit, as texts with that unit.

    >>> plain_values(np.array([1.5, 2.0])), plain_values(np.float64(3.0))
    ([1.5, 2.0], 3.0)
    """
    number = getattr(array, "magnitude", array)
    unit = array.units if number is not array else getattr(array, "attrs", {}).get("units")
    values = np.asarray(number).tolist()
    if not unit:
        return values
    return [f"{value} {unit}" for value in values] if isinstance(values, list) else f"{values} {unit}"


def _as_float(value: Real | Decimal) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _kind(value: object) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    return {"dict": "a mapping", "list": "a list"}.get(type(value).__name__, f"a {type(value).__name__}")


def _short(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")


def _converted(number: str, given: str, unit: str, name: str, difference: bool) -> float:
    given = _POWER.sub(r"\1^\2", given)
    try:
        if (factor := si_factor(given, unit)) is not None:
            return float(Decimal(number) * factor)
        if given == "degC" and unit == "K" and not difference:
            return float(Decimal(number) + ZERO_CELSIUS)
    except ArithmeticError:
        pass  # Pint reports numbers that are too large
    return _by_pint(number, given, unit, name, difference)


def _by_pint(number: str, given: str, unit: str, name: str, difference: bool) -> float:
    registry, target, shown = _registry(), _unit(unit), f"{number} {given}"
    if given in ("C", "F") and target.is_compatible_with("K"):
        kelvin = float(registry.Quantity(Decimal(number), f"deg{given}").m_as("K"))
        raise InputError(f'{shown} is {_described(_unit(given))}; write "{number} deg{given}" or {kelvin:.10g} K.')
    try:
        source = _per_particle(_unit(given), target)
        if difference and source in (registry.degC, registry.degF):
            raise InputError(f"{shown} is a temperature, {name} a difference of temperatures; give it in K.")
        if not source.is_compatible_with(target):
            raise InputError(f"{shown} is {_described(source)}; {name} needs {dimension(unit)}.")
        # Pint treats radians as one, so that 1 rpm would not be 1/60 Hz.
        angles = ["radian" in str(registry.Quantity(1, each).to_root_units().units) for each in (source, target)]
        if angles == [True, False]:
            raise InputError(f"{shown} counts an angle; {name} needs {dimension(unit)}: cycles per second in Hz, say.")
        return _as_float(registry.Quantity(Decimal(number), source).m_as(target))
    except TypeError:  # Pint takes no logarithms of decimals
        raise InputError(f"{shown} is in a logarithmic unit; {name} needs {dimension(unit)}.") from None
    except ArithmeticError:
        raise InputError(f"{shown} is too large or too small to convert to {unit}.") from None


def _per_particle(source: Any, target: Any) -> Any:
    """Return the unit per mole if it is meant per particle, and the converse: eV for J/mol, kJ/mol for J."""
    registry = _registry()
    of_one = not PER_PARTICLE.isdisjoint(map(str, source._units))
    if of_one and target.is_compatible_with("J/mol") and source.is_compatible_with("J"):
        return source / registry.particle
    if target.is_compatible_with("J") and source.is_compatible_with("J/mol"):
        return source * registry.particle
    return source


@lru_cache(maxsize=1024)
def _unit(text: str) -> Any:
    """Return Pint's unit of a text; InputError if there is none."""
    import pint

    numbers = re.findall(r"(?<!\w)[\d.]+", _EXPONENT.sub("", text))
    if POWER_TOWER.search(text) or any(number != "1" for number in numbers):
        raise InputError(f"{_short(text)} is not a unit.{_HINT}")
    try:
        unit = _registry().parse_units(f"1{text}" if text.startswith("/") else text)
        _ = unit.dimensionality  # logarithmic units in a quotient, such as 1/Np, fail only here
        return unit
    except pint.UndefinedUnitError as error:
        names: Any = error.unit_names
        unknown = names if isinstance(names, str) else names[0]
        guess = suggestion(unknown, SUGGESTED_UNITS).partition(" Known")[0]
        raise InputError(f"no unit '{unknown}'.{guess or _HINT}") from None
    except Exception:  # its parser is Python's tokenizer, which fails in many ways
        raise InputError(f"{_short(text)} is not a unit.{_HINT}") from None


def quotient(unit: str, per: str) -> str:
    """Return the quotient of two units.

    >>> quotient("m", "s"), quotient("m/s", "s"), quotient("W/m^2", "s"), quotient("1", "m/s")
    ('m/s', 'm/s^2', 'W/(m^2 s)', 's/m')
    """
    powers: dict[str, int] = {}
    for text, sign in ((unit, 1), (per, -1)):
        for base, power in si_factors(text or "1"):
            powers[base] = powers.get(base, 0) + sign * power
    powers.pop("1", None)
    written = {base: base if abs(power) == 1 else f"{base}^{abs(power)}" for base, power in powers.items()}
    top, bottom = ([written[base] for base, power in powers.items() if power * sign > 0] for sign in (1, -1))
    below = f"({' '.join(bottom)})" if len(bottom) > 1 else "".join(bottom)
    return "/".join([" ".join(top) or "1", *([below] if below else [])])


TOTAL_UNITS = {
    "Pa": "N",
    "Pa/s": "N/s",
    "Pa/m": "N/m",
    "Pa s/m": "N s/m",
    "kg/m^2": "kg",
    "J/m^2": "J",
    "W/m^2": "W",
    "J/(m^2 K)": "J/K",
    "W/(m^2 K)": "W/K",
    "1/m^2": "1",
    "1/(m^2 s)": "1/s",
}
"""Units of quantities per area, each with the unit of the total for a pair of bodies."""


def dimension(unit: str) -> str:
    """Return the dimension of a unit in words: ``a length [m]``."""
    exact = next((words for words, known in DIMENSION_UNITS.items() if known == unit), None)
    words = exact or _words().get(_unit(unit).dimensionality)
    measured = f"{words} [{unit}]" if words else f"a quantity in {unit}"
    return measured if unit != "1" else "a pure number"


def _described(unit: Any) -> str:
    """Return the dimension of a unit in words, else the unit in SI."""
    words = _words().get(unit.dimensionality)
    return words or f"a quantity in {_registry().Quantity(1, unit).to_base_units().units:~}"


@lru_cache(maxsize=1)
def _words() -> dict[Any, str]:
    return {_unit(unit).dimensionality: words for words, unit in reversed(DIMENSION_UNITS.items())}


@lru_cache(maxsize=1)
def _registry() -> Any:
    """Return Pint's registry, cached in the user's cache folder if possible; in decimals, so that 1/um^2 is 1e12."""
    import pint

    registry: Any
    try:
        registry = pint.UnitRegistry(cache_folder=":auto:", non_int_type=Decimal)
    except Exception:  # the folder may be read-only, the file half written by another process
        registry = pint.UnitRegistry(non_int_type=Decimal)
    registry.define(f"kT = {THERMAL_ENERGY} joule")  # not a thousand tesla
    return registry
