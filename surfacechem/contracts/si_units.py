"""Factors to SI for the units that cases mostly use, without the 0.15 s for importing Pint.

Results agree with Pint's to the last digit; unusual or wrong units are left to Pint and its messages.

>>> factor("kJ/m^2/K", "J/(m^2 K)")
Decimal('1E+3')
>>> factor("furlong", "m") is None
True
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache
from itertools import chain, repeat

ZERO_CELSIUS = Decimal("273.15")
"""0 degC in K."""

POWER_TOWER = re.compile(r"[\d²³⁰-⁹]\s*\)*\s*(?:\^|\*\*)|(?:\^|\*\*)\s*(?![-+(\d])")
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
def factor(given: str, target: str) -> Decimal | None:
    """Return the factor from one unit to another; None if either is unusual or their dimensions differ."""
    try:
        (ours, powers), (theirs, wanted) = _parsed(given), _parsed(target)
    except _LeftToPintError:
        return None
    return ours / theirs if powers == wanted else None


def _parsed(text: str) -> tuple[Decimal, dict[str, int]]:
    """Return the factor and the powers of the base units of a text."""
    value, powers = Decimal(1), Counter[str]()
    for name, power in factors(text):
        if name not in KNOWN:
            raise _LeftToPintError
        number, own = KNOWN[name]
        value = value * number**power if power > 0 else value / number**-power
        for base, n in own.items():
            powers[base] += n * power
    return value, {base: power for base, power in powers.items() if power}


def factors(text: str) -> list[tuple[str, int]]:
    """Return the names in a product or quotient of units, each with its power.

    >>> factors("W/(m^2 K)")
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
