"""Numbers and units of a mechanism file: those that Cantera would misread, and those that it does not know."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError, suggestion
from surfacechem.mechanism.mixture import AVOGADRO, Spring
from surfacechem.mechanism.rates import SurfaceReaction
from surfacechem.mechanism.source import Source
from surfacechem.mechanism.thermo import KILO

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


def rate_fields(law: type[SurfaceReaction], source: Source, entry: Any) -> dict[str, float]:
    """Own parameters of a rate type from the entry of its reaction."""
    specs, title = dict(law.specs()), f"reaction {entry.get('equation')}"
    defaults = {item.name for item in fields(law) if item.default is not MISSING}
    found: dict[str, float] = {}
    for key, name in law.own_keys().items():
        if key in entry:
            found[name] = _number(source, entry, entry, key, specs[name], title)
        elif name not in defaults:
            kind = law.kind.removeprefix("interface-")
            message = f"{title}: a rate of type {kind} needs `{key}`: {specs[name].text} [{specs[name].unit}]."
            raise InputError(message, source.place(entry))
    return found


def spring(source: Source, entry: Any) -> Spring | None:
    """The elasticity of a species; None where it has none."""
    bond = entry.get("bond")
    if bond is None:
        return None
    title = f"species {entry.get('name')}: bond"
    if "stiffness" not in bond:
        raise InputError(f"{title} needs `stiffness`: stiffness of the bond [N/m].", source.place(entry, "bond"))
    keys = {name.replace("_", "-"): (name, spec) for name, spec in Spring.specs()}
    items = ((name, key, spec) for key, (name, spec) in keys.items() if key in bond)
    found: Any = {name: _number(source, entry, bond, key, spec, title) for name, key, spec in items}
    return Spring(**found)


LONGEST = 1e-5
"""Lengths [m] above this are not those of molecules, not even of tethers."""


def _number(source: Source, entry: Any, node: Any, key: str, spec: Spec, title: str) -> float:
    """A number in SI units; what has no unit has that of the file."""
    import cantera

    place = source.place(node, key)
    declared: Any = source.defaults(entry)
    units = cantera.UnitSystem(declared)
    value = node[key]
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError(f"{title}: {key} must be a number, not {value!r}.", place)
    try:
        number = converted(units, value if isinstance(value, str) else float(value), spec.unit)
        spec.check(key, number)
    except InputError as error:
        named = error.message if error.message.startswith(key) else f"{key}: {error.message}"
        raise InputError(f"{title}: {named}", place) from None
    except (cantera.CanteraError, ValueError):
        raise InputError(f"{title}: {key} = {value} is not a quantity in {spec.unit}.", place) from None
    return number


def converted(units: Any, value: str | float, unit: str) -> float:
    """Energies may be per molecule or per mole, as Cantera's activation energies."""
    import cantera

    if unit == "1":
        return float(value)
    if unit == "J/mol":
        return float(units.convert_activation_energy_to(value, "J/kmol")) / KILO
    if unit == "J":
        try:
            return float(units.convert_to(value, "J")) if isinstance(value, str) else _per_molecule(units, value)
        except cantera.CanteraError:
            return _per_molecule(units, value)
    number = float(units.convert_to(value, unit))
    if unit == "m" and abs(number) > LONGEST:
        raise InputError(f"{value} is a length of {number:g} m, which no bond has; write it as `0.4 nm`.")
    return number


def _per_molecule(units: Any, value: str | float) -> float:
    return float(units.convert_activation_energy_to(value, "J/kmol")) / (KILO * AVOGADRO)
