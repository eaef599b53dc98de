"""The medium between the bodies: its properties as functions of the interface temperature, for laws that read them.

A property of a fluid is a piecewise polynomial between two temperatures, at which a run ends. The thermal free energy
is the double integral of such a polynomial, so that capacity, entropy and energy are exactly consistent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
import symengine

from surfacechem.contracts.fits import CRITICAL_ACCURACY, FIT_ACCURACY, Piece
from surfacechem.contracts.terms import Fluid, Property, Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, log
from surfacechem.model.build import Build
from surfacechem.model.system import Caution, Margin, State
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import Medium
from surfacechem.tolerances import NANOMETRE

PATH = "interface.medium"

PROPERTY_KEYS = {"k_m": "conductivity", "eta_m": "viscosity", "rho_m": "density", "cp_m": "heat-capacity"}
"""Properties that a case may give, and their keys."""

FITTED_KEYS = (*PROPERTY_KEYS, "gamma_m")


def variables(build: Build) -> Iterator[State]:
    """Define the properties of the medium, made when first read; yield the thickness of a film that grows."""
    found = build.interface.medium
    assert found is not None
    thickness: Any
    if found.growth:
        thickness, role, by = symengine.Symbol("d_m"), "evolved", f"{PATH}.growth"
        yield State(VARIABLES["d_m"], build.initial("d_m"), NANOMETRE)
    elif found.thickness is None:
        thickness, role, by = partial(build.variables.get, "g_n", "the medium", PATH), "derived", "the normal gap"
    else:
        spec, role, by = Spec("m", "thickness of the medium", above=0), "constant", f"{PATH}.thickness"
        thickness = partial(build.constant, "d_m", by, spec, found.thickness)
    build.variables.define("d_m", thickness, role, by)
    if found.fluid is not None:
        spec = Spec("Pa", "pressure of the medium", above=0)
        pressure = partial(build.constant, "p_m", f"{PATH}.pressure", spec, found.fluid.pressure, internal=True)
        build.variables.define("p_m", pressure, "constant", f"{PATH}.pressure")
    for name, value in found.properties.items():
        build.variables.define(name, partial(_given, build, name, value), "derived", f"{PATH}.{PROPERTY_KEYS[name]}")
    fluid = None if found.fluid is None else cache(partial(FluidFit, build, found.fluid))
    if fluid is not None:
        for name in FITTED_KEYS:
            if name not in found.properties:
                build.variables.define(name, partial(_property, fluid, name), "derived", f"{PATH}.fluid")
    build.variables.define("f_m", partial(_free_energy, build, found, fluid), "derived", PATH)


def laws(build: Build) -> None:
    """Set the balance of a film that grows and wears."""
    found, total = build.interface.medium, symengine.Integer(0)
    assert found is not None
    for law in found.growth:
        bound = build.variables.bind(law, f"{PATH}.growth.{law.name()}")
        rate = build.variables.call(bound, bound.statement)
        build.law_domain(law, bound, {})
        quantity = Quantity(f"growth_{build.unique(law.label)}", "m/s", f"rate of the film's thickness by {law.title}")
        total += build.name(quantity, rate)
    if found.growth:
        build.rows.kinematics("d_m", total)


def _property(fluid: Callable[[], FluidFit], name: str) -> Expression:
    return fluid().property(name)


def _given(build: Build, name: str, value: float | Property) -> Expression:
    path = f"{PATH}.{PROPERTY_KEYS[name]}"
    if not isinstance(value, Property):
        return build.constant(name, path, Spec(VARIABLES[name].unit, VARIABLES[name].long_name, above=0), value)
    bound = build.variables.bind(value, f"{path}.{value.name()}")
    expression = build.variables.call(bound, bound.statement)
    build.law_domain(value, bound, {})
    return build.name(VARIABLES[name], expression)


def _free_energy(build: Build, found: Medium, fluid: Callable[[], FluidFit] | None) -> Expression:
    """Return the thermal free energy per volume, whose second derivative gives the heat capacity."""
    if found.growth:
        message = "the heat that a growing film stores is neglected, as such films are nanometres thick"
        remedy = "Remove `film-capacity`, or give a `thickness` instead of `growth`."
        raise InputError(f"{message}. {remedy}", Place(path=f"{PATH}.growth"))
    if found.thickness is None:
        raise InputError("a film that stores heat needs a thickness. Add `thickness`.", Place(path=PATH))
    given = [name for name in ("rho_m", "cp_m") if name in found.properties]
    if not given and fluid is not None:
        return fluid().energy()
    if len(given) < 2 or any(isinstance(found.properties[name], Property) for name in given):
        needed = "the density and the heat capacity of its medium both from a fluid, or both as numbers"
        raise InputError(f"a film that stores heat needs {needed}.", Place(path=PATH))
    rho, cp, T, T_0 = (build.variables.get(name, "the film", PATH) for name in ("rho_m", "cp_m", "T_c", "T_0"))
    return rho * cp * (T - T_0 - T * log(T / T_0))


FLUID_PATH = "interface.medium.fluid"

CAPACITY = "capacity_m"
"""Heat capacity per volume over T; minus its double integral is the free energy."""

FIT_REACHES = (math.inf, 2.0, 1.1)
"""Factors by which a fit extends beyond the temperatures of a case, tried in this order; the first takes the whole
range."""

RANGE_REMEDY = "give `interface.medium.temperatures` that the run will reach"

END_SPEC = Spec("K", "where a piece of the fit ends")
COEFFICIENT_SPEC = Spec("1", "coefficient of the fit")


class FluidFit:
    """Expressions of a fluid's properties, each fitted once over the temperatures that a run may reach."""

    def __init__(self, build: Build, fluid: Fluid) -> None:
        self.build, self.fluid = build, fluid
        self.T = build.variables.get("T_c", "the medium", "interface.medium")
        assert build.interface.medium is not None
        starts = [build.loads[node.name].at_start() for node in build.thermal.prescribed]
        starts += [T for node in build.thermal.free if (T := build.scene.initial.get(node.name)) is not None]
        self.known = [*starts, *build.interface.medium.temperatures] or [build.scene.T_0 or 300.0]
        self.start = sum(self.known) / len(self.known)
        self.ranges: set[tuple[float, float]] = set()
        # The film has its properties at its mean temperature, also where a wall is beyond the range of the fluid.
        span = fluid.range(self.start)
        for body in build.scene.bodies:
            wall = build.thermal.node_of[body.name].T
            if wall != self.T:
                rest = f"at the wall of {body.name}, while the film keeps the properties that it has at {self.T}."
                build.add(Caution(span.high - wall, f"{span.reason_high} {rest}"))
                build.add(Caution(wall - span.low, f"{span.reason_low} {rest}"))
        if fluid.remark:
            build.add(fluid.remark)

    def property(self, name: str) -> Expression:
        """Name a property of the fluid, constant beyond its range."""
        ends, pieces, _ = self._fitted(name)
        text, unit, inside = "piece of the fit of a property", VARIABLES[name].unit, []
        for i, (scaled, coefficients) in enumerate(pieces):
            of_x = Quantity(f"{name}_{i}_x", "1", "scaled temperature of the piece below")
            x = self.build.name(of_x, scaled, output=False)
            powers = sum(c * x**k for k, c in enumerate(coefficients))
            inside.append(self.build.name(Quantity(f"{name}_{i}", unit, text), powers, output=False))
        # At the ends of the range the scaled temperature is -1 and 1.
        first = sum(c * (-1) ** k for k, c in enumerate(pieces[0][1]))
        last = sum(pieces[-1][1])
        branches = zip((first, *inside, last), (*(end > self.T for end in ends), True), strict=True)
        return self.build.name(VARIABLES[name], symengine.Piecewise(*branches))

    def energy(self) -> Expression:
        """Return the thermal free energy per volume [J/m^3]; it and its slope are zero at the start."""
        ends, pieces, fit = self._fitted(CAPACITY)
        branches = []
        for i, ((x, coefficients), joint) in enumerate(zip(pieces, _joints(fit, self.start), strict=True)):
            half = (ends[i + 1] - ends[i]) / 2
            integral = sum(c * x ** (k + 2) / symengine.Integer((k + 1) * (k + 2)) for k, c in enumerate(coefficients))
            constant, slope = (
                self._number(f"{CAPACITY}_{part}_{i}", f"{CAPACITY}.{part}[{i}]", value)
                for part, value in zip(("constant", "slope"), joint, strict=True)
            )
            condition = ends[i + 1] > self.T if i < len(pieces) - 1 else True
            branches.append((constant + slope * self.T - half**2 * integral, condition))
        return symengine.Piecewise(*branches)

    def _fitted(
        self, quantity: str
    ) -> tuple[list[Expression], list[tuple[Expression, list[Expression]]], tuple[Piece, ...]]:
        """Return ends of the pieces, scaled temperature and coefficients of each, and the pieces as numbers."""
        fit = self._fit(quantity)
        keys = [(f"{quantity}_ends_{i}", f"{quantity}.ends[{i}]") for i in range(len(fit) + 1)]
        numbers = (fit[0].low, *(piece.high for piece in fit))
        ends = [self._number(*key, number, END_SPEC) for key, number in zip(keys, numbers, strict=True)]
        pieces = []
        for i, (piece, (low, high)) in enumerate(zip(fit, pairwise(ends), strict=True)):
            keys = [(f"{quantity}_{i}_{k}", f"{quantity}[{i}][{k}]") for k in range(len(piece.coefficients))]
            coefficients = [self._number(*key, c) for key, c in zip(keys, piece.coefficients, strict=True)]
            pieces.append(((2 * self.T - low - high) / (high - low), coefficients))
        low, high = fit[0].low, fit[-1].high
        if (low, high) not in self.ranges:  # a run ends where a fit ends; most properties have the same range
            self.ranges.add((low, high))
            span = self.fluid.range(self.start)
            fitted = f"the properties of {self.fluid.name} are fitted no further ({RANGE_REMEDY})"
            below = span.reason_low if low == span.low else fitted
            above = span.reason_high if high == span.high else fitted
            margins = (self.T - ends[0], low, below), (ends[-1] - self.T, high, above)
            for margin, end, reason in margins:
                name = f"{self.T} within the range of the fluid"
                self.build.add(Margin(name, margin, f"{reason} at {self.T} = {end:.6g} K"))
        return ends, pieces, fit

    def _fit(self, quantity: str) -> tuple[Piece, ...]:
        """Return the fit over the widest range on which one exists."""
        span = self.fluid.range(self.start)
        for reach, target in (*((reach, FIT_ACCURACY) for reach in FIT_REACHES), (FIT_REACHES[-1], CRITICAL_ACCURACY)):
            low, high = max(min(self.known) / reach, span.low), min(max(self.known) * reach, span.high)
            try:
                found = self.fluid.fit(quantity, low, high, target)
            except InputError as error:
                if target == CRITICAL_ACCURACY:
                    asked = f"The case is at {self.start:g} K, and needs it from {low:.4g} to {high:.4g} K."
                    raise InputError(f"{error.message} {asked}", error.place) from None
                continue
            if target == CRITICAL_ACCURACY:
                named = VARIABLES[quantity].long_name if quantity in VARIABLES else "heat capacity of the medium"
                where = f"between {low:.4g} and {high:.4g} K, where {self.fluid.name} at {self.fluid.pressure:g} Pa"
                self.build.add(f"the {named} is known within {CRITICAL_ACCURACY:g} only {where} is not smooth.")
            return found
        raise AssertionError

    def _number(self, symbol: str, key: str, value: float, spec: Spec = COEFFICIENT_SPEC) -> Expression:
        return self.build.constant(symbol, f"{FLUID_PATH}.{key}", spec, value, internal=True)


def _joints(pieces: Sequence[Piece], T_start: float) -> list[tuple[float, float]]:
    """Return the constant and slope that each piece adds to its double integral: smooth, and zero at T_start."""
    found = [(0.0, 0.0)]
    for left, right in pairwise(pieces):
        (f, df), (g, dg) = _integrals(left, left.high), _integrals(right, left.high)
        constant, slope = found[-1]
        next_slope = slope + df - dg
        found.append((constant + f - g + (slope - next_slope) * left.high, next_slope))
    at = next((i for i, piece in enumerate(pieces) if T_start <= piece.high), len(pieces) - 1)
    f, df = _integrals(pieces[at], T_start)
    slope = found[at][1] + df
    constant = found[at][0] + found[at][1] * T_start + f - slope * T_start
    return [(a - constant, b - slope) for a, b in found]


def _integrals(piece: Piece, T: float) -> tuple[float, float]:
    """Return minus the double integral of a piece, from its middle, and its slope."""
    half = (piece.high - piece.low) / 2
    x = (2 * T - piece.low - piece.high) / (piece.high - piece.low)
    once = np.polynomial.polynomial.polyint(np.array(piece.coefficients))
    twice = np.polynomial.polynomial.polyint(once)
    value, slope = (float(np.polynomial.polynomial.polyval(x, c)) for c in (twice, once))
    return -(half**2) * value, -half * slope
