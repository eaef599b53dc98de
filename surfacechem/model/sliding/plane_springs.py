r"""Dry friction in the plane on springs alone: sliding goes as far as keeps the springs in balance with friction.

With the pull :math:`t`, the stiffness K and the sizes L of friction along both directions the balance
:math:`t = L n` holds at every time, and so do its rates, along and across the direction of sliding,

.. math:: K n\,\dot\ell + L\,n_\perp\dot\alpha = \dot t - \dot L\,n ,

where :math:`\dot t` is that of the loads. The length :math:`\ell` of the path grows, or sliding comes to a stop. A
block on a string, dragged along a line, draws a tractrix.

Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric, differentiated in time as the consistency condition of
plasticity is.
"""

from __future__ import annotations

from collections.abc import Sequence

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, norm, where
from surfacechem.model.automaton import Equilibrium
from surfacechem.model.build import Build
from surfacechem.model.sliding.formulations import PLACE
from surfacechem.model.sliding.planar import (
    SLIDES,
    TURNED,
    Side,
    against,
    aim,
    borne,
    largest,
    resistance,
    turned,
    unit_vector,
)
from surfacechem.model.sliding.slip import NONE
from surfacechem.model.system import Margin

UNSEEN = 1e-18
"""Length [m] of sliding within which what nothing rubs against turns into the direction of the drive."""

SWERVE = 1e-4
"""Traction across the direction of sliding that the integration explains, relative to friction."""

UNFELT = 1e-6
"""The same, relative to the parts that cancel in it."""

FAINT = 1e-8
"""The same, relative to what the springs would pull over the length of the path."""

HELD = 1e-3
"""Part of all this that the integration explains while the interface sticks."""

WAYLESS = (
    "the traction is beyond what sticking bears, as after a jump, and where springs or friction differ from direction "
    "to direction only a mass or a damper says which way it slips"
)

PATH = "l_t"
"""The length of the path of sliding, which evolves on springs alone."""


def on_springs(build: Build, sides: Sequence[Side]) -> None:
    """Sliding as far as keeps the springs in balance with friction: both balances by their rates.

    What turns while nothing rubs would turn at once into the direction of the drive; it does within a length that
    none can see.
    """
    if any(side.far.k == 0 for side in sides):
        raise InputError(
            "what sticks and slides in two directions without a mass or a damper needs a stiffness along both: under "
            "a dead load nothing holds what slides. Give the mounting `k`, `m` or `c_b`.",
            PLACE,
        )
    _refuse_adhesion(sides)
    dl, turn = symengine.symbols(f"d{PATH}_dt dturn_dt")
    sizes = [resistance(build, side) for side in sides]
    pulled = turned([build.total_derivative(side.far.force(NONE, NONE)) for side in sides])
    held = against([side.far.k for side in sides])
    firmer = against([build.total_derivative(size) for size in sizes])
    along, across = (a - b * dl - c for a, b, c in zip(pulled, held, firmer, strict=True))
    skew, (x, _) = against(sizes)[1], unit_vector()
    turning = sizes[0] + (sizes[1] - sizes[0]) * x**2 + _unseen(sides)
    build.rows.switched(PATH, SLIDES, along - skew * turn, dl)
    build.rows.switched("turn", SLIDES, across - turning * turn, turn)
    _settling(build, sides, sizes)


def _refuse_adhesion(sides: Sequence[Side]) -> None:
    if any(side.t_a != 0 for side in sides):
        raise InputError(
            "adhesion in parallel with dry friction in two directions softens, so that springs alone do not say which "
            "way it slips as it gives way. Give the mounting `m` or `c_b`, or let it move in one direction.",
            PLACE,
        )


def _unseen(sides: Sequence[Side]) -> Expression:
    """Traction that the springs bear within a length that none can see [Pa]."""
    return UNSEEN * (sides[0].far.k + sides[1].far.k)


def _settling(build: Build, sides: Sequence[Side], sizes: Sequence[Expression]) -> None:
    """What jumps, with the loads or from a static limit, slips straight along the pull where no way is another."""
    pull = [side.needed for side in sides]
    (ahead, aside), (resisted, skew) = turned(pull), against(sizes)
    size = sum((side.far.size(side.u) for side in sides), largest(sides))
    moved = {str(side.u): side.cosine for side in sides}
    balance = SLIDES * (ahead - resisted)
    build.equilibria.append(Equilibrium(PATH, balance, size, moved, active=SLIDES, slides=1))
    if sizes[0] == sizes[1] and sides[0].far.k == sides[1].far.k:
        goes_on = SLIDES * where(ahead > 0, where(norm(*pull) > sizes[0], 1, 0), 0)
        aimed = {b: where(SLIDES > 0, x, b) for b, x in aim(build, sides).items()}
        build.motion.jolted = {SLIDES: goes_on, **aimed, TURNED: NONE}
        return
    _refuse_static(build, sides, sizes)
    build.motion.jolted = {SLIDES: NONE}
    slack = UNFELT * size + FAINT / UNSEEN * _unseen(sides) * symengine.Symbol(PATH) + _unseen(sides)
    # A rate is in it, so that it is not asked before pressure and gaps are in equilibrium.
    slack += _unseen(sides) * absolute(symengine.Symbol(f"d{PATH}_dt"))
    swerving = SWERVE * norm(*pull) + slack - absolute(aside - skew)
    beyond = borne(sides) + UNFELT * largest(sides) + HELD * slack
    build.margins.append(Margin("way of sliding", where(SLIDES > 0, swerving, beyond), WAYLESS))


def _refuse_static(build: Build, sides: Sequence[Side], sizes: Sequence[Expression]) -> None:
    if any(build.expanded(side.limit) != size for side, size in zip(sides, sizes, strict=True)):
        raise InputError(
            "with a static limit of its own friction lets the springs jump as it gives way, and where springs or "
            "friction differ from direction to direction nothing says which way. Leave out the static coefficient, or "
            "give the mounting `m` or `c_b`.",
            PLACE,
        )
