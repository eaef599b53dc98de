"""What follows a local jump: gaps without inertia or damper stayed where they were, and then find their equilibrium."""

from __future__ import annotations

from dataclasses import replace

import symengine

from surfacechem.model.automaton import Edge
from surfacechem.model.build import Build


def relaxing(build: Build) -> None:
    """Where only the interface pays for a broken bond the gaps move in a jump of their own, in which the bodies do."""
    local = [j for j, item in enumerate(build.edges) if item.name == "debond" and item.heat == "local"]
    if not (local and build.equilibria):
        return
    loose = build.register("loose", "whether the gaps have yet to follow a local jump")
    for j in local:
        item = build.edges[j]
        modes = {**item.modes, loose: symengine.Integer(1)}
        build.edges[j] = replace(item, modes=modes, equilibrates=False)
    always, reason = -symengine.Integer(1), "the gap follows what gave way"
    done = {loose: symengine.Integer(0)}
    build.edges.insert(0, Edge("relax", always, reason, done, equilibrates=True, when={loose: (1,)}))
