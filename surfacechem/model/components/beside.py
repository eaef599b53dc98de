r"""What reactions take from phases beside the interface: enthalpy comes in with it, and entropy.

A reaction that takes :math:`-\nu_j` molecules of the species j of a neighbour brings the enthalpy
:math:`-\sum_j \nu_j h_j` and the entropy :math:`-\sum_j \nu_j s_j` to the interface, and its affinity contains
:math:`-\sum_j \nu_j \mu_j`. The neighbour is at the temperature of the interface, so that nothing is lost on the way.
"""

from __future__ import annotations

from collections.abc import Mapping

import symengine

from surfacechem.contracts.terms import RateLaw
from surfacechem.expressions import Expression
from surfacechem.model.build import Build
from surfacechem.model.system import Account
from surfacechem.quantities import Quantity

NEIGHBOURS = "neighbours"


def affinity_taken(build: Build, law: RateLaw) -> Expression:
    """Gibbs energy [J] that one reaction takes from neighbours."""
    return build.variables.call(law, law.taken[1]) if law.taken else symengine.Integer(0)


def supplied(build: Build, laws: Mapping[str, RateLaw], rates: Mapping[str, Expression]) -> None:
    """Book the enthalpy and the entropy that reactions take from neighbours; the interface gets the enthalpy."""
    heat, entropy = [], []
    for label, law in laws.items():
        if law.taken:
            h, g = (build.variables.call(law, formula) for formula in law.taken)
            heat.append(build.stretch * rates[label] * h)
            entropy.append(build.stretch * rates[label] * (h - g))
    if not heat:
        return
    text = "enthalpy of what reactions take from neighbours"
    power = build.name(Quantity("q_n", "W/m^2", text), symengine.Add(*heat))
    T = build.variables.get("T_c", "the neighbours")
    name = f"H_{NEIGHBOURS}"
    build.ledger.append(Account(Quantity(name, "J/m^2", text), power, "energy supply"))
    with_it = Quantity(f"{name}_entropy", "J/(m^2 K)", "entropy of what reactions take from neighbours")
    build.ledger.append(Account(with_it, symengine.Add(*entropy) / T, "entropy supply"))
    build.into_interface.append(power)
    build.node_of["interface"].inflow.append(power)
