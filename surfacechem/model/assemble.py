"""Assembly of a scene into a system: components state their parts phase by phase, and the balances follow from these.

A component is a module of the folders ``components`` and ``constraints``. Its functions are named after the phases.
Each reads the build and yields records: nodes, bonds and energies, powers, states, margins, constraints, notes,
warnings.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from typing import Any

from surfacechem.contracts.terms import Spec
from surfacechem.contracts.units import TOTAL_UNITS
from surfacechem.errors import InputError, Place
from surfacechem.model import components, constraints, ledger
from surfacechem.model.build import Build
from surfacechem.model.checks import refuse_idle_initial_values
from surfacechem.model.components.sliding_friction import stands_for_velocity
from surfacechem.model.system import START, ExternalRates, System
from surfacechem.quantities import Quantity
from surfacechem.scene import Scene

AREAL_PATH = "surface"
"""Start of the paths of parameters that are per area in every scene."""

PHASES = ("variables", "energies", "laws"), ("rows", "jumps", "stages"), ("outputs",)
"""Phases of the assembly: those before the powers are added up, those before the totals, and that of the outputs.

variables: roles of variables, states and modes. energies: the free energy with tractions and forces. laws: laws with
their powers, and the balances of bonds and tractions. rows: the balances of energy. jumps: the edges and their reset
maps. stages: the ends of stages of the loading, which may wait for any of these. outputs: states that come after all
others.
"""

ORDER = (
    "thermal",
    "conduction",
    "programme",
    "interface",
    "threshold",
    "unilateral",
    "chemistry",
    "force",
    "sliding_friction",
    "gap",
    "tangential",
    "medium",
    "heat",
    "fold",
    "mounting",
    "envelope",
)
"""Order of components that build on, or are printed after, those before them; all others follow by name."""


def _bonds(scene: Scene) -> object:
    """True if the scene has bonds or states their number."""
    interface = scene.interface
    driven = "phi" in scene.loading or any("phi" in stage.rates for stage in scene.programme)
    return driven or interface.sites or interface.variables or interface.reactions


OPTIONAL: dict[str, Callable[[Scene], object]] = {
    "conduction": lambda scene: any(body.conduction for body in scene.bodies),
    "programme": lambda scene: scene.programme,
    "medium": lambda scene: scene.interface.medium,
    **dict.fromkeys(("chemistry", "pairs", "bound", "envelope"), _bonds),
}
"""Condition on the scene for each optional component, which is imported only if it holds."""


@cache
def _places() -> dict[str, str]:
    """Return the module of each component by its file's name."""
    rooms = (components, constraints)
    found = {file.name: f"{r.__name__}.{file.name}" for r in rooms for file in pkgutil.iter_modules(r.__path__)}
    return {name: found[name] for name in (*ORDER, *sorted(found.keys() - {*ORDER}))}


def assemble(scene: Scene) -> System:
    """Assemble the equations of a scene.

    Parameters
    ----------
    scene
        Two bodies, the interface, heat paths, loading and initial values, in SI.

    Returns
    -------
    System
        States, rows, ledger, modes and transitions as one symbolic graph.

    Raises
    ------
    InputError
        Where a variable that is read has no role, or two.
    """
    if scene.surface is None:
        return _system(_built(scene))
    # A quick pass with surrogates reports errors of the scene before the costly integrals over its surfaces are
    # computed.
    _built(with_surrogates(scene))
    return _of_pair(_system(_built(scene)))


def with_surrogates(scene: Scene) -> Scene:
    """Return the scene with cheap surrogates of its laws, for checks of everything else."""
    return _with_laws(scene, lambda law: law.surrogate())


def perturbed(scene: Scene) -> Scene:
    """Return the scene with each law perturbed by the error of the numbers that it computes internally."""
    return _with_laws(scene, lambda law: law.perturbed())


def _with_laws(scene: Scene, change: Callable[[Any], Any]) -> Scene:
    """Return the scene with ``change`` applied to its potentials and heat paths."""
    potentials = tuple(map(change, scene.interface.potentials))
    interface = replace(scene.interface, potentials=potentials)
    return replace(scene, interface=interface, heat=tuple(map(change, scene.heat)))


def _built(scene: Scene) -> Build:
    """Return the build with all records of the components of a scene."""
    build = Build(scene)
    needed = [place for name, place in _places().items() if name not in OPTIONAL or OPTIONAL[name](scene)]
    found = [import_module(place) for place in needed]
    for phases, follow in zip(PHASES, (ledger.flows, ledger.totals, _close), strict=True):
        for phase in phases:
            for component in found:
                for record in getattr(component, phase, lambda _: None)(build) or ():
                    ledger.add_record(build, record)
        follow(build)
    return build


def _close(build: Build) -> None:
    """Add what needs the whole scene: margins of varying parameters, the start of arcs, checks and warnings."""
    build.varying_margins()
    refuse_idle_initial_values(build)
    if build.edges or any(state.finest for state in build.states) or stands_for_velocity(build):
        build.constant("t_start", START, Spec("s", "time at which a stretch between events starts"), 0.0, internal=True)
    own = {str(item.symbol) for item in build.parameters.items if not item.internal}
    shared = own & {item.name for item in build.named}
    assert not shared, f"parameters and quantities share the names {shared}"
    loading = (name for name in build.scene.loading if name not in build.thermal.nodes)
    unread = (name for name in loading if not build.variables.was_read(name))
    build.warnings += [f"loading: {name} is prescribed but nothing reads it." for name in unread]


def _system(build: Build) -> System:
    """Return the immutable system of all records."""
    far_fields, sinks = build.motion.far_fields, ledger.sinks(build)
    return System(
        t=build.t,
        states=tuple(build.states),
        parameters=tuple(build.parameters.items),
        constants=dict(build.parameters.constants),
        named=tuple(build.named),
        rows={state.name: build.rows[state.name] for state in build.states},
        ledger=tuple(build.ledger),
        margins=tuple(build.margins),
        roles=build.roles,
        notes=tuple(build.notes),
        conductances=build.conductances,
        regime=ledger.regime(build),
        breakpoints=build.breakpoints,
        cycles=build.cycles,
        modes=tuple(build.modes),
        registers=tuple(build.registers),
        edges=tuple(build.edges),
        equilibria=tuple(build.equilibria),
        sinks=sinks,
        followers={str(x): value for x, value in build.motion.followers.items()},
        far_work={f"W_{axis}": far.F * far.gap for axis, far in far_fields.items() if far.F != 0},
        far_fields={f"W_{axis}": (far.k, far.w, far.F, far.gap) for axis, far in far_fields.items() if far.does_work},
        warnings=(*build.interface.remarks, *build.warnings),
        external_rates=_outside(build),
        origin=partial(assemble, build.scene),
    )


def _of_pair(system: System) -> System:
    """Return the system of a pair of bodies: quantities per area become totals, in their units and words."""

    def renamed(item: Quantity) -> Quantity:
        unit, words = TOTAL_UNITS.get(item.unit, item.unit), item.long_name
        words = words.replace("traction", "force") if unit != item.unit else words
        return replace(item, unit=unit, long_name=words)

    def spec(item: Spec) -> Spec:
        return replace(item, unit=TOTAL_UNITS.get(item.unit, item.unit))

    return replace(
        system,
        states=tuple(replace(item, quantity=renamed(item.quantity)) for item in system.states),
        named=tuple(replace(item, quantity=renamed(item.quantity)) for item in system.named),
        ledger=tuple(replace(item, quantity=renamed(item.quantity)) for item in system.ledger),
        parameters=tuple(
            item if item.path.startswith(AREAL_PATH) else replace(item, spec=spec(item.spec))
            for item in system.parameters
        ),
        in_totals=True,
    )


def _outside(build: Build) -> ExternalRates | None:
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
    return ExternalRates(engine, reads)
