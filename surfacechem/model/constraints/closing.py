"""Whether the potentials of a gap bear the bodies in contact; where nothing does, a run ends as the gap closes."""

from __future__ import annotations

from typing import Any

import symengine

from surfacechem.expressions import Expression, derivative, where
from surfacechem.model.build import Build
from surfacechem.model.system import Margin

OVERLAP, OPENING = -1.0, 1e-15
"""Gaps [m] deep in contact and as good as at touch; a law that bears contact has more pressure at the former."""

LEAST = 1e-3
"""Pressure [Pa] deep in contact that bears nothing; bonds that have all but gone leave less."""

TOUCHING = 1e-12
"""Overlap [m] that still is touch: far below the size of an atom, far above the rounding of a gap."""

REMEDY = "Give a potential that does, such as `penalty`."
CLOSED = "the gap closed, and no potential bears the bodies in contact"


def closing(build: Build, g: Any) -> None:
    """End a run as the gap closes, unless a potential bears the bodies there, or a law ends there by itself."""
    if any(margin.name == "g_n > 0" for margin in build.margins):
        return
    borne = _borne(build, g)
    without_bonds = borne.subs({bond.symbol: 0 for bond in build.bonding.values()})
    # A law may have no number there.
    if not build.at_start(without_bonds) <= LEAST:
        return
    if build.at_start(borne) <= LEAST:
        build.warnings.append(f"no potential bears the bodies in contact: the run ends if the gap closes. {REMEDY}")
    gap = g + TOUCHING
    margin = where(borne > LEAST, 1, gap) if borne.free_symbols else gap
    build.margins.append(Margin("g_n >= 0", margin, CLOSED, remedy=REMEDY, domain=True))


def _borne(build: Build, g: Any) -> Expression:
    """Pressure that the potentials bear deep in contact [Pa]; none where it is the same as at touch."""
    t_n, side = build.expanded(derivative(build.psi, g)), symengine.Symbol("side")
    deep = t_n.subs({g: OVERLAP, side: -1})
    return symengine.Integer(0) if deep == t_n.subs({g: OPENING, side: 1}) else -deep
