r"""Load on the bonds: normal traction and force per bond, defined if a law reads them.

The force on a bond is the derivative of its chemical potential with respect to the gap,

.. math:: f_k = \partial\mu_k / \partial g_n = \partial^2\Psi / \partial\theta_k \partial g_n / N_k

which for a spring is :math:`w_b'(g_n)`: species share the load by their stiffness. If the potential gives bonds no
elasticity they share the tensile part of the traction evenly, :math:`f = \langle t_n\rangle / (n_c\phi)`: in
compression the surfaces carry the load, not the bonds.

Source: Bell (1978), Science 200, 618, doi 10.1126/science.347575; shared load as in Erdmann & Schwarz (2004),
Phys. Rev. Lett. 92, 108102, doi 10.1103/PhysRevLett.92.108102.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import symengine

from surfacechem.expressions import Expression, depends, derivative, positive, where
from surfacechem.model.build import Build
from surfacechem.model.system import Margin
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.tolerances import LEAST_BONDED, NO_AMOUNT, TIME_EPS, ZERO_TIME

SHARED_LOAD = "load shared by all bonds"
BOND_ELASTICITY = "bond elasticity"
OVERLOAD = "The load breaks all bonds at once: lower `t_n`, or let it grow from zero."


def energies(build: Build) -> None:
    """Define the normal traction and the force per bond."""
    g_n = symengine.Symbol("g_n")
    if depends(build.psi, g_n):
        build.variables.define("t_n", symengine.Symbol("t_n"), "derived", "the interface's potential")
    for name, bond in build.bonding.items() if depends(build.psi, g_n) else ():
        if depends(derivative(build.psi, bond.symbol), g_n):
            quantity = VARIABLES["f"] if name == "phi" else Quantity(f"f_{name}", "N", f"force per bond of {name}")
            stretching = derivative(derivative(build.psi, bond.symbol), g_n) / bond.density
            build.variables.define(quantity.name, partial(build.name, quantity, stretching), "derived", BOND_ELASTICITY)
    elastic = {role.variable for role in build.variables.roles if role.by == BOND_ELASTICITY}

    def shared() -> Expression:
        """Name the force per bond, tension over bonded sites, with a margin that ends a step at a change of sign."""
        t_n, n_c, phi = (build.variables.get(x, "the force per bond", "interface") for x in ("t_n", "n_c", "phi"))
        build.add(Margin("t_n", t_n, "the load on the bonds changes its sign", terminal=False))
        carrying = where(phi > LEAST_BONDED, phi, LEAST_BONDED)
        return build.name(VARIABLES["f"], positive(t_n) / (n_c * carrying))

    if build.variables.has("t_n") and "f" not in elastic:
        build.variables.define("f", shared, "derived", SHARED_LOAD)


def laws(build: Build) -> Iterator[Margin]:
    """Yield margins that end a run at rupture: loaded bonds break ever faster, beyond what time resolves."""
    # Bonds whose rupture increases the load on the rest: they share it, or hold a gap with a balance.
    carriers = []
    for role in (role for role in build.variables.roles if build.variables.was_read(role.variable)):
        if role.by == SHARED_LOAD:
            carriers.append(("phi", build.variables.get("phi", "the force per bond", "interface")))
        if role.by == BOND_ELASTICITY and "g_n" in build.motion.gap_rates:
            name = role.variable.removeprefix("f_") if role.variable != "f" else "phi"
            carriers.append((name, build.bonding[name].symbol))
    for name, bonds in carriers:
        rates = ((b.symbol, build.rows[other].subs({b.dot: 0})) for other, b in build.bonding.items())
        loss = symengine.Add(*(derivative(bonds, symbol) * rate for symbol, rate in rates))
        if loss != 0:
            # Bonds that would be gone within the roundoff of the elapsed time have ruptured.
            left = bonds - TIME_EPS * (build.t + ZERO_TIME) * loss + NO_AMOUNT
            # Below this fraction the remaining bonds are roundoff, so the margin stays open.
            left = where(bonds > LEAST_BONDED, left, NO_AMOUNT)
            which = f"the bonds {name}" if len(carriers) > 1 else "the bonds"
            yield Margin(f"{name} left", left, f"{which} ruptured", remedy=OVERLOAD, path="interface")
