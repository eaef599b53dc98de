"""Numbers and units of a mechanism file that Cantera would take for something else."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from surfacechem.errors import InputError, suggestion
from surfacechem.mechanism.source import Source

UNITS = frozenset(
    ("length", "mass", "time", "quantity", "current", "temperature", "pressure", "energy", "activation-energy")
)
"""Dimensions for which a file may say what a bare number means."""

AMOUNT = ("quantity",)
ENERGY = ("activation-energy", "quantity")
BARE = {
    "site-density": (AMOUNT, "kmol/m^2", "1e-9 mol/m^2"),
    "A": (AMOUNT, "powers of m^2/kmol", "1e8 m^2/mol/s"),
    "Ea": (ENERGY, "J/kmol", "50 kJ/mol"),
    "E": (ENERGY, "J/kmol", "50 kJ/mol"),
    "h0": (AMOUNT, "J/kmol", "-10 kJ/mol"),
    "s0": (AMOUNT, "J/(kmol K)", "50 J/mol/K"),
    "cp0": (AMOUNT, "J/(kmol K)", "30 J/mol/K"),
}
"""Entries whose bare number Cantera counts per kmol: what in `units` says otherwise, the unit, and an example."""

DIMENSIONS = {"m": ("length",), "N/m": ("length",), "J": ENERGY, "J/mol": ENERGY}
"""What in `units` gives a bare number of that unit a meaning."""

EXAMPLES = {"m": "0.4 nm", "N/m": "1 pN/nm", "J": "10 kJ/mol", "J/mol": "50 kJ/mol"}

NUMBER = r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)"


def leading(value: Any) -> float:
    """The number with which a value begins; nan where there is none.

    >>> leading("-1e-9 mol/m^2"), leading(2)
    (-1e-09, 2.0)
    """
    if isinstance(value, int | float):
        return float(value)
    found = re.match(NUMBER, str(value))
    return float(found[1]) if found else float("nan")


def check_units(source: Source, node: Any) -> None:
    """The `units` of an entry are dimensions and units that exist."""
    import cantera

    given = node.get("units") if isinstance(node, Mapping) else None
    if given is None:
        return
    if not isinstance(given, Mapping):
        raise InputError(f"units: a mapping such as {{length: m, quantity: mol}}, not {given!r}.", source.place(node))
    for key, unit in given.items():
        place = source.place(given, key)
        if key not in UNITS:
            raise InputError(f"units: unknown key '{key}'.{suggestion(str(key), UNITS)}", place)
        if key == "temperature" and unit != "K":
            raise InputError(f"units: temperatures are in K, not in {unit}.", place)
        try:
            cantera.UnitSystem({key: str(unit)})  # type: ignore[arg-type]
        except cantera.CanteraError:
            raise InputError(f"units: {key}: '{unit}' is no unit of it that Cantera knows.", place) from None


def check_bare(source: Source, node: Any, key: str, title: str, entry: Any = None) -> None:
    """A number without a unit is refused where the file does not say what it counts in; zero needs no unit."""
    value = node.get(key)
    numbers = value if isinstance(value, list) else [value]
    wanted, unit, example = BARE[key]
    given = source.defaults(entry)
    if any(item in given for item in wanted):
        return
    for number in numbers:
        if isinstance(number, int | float) and number:
            message = (
                f"{title}: {key}: {number:g} without a unit counts in {unit}. Write it with its unit, such as "
                f"`{key}: {example}`, or say at the top `units: {{quantity: mol, activation-energy: kJ/mol}}`."
            )
            raise InputError(message, source.place(node, key))


def check_dimension(source: Source, node: Any, key: str, title: str, unit: str, entry: Any) -> None:
    """A length, stiffness or energy without a unit is refused where the file does not say what it counts in."""
    value, wanted = node.get(key), DIMENSIONS.get(unit, ())
    bare = isinstance(value, int | float) and value
    if bare and wanted and not any(item in source.defaults(entry) for item in wanted):
        message = f"{title}: {key}: {value:g} has no unit, and `units` says nothing about it; write it in {unit}, "
        raise InputError(f"{message}such as `{key}: {EXAMPLES[unit]}`.", source.place(node, key))


def check_positive(source: Source, node: Any, key: str, title: str) -> None:
    """A number that is there is above zero."""
    if key in node and not leading(node[key]) > 0:
        raise InputError(f"{title}: {key}: {node[key]!r} is no number above zero.", source.place(node, key))


def check_kelvin(source: Source, node: Any, key: str, title: str) -> None:
    """A temperature is in kelvin: Cantera reads degrees Celsius as such without a word."""
    value = node.get(key)
    unit = value.split()[-1] if isinstance(value, str) else "K"
    if value is not None and (unit != "K" or not leading(value) > 0):
        message = f"{title}: {key}: '{value}' is no temperature above zero in kelvin; write `{key}: 298.15 K`."
        raise InputError(message, source.place(node, key))
