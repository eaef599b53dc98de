"""Whether the potentials of a gap bear the bodies in contact; where nothing does, a run ends as the gap closes."""

from __future__ import annotations

from typing import Any

import symengine

from surfacechem.assembly.build import Build
from surfacechem.expressions import Expression, derivative, where
from surfacechem.system import Margin

OVERLAP, OPENING = -1.0, 1e-15
"""Gaps [m] deep in contact and as good as at touch; a law that bears contact has more pressure at the former."""

TOUCHING = 1e-12
"""Overlap [m] that still is touch: far below the size of an atom, far above the rounding of a gap."""

UNIT = 1.0
"""What stands for a variable without initial value; only a sign depends on it."""

REMEDY = "Give a potential that does, such as `penalty`"
RIGID = ", or leave out the mass and the damper: contact on a stiffness alone is rigid."
CLOSED = "the gap closed, and no potential bears the bodies in contact"


def closing(build: Build, g: Any) -> None:
    """End a run as the gap closes, unless a potential bears the bodies there, or a law ends there by itself."""
    if any(margin.name == "g_n > 0" for margin in build.margins):
        return
    borne = _borne(build, g)
    bears = _at_start(build, borne) > 0
    if bears and not borne.free_symbols & {bond.symbol for bond in build.bonding.values()}:
        return
    remedy = REMEDY + ("." if g in build.psi.free_symbols else RIGID)
    if not bears:
        build.warnings.append(f"no potential bears the bodies in contact: the run ends if the gap closes. {remedy}")
    gap = g + TOUCHING
    margin = where(borne > 0, 1, gap) if borne.free_symbols else gap
    build.margins.append(Margin("g_n >= 0", margin, CLOSED, remedy=remedy, domain=True))


def _borne(build: Build, g: Any) -> Expression:
    """Pressure that the potentials gain from touch to deep in contact [Pa]."""
    t_n, side = build.expanded(derivative(build.psi, g)), symengine.Symbol("side")
    return t_n.subs({g: OPENING, side: 1}) - t_n.subs({g: OVERLAP, side: -1})


def _at_start(build: Build, borne: Expression) -> float:
    values = {parameter.symbol: parameter.at(0.0) for parameter in build.parameters.items}
    found = borne.subs(values)
    return float(found.subs({x: build.scene.initial.get(str(x), UNIT) for x in found.free_symbols}))
