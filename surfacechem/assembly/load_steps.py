"""Far-field tractions that jump: a gap without inertia or damper moves at once to where the tractions balance again.

The traction does its work on the way, and what the bodies do not store of it is heat.
"""

from __future__ import annotations

import symengine

from surfacechem.assembly.build import Build
from surfacechem.expressions import Expression, where
from surfacechem.transitions import LOAD_STEP, Transition

JUMPING = ("F_n", "F_t")


def load_steps(build: Build) -> None:
    """The transition that a jump of a traction makes, where a gap in equilibrium feels one."""
    steps = [name for name in JUMPING if name in build.loads and build.loads[name].jumps()]
    if not (steps and build.equilibria):
        return
    reason = f"{' or '.join(steps)} jumps"
    never = symengine.Integer(1)
    build.transitions.append(Transition(LOAD_STEP, never, reason, _sticking(build), settles=True))


def _sticking(build: Build) -> dict[Expression, Expression]:
    """What slides sticks where the traction falls: it is pushed back, and friction does not push."""
    slip = next((mode.symbol for mode in build.modes if mode.name == "slip"), None)
    driving = next((item.residual for item in build.equilibria if item.state == "u_t"), None)
    if slip is None or driving is None:
        return {}
    return {slip: where(slip * driving < 0, symengine.Integer(0), slip)}
