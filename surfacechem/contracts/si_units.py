"""Factors to SI of the units that cases are mostly written in, without the 0.15 s that importing Pint takes.

What is read here is what Pint reads, to the last digit; whatever is unusual or wrong is left to Pint and its messages.

>>> factor("kJ/m^2/K", "J/(m^2 K)")
Decimal('1E+3')
>>> factor("furlong", "m") is None
True
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from decimal import Decimal
from functools import lru_cache

ZERO_CELSIUS = Decimal("273.15")
"""0 degC in K."""

TOWER = re.compile(r"[\d²³⁰-⁹]\s*\)*\s*(?:\^|\*\*)|(?:\^|\*\*)\s*(?![-+(\d])")
"""Powers of powers, such as 9^9^9, which would never end, and of numbers."""

_TOKEN = re.compile(r"[^\W\d_]+|%|1(?![\d.])|\*\*|[-+]?\d+|[()*/^]|\s+")

_BASES: Mapping[str, Mapping[str, int]] = {
    "1": {},
    "m": {"m": 1},
    "g": {"g": 1},
    "s": {"s": 1},
    "K": {"K": 1},
    "mol": {"mol": 1},
    "rad": {"rad": 1},
    "Hz": {"s": -1},
    "N": {"g": 1, "m": 1, "s": -2},
    "Pa": {"g": 1, "m": -1, "s": -2},
    "J": {"g": 1, "m": 2, "s": -2},
    "W": {"g": 1, "m": 2, "s": -3},
}
"""Powers of the base units in each unit; grams and not kilograms, as the prefix belongs to the gram."""

_KILOGRAM = Decimal(1000)
_PREFIXES = {"G": 9, "M": 6, "k": 3, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9, "p": -12}
_PREFIXED = ("m", "g", "s", "mol", "Hz", "N", "Pa", "J", "W")
THERMAL_ENERGY = Decimal("1.380649e-23") * Decimal("298.15")
"""kT [J] at 25 degC, in which energies of single bonds are given: 4.116 pN nm."""

_OTHERS: Mapping[str, tuple[Decimal | int, str]] = {
    "min": (60, "s"),
    "minute": (60, "s"),
    "h": (3600, "s"),
    "hour": (3600, "s"),
    "day": (86400, "s"),
    "cm": (Decimal("0.01"), "m"),
    "kT": (THERMAL_ENERGY, "J"),
    "bar": (100_000, "Pa"),
    "atm": (101_325, "Pa"),
    "percent": (Decimal("0.01"), "1"),
    "%": (Decimal("0.01"), "1"),
}
"""Units that are a number times another one."""


def _table() -> dict[str, tuple[Decimal, Mapping[str, int]]]:
    """Every known name with its factor to grams, metres, seconds, kelvin and moles, and with its powers of them."""
    found = {}
    for name, powers in _BASES.items():
        # One newton is a thousand g m/s^2.
        factor = Decimal(1) if name == "g" else _KILOGRAM ** powers.get("g", 0)
        found[name] = (factor, powers)
        if name in _PREFIXED:
            found |= {prefix + name: (factor.scaleb(power), powers) for prefix, power in _PREFIXES.items()}
    return found | {name: (found[base][0] * number, found[base][1]) for name, (number, base) in _OTHERS.items()}


TABLE = _table()


class _UnusualError(Exception):
    """Ends the reading of a text that is left to Pint."""


@lru_cache(maxsize=1024)
def factor(given: str, target: str) -> Decimal | None:
    """The factor from one unit to another; None where either is unusual or where they do not measure the same."""
    try:
        (ours, powers), (theirs, wanted) = _read(given), _read(target)
    except _UnusualError:
        return None
    return ours / theirs if powers == wanted else None


def _read(text: str) -> tuple[Decimal, dict[str, int]]:
    """Factor and powers of the base units of a text."""
    tokens = _TOKEN.findall(text)
    if "".join(tokens) != text or not text or text[0] in "*/^" or TOWER.search(text):
        raise _UnusualError
    stream = iter([token.strip() or " " for token in tokens] + [""])
    value, powers, last = _product(stream)
    if last:
        raise _UnusualError
    return value, {base: power for base, power in powers.items() if power}


def _product(stream: Iterator[str]) -> tuple[Decimal, Counter[str], str]:
    """Factors with `*`, a space or `/` between, as far as a closing parenthesis or the end, which is given, too."""
    value, powers, sign, divided = Decimal(1), Counter[str](), 1, False
    while True:
        number, own, token = _factor(stream)
        value = value * number if sign > 0 else value / number
        for base, power in own.items():
            powers[base] += sign * power
        if token in (")", ""):
            return value, powers, token
        # In "J/m^2 K" the eye reads another unit than the rules.
        if token not in ("*", " ", "/") or (divided and token != "/"):
            raise _UnusualError
        sign = -1 if token == "/" else 1
        divided = token == "/"


def _factor(stream: Iterator[str]) -> tuple[Decimal, Mapping[str, int], str]:
    """A name or a product in parentheses, with its power, and the token that follows."""
    token = next(stream)
    number: Decimal
    powers: Mapping[str, int]
    if token == "(":
        number, powers, last = _product(stream)
        if last != ")":
            raise _UnusualError
    elif token in TABLE:
        number, powers = TABLE[token]
    else:
        raise _UnusualError
    token = next(stream)
    if token not in ("^", "**"):
        return number, powers, token
    try:
        power = int(next(stream))
    except ValueError:
        raise _UnusualError from None
    return number**power, {base: n * power for base, n in powers.items()}, next(stream)
