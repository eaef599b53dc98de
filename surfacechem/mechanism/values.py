"""Numbers of a mechanism file that Cantera does not know, in SI units."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any

from surfacechem.contracts.terms import Law, Spec
from surfacechem.errors import InputError
from surfacechem.mechanism.mixture import AVOGADRO
from surfacechem.mechanism.source import Source
from surfacechem.mechanism.thermo import KILO

NUMBER = r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"


def leading(value: Any) -> float:
    """The number with which a value begins; nan where there is none.

    >>> leading("-1e-9 mol/m^2"), leading(2)
    (-1e-09, 2.0)
    """
    if isinstance(value, int | float):
        return float(value)
    found = re.match(NUMBER, str(value))
    return float(found[1]) if found else float("nan")


def own_parameters(
    law: type[Law], keys: Mapping[str, str], node: Any, who: str, read: Callable[[str, Spec], float]
) -> dict[str, float]:
    """Parameters of a law from an entry that has them by these keys, each ``read`` as it is specified.

    InputError where one that has no default is not there.
    """
    specs = dict(law.specs())
    optional = {item.name for item in fields(law) if item.default is not MISSING}
    for key, name in keys.items():
        if key not in node and name not in optional:
            raise InputError(f"{who} needs `{key}`: {specs[name].text} [{specs[name].unit}].")
    return {name: read(key, specs[name]) for key, name in keys.items() if key in node}


LONGEST = 1e-5
"""Lengths [m] above this are not those of molecules, not even of tethers."""


def number(source: Source, entry: Any, node: Any, key: str, spec: Spec, title: str = "") -> float:
    """A number in its SI unit and range; what has no unit has that of the file."""
    import cantera

    declared: Any = source.defaults(entry)
    value = node[key]
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise source.error(f"{title}{key} must be a number, not {value!r}.", node, key)
    try:
        units = cantera.UnitSystem(declared)
        found = converted(units, value if isinstance(value, str) else float(value), spec.unit)
        spec.check(key, found)
    except InputError as error:
        named = error.message if error.message.startswith(key) else f"{key}: {error.message}"
        raise source.error(f"{title}{named}", node, key) from None
    except (cantera.CanteraError, ValueError):
        raise source.error(f"{title}{key} = {value} is not a quantity in {spec.unit}.", node, key) from None
    return found


def converted(units: Any, value: str | float, unit: str) -> float:
    """A number in an SI unit; energies may be per molecule or per mole, as Cantera's activation energies."""
    import cantera

    if unit == "1":
        return float(value)
    if unit == "J" and isinstance(value, str):
        try:
            return float(units.convert_to(value, "J"))
        except cantera.CanteraError:
            pass  # an energy per amount
    if unit in ("J", "J/mol"):
        return float(units.convert_activation_energy_to(value, "J/kmol")) / (KILO * (AVOGADRO if unit == "J" else 1))
    number = float(units.convert_to(value, unit))
    # A number in metres that was meant in nanometres is not caught by its unit.
    if unit == "m" and abs(number) > LONGEST:
        raise InputError(f"{value} is a length of {number:g} m, which no bond has; write it as `0.4 nm`.")
    return number
