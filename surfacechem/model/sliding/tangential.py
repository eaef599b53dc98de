"""The tangential motion, in one direction or two.

Smooth friction moves the interface in each direction by the same equations. What sticks has one direction of sliding in
the plane, which both share.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from surfacechem.expressions import Expression, norm, sign, where
from surfacechem.model.automaton import Constraint
from surfacechem.model.balances import Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import ACROSS, ALONG
from surfacechem.model.sliding import line, plane
from surfacechem.model.sliding.formulation import Formulation, directions, displacement, formulations, in_parallel
from surfacechem.quantities import VARIABLES


def variables(build: Build) -> None:
    """States and modes of the tangential motion."""
    found = build.motion.slips = formulations(build)
    if not found:
        _prescribed_direction(build)
    elif _in_the_plane(found):
        plane.states(build, found)
    else:
        for kind in found:
            line.states(build, kind)


def _in_the_plane(found: Sequence[Formulation]) -> bool:
    return len(found) == 2 and found[0].sticks


def _prescribed_direction(build: Build) -> None:
    """The direction of sliding where its velocity is prescribed: a sign, or a unit vector."""
    if in_parallel(build):
        build.variables.define("v", partial(_along_displacement, build), "derived", "the prescribed displacement")
    if len(directions(build)) == 1:
        if build.variables.has("v"):
            build.variables.define("direction", lambda: sign(build.variables.get("v", "the friction")), "internal", "v")
        return

    def along(velocity: str) -> Expression:
        speed = build.variables.get("speed", "the friction")
        return build.variables.get(velocity, "the friction") / where(speed > 0, speed, 1)

    def speed() -> Expression:
        v, v_2 = (build.variables.get(name, "the friction") for name in ("v", "v_2"))
        return build.name(VARIABLES["speed"], norm(v, v_2))

    build.variables.define("speed", speed, "derived", "v and v_2")
    for d in (ALONG, ACROSS):
        build.variables.define(d.cosine, partial(along, d.velocity), "internal", "v and v_2")


def _along_displacement(build: Build) -> Expression:
    return build.name(VARIABLES["v"], build.rate_of(str(displacement(build))))


def laws(build: Build) -> Iterator[Power | Constraint]:
    """Balance of the tangential tractions, and the edges between sticking and sliding."""
    if _in_the_plane(build.motion.slips):
        yield from plane.motion(build, build.motion.slips)
        return
    for kind in build.motion.slips:
        yield from line.motion(build, kind)
