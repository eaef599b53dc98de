r"""The balance laws: kinematics, momentum, sites, energy. The only place where equations are formed.

Everything conservative is a derivative of the free energy. For a temperature node with free energy
:math:`F(T, x)`, where x are bonding variables and gaps,

.. math:: U = F - T F_T, \qquad \dot U = -T F_{TT} \dot T + \sum_x (F_x - T F_{Tx})\,\dot x
          = \text{mechanical power} + \text{heat},

so the heat of reaction and the thermo-elastic coupling need no formula of their own. The row of the node that carries
the interface is the sum of the rows of all nodes: exchange fluxes drop out of it by construction, and the mean
temperature stays exact however large a conductance is.

Source: Sauer, Duong & Mandadapu (2021), sections 3 and 4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import symengine

from surfacechem.expressions import Expression, depends, derivative, where

OUTSIDE, MECHANICS, INTERFACE, SURROUNDINGS = "outside", "mechanics", "interface", "surroundings"
"""Places that energy comes from and goes to, beside the bodies and the nodes inside them, by their names: what drives
the scene, the springs and masses that hold the bodies, the interface with its bonds, and what is around."""

WORK, HEAT, DISSIPATION = "work", "heat", "dissipation"
"""Kinds of powers: work has no entropy; dissipation is heat where it arrives, whatever it was before."""


@dataclass(frozen=True)
class Power:
    """Energy that passes from one place to another, per time and reference area [W/m^2].

    Stated once by what makes it: the balances of the nodes, the ledger, the fluxes into the bodies and the entropy
    production follow from it.
    """

    kind: str
    source: str
    target: str | Mapping[str, Expression]
    """The place where it arrives, or several with their shares."""
    rate: Expression
    label: str = ""
    """Name of its account, or of what it dissipates; none for what passes between places of the scene only."""
    text: str = ""
    channels: Mapping[str, Expression] = field(default_factory=dict)
    """Its parts, by what carries the heat."""
    entropy: Expression | None = None
    """Entropy [W/(m^2 K)] that comes with it from outside, or that is produced on the way; where dissipation says
    nothing it is produced at the temperature of the interface."""

    @property
    def amount(self) -> Expression:
        """Its rate, by name where it dissipates."""
        return symengine.Symbol(f"D_{self.label}") if self.kind == DISSIPATION else self.rate


@dataclass(frozen=True)
class Node:
    """A temperature node with the free energies of its members."""

    name: str
    T: Expression
    T_dot: Expression
    energies: Mapping[str, Expression] = field(default_factory=dict)
    """Free energies of the members, by member name: a body's name or 'interface'."""
    prescribed: bool = False

    @property
    def free_energy(self) -> Expression:
        """Free energy of the node [J/m^2]."""
        return sum(self.energies.values(), symengine.Integer(0))

    @property
    def takes_heat(self) -> bool:
        """Whether heat stays in it, or is taken from outside; what stores none passes it on at once."""
        return self.prescribed or second(self.free_energy, self.T) != 0

    def capacity(self) -> Expression:
        """Heat capacity -T F_TT [J/(m^2 K)]; zero where nothing stores heat."""
        return -self.T * second(self.free_energy, self.T)


def elastic_energy(k: Any, w: Any, g: Any) -> Any:
    """Energy [J/m^2] of bodies of stiffness `k` [Pa/m], the far field displaced by `w` [m] at the gap `g` [m].

    Of expressions or of arrays.
    """
    return k * (w - g) ** 2 / 2


def internal_energy(F: Expression, T: Expression) -> Expression:
    """Internal energy U = F - T F_T, term by term, so that terms in proportion to T cancel exactly."""
    return symengine.Add(*(term - T * derivative(term, T) for term in _terms(F)))


def _terms(F: Expression) -> Sequence[Expression]:
    """Terms of a sum; any other expression is its only term."""
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
    """dU/dt by the chain rule; ``rates`` maps the other variables of F to their time derivatives."""
    if not isinstance(T, symengine.Symbol):  # no medium: F does not depend on temperature
        return symengine.Add(*(power(F, x, rate) for x, rate in rates.items()))
    U = internal_energy(F, T)
    heating = conditioned(-T * second(F, T), about) * T_dot
    return symengine.Add(heating, *(power(U, x, rate) for x, rate in rates.items()))


def power(F: Expression, x: Expression, rate: Expression) -> Expression:
    """Power F_x dx/dt of what does work on x, term by term.

    In the balance of energy the mechanical power that flows in stands beside dU/dt, and cancels to what couples it to
    temperature: as products with sums they would cancel as numbers only, however large beside all heat.
    """
    return symengine.Add(*(term * rate for term in _terms(derivative(F, x))))


def conditioned(expression: Expression, about: Mapping[Any, Expression], degree: int = 4) -> Expression:
    """The same polynomial written in powers of (x - x_0) for each x in ``about``.

    A capacity that nearly vanishes at x_0 would lose all its digits to cancellation as a difference of large terms;
    in this form the small part is a term of its own. Left alone where it is no polynomial of x.
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
    """Energy balance of one node as a residual: dU/dt minus what flows in, flow by flow.

    So a flux between two nodes cancels from their sum.
    """
    rate = energy_rate(node.free_energy, node.T, node.T_dot, rates, about)
    return symengine.Add(rate, *(-term for flow in inflow for term in _terms(flow)))


class Rows(dict[str, Expression]):
    """The equations of a system as residuals, linear in the rates: one row for each state, by the state's name.

    ``moves`` is 1 where a balance governs and 0 where a constraint holds what would move; it may be a mode.
    """

    def kinematics(self, name: str, rate: Expression) -> None:
        """x_dot = rate."""
        self[name] = _dot(name) - rate

    def momentum(self, name: str, force: Expression, mass: Expression, moves: Expression = 1) -> None:
        """Newton's law, mass times acceleration = force; what is held keeps its velocity."""
        self[name] = _dot(name) - moves * force / mass

    def momentum_of(self, name: str, inertia: Expression, force: Expression, moves: Expression) -> None:
        """Inertia = force, where the state is not the velocity but something that stands for it."""
        # No blend of both: an inertia that is next to none would be rounded away beside one that is off.
        self[name] = where(moves > 0, inertia - force, _dot(name))

    def equilibrium(
        self, name: str, driving_rate: Expression, moves: Expression = 1, held: Expression | None = None
    ) -> None:
        """Equilibrium, differentiated once: the driving traction stays zero. ``held`` is the row under a constraint."""
        self[name] = -moves * driving_rate + (0 if held is None else (1 - moves) * held)

    def switched(self, name: str, moves: Expression, balance: Expression, held: Expression) -> None:
        """An algebraic balance while it governs, else the constraint; a balance without meaning there is not formed."""
        self[name] = where(moves > 0, balance, held)

    def balance(self, name: str, balance: Expression) -> None:
        """An algebraic balance that always governs."""
        self[name] = balance

    def sites(self, name: str, rate: Expression, density: Expression, stretch: Expression) -> None:
        """N x_dot = J_c R, scaled by 1/N: bonds per reference area change by the reaction rate."""
        self[name] = _dot(name) - stretch * rate / density

    def logarithm(self, name: str, symbol: Any, logarithm: str, row: Expression) -> None:
        """The row of ln x in place of that of x: the balance per x, ``row`` that of x in terms of ln x."""
        del self[name]
        self[logarithm] = symengine.expand(row * symengine.exp(-symbol))

    def energies(self, rows: Mapping[str, Expression], centre: str) -> None:
        """The energy balances of the free nodes, that of ``centre`` replaced by the sum over all of them."""
        self |= {name: symengine.Add(*rows.values()) if name == centre else row for name, row in rows.items()}


def _dot(name: str) -> Expression:
    return symengine.Symbol(f"d{name}_dt")
