"""The bonding state as its logarithm, where the case gives ``ln_phi`` its initial value: survival far below 1e-16."""

from __future__ import annotations

import math

import symengine

from surfacechem.errors import InputError
from surfacechem.model.build import Build
from surfacechem.model.system import Named, State
from surfacechem.quantities import VARIABLES, Quantity

LOGARITHM = "ln_phi"


def initial_bonding(build: Build, name: str) -> float:
    """Initial value of a bonding variable, from its logarithm where that is given."""
    initial = build.scene.initial
    if name != "phi" or LOGARITHM not in initial:
        return build.initial(name)
    if "phi" in initial:
        raise InputError(
            f"phi has two roles: given by itself and by {LOGARITHM}. Remove one of them.", path="initial.phi"
        )
    if initial[LOGARITHM] < math.log(math.ulp(0.0)):
        message = f"{LOGARITHM} = {initial[LOGARITHM]:g} is no bonding state that a number can hold."
        raise InputError(message, path=f"initial.{LOGARITHM}")
    return math.exp(initial[LOGARITHM])


def outputs(build: Build) -> None:
    """Replace the state phi by ln phi: d ln phi / dt is the balance of the bonds per bond."""
    if "phi" not in build.bonding or LOGARITHM not in build.scene.initial:
        return
    bond = build.bonding["phi"]
    if any(bond.symbol in edge.reset for edge in build.edges):
        message = f"bonds that break at once have no {LOGARITHM}. Give `phi` instead."
        raise InputError(message, path=f"initial.{LOGARITHM}")
    state = State(VARIABLES[LOGARITHM], build.scene.initial[LOGARITHM], 1.0)
    phi, rate = Named(VARIABLES["phi"], symengine.exp(state.symbol)), bond.symbol * state.dot
    build.named[:0] = [phi, Named(Quantity(str(bond.dot), "1/s", "rate of change of the bonding state"), rate, False)]
    build.rows.logarithm("phi", state.symbol, LOGARITHM, build.expanded(build.rows["phi"]))
    build.states[:] = [state if item.symbol == bond.symbol else item for item in build.states]
