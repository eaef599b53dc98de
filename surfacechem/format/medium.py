"""The medium between the bodies: a fluid by name, single properties, a thickness."""

from __future__ import annotations

from collections.abc import Mapping

from surfacechem.contracts.substances import Fluid, Property
from surfacechem.contracts.terms import Spec
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError
from surfacechem.format.fields import items, mapping, number, text
from surfacechem.format.laws import Units, law
from surfacechem.quantities import VARIABLES
from surfacechem.scene import Medium

PROPERTIES = {"conductivity": "k_m", "viscosity": "eta_m", "density": "rho_m", "heat-capacity": "cp_m"}
"""Keys of single properties and the quantities that they are."""

MEDIUM_KEYS = ("fluid", "pressure", "temperatures", "thickness", *PROPERTIES)


def read_medium(tree: Tree | None, units: Units) -> Medium | None:
    """The medium of an interface, if it has one."""
    if tree is None:
        return None
    given = mapping(tree, MEDIUM_KEYS)
    properties = {name: _property(given[key], key, name, units) for key, name in PROPERTIES.items() if key in given}
    thickness = _positive(given["thickness"], "thickness", "m") if "thickness" in given else None
    temperatures = tuple(_positive(item, "temperature", "K") for item in items(given.get("temperatures"), "[300 K]"))
    return Medium(_fluid(tree, given), properties, thickness, temperatures)


def _positive(tree: Tree, name: str, unit: str) -> float:
    return number(tree, unit, name, Spec(unit, name, above=0))


def _property(tree: Tree, key: str, name: str, units: Units) -> float | Property:
    unit = VARIABLES[name].unit
    if not isinstance(tree.value, dict):
        return _positive(tree, key, unit)
    found: Property = law(Property, tree, units, unit)
    if found.quantity != name:
        raise tree.error(f"{found.name()} is a law of the {VARIABLES[found.quantity].long_name}, not of the {key}.")
    return found


def _fluid(tree: Tree, given: Mapping[str, Tree]) -> Fluid | None:
    if "fluid" not in given:
        for key in ("pressure", "temperatures"):
            if key in given:
                raise given[key].error(f"`{key}` belongs to a fluid. Add `fluid:`, or remove it.")
        return None
    if "pressure" not in given:
        raise tree.error("the fluid needs a `pressure`, for example `pressure: 1 atm`.")
    from surfacechem.media.coolprop import CoolPropFluid

    fluid = CoolPropFluid(text(given["fluid"], "fluid"), _positive(given["pressure"], "pressure", "Pa"))
    try:
        fluid.check()
    except InputError as error:
        raise error.at(given["fluid"].place) from None
    return fluid
