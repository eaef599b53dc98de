"""What a mechanism gives beyond Cantera's own keys: parameters of rate types and springs of bonds, in SI units."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError
from surfacechem.mechanism.mixture import AVOGADRO, Spring
from surfacechem.mechanism.rates import SurfaceReaction
from surfacechem.mechanism.source import Source
from surfacechem.mechanism.thermo import KILO


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
