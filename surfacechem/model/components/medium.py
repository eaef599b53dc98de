"""The medium between the bodies: its properties as functions of the interface temperature, for the laws that ask.

A property of a fluid is a polynomial in pieces whose coefficients are parameters; they hold between two temperatures,
and a run that reaches these goes on with others. The thermal free energy is the double integral of such a polynomial,
so that capacity, entropy and energy belong together exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

from surfacechem.contracts.substances import Property
from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, log
from surfacechem.model.build import Build
from surfacechem.model.components.fluid import FluidFit
from surfacechem.quantities import VARIABLES
from surfacechem.scene import Medium

PATH = "interface.medium"

KEYS = {"k_m": "conductivity", "eta_m": "viscosity", "rho_m": "density", "cp_m": "heat-capacity"}
"""Properties that a case may give, and their keys."""

FITTED = (*KEYS, "gamma_m")


def medium(build: Build) -> None:
    """Properties of the medium; each comes to life when something reads it."""
    found = build.interface.medium
    if found is None:
        return
    _film(build, found)
    for name, value in found.properties.items():
        build.variables.define(name, partial(_given, build, name, value), "derived", f"{PATH}.{KEYS[name]}")
    fluid: Callable[[], FluidFit] | None = None
    if found.fluid is not None:
        fluid = cache(partial(FluidFit, build, found.fluid))
        for name in FITTED:
            if name not in found.properties:
                build.variables.define(name, partial(_property, fluid, name), "derived", f"{PATH}.fluid")
    build.variables.define("f_m", partial(_free_energy, build, found, fluid), "derived", PATH)


def _property(fluid: Callable[[], FluidFit], name: str) -> Expression:
    return fluid().property(name)


def _film(build: Build, found: Medium) -> None:
    if found.thickness is None:
        build.variables.define(
            "d_m", lambda: build.variables.get("g_n", "the medium", PATH), "derived", "the normal gap"
        )
    else:
        spec = Spec("m", "thickness of the medium", above=0)
        thickness = partial(build.constant, "d_m", f"{PATH}.thickness", spec, found.thickness)
        build.variables.define("d_m", thickness, "constant", f"{PATH}.thickness")
    if found.fluid is not None:
        spec = Spec("Pa", "pressure of the medium", above=0)
        pressure = partial(build.constant, "p_m", f"{PATH}.pressure", spec, found.fluid.pressure, internal=True)
        build.variables.define("p_m", pressure, "constant", f"{PATH}.pressure")


def _given(build: Build, name: str, value: float | Property) -> Expression:
    path = f"{PATH}.{KEYS[name]}"
    if not isinstance(value, Property):
        return build.constant(name, path, Spec(VARIABLES[name].unit, VARIABLES[name].long_name, above=0), value)
    bound = build.variables.bind(value, f"{path}.{value.name()}")
    expression = build.variables.call(bound, bound.statement)
    build.law_ranges(value)
    build.law_margins(value, {})
    return build.name(VARIABLES[name], expression)


def _free_energy(build: Build, found: Medium, fluid: Callable[[], FluidFit] | None) -> Expression:
    """Thermal free energy per volume, whose second derivative is the heat capacity."""
    if found.thickness is None:
        raise InputError("a film that stores heat needs a thickness. Add `thickness`.", Place(path=PATH))
    given = [name for name in ("rho_m", "cp_m") if name in found.properties]
    if not given and fluid is not None:
        return fluid().energy()
    if len(given) < 2 or any(isinstance(found.properties[name], Property) for name in given):
        raise InputError(
            "a film that stores heat needs the density and the heat capacity of its medium both from a fluid, or both "
            "as numbers.",
            Place(path=PATH),
        )
    rho, cp, T, T_0 = (build.variables.get(name, "the film", PATH) for name in ("rho_m", "cp_m", "T_c", "T_0"))
    return rho * cp * (T - T_0 - T * log(T / T_0))
