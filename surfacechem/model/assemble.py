"""Assembly of a scene into a system: components state their parts phase by phase, and the balances follow from these.

A component is a module of the folders ``components`` and ``constraints``. Its functions are named after the phases.
Each reads the build and yields records: nodes, bonds and energies, powers, states, margins, constraints, notes,
warnings.

Before a run initial values, limits at the start, and conductances of heat paths on both sides of touch are checked.
Source: Sauer, Duong & Mandadapu (2021), section on heat transfer: the sum of gas and radiation may exceed the contact.
"""

from __future__ import annotations

import math
import pkgutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache, lru_cache, partial
from importlib import import_module
from typing import Any

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.contracts.units import TOTAL_UNITS
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.expressions import Expression, depends
from surfacechem.model import components, constraints, ledger
from surfacechem.model.build import Build
from surfacechem.model.components.sliding_friction import stands_for_velocity
from surfacechem.model.system import START, Array, ExternalRates, System
from surfacechem.quantities import Quantity
from surfacechem.scene import Scene
from surfacechem.tolerances import CBRT_EPS, EPS

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
    sinks = ledger.sinks(build)
    pulls = {f"W_{axis}": far for axis, far in build.motion.far_fields.items() if far.does_work}
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
        far_work={label: far.F * far.gap for label, far in pulls.items() if far.F != 0},
        far_fields={label: (far.law.k, far.w, far.F, far.gap) for label, far in pulls.items()},
        warnings=(*build.interface.remarks, *build.warnings),
        external_rates=_outside(build),
        origin=partial(assemble, build.scene),
    )


def _of_pair(system: System) -> System:
    """Return the system of a pair of bodies: quantities per area become totals, in their units and words."""

    def renamed(item: Quantity) -> Quantity:
        unit, words = TOTAL_UNITS.get(item.unit, item.unit), item.long_name
        words = words.replace("traction", "force") if unit != item.unit else words
        return item._replace(unit=unit, long_name=words)

    def spec(item: Spec) -> Spec:
        return item._replace(unit=TOTAL_UNITS.get(item.unit, item.unit))

    return replace(
        system,
        states=tuple(replace(item, quantity=renamed(item.quantity)) for item in system.states),
        named=tuple(item._replace(quantity=renamed(item.quantity)) for item in system.named),
        ledger=tuple(item._replace(quantity=renamed(item.quantity)) for item in system.ledger),
        parameters=tuple(
            item if item.path.startswith(AREAL_PATH) else item._replace(spec=spec(item.spec))
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
        problem = "has no heat capacity, so it would have to be found together with rates that are evaluated outside"
        remedy = "Give the interface a capacity, or let it share the temperature of a body."
        raise InputError(f"{algebraic[0].name} {problem}. {remedy}", Place(path="interface.mechanism"))
    return ExternalRates(engine, reads)


TRIAL_GAPS = tuple(10.0 ** (k / 8) for k in range(-80, -16))
"""Trial gaps for the check that a conductance is monotone [m]: 0.1 nm to 10 mm."""

P, G = symengine.symbols("p g_n")


def conductance_warnings(system: System) -> Iterator[str]:
    """Yield warnings on conductances that jump at touch, rise as the gap opens, or do not vanish without contact.

    Everything but the gap and the pressure has its value at the start.
    """
    point = _numbers_at_start(system)
    gap = system.definitions.get(G)
    moves = {system.t, *(state.symbol for state in system.states)}
    held_open = gap is not None and not gap.free_symbols & moves and gap.subs(point) > 0
    for (a, b), channels in system.conductances.items():
        ends = f"the conductance between {a} and {b}"
        across = [symengine.sympify(h).subs(point) for h in channels if depends(h, G)]
        if not across:
            continue
        borne = (symengine.sympify(h).subs(point) for h in channels if depends(h, P) and not depends(h, G))
        if any(_value(h, P, 0.0) for h in borne):
            yield f"{ends} has a part that reads p and does not vanish without pressure, nor with the gap."
        if not held_open:
            yield from _at_touch(ends, symengine.Add(*across))


def _numbers_at_start(system: System) -> dict[Any, Any]:
    """Return numbers for everything but the gap and the pressure."""
    point: dict[Any, Any] = {system.t: 0.0} | {item.symbol: item.at(0.0) for item in system.parameters}
    point |= {state.symbol: state.initial for state in system.states if state.symbol not in (P, G)}
    for item in system.named:
        symbol = symengine.Symbol(item.name)
        if symbol not in (P, G):
            point[symbol] = symengine.sympify(item.expression).subs(point)
    return point


def _value(h: Expression, variable: Any, value: float) -> float | None:
    """Return a conductance at this value of the variable; None if it depends on more variables."""
    found = h.subs({variable: value})
    return None if found.free_symbols else float(found)


def _at_touch(ends: str, h: Expression) -> Iterator[str]:
    at_touch = _value(h, G, 0.0)
    # A pole, as of a film of zero thickness, is no jump: the law ends there and has a margin for it.
    if at_touch is None or not math.isfinite(at_touch):
        return
    before, after = (_value(h, G, side * EPS) or 0.0 for side in (-1, 1))
    highest, where = max((_value(h, G, g) or 0.0, g) for g in TRIAL_GAPS)
    if max(before, after) > (1 + CBRT_EPS) * min(before, after):
        yield f"{ends} jumps at touch, from {before:.6g} to {after:.6g} W/(m^2 K)."
    elif highest > (1 + CBRT_EPS) * before:
        values = f"{before:.6g} W/(m^2 K) at touch, {highest:.6g} at a gap of {where:.2g} m"
        yield f"{ends} is not monotone: {values}. Gas and radiation across the closed gap exceed the contact."


def refuse_idle_initial_values(build: Build) -> None:
    """Raise InputError if an initial value belongs to no variable that evolves."""
    states = {state.start or state.at_start[0].name for state in build.states}
    for name in build.scene.initial:
        if name in states:
            continue
        if name in build.scene.loading:
            message = f"{name} is prescribed under `loading`, so it has no initial value; remove one of them."
        elif build.variables.has(name):
            symbol = build.variables.get(name, "the initial value")
            same = next((state.name for state in build.states if state.symbol == symbol), None)
            message = f"{name} has two roles: an initial value, and prescribed or constant elsewhere."
            message = f"{name} is {same} in this case; give `{same}` instead." if same else message
        elif name in ("phi", "ln_phi"):
            message = f"nothing evolves {name}. Give a law under `bonding`, or remove it."
        else:
            known = {*states, *(slab.profile for slab in build.thermal.slabs.values())}
            message = f"nothing that evolves is called '{name}'.{suggestion(name, known)}"
        raise InputError(message, path=f"initial.{name}")


class StartLimits:
    """Check of initial values against the limits of a system."""

    def __init__(self, system: System) -> None:
        states = [None if state.algebraic else state.symbol for state in system.states]
        symbols = [system.t, *states, *(parameter.symbol for parameter in system.parameters)]
        places = {symbol: place for place, symbol in enumerate(symbols) if symbol is not None}
        self._limits = [(margin, _value_of(expression, places)) for margin, expression in system.limits]

    def check(self, y: Array, parameters: Array) -> None:
        """Raise InputError if these states and parameters are outside the range in which the laws hold."""
        numbers = [0.0, *y.tolist(), *parameters.tolist(), 1.0]
        for margin, value in self._limits:
            try:
                number = value(numbers)
            except (RuntimeError, TypeError, ValueError):  # undefined, such as zero over zero
                number = math.nan
            # A limit that reads an algebraic variable or a derivative is None: only the run can evaluate it.
            if number is not None and not number > 0:
                remedy = f" {margin.remedy}" if margin.remedy else ""
                message = f"at the start {margin.reason} ({margin.name} does not hold: {number:.6g}).{remedy}"
                raise InputError(message, path=margin.path)


def _value_of(expression: Expression, places: Mapping[Any, int]) -> Callable[[Sequence[float]], float | None]:
    """Return the function for the value of an expression without roundoff, None if a symbol has no number, from the
    numbers at these places.
    """
    if (terms := _sum(expression, places)) is not None:
        return lambda numbers: math.fsum([factor * numbers[place] for place, factor in terms])
    known = {x: places[x] for x in expression.free_symbols if x in places}

    @lru_cache(maxsize=64)  # runs that differ in other numbers, as a run and its second one, start from the same
    def value(*own: float) -> float | None:
        found = expression.subs(dict(zip(known, map(_exact, own), strict=True)))
        return None if found.free_symbols else float(found)

    return lambda numbers: value(*[numbers[place] for place in known.values()])


def _sum(expression: Expression, places: Mapping[Any, int]) -> list[tuple[int, float]] | None:
    """Return positions and factors of the terms, if an expression is a sum of known symbols and numbers alone.

    Most limits are. A number is its factor times the last entry, which is one.
    """
    terms = []
    for term in expression.args if isinstance(expression, symengine.Add) else (expression,):
        if isinstance(term, symengine.Float | symengine.Integer):
            terms.append((-1, float(term)))
        elif term in places:
            terms.append((places[term], 1.0))
        elif -term in places:
            terms.append((places[-term], -1.0))
        else:
            return None
    return terms


@lru_cache(maxsize=1024)
def _exact(value: float) -> Any:
    """Return a double as an exact rational number, so that a capacity that vanishes exactly is found to vanish."""
    fraction = Fraction(value)
    if fraction.denominator > sys.float_info.max:  # of rationals beyond doubles no function has a value
        return symengine.RealDouble(value)
    return symengine.Integer(fraction.numerator) / symengine.Integer(fraction.denominator)
