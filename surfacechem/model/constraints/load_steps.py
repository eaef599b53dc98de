"""Loads that jump: a gap without inertia or damper moves at once to where the tractions balance again.

A far-field displacement that jumps does its work on the spring before the gap moves, a far-field traction does it on
the way. What is not stored of it is heat.
"""

from __future__ import annotations

import symengine

from surfacechem.expressions import Expression, where
from surfacechem.model.automaton import Edge
from surfacechem.model.build import Build


def jumps(build: Build) -> None:
    """The transition that loads make by their jumps, where a gap in equilibrium or a spring feels them."""
    springs = [far.stored(far.gap) for far in build.motion.far_fields.values() if far.works]
    felt = set().union(*(build.expanded(x).free_symbols for x in [*(e.residual for e in build.equilibria), *springs]))
    steps = {name: load for name, load in build.loads.items() if load.jumps() and felt & _histories(build, name)}
    if not steps:
        return
    reason = f"{' or '.join(steps)} jumps"
    times = tuple(sorted({t for load in steps.values() for t in load.jumps()}))
    never = symengine.Integer(1)
    build.edges.append(Edge("load", never, reason, _closing(build), equilibrates=True, times=times))


def _histories(build: Build, name: str) -> set[Expression]:
    return {item.symbol for item in build.parameters.items if item.path.startswith(f"loading.{name}.")}


def _closing(build: Build) -> dict[Expression, Expression]:
    """A rigid interface that the loads press together closes as they jump."""
    for item in build.edges:
        if item.name == "touch" and not item.measure:
            return {mode: where(item.masked < 0, value, mode) for mode, value in item.modes.items()}
    return {}
