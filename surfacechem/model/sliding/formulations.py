"""What determines the tangential motion of a scene, in each direction in which it moves by a balance."""

from __future__ import annotations

from dataclasses import dataclass

import symengine

from surfacechem.contracts.terms import Potential, TangentialPotential
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, sqrt
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import ACROSS, ALONG, Direction, Held, driven, held, held_across, law_reads
from surfacechem.model.sliding.resistance import formula_along

PLACE = Place(path="mechanics.tangential")


@dataclass(frozen=True)
class Kind:
    """What determines the tangential motion of a scene."""

    d: Direction
    mount: Held | None
    """None where the displacement is prescribed."""
    elastic: bool
    """Whether sticking is elastic: the free energy depends on the elastic gap."""
    sticks: bool
    """Whether some friction has a limit below which nothing slides."""
    rate_dependent: bool
    """Whether what resists sliding depends on its velocity."""
    slides: bool
    """Whether anything says how the interface slides; an elastic one follows the displacement otherwise."""

    @property
    def inertial(self) -> bool:
        return self.mount is not None and self.mount.inertial

    @property
    def own_velocity(self) -> str:
        """The velocity of the displacement, which is that of sliding unless the interface is elastic."""
        return "v_t" if self.elastic else self.d.velocity


def kinds(build: Build) -> tuple[Kind, ...]:
    """What determines the motion in each direction in which the scene moves by a balance."""
    mount = held(build, "t")
    elastic = bool(in_series(build)) and not driven(build, "g_t")
    across = held_across(build, mount) if mount is not None else None
    if across is not None:
        _refuse_half(build, elastic)
        return _kind(build, ALONG, mount, elastic), _kind(build, ACROSS, across, elastic)
    if build.scene.transverse is not None:
        message = "a mounting across stands beside one along: give `tangential`, too."
        raise InputError(message, build.scene.transverse.place)
    if mount is None and not (elastic and "u_t" in build.scene.loading):
        return ()
    return (_kind(build, ALONG, mount, elastic),)


def in_parallel(build: Build) -> tuple[Potential, ...]:
    """The potentials whose tangential gap is the whole displacement, which friction acts along too.

    What moves in two directions has no elastic gap, so that it is the displacement there without friction as well. A
    gap and a velocity that are prescribed each by itself are no one displacement.
    """
    mount, frictions = held(build, "t"), bool(build.interface.frictions)
    if mount is not None:
        beside = not driven(build, "g_t") and (frictions or held_across(build, mount) is not None)
    else:
        beside = frictions and not driven(build, "v") and (driven(build, "g_t") or driven(build, "u_t"))
    return tuple(law for law in _sheared(build) if beside and arrangement(law) == "parallel")


def arrangement(law: Potential) -> str:
    """How a potential acts with friction."""
    return law.shear if isinstance(law, TangentialPotential) else "series"


def in_series(build: Build) -> tuple[Potential, ...]:
    """The potentials of an elastic gap, which gives way where friction does."""
    parallel = in_parallel(build)
    return tuple(law for law in _sheared(build) if law not in parallel)


def _sheared(build: Build) -> list[Potential]:
    return [law for law in build.interface.potentials if law_reads(law, "g_t") and arrangement(law) != "none"]


def displacement(build: Build) -> Expression:
    """The tangential gap of what stands beside friction: the displacement, in two directions its length.

    Laws read its square, so that it needs no guard where it is zero.
    """
    if len(build.motion.slips) == 2:
        return sqrt(sum(symengine.Symbol(slip.d.displacement) ** 2 for slip in build.motion.slips))
    name = "g_t" if driven(build, "g_t") else "u_t"
    return build.variables.get(name, "the adhesion beside friction")


def _refuse_half(build: Build, elastic: bool) -> None:
    """Motion in two directions where something holds in one only."""
    if elastic:
        raise InputError(
            "the interface moves in two directions, but the elastic gap g_t of its potential has one. Leave out what "
            "moves it across (`transverse`, w_t2, F_t2, v_2 or a law with two directions), or the potential of g_t.",
            PLACE,
        )
    for name in ("v", "v_2"):
        if name in build.scene.loading:
            raise InputError(
                f"{name} is prescribed, but a mounting moves the interface along it. Prescribe `v` and `v_2` under "
                "`loading`, or let the mounting give both.",
                PLACE,
            )


def _kind(build: Build, d: Direction, mount: Held | None, elastic: bool) -> Kind:
    laws = build.interface.frictions
    rate_dependent = any({"v", "v_2"} & {*formula_along(law, d)} for law in laws)
    if not elastic and mount is not None:
        rate_dependent = rate_dependent or mount.damped
    sticks = any(law.has_limit for law in laws)
    return Kind(d, mount, elastic, sticks, rate_dependent, bool(laws) or not elastic)
