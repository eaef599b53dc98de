"""The medium between the bodies: its properties as functions of the interface temperature, for the laws that ask.

A property of a fluid is a polynomial in pieces whose coefficients are parameters; they hold between two temperatures,
and a run that reaches these goes on with others. The thermal free energy is the double integral of such a polynomial,
so that capacity, entropy and energy belong together exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import pairwise

import numpy as np
import symengine

from surfacechem.contracts.fits import DEGREE, NoFitError, Piece, divided
from surfacechem.contracts.terms import Fluid, Load, Property, Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, log
from surfacechem.model.build import Build
from surfacechem.model.refit import Fit, first_range
from surfacechem.model.system import Caution, Margin
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import Medium

PATH = "interface.medium"

KEYS = {"k_m": "conductivity", "eta_m": "viscosity", "rho_m": "density", "cp_m": "heat-capacity"}
"""Properties that a case may give, and their keys."""

FITTED = (*KEYS, "gamma_m")


def variables(build: Build) -> None:
    """Properties of the medium; each comes to life when something reads it."""
    found = build.interface.medium
    if found is None:
        return
    _film(build, found)
    for name, value in found.properties.items():
        build.variables.define(name, partial(_given, build, name, value), "derived", f"{PATH}.{KEYS[name]}")
    fluid = None if found.fluid is None else cache(partial(FluidFit, build, found.fluid))
    if fluid is not None:
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


FLUID_PATH = "interface.medium.fluid"

ENERGY = "capacity_m"
"""Heat capacity per volume over T; minus its double integral is the free energy."""

PIECES = 4
"""Fewest pieces of a fit."""

SPARE = 2
"""Pieces beyond those that the first range takes, for the kinks of a wider one."""

REMEDY = "Give `interface.medium.temperatures`: those that the run will reach."

KELVIN = Spec("K", "where a piece of the fit ends")
NUMBER = Spec("1", "coefficient of the fit")


@dataclass(frozen=True)
class Coefficients:
    """The fits of a fluid as values of parameters, by path."""

    fluid: Fluid
    counts: dict[str, int] = field(default_factory=dict)
    """Number of pieces of each property."""

    def __call__(self, low: float, high: float, T_start: float) -> Mapping[str, float]:
        """Values between two temperatures; the energy is zero with its slope at ``T_start`` [K]."""
        values = {f"{FLUID_PATH}.low": low, f"{FLUID_PATH}.high": high}
        for quantity, count in self.counts.items():
            pieces = self._pieces(quantity, count, low, high)
            for i, piece in enumerate(pieces):
                values[f"{FLUID_PATH}.{quantity}.ends[{i}]"] = piece.high
                values |= {f"{FLUID_PATH}.{quantity}[{i}][{k}]": c for k, c in enumerate(piece.coefficients)}
            if quantity == ENERGY:
                for i, (constant, slope) in enumerate(_joints(pieces, T_start)):
                    values[f"{FLUID_PATH}.{quantity}.constant[{i}]"] = constant
                    values[f"{FLUID_PATH}.{quantity}.slope[{i}]"] = slope
        return values

    def _pieces(self, quantity: str, count: int, low: float, high: float) -> tuple[Piece, ...]:
        try:
            return divided(self.fluid.fit(quantity, low, high), count)
        except NoFitError as error:
            message = f"the fit of {quantity} of {self.fluid.name} cannot go on: {error} {REMEDY}"
            raise InputError(message, path="interface.medium") from None


def _joints(pieces: Sequence[Piece], T_start: float) -> list[tuple[float, float]]:
    """What each piece of the energy needs beside its double integral, to be smooth and zero with its slope there."""
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
    """Minus the double integral of a piece, from its middle, and its slope."""
    half = (piece.high - piece.low) / 2
    x = (2 * T - piece.low - piece.high) / (piece.high - piece.low)
    once = np.polynomial.polynomial.polyint(np.array(piece.coefficients))
    twice = np.polynomial.polynomial.polyint(once)
    value, slope = (float(np.polynomial.polynomial.polyval(x, c)) for c in (twice, once))
    return -(half**2) * value, -half * slope


class FluidFit:
    """Makes the expressions of a fluid's properties, and remembers which were asked for."""

    def __init__(self, build: Build, fluid: Fluid) -> None:
        self.build = build
        self.T = build.variables.get("T_c", "the medium", "interface.medium")
        assert build.interface.medium is not None
        self.held = (*_held(build), *build.interface.medium.temperatures)
        self.states = tuple(node.name for node in build.thermal.free)
        starts = [build.scene.initial.get(state) for state in self.states]
        known = [*self.held, *(T for T in starts if T is not None)] or [build.scene.T_0 or 300.0]
        self.coefficients = Coefficients(fluid)
        self.low, self.high, self.start = first_range(fluid, known)
        limits = {f"{FLUID_PATH}.low": self.low, f"{FLUID_PATH}.high": self.high}
        self.ends = [self._number(f"T_m_{end}", end, limits, KELVIN) for end in ("low", "high")]
        for end, sign in zip(self.ends, (1, -1), strict=True):
            reason = f"{fluid.name} has no properties beyond its range"
            build.margins.append(Margin(Fit.margin, sign * (self.T - end), reason))
        self._watch_walls(fluid)
        low, high = limits
        build.notes.append(Fit(fluid, str(self.T), self.held, self.states, self.coefficients, (low, high)))

    def _watch_walls(self, fluid: Fluid) -> None:
        """Tell where a wall is beyond the range of a film whose properties are those at its own temperature."""
        span = fluid.range(self.start)
        thermal = self.build.thermal
        for body in self.build.scene.bodies:
            wall = thermal.nodes[thermal.members[body.name]].T
            if wall != self.T:
                rest = f"at the wall of {body.name}, while the film keeps the properties that it has at {self.T}."
                self.build.notes.append(Caution(span.high - wall, f"{span.reason_high} {rest}"))
                self.build.notes.append(Caution(wall - span.low, f"{span.reason_low} {rest}"))

    def property(self, name: str) -> Expression:
        """A property as a named quantity, constant beyond its range."""
        (low, *bounds), pieces, _ = self._fitted(name)
        text, unit, inside = "piece of the fit of a property", VARIABLES[name].unit, []
        for i, (scaled, coefficients) in enumerate(pieces):
            of_x = Quantity(f"{name}_{i}_x", "1", "scaled temperature of the piece below")
            x = self.build.name(of_x, scaled, output=False)
            powers = sum(c * x**k for k, c in enumerate(coefficients))
            inside.append(self.build.name(Quantity(f"{name}_{i}", unit, text), powers, output=False))
        # At the ends of the range the scaled temperature is -1 and 1.
        first = sum(c * (-1) ** k for k, c in enumerate(pieces[0][1]))
        last = sum(pieces[-1][1])
        branches = [(first, low > self.T), *zip(inside, (bound > self.T for bound in bounds), strict=True)]
        return self.build.name(VARIABLES[name], symengine.Piecewise(*branches, (last, True)))

    def energy(self) -> Expression:
        """Thermal free energy per volume [J/m^3]."""
        ends, pieces, values = self._fitted(ENERGY)
        branches = []
        for i, (x, coefficients) in enumerate(pieces):
            half = (ends[i + 1] - ends[i]) / 2
            integral = sum(c * x ** (k + 2) / symengine.Integer((k + 1) * (k + 2)) for k, c in enumerate(coefficients))
            constant, slope = (
                self._number(f"{ENERGY}_{part}_{i}", f"{ENERGY}.{part}[{i}]", values) for part in ("constant", "slope")
            )
            condition = ends[i + 1] > self.T if i < len(pieces) - 1 else True
            branches.append((constant + slope * self.T - half**2 * integral, condition))
        return symengine.Piecewise(*branches)

    def _fitted(
        self, quantity: str
    ) -> tuple[list[Expression], list[tuple[Expression, list[Expression]]], Mapping[str, float]]:
        """Ends of the pieces, scaled temperature and coefficients of each, and the numbers that these stand for."""
        fluid, counts = self.coefficients.fluid, self.coefficients.counts
        counts[quantity] = max(PIECES, len(fluid.fit(quantity, self.low, self.high)) + SPARE)
        values = Coefficients(fluid, {quantity: counts[quantity]})(self.low, self.high, self.start)
        ends = [self.ends[0]]
        ends += [self._number(f"{quantity}_ends_{i}", f"{quantity}.ends[{i}]", values) for i in range(counts[quantity])]
        pieces = []
        for i, (low, high) in enumerate(pairwise(ends)):
            keys = [(f"{quantity}_{i}_{k}", f"{quantity}[{i}][{k}]") for k in range(DEGREE + 1)]
            coefficients = [self._number(symbol, key, values) for symbol, key in keys]
            pieces.append(((2 * self.T - low - high) / (high - low), coefficients))
        return ends, pieces, values

    def _number(self, symbol: str, key: str, values: Mapping[str, float], spec: Spec = NUMBER) -> Expression:
        path = f"{FLUID_PATH}.{key}"
        return self.build.constant(symbol, path, spec, values[path], internal=True)


def _held(build: Build) -> list[float]:
    """Prescribed temperatures at the start."""
    loads: list[Load] = [build.loads[node.name] for node in build.thermal.nodes.values() if node.prescribed]
    return [float(load.bind(load.piece(0.0)).value(0.0)) for load in loads]
