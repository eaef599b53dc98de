"""Loads that jump: a gap without inertia or damper moves at once to where the tractions balance again.

A far-field displacement that jumps does its work on the spring before the gap moves, a far-field traction does it on
the way. What is not stored of it is heat.
"""

from __future__ import annotations

from collections.abc import Iterator

import symengine

from surfacechem.model.automaton import Constraint, Edge
from surfacechem.model.build import Build


def jumps(build: Build) -> Iterator[Constraint]:
    """The edge at the times at which loads jump, where a gap in equilibrium or a spring feels them."""
    springs = [far.stored(far.gap) for far in build.motion.far_fields.values() if far.works]
    felt = set().union(*(build.expanded(x).free_symbols for x in [*(e.residual for e in build.equilibria), *springs]))
    paths = {item.path for item in build.parameters.items if item.symbol in felt}
    steps = {
        name: load
        for name, load in build.loads.items()
        if load.jumps() and any(path.startswith(f"loading.{name}.") for path in paths)
    }
    if steps:
        times = tuple(sorted({t for load in steps.values() for t in load.jumps()}))
        reason, never = f"{' or '.join(steps)} jumps", symengine.Integer(1)
        yield Constraint(edges=(Edge("load", never, reason, equilibrates=True, times=times),))
