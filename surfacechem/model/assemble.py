"""From a scene to its system: roles read off, potentials differentiated, dissipative laws stated, balances formed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.model.automaton import Sink
from surfacechem.model.balances import INTERFACE
from surfacechem.model.build import Build
from surfacechem.model.components.chemistry import reactions
from surfacechem.model.components.conduction import conductors, profiles, slabs
from surfacechem.model.components.force import force, rupture
from surfacechem.model.components.friction import friction
from surfacechem.model.components.gap import normal_gap, normal_motion
from surfacechem.model.components.heat import heat_paths
from surfacechem.model.components.interface import LOADABLE, bonding_variables, free_energy, prescribed_variables
from surfacechem.model.components.logarithms import logarithmic_state
from surfacechem.model.components.medium import medium
from surfacechem.model.components.programme import TRACTIONS, programme, stage_ends
from surfacechem.model.components.thermal import body_energies, equations, surface_rates, surface_work, temperatures
from surfacechem.model.constraints.bound import released
from surfacechem.model.constraints.envelope import apart_from_envelope, softening_mode
from surfacechem.model.constraints.fold import folds
from surfacechem.model.constraints.load_steps import load_steps
from surfacechem.model.constraints.threshold import bonded_mode, limits, relaxing
from surfacechem.model.constraints.unilateral import impacts, missed
from surfacechem.model.ledger import flow, regime, sinks, state, totals
from surfacechem.model.refit import Fit
from surfacechem.model.sliding.rate_and_state import stands_for_velocity
from surfacechem.model.sliding.tangential import tangential_gap, tangential_motion
from surfacechem.model.system import START, Capped, Caution, Outside, Pace, Pair, Profile, Range, Role, System
from surfacechem.scene import Scene

__all__ = ["LOADABLE", "TRACTIONS", "assemble"]


def assemble(scene: Scene) -> System:
    """The system of a scene; InputError where a variable that is read has no role, or two."""
    build = Build(scene)
    stated = partial(state, build)
    # Variables: what evolves, what is prescribed, and the modes that laws read.
    build.thermal = temperatures(build)
    build.thermal = body_energies(build)
    build.thermal = stated(slabs(build))
    prescribed_variables(build)
    programme(build)
    build.bonding = bonding_variables(build)
    normal_gap(build)
    tangential_gap(build)
    bonded_mode(build)
    softening_mode(build)
    fit = medium(build)
    # The free energy, and the tractions and forces that are its derivatives.
    build.energy = free_energy(build)
    if build.interface.temperature is not None:
        build.thermal = build.thermal.with_energy(INTERFACE, build.psi)
    force(build)
    # Laws: what they pass on, and the balances of bonds and of tractions.
    limits(build)
    stated(reactions(build))
    rupture(build)
    stated(friction(build))
    stated(normal_motion(build))
    stated(tangential_motion(build))
    impacts(build)
    relaxing(build)
    build.conductances = stated(heat_paths(build))
    missed(build)
    # Balances of energy, from all that passes energy on.
    build.rates = surface_rates(build)
    stated(surface_work(build))
    build.inflow = flow(build)
    stated(equations(build))
    # What jumps and what it takes with it.
    folds(build)
    load_steps(build)
    apart_from_envelope(build)
    released(build)
    stage_ends(build)
    # Outputs.
    totals(build)
    logarithmic_state(build)
    layers = profiles(build)
    build.varying_margins()
    _refuse_idle_initial_values(build)
    taking = sinks(build)
    if build.edges or any(state.finest for state in build.states) or stands_for_velocity(build):
        build.constant("t_start", START, Spec("s", "time at which a stretch between events starts"), 0.0, internal=True)
    own = {str(item.symbol) for item in build.parameters.items if not item.internal}
    shared = own & {item.name for item in build.named}
    assert not shared, f"parameters and quantities share the names {shared}"
    unread = [name for name in scene.loading if name not in build.thermal.nodes and not build.variables.was_read(name)]
    build.warnings += [f"loading: {name} is prescribed but nothing reads it." for name in unread]
    return _system(build, layers, taking, fit())


def _system(
    build: Build, layers: tuple[Profile, ...], taking: Mapping[str, tuple[Sink, ...]], fit: Fit | None
) -> System:
    """All that was stated, as one frozen graph."""
    far_fields = build.motion.far_fields
    return System(
        t=build.t,
        states=tuple(build.states),
        parameters=tuple(build.parameters.items),
        constants=dict(build.parameters.constants),
        named=tuple(build.named),
        rows={state.name: build.rows[state.name] for state in build.states},
        ledger=tuple(build.ledger),
        margins=tuple(build.margins),
        roles=tuple(role for role in build.variables.roles if _is_there(build, role)),
        ranges=build.noted(Range),
        capped=build.noted(Capped),
        pairs=build.noted(Pair),
        paces=build.noted(Pace),
        cautions=build.noted(Caution),
        profiles=layers,
        conductors=tuple(conductors(build)),
        conductances=build.conductances,
        regime=regime(build),
        breakpoints=tuple(sorted({t for load in build.loads.values() for t in load.breakpoints()})),
        cycles=tuple(_cycles(build)),
        modes=tuple(build.modes),
        registers=tuple(build.registers),
        edges=tuple(build.edges),
        equilibria=tuple(build.equilibria),
        sinks=taking,
        follows={str(x): value for x, value in build.motion.follows.items()},
        given={f"W_{axis}": far.F * far.gap for axis, far in far_fields.items() if far.F != 0},
        pulls={f"W_{axis}": (far.k, far.w, far.F, far.gap) for axis, far in far_fields.items() if far.works},
        fit=fit,
        warnings=(*build.interface.remarks, *build.warnings),
        outside=_outside(build),
        origin=partial(assemble, build.scene),
    )


def _cycles(build: Build) -> Iterator[str]:
    """Paths of the frequencies of histories that repeat themselves."""
    for name, load in build.loads.items():
        if load.cycle:
            yield f"{load.path if load.place else f'loading.{name}'}.{load.cycle}"


def _is_there(build: Build, role: Role) -> bool:
    """Whether a derived variable was derived: one that nobody reads is not there."""
    name = role.variable
    return role.role != "derived" or build.variables.was_read(name) or build.is_named(name)


def _outside(build: Build) -> Outside | None:
    engine = build.interface.engine
    if engine is None:
        return None
    reads = tuple(build.variables.get(name, "the engine of the mechanism") for name in engine.reads)
    algebraic = [state for state in build.states if state.algebraic]
    if algebraic:
        raise InputError(
            f"{algebraic[0].name} has no heat capacity, so it would have to be found together with rates that are "
            "evaluated outside. Give the interface a capacity, or let it share the temperature of a body.",
            Place(path="interface.mechanism"),
        )
    return Outside(engine, reads)


def _refuse_idle_initial_values(build: Build) -> None:
    """An initial value belongs to something that evolves."""
    states = {state.start or state.at_start[0].name for state in build.states}
    for name in build.scene.initial:
        if name in states:
            continue
        if name in build.scene.loading:
            message = f"{name} is prescribed under `loading`, so it has no initial value; remove one of them."
            raise InputError(message, path=f"initial.{name}")
        if build.variables.has(name):
            symbol = build.variables.get(name, "the initial value")
            same = next((state.name for state in build.states if state.symbol == symbol), None)
            message = f"{name} has two roles: an initial value, and prescribed or constant elsewhere."
            message = f"{name} is {same} in this case; give `{same}` instead." if same else message
            raise InputError(message, path=f"initial.{name}")
        if name in ("phi", "ln_phi"):
            message = f"nothing evolves {name}. Give a law under `bonding`, or remove it."
            raise InputError(message, path=f"initial.{name}")
        known = {*states, *(slab.profile for slab in build.thermal.slabs.values())}
        raise InputError(f"nothing that evolves is called '{name}'.{suggestion(name, known)}", path=f"initial.{name}")
