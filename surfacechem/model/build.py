"""The system under construction, and the few ways in which stages add to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import symengine

from surfacechem.contracts import grids
from surfacechem.contracts.terms import Friction, Law, Load, Spec, optional
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative
from surfacechem.model.automaton import Mode, Register
from surfacechem.model.balances import Node
from surfacechem.model.draft import Draft
from surfacechem.model.system import Margin, Named, Range
from surfacechem.model.variables import unit_of
from surfacechem.quantities import Quantity

MANY = range(2, 1000)

BOTH = "interface", "each body"
"""Ends of the paths that bring heat into both bodies alike."""

NOTHING = 1e-9
"""Amount, in SI units, by which rounding may carry a variable below zero."""
STARTS = {"g_n": "Give `g_n` under `initial`: a gap that finds its equilibrium begins its search there, else at zero."}
"""What to do where a variable that finds its own value has none at the start."""
DIGITS = 1e-12
"""Part of its terms by which rounding may carry a sum below zero."""


class Build(Draft):
    """What has been assembled so far, and how stages add to it."""

    def name(self, quantity: Quantity, expression: Expression, *, output: bool = True) -> Expression:
        """Add a named quantity and return its symbol."""
        self.named.append(Named(quantity, expression, output))
        return symengine.Symbol(quantity.name)

    def constant(self, name: str, path: str, spec: Spec, value: float, *, internal: bool = False) -> Expression:
        """A scene-level number as a run-time parameter."""
        return self.parameters.constant(name, path, spec, value, internal)

    def bound(self, law: Friction) -> Friction:
        """A friction law with its parameters as symbols, made once."""
        if law not in self.bound_frictions:
            path = f"interface.friction.{law.name()}"
            self.bound_frictions[law] = self.variables.bind(law, path)
        return self.bound_frictions[law]

    def label(self, law: Law) -> str:
        """A short unique name of a law for its quantities."""
        return self.unique(law.label)

    def unique(self, base: str) -> str:
        """The name, with a number where it is taken."""
        name = next(n for n in (base, *(f"{base}_{i}" for i in MANY)) if n not in self.used_names)
        self.used_names.add(name)
        return name

    def history(self, name: str, load: Load) -> Expression:
        """A prescribed history as an expression of time; its breakpoints will end a step."""
        self.breakpoints.update(load.breakpoints())
        self.loads[name] = load
        bound = self.variables.bind(load, f"loading.{name}", unit=unit_of(name))
        if load.cycle:
            self.cycles.append(f"{bound.path}.{load.cycle}")
        return bound.value(self.t)

    def prescribe(self, quantity: Quantity, load: Load) -> Expression:
        """Make a prescribed variable a named quantity."""
        return self.name(quantity, self.history(quantity.name, load))

    def slope_of(self, name: str) -> Expression:
        """Time derivative of a prescribed variable between its jumps."""
        if name in self.motion.drives:
            return self.motion.drives[name]
        expression = next(item.expression for item in self.named if item.name == name)
        return derivative(expression, self.t)

    def rate_of(self, name: str) -> Expression:
        """Time derivative of a prescribed variable that stores energy, which must not jump."""
        if name in self.motion.drives:
            return self.motion.drives[name]
        load = self.loads[name]
        if load.jumps():
            raise InputError(
                f"{name} stores energy, so it cannot jump (at t = {load.jumps()[0]:g} s): the work would be unknown. "
                "Give the jump a duration.",
                load.place,
            )
        return self.slope_of(name)

    def refuse_foreign(self, F: Expression, own: set[Any], law: Law) -> None:
        """A free energy depends on what its balance accounts for, and on constants."""
        moving = {str(state.symbol) for state in self.states} | {node.name for node in self.nodes.values()}
        moving |= {item.name for item in self.named if item.name in self.loads and self.slope_of(item.name) != 0}
        moving -= {name for name, load in self.loads.items() if self.slope_of(name) == 0 and not load.jumps()}
        foreign = {str(symbol) for symbol in symengine.sympify(F).free_symbols - own} & moving
        if foreign:
            allowed = ", ".join(sorted(str(symbol) for symbol in own))
            raise InputError(
                f"the energy of {law.name()} varies with {', '.join(sorted(foreign))}, which its balance does not "
                f"know. It may vary with {allowed}.",
                law.place,
            )

    def mode(
        self,
        name: str,
        initial: float,
        words: Mapping[float, str],
        start: Expression | None = None,
        waits: Mapping[float, str] | None = None,
        given: Callable[[Mapping[str, float]], float] | None = None,
    ) -> Any:
        """A discrete variable; its symbol is a parameter that only transitions change."""
        spec = Spec("1", " or ".join(f"{value:g}: {word}" for value, word in words.items()))
        symbol = self.constant(name, f"mode.{name}", spec, initial, internal=True)
        self.modes.append(Mode(name, symbol, initial, words, start, given, waits or {}))
        return symbol

    def register(
        self, name: str, text: str, initial: float = 0.0, given: Callable[[Mapping[str, float]], float] | None = None
    ) -> Any:
        """A number that edges write; its symbol is a parameter that nothing else changes."""
        symbol = self.constant(name, f"register.{name}", Spec("1", text), initial, internal=True)
        self.registers.append(Register(name, symbol, text, given))
        return symbol

    def find_mode(self, name: str) -> Any:
        """The symbol of a mode, None where the scene has none of that name."""
        return next((mode.symbol for mode in self.modes if mode.name == name), None)

    def at_start(self, expression: Expression) -> float:
        """Value with the parameters and initial values of the scene, one for what has none; NaN where undefined."""
        values = {parameter.symbol: parameter.at(0.0) for parameter in self.parameters.items} | {self.t: 0.0}
        values |= {state.symbol: state.initial for state in self.states}
        try:
            found = self.expanded(expression).subs(values)
            return float(found.subs({x: self.scene.initial.get(str(x), 1.0) for x in found.free_symbols}))
        except RuntimeError:  # a condition on a number that is undefined
            return math.nan

    def total_derivative(self, expression: Expression) -> Expression:
        """Time derivative of an expression of the states and of prescribed variables."""
        expanded = self.expanded(expression)
        rates = {state.symbol: state.dot for state in self.states}
        rates |= {node.T: node.T_dot for node in self.nodes.values() if not node.prescribed}
        return sum((derivative(expanded, x) * x_dot for x, x_dot in rates.items()), derivative(expanded, self.t))

    @property
    def stretch(self) -> Expression:
        """Area stretch J_c, or one."""
        return self.variables.get("J_c", "the balance") if self.variables.has("J_c") else symengine.Integer(1)

    def initial(self, name: str) -> float:
        """Initial value of a state; InputError where the case gives none."""
        if name not in self.scene.initial:
            unknown = [other for other, value in self.scene.initial.items() if math.isnan(value)]
            misspelt = f"; '{unknown[0]}' there is no variable" if unknown else ""
            message = f"{name} evolves but has no initial value. Add `{name}:` under `initial`{misspelt}."
            raise InputError(message, path="initial")
        return self.scene.initial[name]

    def areal(self, quantity: Quantity, nominal: Expression) -> Expression:
        """A quantity per current area, and per reference area too where the two differ; returns the nominal one."""
        if not self.variables.has("J_c"):
            return self.name(quantity, nominal)
        per_reference = Quantity(
            f"{quantity.name}_nominal", quantity.unit, f"{quantity.long_name} per reference area", tag=quantity.tag
        )
        symbol = self.name(per_reference, nominal)
        self.name(quantity, symbol / self.stretch)
        return symbol

    def law_ranges(self, law: Law) -> None:
        """Ranges of variables that a run watches for a law."""
        for name, (low, high) in law.ranges.items():
            self.ranges.append(Range(str(self.variables.get(name, law)), low, high, law.title))

    def refuse_never_positive(self, law: Law, own: Mapping[str, Expression]) -> None:
        """A law that divides by what is zero, whatever the state, is none for this scene."""
        for name in law.positive:
            value = symengine.sympify(own[name] if name in own else self.variables.get(name, law))
            if value.is_Number and not value > 0:
                raise InputError(
                    f"{law.name()} holds for {name} > 0 only; with the laws of this scene {name} is always {value}.",
                    law.place,
                )

    def law_margins(self, law: Law, own: Mapping[str, Expression], met: Collection[str] = ()) -> None:
        """What must stay positive for a law to hold, but for the bounds that are ``met`` by what it is given."""
        for name in law.positive:
            value = own[name] if name in own else self.variables.get(name, law)
            reason = f"{name} reached zero, where the law {law.name()} ends"
            sought = name in self.motion.gap_rates and name not in self.scene.initial
            remedy = STARTS.get(name, "") if sought else ""
            self.margins.append(Margin(f"{name} > 0", value, reason, remedy=remedy, path=law.path, domain=True))
        for name in (bound for bound in law.nonnegative if bound not in met):
            value = own[name] if name in own else self.variables.get(name, law)
            least = law.least.get(name, 0)
            slack = NOTHING + self._rounding(value) + DIGITS * absolute(least)
            reason = f"{name} fell below {least if least != 0 else 'zero'}, where the law {law.name()} ends"
            self.margins.append(Margin(f"{name} >= {least}", value - least + slack, reason))
        for name, bend in law.kinks.items():
            if name in law.least and name not in met:
                continue  # the law ends there
            value = own[name] if name in own else self.variables.get(name, law)
            self.margins.append(Margin(name, value - bend, f"{law.name()} bends at this {name}", False))
        for name, tops in {**dict.fromkeys(law.positive, ()), **law.peaks}.items():
            if name not in own and not self.variables.has(name) and name in optional(law.statement):
                continue
            value = own[name] if name in own else self.variables.get(name, law)
            if not symengine.sympify(value).is_Number:
                self._narrow(law, name, value, tops if isinstance(tops, Sequence) else (tops,))
        for name, ends in law.limits.items():
            value, (low, high) = self.variables.get(name, law), ends
            slack = NOTHING * max(abs(end) for end in ends if math.isfinite(end))
            reason = f"{name} left the range of the law {law.name()}, {low:g} to {high:g}"
            if math.isfinite(low):
                self.margins.append(Margin(f"{name} >= {low:g}", value - low + slack, reason, domain=True))
            if math.isfinite(high):
                self.margins.append(Margin(f"{name} <= {high:g}", high + slack - value, reason, domain=True))

    def _narrow(self, law: Law, name: str, value: Expression, tops: Sequence[Expression]) -> None:
        """A step ends where a variable passes a narrow place of a law, and where a gap with a mass turns round, which
        may have come close to one.
        """
        reason, moving = f"{law.name()} is narrow near here", symengine.sympify(self.expanded(value)).free_symbols
        found = [Margin(f"{name} at place {i} of {law.name()}", value - top, reason) for i, top in enumerate(tops, 1)]
        velocities = {state.symbol for state in self.states if state.quantity.unit == "m/s"}
        for gap, rate in self.motion.gap_rates.items():
            if symengine.Symbol(gap) in moving and symengine.sympify(rate).free_symbols & velocities:
                found.append(Margin(f"{gap} turns", rate, reason))
        known = {margin.expression for margin in self.margins}
        self.margins += [replace(item, terminal=False, peak=True) for item in found if item.expression not in known]

    def volume(self, body: str) -> list[tuple[Node, Expression]]:
        """The nodes of a body with their parts of its volume; the one at the contact is the first."""
        if body not in self.slabs:
            return [(self.node_of[body], symengine.Integer(1))]
        slab = self.slabs[body]
        return list(zip(slab.nodes, grids.shares(slab.points), strict=True))

    def varying_margins(self) -> None:
        """Parameters stay in their range as they vary; what may be zero may be so by rounding."""
        found = []
        for law, name, spec, value in self.variables.varying:
            slack = NOTHING * abs(getattr(law, name).value)
            low, why = max(spec.above, spec.at_least), f"{law.title}: {name} left its range ({spec.range}) as it varies"
            if math.isfinite(low):
                above = value - low + (slack if spec.at_least >= low else 0)
                found.append(Margin(f"{name} of {law.label} {spec.range}", above, why))
            if math.isfinite(spec.at_most):
                found.append(Margin(f"{name} of {law.label} at most", spec.at_most + slack - value, why))
        self.margins[:0] = found

    def shares(self) -> dict[str, Expression]:
        """Fractions of the interface's heat that go into the bodies and the surroundings where there is no medium."""
        alpha = self._share("alpha", "interface.partition", self.interface.partition, "body 1")
        first, second = (body.name for body in self.scene.bodies)
        if not self.interface.loss:
            return {first: alpha, second: 1 - alpha}
        loss = self._share("alpha_a", "interface.partition.surroundings", self.interface.loss, "the surroundings")
        return {first: alpha, second: 1 - alpha - loss, "surroundings": loss}

    def _share(self, name: str, path: str, value: float, end: str) -> Expression:
        if not self.variables.has(path):
            spec = Spec("1", f"fraction of heat into {end}", at_least=0, at_most=1)
            self.variables.define(path, lambda: self.constant(name, path, spec, value), "constant", path)
        return self.variables.get(path, "the interface", "interface")

    def _rounding(self, value: Expression) -> Expression:
        """By how much the last digits of its terms change a sum."""
        whole = self.expanded(value)
        return DIGITS * sum((absolute(term) for term in whole.args), symengine.Integer(0)) if whole.is_Add else 0

    def expanded(self, expression: Expression) -> Expression:
        """The expression without names of quantities."""
        result: dict[Any, Expression] = {}
        for item in self.named:
            result[symengine.Symbol(item.name)] = symengine.sympify(item.expression).subs(result)
        return symengine.sympify(expression).subs(result)
