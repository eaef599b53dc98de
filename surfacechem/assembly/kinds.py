"""What determines the tangential motion of a scene, in each direction in which it moves by a balance."""

from __future__ import annotations

from dataclasses import dataclass

from surfacechem.assembly.build import Build
from surfacechem.assembly.mounting import ACROSS, ALONG, Direction, Held, held, held_across, read_by_potentials
from surfacechem.assembly.resistance import formula_along
from surfacechem.errors import InputError, Place

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
    elastic = read_by_potentials(build, "g_t") and "g_t" not in build.scene.loading
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
