r"""Balance laws: kinematics, momentum, sites and energy. Equations are formed in this module only.

Everything conservative is a derivative of the free energy. For a temperature node with free energy
:math:`F(T, x)`, where x are bonding variables and gaps,

.. math:: U = F - T F_T, \qquad \dot U = -T F_{TT} \dot T + \sum_x (F_x - T F_{Tx})\,\dot x
          = \text{mechanical power} + \text{heat},

so the heat of reaction and the thermo-elastic coupling need no separate formula. The row of the node that carries
the interface is the sum of the rows of all nodes: exchange fluxes drop out of it by construction, and the mean
temperature stays exact however large a conductance is.

Source: Sauer, Duong & Mandadapu (2021), sections 3 and 4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import symengine

from surfacechem.expressions import Expression, depends, derivative, where

OUTSIDE, MECHANICS, INTERFACE, SURROUNDINGS = "outside", "mechanics", "interface", "surroundings"
"""Places between which energy passes, in addition to the bodies and the nodes inside them: the outside, which drives
the scene; the springs and masses that hold the bodies; the interface with its bonds; and the surroundings."""

WORK, HEAT, DISSIPATION = "work", "heat", "dissipation"
"""Kinds of powers: work carries no entropy; dissipation arrives as heat, whatever form the energy had before."""


class PowerFlow(NamedTuple):
    """Energy that passes from one place to another, per time and reference area [W/m^2].

    Each process states its power once: the balances of the nodes, the ledger, the heat fluxes into the bodies and the
    entropy production follow from it.
    """

    kind: str
    source: str
    target: str | Mapping[str, Expression]
    """The place that receives it, or several places with their shares."""
    rate: Expression
    label: str = ""
    """Name of its account, or of the dissipative process; empty if it only passes between places of the scene."""
    text: str = ""
    channels: Mapping[str, Expression] = {}
    """Its parts, by the carrier of the heat."""
    entropy: Expression | None = None
    """Entropy rate [W/(m^2 K)] that it brings from outside, or that is produced on the way. A dissipation without it
    produces its entropy at the temperature of the interface."""

    @property
    def amount(self) -> Expression:
        """Its rate; the symbol of the named dissipation if it dissipates."""
        return symengine.Symbol(f"D_{self.label}") if self.kind == DISSIPATION else self.rate


class Node(NamedTuple):
    """A temperature node with the free energies of its members."""

    name: str
    T: Expression
    T_dot: Expression
    energies: Mapping[str, Expression] = {}
    """Free energies of the members, by member name: a body's name or 'interface'."""
    prescribed: bool = False

    @property
    def free_energy(self) -> Expression:
        """Free energy of the node [J/m^2]."""
        return sum(self.energies.values(), symengine.Integer(0))

    @property
    def takes_heat(self) -> bool:
        """True if it stores heat or is prescribed; a free node without capacity passes heat on at once."""
        return self.prescribed or second(self.free_energy, self.T) != 0

    def capacity(self) -> Expression:
        """Return the heat capacity -T F_TT [J/(m^2 K)]; zero if no member stores heat."""
        return -self.T * second(self.free_energy, self.T)


def elastic_energy(k: Any, w: Any, g: Any) -> Any:
    """Return the elastic energy [J/m^2] of bodies of stiffness `k` [Pa/m].

    ``w`` is the displacement of the far field and ``g`` the gap [m]; both may be expressions or arrays.
    """
    return k * (w - g) ** 2 / 2


def internal_energy(F: Expression, T: Expression) -> Expression:
    """Return the internal energy U = F - T F_T, term by term, so that terms proportional to T cancel exactly."""
    return symengine.Add(*(term - T * derivative(term, T) for term in _terms(F)))


def _terms(F: Expression) -> Sequence[Expression]:
    """Return the terms of a sum; any other expression is its only term."""
    whole = symengine.sympify(F)
    return whole.args if whole.is_Add else (whole,)


def entropy(F: Expression, T: Expression) -> Expression:
    """S = -F_T."""
    return -derivative(F, T)


def second(F: Expression, T: Expression) -> Expression:
    """F_TT."""
    return derivative(derivative(F, T), T)


def energy_rate(
    F: Expression, T: Expression, T_dot: Expression, rates: Mapping[Any, Expression], about: Mapping[Any, Expression]
) -> Expression:
    """Return dU/dt by the chain rule; ``rates`` maps the other variables of F to their time derivatives."""
    if not isinstance(T, symengine.Symbol):  # no medium: F does not depend on temperature
        return symengine.Add(*(power(F, x, rate) for x, rate in rates.items()))
    U = internal_energy(F, T)
    heating = conditioned(-T * second(F, T), about) * T_dot
    return symengine.Add(heating, *(power(U, x, rate) for x, rate in rates.items()))


def power(F: Expression, x: Expression, rate: Expression) -> Expression:
    """Return the power F_x dx/dt, term by term.

    In an energy balance this mechanical power cancels against a part of dU/dt, which leaves the coupling to
    temperature. Term by term the cancellation is symbolic; as products with sums the numbers would cancel, with
    roundoff of the size of the mechanical power however small the heat is.
    """
    return symengine.Add(*(term * rate for term in _terms(derivative(F, x))))


def conditioned(expression: Expression, about: Mapping[Any, Expression], degree: int = 4) -> Expression:
    """Return the same polynomial in powers of (x - x_0) for each x in ``about``.

    A capacity that nearly vanishes at x_0 would lose all its digits to cancellation as a difference of large terms;
    in this form the small part is a separate term. An expression that is no polynomial of x is left unchanged.
    """
    for x, x_0 in about.items():
        if not depends(expression, x):
            continue
        derivatives = [expression]
        while depends(derivatives[-1], x) and len(derivatives) <= degree + 1:
            derivatives.append(derivative(derivatives[-1], x))
        if depends(derivatives[-1], x):
            continue
        *lower, result = [d.subs({x: x_0}) for d in derivatives]
        for order, coefficient in reversed(list(enumerate(lower, start=1))):  # Taylor's series by Horner's rule
            result = coefficient + (x - x_0) * result / order
        expression = result
    return expression


def node_row(
    node: Node, inflow: Sequence[Expression], rates: Mapping[Any, Expression], about: Mapping[Any, Expression]
) -> Expression:
    """Return the energy balance of one node as a residual: dU/dt minus the inflow.

    Flows are subtracted term by term, so that a flux between two nodes cancels from the sum of their rows.
    """
    rate = energy_rate(node.free_energy, node.T, node.T_dot, rates, about)
    return symengine.Add(rate, *(-term for flow in inflow for term in _terms(flow)))


class Rows(dict[str, Expression]):
    """The equations of a system as residuals, linear in the rates: one row for each state, by the state's name.

    ``moves`` is 1 if the balance governs and 0 if a constraint holds the variable; it may be a mode.
    """

    def kinematics(self, name: str, rate: Expression) -> None:
        """Set x_dot = rate."""
        self[name] = _dot(name) - rate

    def momentum(
        self, name: str, force: Expression, mass: Expression, moves: Expression = 1, inertia: Expression | None = None
    ) -> None:
        """Set Newton's law, mass times acceleration = force; a held body keeps its velocity.

        ``inertia`` replaces the mass for a state that is a function of the velocity rather than the velocity.
        """
        if inertia is None:
            self[name] = _dot(name) - moves * force / mass
        else:  # no blend of both cases: a tiny inertia would be lost to rounding next to the term that is off
            self[name] = where(moves > 0, inertia - force, _dot(name))

    def equilibrium(
        self, name: str, driving_rate: Expression, moves: Expression = 1, held: Expression | None = None
    ) -> None:
        """Set equilibrium, differentiated once: the driving traction stays zero. ``held`` is the constrained row."""
        self[name] = -moves * driving_rate + (0 if held is None else (1 - moves) * held)

    def switched(self, name: str, moves: Expression, balance: Expression, held: Expression) -> None:
        """Set an algebraic balance while it governs, else the constraint; the balance may be undefined there."""
        self[name] = where(moves > 0, balance, held)

    def balance(self, name: str, balance: Expression) -> None:
        """Set an algebraic balance that always governs."""
        self[name] = balance

    def sites(self, name: str, rate: Expression, density: Expression, stretch: Expression) -> None:
        """Set N x_dot = J_c R, scaled by 1/N: bonds per reference area change by the reaction rate."""
        self[name] = _dot(name) - stretch * rate / density

    def logarithm(self, name: str, symbol: Any, logarithm: str, row: Expression) -> None:
        """Replace the row of x by that of ln x: the balance divided by x; ``row`` is that of x in terms of ln x."""
        del self[name]
        self[logarithm] = symengine.expand(row * symengine.exp(-symbol))

    def energies(self, rows: Mapping[str, Expression], centre: str) -> None:
        """Set the energy balances of the free nodes; that of ``centre`` is replaced by the sum over all of them."""
        self |= {name: symengine.Add(*rows.values()) if name == centre else row for name, row in rows.items()}


def _dot(name: str) -> Expression:
    return symengine.Symbol(f"d{name}_dt")
