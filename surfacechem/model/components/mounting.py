"""Mounting of the gap on the far field, by axis: springs, masses, dampers, their energies, and loads that jump.

When a load jumps, a gap without inertia or damper moves at once to the new equilibrium of tractions. A far-field
displacement that jumps does its work on the spring before the gap moves, a far-field traction during the motion. Work
that is not stored becomes heat.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import symengine

from surfacechem.contracts.terms import Law, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative, sqrt
from surfacechem.model.automaton import ONE, Constraint, Edge, Equilibrium
from surfacechem.model.balances import DISSIPATION, INTERFACE, MECHANICS, OUTSIDE, WORK, PowerFlow, elastic_energy
from surfacechem.model.build import Build
from surfacechem.model.system import TimeScale
from surfacechem.quantities import Quantity
from surfacechem.scene import Mounting
from surfacechem.tolerances import MICROMETRE

LENGTH_SCALE = MICROMETRE
"""Scale of gaps [m] and of their velocities [m/s]: displacements of a micrometre are rounded at 1e-22 m."""

AXIS_WORDS = {"n": "normal gap", "t": "tangential displacement", "t2": "transverse displacement"}
GAP_ALONG = {"n": "g_n", "t": "u_t", "t2": "u_t2"}
SECTIONS = {"n": "normal", "t": "tangential", "t2": "transverse"}


class Direction(NamedTuple):
    """A direction along the interface, with the names of its variables."""

    axis: str
    displacement: str
    velocity: str
    cosine: str
    """Name of the component of the slip direction."""
    traction: str
    total: str
    text: str


ALONG = Direction("t", "u_t", "v", "direction", "t", "t_t", "tangential traction")
ACROSS = Direction("t2", "u_t2", "v_2", "direction_2", "t_2", "t_t2", "transverse traction")

SLIDING_TRACTIONS = (ALONG.total, ACROSS.total)
"""Tractions along the interface, which a stage may wait for even if no law reads them."""


class Support(NamedTuple):
    """The mounting of an axis as the case gives it."""

    law: Mounting
    axis: str
    by: str
    first_axis: Support | None = None
    """The other tangential mounting, which shares the mass, and everything else if one is given for both."""

    @property
    def inertial(self) -> bool:
        return self.first_axis.inertial if self.first_axis else self.law.m > 0

    @property
    def damped(self) -> bool:
        return self.law.c_b > 0 or self.law.c_g > 0

    @property
    def quasi_static(self) -> bool:
        return not (self.inertial or self.damped)


def support(build: Build, axis: str) -> Support | None:
    """Return the mounting of an axis, or None; a far-field traction alone is a dead load."""
    law: Mounting | None = getattr(build.scene, SECTIONS[axis])
    force = f"F_{axis}"
    pulls = driven(build, force)
    if law is not None:
        if not (law.k or law.m or law.c_b or law.c_g or pulls):
            raise InputError("the mounting holds nothing: give it a stiffness k, a mass m or a damper.", law.place)
        _refuse_restitution(law, axis)
        return Support(law, axis, law.path)
    by = f"loading.{force}" if force in build.scene.loading else "programme"
    return Support(Mounting(), axis, by) if pulls else None


def _refuse_restitution(law: Mounting, axis: str) -> None:
    if axis != "n" and law.e:
        message = f"bodies rebound along the normal: give the coefficient of restitution e there, not {SECTIONS[axis]}."
        raise InputError(message, law.place)


def transverse_support(build: Build, along: Support) -> Support | None:
    """Return the transverse mounting, if the scene moves that way: the one given, else a copy of the tangential one."""
    law = build.scene.transverse
    if law is not None:
        if law.m:
            raise InputError("a mass is the same in every direction. Give `m` under `tangential`.", law.place)
        _refuse_restitution(law, "t2")
        return Support(law, "t2", law.path, along)
    given = any(driven(build, name) or name in build.scene.initial for name in ("w_t2", "F_t2", "u_t2", "v_2"))
    if given or any(friction.transverse is not None for friction in build.interface.frictions):
        return Support(along.law, "t2", along.by, along)
    return None


def driven(build: Build, name: str) -> bool:
    """True if a history or the programme gives the variable."""
    return name in build.scene.loading or any(name in stage.rates for stage in build.scene.programme)


def law_reads(law: Law, name: str) -> bool:
    """True if a law depends on the variable, in its formula or by a factor."""
    return name in reads(law.statement) or any(factor.of == name for factor in law.factors)


def feels_pressure(law: Law) -> bool:
    """True if a law depends on the normal traction or the pressure."""
    return law_reads(law, "p") or law_reads(law, "t_n")


class FarField(NamedTuple):
    """A mounting, its parameters as symbols, and the histories that drive it."""

    mount: Support
    law: Mounting
    w: Expression
    w_dot: Expression
    F: Expression

    @property
    def gap(self) -> symengine.Symbol:
        """The gap that the far field pulls at."""
        return symengine.Symbol(GAP_ALONG[self.mount.axis])

    @property
    def does_work(self) -> bool:
        """True if the far field does work."""
        return bool(self.w_dot != 0 or self.F != 0)

    def energy(self, g: Expression) -> Expression:
        """Return the elastic energy of the bodies [J/m^2]."""
        return elastic_energy(self.law.k, self.w, g)

    def elastic_traction(self, g: Expression) -> Expression:
        """Return the elastic traction of the bodies [Pa], the decrease of their energy with the gap."""
        slot = symengine.Symbol("opening")
        return -derivative(self.energy(slot), slot).subs({slot: g})

    def force(self, g: Expression, rate: Expression) -> Expression:
        """Return the traction with which the far field opens the gap [Pa]."""
        return self.elastic_traction(g) + self.law.c_b * (self.w_dot - rate) + self.F

    def size(self, g: Expression) -> Expression:
        """Return the size of the tractions that balance in the far field [Pa]."""
        return self.law.k * (absolute(self.w) + absolute(g)) + absolute(self.F)

    def time_scales(self, text: str) -> list[TimeScale]:
        """Return the period of a mass on the bodies' stiffness, or the relaxation time of a damper in parallel."""
        if self.law.k == 0:
            return []
        if self.law.m != 0:
            remedy = "leave out the mass, so that it follows at once, or end the run sooner"
            return [TimeScale(f"period of the {text}", 2 * math.pi * sqrt(self.law.m / self.law.k), remedy)]
        if self.law.c_b + self.law.c_g != 0:
            remedy = "leave out the damper, so that it snaps where it loses its equilibrium"
            return [TimeScale(f"relaxation of the {text}", (self.law.c_b + self.law.c_g) / self.law.k, remedy)]
        return []

    def receivers(self, build: Build) -> dict[str, Expression]:
        """Return the shares of places in the bodies in the dissipation of the support."""
        shares = zip((body.name for body in build.scene.bodies), (self.law.beta_1, 1 - self.law.beta_1), strict=True)
        return {place: share * part for body, share in shares for place, part in build.thermal.volume(body).items()}

    def damped_rate(self, g: Expression, traction: Expression) -> Expression:
        """Return the rate of the gap at which the dampers alone balance the driving traction [m/s]."""
        return (self.force(g, symengine.Integer(0)) - traction) / (self.law.c_b + self.law.c_g)

    def powers(
        self, build: Build, g: Expression, rate: Expression, moves: Expression | None = None
    ) -> Iterator[PowerFlow | TimeScale]:
        """Yield the work of the far field and the dissipation of the dampers; store the energies of the bodies.

        An overdamped rate is computed from tractions, with their roundoff. The work is therefore done on the gap's
        derivative ``moves``: energy is then conserved in each step, however stiff the damper.
        """
        moves = rate if moves is None else moves
        axis = self.mount.axis
        text = AXIS_WORDS[axis]
        yield from self.time_scales(text)
        for name, energy, what in (
            ("spring", self.energy(g), "elastic energy of the bodies"),
            ("kinetic", self.law.m * rate**2 / 2, "kinetic energy"),
        ):
            if energy != 0:
                build.store(Quantity(f"E_{name}_{axis}", "J/m^2", f"{what}, {text}"), energy)
        bulk = self.w_dot - rate
        power = (self.elastic_traction(g) + self.law.c_b * bulk) * self.w_dot + self.F * moves
        if power != 0:
            yield PowerFlow(WORK, OUTSIDE, MECHANICS, power, f"W_{axis}", f"work of the far field on the {text}")
        if self.law.c_b != 0:
            damped = self.law.c_b * bulk * (self.w_dot - moves)
            label, what = f"bulk_damper_{axis}", f"the damper of the bodies, {text}"
            symbol, receivers = symengine.Symbol(f"D_{label}"), self.receivers(build)
            produced = symengine.Add(*(share * symbol / build.thermal.places[at].T for at, share in receivers.items()))
            yield PowerFlow(DISSIPATION, MECHANICS, receivers, damped, label, what, entropy=produced)
        if self.law.c_g != 0:
            label = build.unique(f"contact_damper_{axis}")
            yield PowerFlow(DISSIPATION, MECHANICS, INTERFACE, self.law.c_g * rate * moves, label)

    def balance(
        self,
        build: Build,
        rate: Expression,
        tractions: Sequence[Expression],
        *,
        velocity: str = "",
        inertia: Expression | None = None,
        active: Expression = 1,
        held: Expression | None = None,
        coupled: Mapping[str, Expression] | None = None,
        slip: int = 0,
        limit: Expression = 1,
    ) -> Iterator[Equilibrium]:
        """Set the rows of a gap that moves against ``tractions`` [Pa] by Newton's law, by dampers, or in equilibrium.

        ``inertia`` [Pa] is that of a state that is a function of the velocity, ``held`` the row while not active.
        """
        name, rows = str(self.gap), build.rows
        resisted = [-part for part in tractions]  # separate terms, no nested sum, so that terms cancel symbolically
        if self.mount.inertial:
            rows.kinematics(name, rate)
            force = symengine.Add(self.force(self.gap, rate), *resisted, -self.law.c_g * rate)
            rows.momentum(velocity, force, self.law.m, active, inertia)
        elif self.mount.damped:
            rows.kinematics(name, rate)  # at the rate of the dampers under the unbalanced traction
        else:
            # Equilibrium at all times: its rate is the equation; the residual is for the start and for jumps.
            residual = symengine.Add(self.force(self.gap, symengine.Integer(0)), *resisted)
            rows.equilibrium(name, build.total_derivative(residual), active, held)
            size = self.size(self.gap) + symengine.Add(*(absolute(part) for part in tractions))
            yield Equilibrium(name, active * residual, size, coupled or {}, active, slip, limit)


def far_field(build: Build, mount: Support) -> FarField:
    """Return the mounting with symbols for its parameters; it is made once."""
    if mount.axis not in build.motion.far_fields:
        law = _bound(build, mount)
        w, F = f"w_{mount.axis}", f"F_{mount.axis}"
        given, none = build.variables.has(w), symengine.Integer(0)
        needed = law.k != 0 or law.c_b != 0
        drive = build.variables.get(w, mount.law) if needed else none
        force = build.variables.get(F, "the far field") if build.variables.has(F) else none
        load = build.loads.get(w)
        if law.c_b != 0 and given and load is not None and load.jumps():
            problem = f"(at t = {load.jumps()[0]:g} s): the damper c_b of the bodies would bear infinite traction"
            remedy = "Give the jump a duration, or leave out the damper."
            raise InputError(f"{w} cannot jump {problem}. {remedy}", load.place)
        w_dot = build.slope_of(w) if needed and given else none
        build.motion.far_fields[mount.axis] = FarField(mount, law, drive, w_dot, force)
    far: FarField = build.motion.far_fields[mount.axis]
    return far


def _bound(build: Build, mount: Support) -> Mounting:
    """Return the parameters of a mounting as symbols; two axes share the mass, or the whole mounting."""
    if mount.first_axis is None:
        law = build.variables.bind(mount.law, f"mechanics.{SECTIONS[mount.axis]}", f"_{mount.axis}")
        # The parameter that makes a gap inertial, overdamped or quasi-static may change, but not vanish.
        dampers = [name for name in ("c_b", "c_g") if getattr(mount.law, name) > 0]
        makes = "m" if mount.inertial else "k" if mount.quasi_static else dampers[0] if len(dampers) == 1 else ""
        path = f"mechanics.{SECTIONS[mount.axis]}.{makes}"
        items = build.parameters.items
        for i, item in enumerate(items):
            if item.path == path and item.value > 0:
                items[i] = item._replace(spec=item.spec._replace(above=0.0, at_least=-math.inf))
        return law
    first = far_field(build, mount.first_axis).law
    if mount.law is mount.first_axis.law:
        return first
    law = build.variables.bind(mount.law, f"mechanics.{SECTIONS[mount.axis]}", f"_{mount.axis}")
    return law.bind({"m": first.m, "e": first.e})


def jumps(build: Build) -> Iterator[Constraint]:
    """Yield the edge at the times of jumps of loads that act on a gap in equilibrium or on a spring."""
    springs = [far.energy(far.gap) for far in build.motion.far_fields.values() if far.does_work]
    read = set().union(*(build.expanded(x).free_symbols for x in [*(e.residual for e in build.equilibria), *springs]))
    paths = {item.path for item in build.parameters.items if item.symbol in read}
    steps = {
        name: load
        for name, load in build.loads.items()
        if load.jumps() and any(path.startswith(f"loading.{name}.") for path in paths)
    }
    if steps:
        times = tuple(sorted({t for load in steps.values() for t in load.jumps()}))
        yield Constraint(edges=(Edge("load", ONE, f"{' or '.join(steps)} jumps", equilibrates=True, times=times),))
