"""Reader from the sections of a case to its scene and its run, with checks across keys."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from surfacechem import solve as solvers
from surfacechem.contracts.terms import Law, Load, Property
from surfacechem.contracts.units import TOTAL_UNITS
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, listed, refuse_unknown
from surfacechem.format.declarations import UNITS, Context, is_name, keys, number, read
from surfacechem.format.sections import (
    BODY_NAME,
    DEFAULT_OUTPUTS,
    LINEAR,
    LUMP,
    REFERENCE,
    STEADY,
    BodySection,
    CellAccuracy,
    Document,
    FarSide,
    InterfaceSection,
    MechanismSection,
    MediumSection,
    ReferenceSection,
    RunSection,
    StageSection,
    Threshold,
)
from surfacechem.quantities import VARIABLES
from surfacechem.results.accuracy import first_tolerance
from surfacechem.scene import Body, Conduction, Interface, Medium, Mounting, Scene, Sites, Stage
from surfacechem.solve.run import OWN, Run
from surfacechem.tolerances import DEFAULT_RTOL, LINE_ERROR, NO_AMOUNT

if TYPE_CHECKING:
    from surfacechem.mechanism import Mechanism
    from surfacechem.mechanism.thermo import Species
    from surfacechem.surfaces.potential import CurvedSurfaces

L = TypeVar("L", bound=Law)

DEFAULT_BODIES = ("lower", "upper")
SHARED = "T"
"""Names of bodies that a case omits, and of the temperature that they share with the interface."""

# Reserved names for the temperatures of body 1, of body 2 and of the interface.
OWNERS = {"T_1": 0, "T_2": 1, "T_c": 2}

RESERVED = ("T_a", "T_from", "T_to")
TAKEN = ("interface", "surroundings", "reference")

# Keys of the interface that are not allowed with curved surfaces: all bonds would be at their least gap.
KEYS_OF_FLATS = ("sites", "bonding", "mechanism", "friction")

# Number of cells of a body until a run has chosen it.
DEFAULT_CELLS = 16


class ExactSolution(NamedTuple):
    """An exact solution by name, with the parameters that the case gives for it."""

    name: str
    options: Mapping[str, float] = {}
    place: Place | None = None

    @property
    def fixed(self) -> str:
        """Reason why the solution applies only to the scene of the case, in words; empty if it follows changes."""
        if not self.options:
            return ""
        own = f"it is given with {', '.join(self.options)}, and the scene was changed"
        return f"the exact solution {self.name} does not apply to this scene: {own}"


def read_document(tree: Tree, base: str = ".", mechanism_text: str | None = None) -> tuple[Document, Mechanism | None]:
    """Return the sections of a case and the mechanism that it names.

    Names of temperatures and species, which other sections may use, are given by the bodies and the interface, so that
    they are collected first.
    """
    nothing, outer, inner = Tree(None, tree.place), keys(Document), keys(InterfaceSection)
    top = tree.mapping(outer, elsewhere=dict.fromkeys(inner, "under `interface`"))
    bodies = top.get("bodies", nothing).mapping()
    interface = top.get("interface", nothing).mapping(inner, elsewhere=dict.fromkeys(outer, "at the top level"))
    _refuse(top, bodies, interface)
    # Owners with the same name of their temperature share it: they are in perfect contact.
    owners = [body.mapping().get("temperature") for body in bodies.values()] or [None, None]
    temperatures = _temperature_names([*owners, interface.get("temperature")])
    whole = "surface" in top
    units = {name: TOTAL_UNITS.get(unit, unit) for name, unit in UNITS.items()} if whole else UNITS
    names = {**units, **dict.fromkeys(temperatures, "K")}
    context = Context(names, temperatures, tuple(bodies) or DEFAULT_BODIES, whole=whole, remarks={})
    mechanism = None
    if "mechanism" in interface:
        # The solver decides whether a mechanism may ask Cantera for its rates.
        run = run_of(read(RunSection, top["run"], context)) if "run" in top else Run(times=(0.0, 1.0))
        named = keys(InterfaceSection)["mechanism"].content.read(interface["mechanism"], "the mechanism", context)
        evaluate = run.solver in (solvers.AUTO, *solvers.CALLING_PYTHON)
        mechanism = _mechanism(named, interface["mechanism"], Path(base), mechanism_text, evaluate)
        coverages = (variable.name for variable in mechanism.variables)
        context = context._replace(units={**context.units, **dict.fromkeys(coverages, "1")})
    case = read(Document, tree, context)
    case.remarks = tuple(context.remarks or ())
    return case, mechanism


def _refuse(top: Mapping[str, Tree], bodies: Mapping[str, Tree], interface: Mapping[str, Tree]) -> None:
    """Raise InputError if bodies are not two, or cannot have their names, or curved ones bond or rub as flats do."""
    if "bodies" in top and len(bodies) != 2:
        given = f"{len(bodies)} ({listed([*bodies]) or 'none'})"
        raise top["bodies"].error(f"exactly two bodies are needed, not {given}; the first is body 1.")
    for name, body in bodies.items():
        if not re.fullmatch(BODY_NAME, name) or name in TAKEN:
            raise body.error(f"'{name}' cannot name a body: use letters, digits, - and _, and none of {TAKEN}.")
    # Before numbers are read, which would be expected in the units of a pair of bodies.
    for name in KEYS_OF_FLATS if "surface" in top else ():
        if name in interface:
            text = "is of flats. Over curved surfaces bonds may be in equilibrium with the gap: put the law"
            raise interface[name].error(f"`{name}` {text} equilibrium-bonds under `surface: {{laws: ...}}`.")


def _temperature_names(owners: Sequence[Tree | None]) -> tuple[str, ...]:
    """Return the names of the temperatures of body 1, body 2 and the interface; reserved names need the right owner."""
    names = [str(owner.value) if owner is not None and is_name(owner) else "" for owner in owners]
    for name, owner in zip(names, owners, strict=True):
        if owner is not None and (name in RESERVED or (name in OWNERS and names[OWNERS[name]] != name)):
            raise owner.error(f"'{name}' is {VARIABLES[name].long_name}, which has its own; use another name.")
    return tuple(dict.fromkeys(filter(None, names)))


# -- scene ------------------------------------------------------------------------------------------------------------


def scene_of(case: Document, mechanism: Mechanism | None) -> Scene:
    """Return the scene that the sections define."""
    interface, surface, heat = _interface(case, mechanism), _surface(case), case.heat
    interface = replace(interface, remarks=(*interface.remarks, *case.remarks))
    if surface is not None:
        from surfacechem.surfaces.potential import CurvedConductance

        interface = replace(interface, potentials=(*interface.potentials, surface))
        for law in surface.heat_laws:
            own = CurvedConductance(law=law, pair=surface, between=law.between, closure=law.closure, place=law.place)
            heat = (*heat, own)
    if case.bodies:
        first, second = (_body(*item) for item in case.bodies.items())
    elif isinstance(case.interface.temperature, Load):  # reservoirs at the temperature of the interface
        first, second = (Body(name, SHARED) for name in DEFAULT_BODIES)
    else:
        message = "the two bodies, of which the first is body 1, for example `bodies: {lower: {...}, upper: {...}}`"
        raise case.tree.error(f"the case needs `bodies`: {message}; or `interface: {{temperature: 300 K}}`.")
    scene = Scene(
        bodies=(first, second),
        interface=interface,
        surface=surface,
        heat=heat,
        loading=dict(case.loading),
        surroundings=case.surroundings.temperature if case.surroundings else None,
        T_0=case.T_0,
        initial=_initial(case, mechanism),
        normal=_normal(case),
        tangential=case.mechanics.tangential,
        transverse=case.mechanics.transverse,
        programme=_stages(case),
    )
    if case.bodies:
        return scene
    # One history for all three, so that a change of it applies to all.
    given: Load = case.interface.temperature  # type: ignore[assignment]
    return replace(
        scene, interface=replace(scene.interface, temperature=SHARED), loading={SHARED: given, **scene.loading}
    )


def _body(name: str, section: BodySection) -> Body:
    stores = section.more or section.has("capacity")
    energy = BodySection.energy(section.tree)(**section.more, place=section.tree.place) if stores else None
    if (given := section.conduction) is None:
        return Body(name, section.temperature, energy)
    chosen = given.cells if isinstance(given.cells, CellAccuracy) else None
    cells = 0 if given.cells == LUMP else given.cells if isinstance(given.cells, int) else DEFAULT_CELLS
    if cells % 2:
        raise given.error(f"cells must be even, so that half of them show the error; got {cells}.", "cells")
    far = given.far if isinstance(given.far, FarSide) else None
    conduction = Conduction(
        thickness=given.thickness,
        conductivity=given.conductivity,
        cells=cells,
        accuracy=chosen.accuracy if chosen else None,
        after=chosen.after if chosen else None,
        grading=given.grading,
        far=far.temperature if far else None,
        h_far=far.h if far else None,
        place=given.tree.place,
    )
    return Body(name, section.temperature, energy, conduction)


def _interface(case: Document, mechanism: Mechanism | None) -> Interface:
    section = case.interface
    partition, loss = _partition(case)
    own = Interface(
        section.temperature,
        section.potential,
        section.friction,
        section.bonding,
        _sites(case),
        partition,
        limits=section.limits,
        loss=loss,
        medium=_medium(section.medium) if section.medium else None,
    )
    if mechanism is None:
        return own
    if section.has("sites"):
        remedy = "remove `sites` or `mechanism`. `sweep --over interface.sites=[...]` changes them"
        raise section.error(f"the mechanism gives the sites; {remedy}.", "sites")
    return replace(
        own,
        potentials=(*own.potentials, *mechanism.potentials),
        reactions=(*own.reactions, *mechanism.reactions),
        sites=mechanism.sites,
        variables=mechanism.variables,
        bonds=mechanism.bonds,
        engine=mechanism.engine,
        remarks=mechanism.remarks,
    )


def _surface(case: Document) -> CurvedSurfaces | None:
    """Return the free energy of two surfaces of given shapes, a function of their approach."""
    section = case.surface
    if section is None:
        return None
    from surfacechem.surfaces.potential import CurvedSurfaces

    first, second = tuple(case.bodies or ()) or DEFAULT_BODIES
    missing = [name for name in (first, second) if name not in section.bodies]
    if missing:
        raise section.error(f"{missing[0]} has no shape: give one to both bodies.", "bodies")
    if not (section.pair or section.laws):
        raise section.error("nothing acts between the surfaces: give a law under `pair` or `laws`.")
    if section.laws and "J_c" in case.loading:
        text = "`laws` are those of the area as it is; a stretch `J_c` thins out the points of `pair` alone"
        raise section.error(f"{text}: leave one of the two out.", "laws")
    low, high = section.approach.low, section.approach.high
    if not low < high:
        message = f"the least approach {low:g} m must be below the largest, {high:g} m."
        raise section.approach.error(message, "from", "to")
    _refuse_outside(case, low, high)
    return CurvedSurfaces(
        shapes=(section.bodies[first], section.bodies[second]),
        pairs=section.pair,
        gap_laws=section.laws,
        heat_laws=section.heat,
        approach=(low, high),
        accuracy=section.accuracy,
        place=section.tree.place,
    )


def _refuse_outside(case: Document, low: float, high: float) -> None:
    """Raise InputError if the initial gap is not among the approaches."""
    history, starts = case.loading.get("g_n"), {"initial": case.initial.get("g_n", low)}
    if history is not None:
        starts["loading"] = history.at_start()
    for where, start in starts.items():
        if not low <= start <= high:
            raise case.error(f"g_n = {start:g} m is not among the approaches, {low:g} to {high:g} m.", where)


def _partition(case: Document) -> tuple[float, float]:
    """Return the fractions of the heat into body 1 and into the surroundings."""
    section, shares = case.interface, case.interface.partition
    if shares is None:
        return 0.5, 0.0
    if section.has("temperature"):
        raise section.error("an interface with a temperature divides its heat by itself; remove it.", "partition")
    if not isinstance(shares, Mapping):
        return shares, 0.0
    if abs(sum(shares.values()) - 1) > NO_AMOUNT:  # fractions are written in decimals
        raise section.error(f"the fractions of the heat must add up to 1, not {sum(shares.values()):g}.", "partition")
    if shares.get("surroundings") and case.surroundings is None:
        message = "the surroundings have no temperature. Add `surroundings: {temperature: ...}`."
        raise section.error(message, "partition")
    return shares.get(next(iter(case.bodies)), 0.0), shares.get("surroundings", 0.0)


def _sites(case: Document) -> Sites | None:
    """Return the density of sites. It is one per square metre for bonds whose density nothing reads: under a given
    force, without stored energy.
    """
    section, bodies, sites = case.interface, list(case.bodies or DEFAULT_BODIES), case.interface.sites
    if sites is None:
        alone = section.bonding and not section.potential and not section.has("mechanism")
        return Sites(1.0, 1.0) if alone and "f" in case.loading else None
    if not isinstance(sites, Mapping):
        return Sites(sites, sites)
    for name in bodies:
        if name not in sites:
            raise section.error(f"the sites of {name} are missing: give both bodies a density.", "sites")
    reference = sites.get("reference", bodies[0])
    if "reference" in sites:
        place = section.tree.value["sites"].value["reference"].place
        refuse_unknown([reference], bodies, "no body '{}'", place)
    return Sites(sites[bodies[0]], sites[bodies[1]], bodies.index(reference) + 1)


def _medium(section: MediumSection) -> Medium:
    properties, fluid = {}, None
    for key, declared in keys(MediumSection).items():
        name, value = declared.attribute, getattr(section, declared.attribute)
        if name not in VARIABLES or value is None:
            continue
        if isinstance(value, Property) and value.quantity != name:
            about = VARIABLES[value.quantity].long_name
            raise section.error(f"{value.name()} is a law of the {about}, not of the {key}.", key)
        properties[name] = value
    if section.fluid is None:
        for name in ("pressure", "temperatures"):
            if section.has(name):
                raise section.error(f"`{name}` belongs to a fluid. Add `fluid:`, or remove it.", name)
    elif section.pressure is None:
        raise section.error("the fluid needs a `pressure`, for example `pressure: 1 atm`.")
    else:
        from surfacechem.laws.coolprop import CoolPropFluid

        fluid = CoolPropFluid(section.fluid, section.pressure)
        try:
            fluid.check()
        except InputError as error:
            raise section.error(error.message, "fluid") from None
    if section.growth and section.thickness is not None:
        raise section.error("the film grows: give its thickness at the start as `d_m` under `initial`.", "thickness")
    return Medium(fluid, properties, section.thickness, tuple(section.temperatures), tuple(section.growth))


def _normal(case: Document) -> Mounting | None:
    """Return the mounting along the normal, with the stiffness of the bodies in series: 1/k = H_1/E_1 + H_2/E_2."""
    normal = case.mechanics.normal
    given = [k for k in map(_stiffness, case.bodies.values()) if k is not None]
    if not given:
        return normal
    if "normal" in (held := case.mechanics.tree.mapping()) and "k" in held["normal"].mapping():
        message = "the stiffness has two roles: give `k` here or a stiffness to the bodies."
        raise case.mechanics.error(message, "normal")
    return replace(normal or Mounting(), k=1 / sum(1 / k for k in given))


def _stiffness(body: BodySection) -> float | None:
    """Return the stiffness of a body [Pa/m]; a body without one is rigid."""
    if body.stiffness is not None:
        for name in ("E", "H"):
            if body.has(name):
                raise body.error("the stiffness has two roles: give `stiffness`, or `E` and `H`.", name, "stiffness")
    for name, other in (("E", "H"), ("H", "E")):
        if body.has(other) and not body.has(name):
            raise body.error(f"a body's stiffness is E / H; `{name}` is missing.", other)
    k = body.E / body.H if body.E is not None and body.H is not None else body.stiffness
    if k is not None and not sys.float_info.min <= k <= 1 / sys.float_info.min:
        raise body.error(f"a stiffness of {k:g} Pa/m is beyond the range of numbers.", "stiffness", "E")
    return k


def _stages(case: Document) -> tuple[Stage, ...]:
    stages = [_stage(name, section) for entry in case.programme for name, section in entry.items()]
    for stage in stages[:-1]:
        if stage.duration is None and not stage.variable and not stage.event:
            message = f"only the last stage may be without end: give {stage.name} `for` or `until`."
            raise case.error(message, "programme")
    return tuple(stages)


def _stage(name: str, section: StageSection) -> Stage:
    """Return a stage with its end: after a time, at an event, or when a variable has a value."""
    stage, until = Stage(name, section.more, place=section.tree.place), section.until
    if section.has("for") and section.has("until"):
        raise section.error("the stage has two ends: give `for` or `until`.", "until", "for")
    if not isinstance(until, Mapping):
        return stage._replace(duration=section.duration, event=until or "")
    ((variable, value),) = until.items()
    if not isinstance(value, Threshold):
        return stage._replace(variable=variable, value=value)
    ends = [end for end in (value.rises_to, value.falls_to) if end is not None]
    if len(ends) != 1:
        raise value.error("give `rises-to` or `falls-to`.")
    return stage._replace(variable=variable, value=ends[0], rising=value.falls_to is None)


def _initial(case: Document, mechanism: Mechanism | None) -> dict[str, float]:
    """Return the initial values by variable, NaN for unknown names; the assembly decides which names are valid."""
    values = dict(case.initial)
    given = values.pop("coverages", None)
    if mechanism is not None and given is not None:
        for species, variable in mechanism.species.items():
            if variable in values:
                message = f"{variable} is a coverage; give it in `coverages: {{{species}: ...}}`, which sum to 1."
                raise InputError(message, case.tree.value["initial"].value[variable].place)
        return values | mechanism.coverages(given, case.tree.value["initial"].value["coverages"].place)
    if mechanism is not None:
        message = "the coverages of the mechanism: add `initial: {coverages: {species: value}}`."
        raise case.error(message, "initial") if case.has("initial") else case.interface.error(message, "mechanism")
    if given is not None:
        raise case.error("coverages are those of a mechanism. Add `interface.mechanism`, or remove them.", "initial")
    return values


# -- mechanism --------------------------------------------------------------------------------------------------------


def _mechanism(named: str | MechanismSection, tree: Tree, base: Path, content: str | None, evaluate: bool) -> Mechanism:
    """Return the mechanism of a case; ``content`` is its text, if known already.

    With ``evaluate`` reactions that cannot be lowered are left to Cantera.
    """
    from surfacechem.mechanism import load_mechanism
    from surfacechem.mechanism.evaluated import Neighbour
    from surfacechem.mechanism.load import find

    section = named if isinstance(named, MechanismSection) else MechanismSection(file=named)
    file = section.file if Path(section.file).suffix in (".yaml", ".yml") else f"{section.file}.yaml"
    neighbours = {name: Neighbour(**x.values, place=x.tree.place) for name, x in section.neighbours.items()}
    if content is None:
        path = find(file, base, (tree.value["file"] if isinstance(named, MechanismSection) else tree).place)
        file = str(path)
    chosen = section.phase, section.bonds
    loaded = load_mechanism(Path(file), *chosen, tree.place, evaluate, neighbours, file, content)
    return _renumbered(loaded, section.species, section.reactions)


def _renumbered(mechanism: Mechanism, species: Tree | None, reactions: Tree | None) -> Mechanism:
    """Return the mechanism with changed parameters of some species, by name, and of some reactions, by label."""
    if species is not None:
        (mixture,) = mechanism.potentials
        given = species.mapping(mechanism.species, "species")
        known: dict[str, Species] = {item.name: item for item in vars(mixture)["species"]}
        if given and any(item.fixed for item in known.values()):
            raise species.error("Cantera evaluates reactions here with the thermo of the file. Change it in the file.")
        known |= {name: _species(known[name], child) for name, child in given.items()}

        def renewed(law: L) -> L:
            return law.bind({"species": tuple(known[item.name] for item in vars(law)["species"])})

        laws = tuple(renewed(law) for law in mechanism.reactions)
        mechanism = mechanism._replace(potentials=(renewed(mixture),), reactions=laws)
    if reactions is not None:
        given = reactions.mapping([law.label for law in mechanism.reactions], "reactions")
        laws = tuple(_changed(law, given[law.label]) if law.label in given else law for law in mechanism.reactions)
        mechanism = mechanism._replace(reactions=laws)
    return mechanism


def _species(item: Species, tree: Tree) -> Species:
    """Return a species with parameters for its bond and for its thermo, by temperature range if it has several."""
    ranges = item.gibbs.ranges
    own: list[Law] = [law for law in (item.spring, ranges.get("")) if law is not None]
    keys = {name: law for law in own for name, _ in law.specs()}
    fields = tree.mapping([*keys, *filter(None, ranges)])

    def renewed(law: L, part: Tree | None = None) -> L:
        inner = {key: child for key, child in fields.items() if keys.get(key) is law}
        return _changed(law, part or tree._replace(value=inner))

    forms = [renewed(form, fields.get(key)) for key, form in ranges.items()]
    return item._replace(gibbs=item.gibbs.with_forms(forms), spring=item.spring and renewed(item.spring))


def _changed(law: L, tree: Tree) -> L:
    """Return a law with the parameters that a case gives for it."""
    specs = {name: law.refine(name, spec) for name, spec in law.specs() if spec.varies}
    fields = tree.mapping(specs, "parameters")
    return law.given({name: number(child, specs[name], name) for name, child in fields.items()})


# -- run and exact solution -------------------------------------------------------------------------------------------


def run_of(section: RunSection) -> Run:
    """Return the run that the section defines."""
    if section.has("accuracy") and section.has("rtol"):
        raise section.error("the tolerance has two roles: give `accuracy` or `rtol`.", "accuracy", "rtol")
    solver = section.solver or (solvers.AUTO if section.accuracy is not None else OWN)
    if section.solver == solvers.AUTO and section.has("rtol"):
        message = "the tolerance has two roles: with `solver: auto` it follows from `accuracy`."
        raise section.error(message, "rtol", "solver")
    # The first tolerance for an accuracy has a margin; `solver: auto` repeats a run that misses it at a tighter one.
    usual = DEFAULT_RTOL if section.accuracy is None else first_tolerance(section.accuracy)
    return Run(
        times=_times(section),
        rtol=section.rtol if section.rtol is not None else usual,
        atol=section.atol,
        solver=solver,
        max_steps=section.max_steps,
        max_seconds=section.max_seconds,
        accuracy=section.accuracy,
        picture=None if any(map(section.has, ("times", "outputs", "spacing", "first"))) else LINE_ERROR,
        steady=section.until == STEADY,
    )


def _times(section: RunSection) -> tuple[float, ...]:
    """Return the output times [s], listed or spaced; if they follow the run, the times at which runs are compared."""
    if (listed := section.times) is not None:
        for name in ("until", "outputs", "spacing", "first"):
            if section.has(name):
                raise section.error(f"the output times have two roles: give `times` or `{name}`.", name, "times")
        if max(listed, default=0.0) == 0.0:
            raise section.error("at least one time after 0 is needed.", "times")
        # Every run begins at zero, even if zero is no output.
        times = tuple(listed) if listed[0] == 0.0 else (0.0, *listed)
    elif section.until is None:
        raise section.error("the run needs an end. Add `until: 1 s`, or a list of `times`.")
    else:
        if section.until == STEADY and section.spacing != LINEAR:
            raise section.error("logarithmic spacing needs an end in time, not `until: steady`.", "spacing", "until")
        times = _spaced(section, 1.0 if isinstance(section.until, str) else section.until)
    if any(b <= a for a, b in pairwise(times)):
        message = "output times must increase from each to the next."
        raise section.error(message, "until" if listed is None else "times")
    return times


def _spaced(section: RunSection, end: float) -> tuple[float, ...]:
    """Return output times [s], spaced evenly or by ratios."""
    count, first = section.outputs or DEFAULT_OUTPUTS, section.first
    if section.spacing == LINEAR:
        if first is not None:
            raise section.error("`first` belongs to `spacing: logarithmic`.", "first", "spacing")
        return (*(end * (i / (count - 1)) for i in range(count - 1)), end)
    if first is None:
        raise section.error("logarithmic spacing needs `first`: the first output time after 0.", "spacing")
    if first > end:
        raise section.error(f"first = {first:g} is outside its range: <= {end:g}.", "first", "until")
    # A difference of logarithms, as the ratio of the ends may overflow; the end itself is exact.
    ratio = math.log(end) - math.log(first)
    return (0.0, *(first * math.exp(ratio * i / max(count - 2, 1)) for i in range(count - 2)), end)


def exact_solution_of(tree: Tree) -> ExactSolution | None:
    """Return the exact solution that a case names; None if the key is left empty."""
    if tree.value is None or tree.value == "":
        return None
    named = REFERENCE.read(tree, "reference", Context())
    if isinstance(named, ReferenceSection):
        return ExactSolution(named.name, named.more, tree.place)
    return ExactSolution(named, place=tree.place)
