"""The sections of a case file: every key with its content, range and default.

Reader, JSON Schema, defaults and the tables of the documentation follow from these declarations. Relations between
sections, and contradictions across keys, are in :mod:`surfacechem.format.reader`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

from surfacechem import laws, references
from surfacechem import solve as solvers
from surfacechem.contracts.terms import (
    BodyEnergy,
    FilmGrowth,
    Friction,
    HeatTransfer,
    Limit,
    Load,
    PairEnergy,
    Potential,
    Property,
    RateLaw,
    Shape,
    Spec,
)
from surfacechem.contracts.units import quotient
from surfacechem.documents.document import Tree
from surfacechem.format.declarations import (
    NODE_NAME,
    REQUIRED,
    UNITS,
    ByShape,
    Content,
    Context,
    Deferred,
    Entries,
    Integer,
    Key,
    ListOf,
    Nested,
    Number,
    OneLaw,
    OneOf,
    Prescribed,
    Section,
    Temperature,
    Text,
    amount,
    key,
    keys,
    law_keys,
    quantity,
)
from surfacechem.model.components.interface import LOADABLE
from surfacechem.model.components.mounting import SLIDING_TRACTIONS
from surfacechem.quantities import VARIABLES
from surfacechem.scene import MOST_CELLS, Conduction, Mounting
from surfacechem.solve.run import OWN
from surfacechem.tolerances import DEFAULT_RTOL, ERROR_FLOOR, MAX_RTOL, MIN_RTOL

BODY_NAME = r"[A-Za-z][A-Za-z0-9_-]*"

# Variables other than temperatures and bonds that some scenes evolve; the assembly decides for each scene.
EVOLVING = ("g_n", "v_n", "u_t", "u_t2", "v_t", "v", "v_2", "g_t", "w_n", "w_t", "w_t2", "F_n", "F_t", "F_t2", "p")

LUMP, INSULATED, QUADRATIC = "lump", "insulated", "quadratic"
STEADY = "steady"
"""Word for the end of a run at its steady state."""

LINEAR, LOGARITHMIC = SPACINGS = ("linear", "logarithmic")
GRID = "grid"

DEFAULT_OUTPUTS = 201
MOST_OUTPUTS = MOST_RUNS = 1_000_000

# Largest numbers of parameters of a grid, and of values of one or draws of a sample, the limit of Sobol' points.
MOST_AXES, MOST_POINTS = 32, 2**30

# Largest ratio of the widths of the last and the first cell, so that their order is resolved by doubles.
STEEPEST = 1e6


def _variables(names: Sequence[str], content: Content) -> dict[str, Key]:
    """Return keys that are variables, in their units."""
    return {name: Key(content, f"{VARIABLES[name].long_name} [{UNITS[name]}]") for name in names}


# -- bodies -----------------------------------------------------------------------------------------------------------


class CellAccuracy(Section):
    """accuracy by which a run chooses the number of cells"""

    called = "a choice of cells"

    accuracy: float = quantity("1", "relative accuracy of temperatures", REQUIRED, above=0, at_most=0.1)
    after: float | None = quantity(
        "s", "time after the start, or a step of a load, from which on it holds; 1/200 of the run if not given", above=0
    )


class FarSide(Section):
    """far side of a body"""

    called = "the far side"

    temperature: Load = key(Prescribed("K", above_zero=True), "temperature at the far side, or beyond it", REQUIRED)
    h: float | None = quantity("W/(m^2 K)", "conductance to what is beyond", at_least=0)


class ConductionSection(Section):
    """temperatures across the body instead of one"""

    thickness: float = key(Number(dict(Conduction.specs())["thickness"]), default=REQUIRED)
    conductivity: Any = key(Number(dict(Conduction.specs())["conductivity"]), default=REQUIRED)
    cells: int | str | CellAccuracy = key(
        ByShape(Integer(2, MOST_CELLS, step=2, word=LUMP), Nested(CellAccuracy)),
        "number of cells, an even one so that half of them show the error, {accuracy: 1e-4}, or lump",
        REQUIRED,
    )
    grading: float = quantity(
        "1", "width of the cells at the far side over that at the contact", 1.0, at_least=1 / STEEPEST, at_most=STEEPEST
    )
    far: str | FarSide = key(
        ByShape(
            OneOf("far side", lambda: (INSULATED,)),
            Nested(FarSide),
            wanted="the far side is `insulated`, {temperature: 25 degC}, or {temperature: 25 degC, h: 10 W/m^2/K}",
        ),
        "far side",
        INSULATED,
    )


class BodySection(Section):
    """one of the two bodies; the first is body 1"""

    temperature: str | Load = key(Temperature(), "a name such as T, or a value or a history", REQUIRED)
    capacity: str = key(
        OneOf("capacity", lambda: sorted(laws.laws(BodyEnergy)), lambda name: laws.knows(BodyEnergy, name)),
        "energy as a function of temperature",
        QUADRATIC,
    )
    conduction: ConductionSection | None = key(Nested(ConductionSection))
    stiffness: float | None = quantity("Pa/m", "normal stiffness of the body; both are in series", above=0)
    E: float | None = quantity("Pa", "Young's modulus, with `H` instead of `stiffness`", above=0)
    H: float | None = quantity("m", "height, with `E` instead of `stiffness`", above=0)

    @staticmethod
    def energy(tree: Tree) -> type[BodyEnergy]:
        """Return the law of the energy, whose parameters are among the other keys."""
        capacity = tree.mapping().get("capacity")
        name = capacity.value if capacity else QUADRATIC
        if capacity and not (isinstance(name, str) and laws.knows(BodyEnergy, name)):
            name = capacity.choice("capacity", laws.laws(BodyEnergy))
        return cast("type[BodyEnergy]", laws.find(BodyEnergy, name))

    @classmethod
    def more_keys(cls, tree: Tree | None) -> Mapping[str, Key]:
        """Return the parameters of the energy, which a body without energy omits."""
        kinds = list(laws.laws(BodyEnergy).values()) if tree is None else [cls.energy(tree)]
        found = {name: declared for kind in kinds for name, declared in law_keys(kind).items()}
        if tree is not None and any(name in tree.mapping() for name in ("capacity", *found)):
            return {name: Key(item.content, item.text, item.default) for name, item in found.items()}
        return {name: Key(item.content, item.text) for name, item in found.items()}


# -- interface --------------------------------------------------------------------------------------------------------


def _property(name: str, key_name: str) -> Any:
    content = ByShape(amount(UNITS[name], above=0), OneLaw(Property))
    return key(content, f"{VARIABLES[name].long_name} [{UNITS[name]}]", name=key_name)


class MediumSection(Section):
    """medium: what fills the space between the bodies"""

    fluid: str | None = key(Text(), "name of a fluid that CoolProp knows")
    pressure: float | None = quantity("Pa", "pressure of the fluid", above=0)
    temperatures: Sequence[float] = key(ListOf(amount("K", above=0), "[300 K]"), "covered from the start [K]", ())
    thickness: float | None = quantity("m", "thickness, else the normal gap", above=0)
    growth: Sequence[FilmGrowth] = key(
        ListOf(OneLaw(FilmGrowth)), "laws by which a film grows and wears, instead of `thickness`", ()
    )
    k_m: Any = _property("k_m", "conductivity")
    eta_m: Any = _property("eta_m", "viscosity")
    rho_m: Any = _property("rho_m", "density")
    cp_m: Any = _property("cp_m", "heat-capacity")


class NeighbourSection(Section):
    """state in which a phase beside the surface is held, each value a number or a history"""

    pressure: Load | None = key(Prescribed("Pa"), "pressure [Pa]")
    composition: Mapping[str, Load] = key(Entries(others=Prescribed("1")), "mole fractions by species", {})
    rest: str = key(Text(), "the species whose mole fraction is what the others leave", "")
    electric_potential: Load | None = key(
        Prescribed("V"), "electric potential against the surface [V]", name="electric-potential"
    )
    capacitance: float | None = quantity(
        "F/m^2", "of what holds charge: its potential is that of the start, and follows from charge", above=0
    )
    current: Load | None = key(Prescribed("A/m^2"), "electric current into it from outside [A/m^2]")


NUMBERS = Entries(others=amount("1"))


class MechanismSection(Section):
    """Cantera surface mechanism"""

    called = "the mechanism"

    file: str = key(Text(), "the name of a Cantera surface mechanism", REQUIRED)
    phase: str | None = key(Text(), "the phase, where there are several")
    bonds: Sequence[str] = key(ListOf(Text()), "species that count as bonds", ())
    neighbours: Mapping[str, NeighbourSection] = key(
        Entries(others=Nested(NeighbourSection)), "states in which the phases beside the surface are held, by name", {}
    )
    species: Tree | None = key(
        Deferred(Entries(others=Entries(others=ByShape(amount("1"), NUMBERS)))), "other numbers of species, by name"
    )
    reactions: Tree | None = key(Deferred(Entries(others=NUMBERS)), "other numbers of reactions, the first being `R1`")


DENSITY = amount("1/m^2", "density of bonding sites", above=0)
SHARE = amount("1", "fraction of heat", at_least=0, at_most=1)
SITES = Entries({"reference": Key(Text(), "the body whose sites define phi")}, DENSITY, lambda case: case.bodies)
PARTITION = Entries(others=SHARE, names=lambda case: [*case.bodies, "surroundings"])


class InterfaceSection(Section):
    """interface between the bodies"""

    temperature: str | Load | None = key(
        Temperature(), "a name, a value or a history; left out where there is no medium"
    )
    sites: float | Mapping[str, Any] | None = key(
        ByShape(DENSITY, SITES), "density of bonding sites [1/m^2], one value or one for each body"
    )
    partition: float | Mapping[str, float] | None = key(
        ByShape(SHARE, PARTITION),
        "fraction of interface heat into body 1 where there is no medium, 0.5 if not given; or fractions by body and "
        "`surroundings`",
    )
    medium: MediumSection | None = key(Nested(MediumSection))
    potential: Sequence[Potential] = key(ListOf(OneLaw(Potential)), "terms of the free energy", ())
    friction: Sequence[Friction] = key(ListOf(OneLaw(Friction)), "friction laws, whose tractions add up", ())
    bonding: Sequence[RateLaw] = key(ListOf(OneLaw(RateLaw)), "reactions, whose rates add up", ())
    limits: Sequence[Limit] = key(ListOf(OneLaw(Limit)), "tractions at which the interface gives way at once", ())
    mechanism: str | MechanismSection | None = key(
        ByShape(Text(), Nested(MechanismSection)), "Cantera surface mechanism, instead of `sites`"
    )


# -- surfaces ---------------------------------------------------------------------------------------------------------


class ApproachSection(Section):
    """approaches between which the force is integrated; a run that reaches an end of them stops"""

    called = "the approach"

    low: float = quantity("m", "least approach", REQUIRED, name="from")
    high: float = quantity("m", "largest approach", REQUIRED, name="to")


class SurfaceSection(Section):
    """shapes of the two bodies; what is per area elsewhere is then that of the whole pair, N for Pa and J for J/m^2"""

    called = "the section surface"

    bodies: Mapping[str, Shape] = key(
        Entries(others=OneLaw(Shape), names=lambda case: case.bodies, what="bodies", words="shapes by body"),
        "the shape of each body",
        REQUIRED,
    )
    pair: Sequence[PairEnergy] = key(ListOf(OneLaw(PairEnergy)), "energies of two points at a distance", ())
    laws: Sequence[Potential] = key(ListOf(OneLaw(Potential)), "laws of the gap, integrated over it", ())
    heat: Sequence[HeatTransfer] = key(ListOf(OneLaw(HeatTransfer)), "conductances over the gap, integrated", ())
    approach: ApproachSection = key(Nested(ApproachSection), default=REQUIRED)
    # Three digits more than the default are still above RUN_EPS, the limit for integrals.
    accuracy: float = quantity(
        "1", "relative accuracy of the force", ERROR_FLOOR, above=ERROR_FLOOR / 1000, at_most=0.1
    )


# -- heat, mechanics, loading -----------------------------------------------------------------------------------------


class SurroundingsSection(Section):
    """a third heat bath, `{temperature: ...}`"""

    called = "the section surroundings"

    temperature: Load = key(Prescribed("K", above_zero=True), "temperature of the surroundings", REQUIRED)


class MechanicsSection(Section):
    """mechanics of the mounted bodies, for a gap that moves"""

    normal: Mounting | None = key(Nested(Mounting), "how the normal gap is held")
    tangential: Mounting | None = key(Nested(Mounting), "how the tangential displacement is held")
    transverse: Mounting | None = key(
        Nested(Mounting), "how the displacement across it is held, where not alike; its mass is that of `tangential`"
    )


class Threshold(Section):
    """a value that a variable reaches from one side"""

    rises_to: float | None = quantity("[x]", "value reached from below", name="rises-to")
    falls_to: float | None = quantity("[x]", "value reached from above", name="falls-to")


THRESHOLDS = Entries(
    others=ByShape(amount("[x]"), Nested(Threshold)),
    names=lambda case: [*case.units, *SLIDING_TRACTIONS],
    units=dict.fromkeys(SLIDING_TRACTIONS, "Pa"),
    what="variables",
    at_most=1,
    wanted="`until` waits for one variable, for example `until: {p: 10 kPa}`",
)


class StageSection(Section):
    """a stage of the loading: rates of what it moves, and one end"""

    duration: float | None = quantity("s", "length of the stage", above=0, name="for")
    until: str | Mapping[str, float | Threshold] | None = key(
        ByShape(Text(), THRESHOLDS),
        "what ends it: `{variable: value}`, `{variable: {falls-to: value}}`, or the name of an event",
    )

    @classmethod
    def more_keys(cls, tree: Tree | None) -> Mapping[str, Key]:
        """Return the rates of the variables that can be moved."""
        units = {name: quotient(UNITS[name], "s") for name in LOADABLE}
        return {name: Key(amount(unit, f"rate of the {VARIABLES[name].long_name}")) for name, unit in units.items()}


STAGE = Entries(
    others=Nested(StageSection), at_most=1, wanted="a stage is `name: {rates, for or until}`", words="stages"
)

LOADING = Entries(
    _variables(LOADABLE, Prescribed()),
    Prescribed(above_zero=True),
    lambda case: case.temperatures,
    NODE_NAME.pattern,
    what="variables",
    words="histories by variable",
)

INITIAL = Entries(
    {
        "phi": Key(amount("1", "bonding state", at_least=0, at_most=1)),
        "ln_phi": Key(amount("1", "logarithm of the bonding state, instead of phi: for survival far below 1e-16")),
        **_variables((*EVOLVING, "theta", "d_m"), amount("[x]")),
        "profile_1": Key(amount("K", "temperature inside body 1, which conducts", above=0)),
        "profile_2": Key(amount("K", "temperature inside body 2, which conducts", above=0)),
        "coverages": Key(Entries(others=amount("1")), "coverages of a mechanism by species"),
    },
    amount("K", above=0),
    lambda case: case.temperatures,
    NODE_NAME.pattern,
    what="variables",
    by_scene=True,
    words="values by variable",
)


# -- run, reference, sweep --------------------------------------------------------------------------------------------


class RunSection(Section):
    """times, accuracy, solver, for example `run: {until: 5 s}`"""

    until: float | str | None = key(
        Number(
            Spec("s", "end of the run", varies=False, above=0),
            word=STEADY,
            wanted="where a load is reached, runs of a sweep end by `sweep.until` and stages of a history by their own "
            "`until`; that of the run is a time, `until: 5 s`, or `steady`",
        ),
        "end of the run [s], or where nothing changes any more",
    )
    outputs: int | None = key(
        Integer(
            *(2, MOST_OUTPUTS),
            wanted="outputs are a number, `outputs: 201`; a list is `times: [1 s, 5 s]`, even ratios are `spacing: "
            "logarithmic` with a `first`",
        ),
        "number of output times, both ends included; they follow the run if not given",
        None,
    )
    spacing: str = key(OneOf("spacing", lambda: SPACINGS), "of the output times", LINEAR)
    first: float | None = quantity("s", "first output time after 0, for logarithmic spacing", above=0)
    times: Sequence[float] | None = key(
        ListOf(amount("s", at_least=0), at_least=1), "output times [s], instead of the four keys above"
    )
    accuracy: float | None = quantity(
        "1", "relative accuracy wanted: solver and tolerance follow from it", above=0, at_most=1
    )
    rtol: float | None = quantity(
        "1",
        f"relative tolerance of each step, instead of `accuracy`; {DEFAULT_RTOL:g} if neither is given",
        at_least=MIN_RTOL,
        at_most=MAX_RTOL,
    )
    atol: float | None = quantity(
        "1", "absolute tolerance in parts of the scale of each state; 1e-6 `rtol` if not given", above=0, at_most=1
    )
    solver: str | None = key(
        OneOf("solver", lambda: (solvers.AUTO, *sorted(solvers.names))),
        f"integrator; {OWN} if not given, {solvers.AUTO} with `accuracy` and for sweeps into a store",
    )
    max_steps: int = key(Integer(1), "most steps", 100_000, name="max-steps")
    max_seconds: float | None = quantity("s", "longest run time", above=0, name="max-seconds")


EXACT_SOLUTION = OneOf("exact solution", references.names, references.known)


class ReferenceSection(Section):
    """an exact solution to compare with, with those of its parameters that the scene does not give"""

    name: str = key(EXACT_SOLUTION, "its name", REQUIRED)

    @classmethod
    def more_keys(cls, tree: Tree | None) -> Mapping[str, Key]:
        """Return the parameters of the named solution; their ranges differ from one solution to another."""
        if tree is None:
            return {name: Key(amount(spec.unit, spec.text)) for name, spec in _parameters(*references.names())}
        name = tree.mapping().get("name")
        if name is None:
            raise tree.error("the exact solution needs a `name`.")
        named = EXACT_SOLUTION.read(name, "name", Context())
        return {item: Key(Number(spec._replace(varies=False))) for item, spec in _parameters(named)}


def _parameters(*solutions: str) -> Iterator[tuple[str, Spec]]:
    for name in solutions:
        yield from ((item.name, item.metadata["spec"]) for item in dataclasses.fields(references.get(name)))  # type: ignore[arg-type]


# An exact solution by name, or with its parameters.
REFERENCE = ByShape(
    EXACT_SOLUTION,
    Nested(ReferenceSection),
    wanted="an exact solution is given by its name, for example `reference: exothermic-bonding`, or as "
    "`{name: ..., parameters}`",
)


class RangeSection(Section):
    """values of a swept parameter"""

    called = "a range"

    first: float = quantity("[x]", "first value", REQUIRED, name="from")
    last: float = quantity("[x]", "last value", REQUIRED, name="to")
    points: int = key(Integer(1, MOST_POINTS), "number of values, both ends included", REQUIRED)
    spacing: str = key(OneOf("spacing", lambda: SPACINGS), "of the values", LINEAR)


OVER = "over: {loading.f.ramp.rate: {from: 1 pN/s, to: 1 nN/s, points: 31}}"

# Values of a swept parameter, in its unit: a list or a range.
SWEPT = ByShape(items=ListOf(amount("[x]"), "[1, 2, 3]", at_least=1), mapping=Nested(RangeSection))


def _by_path(content: Content, wanted: str) -> Entries:
    return Entries(
        others=Deferred(content),
        pattern=lambda: rf"({'|'.join(keys(Document))})(\.[^.]+)*",
        at_most=MOST_AXES,
        wanted=wanted,
    )


class UniformSection(Section):
    """a value between two, each as likely"""

    called = "a uniform distribution"

    first: float = quantity("[x]", "least value", REQUIRED, name="from")
    last: float = quantity("[x]", "largest value", REQUIRED, name="to")
    spacing: str = key(OneOf("spacing", lambda: SPACINGS), "whether values or their ratios are as likely", LINEAR)


class NormalSection(Section):
    """a normal distribution"""

    called = "a normal distribution"

    mean: float = quantity("[x]", "mean", REQUIRED)
    std: float = key(Number(Spec("[x]", "standard deviation", varies=False, at_least=0), True), default=REQUIRED)


class LognormalSection(Section):
    """a distribution whose logarithm is normal"""

    called = "a lognormal distribution"

    median: float = quantity("[x]", "median", REQUIRED, above=0)
    sigma: float = quantity("1", "standard deviation of the natural logarithm", REQUIRED, at_least=0)


class TableSection(Section):
    """values of a column of a CSV file, whose rows are drawn; columns of one file by the same row"""

    called = "a table"

    file: str | None = key(Text(), "a CSV file beside the case; its first line is like K_0 [J/m^2], mu [1]")
    csv: str | None = key(Text(), "the text of such a file")
    column: str | None = key(Text(), "the column, if not named after the parameter")


class DistributionSection(Section):
    """distribution of an uncertain parameter: one of these"""

    called = "a distribution"

    uniform: UniformSection | None = key(Nested(UniformSection))
    normal: NormalSection | None = key(Nested(NormalSection))
    lognormal: LognormalSection | None = key(Nested(LognormalSection))
    table: TableSection | None = key(Nested(TableSection))


OF = "of: {interface.potential.bond-energy.K_0: {normal: {mean: 300 J/m^2, std: 30 J/m^2}}}"


class SampleSection(Section):
    """draws of uncertain parameters"""

    called = "a sample"

    of: Mapping[str, Tree] = key(
        _by_path(Nested(DistributionSection), f"a sample needs `of`: distributions of parameters, for example `{OF}`"),
        f"distributions of parameters by path, for example `{OF}`",
        REQUIRED,
    )
    runs: int = key(Integer(1, MOST_POINTS), "number of draws; of Sobol' points a power of two is best", REQUIRED)
    method: str = key(
        OneOf("method", lambda: ("sobol", "latin-hypercube", "random")), "how the draws are spread", "sobol"
    )
    seed: int = key(Integer(0, 2**31), "another number, another sample", 0)


# A prescribed variable and the value at which each run of a sweep ends, or the survival of bonds.
SWEEP_END = Entries(
    others=amount("[x]"),
    names=lambda _: {**UNITS, "survival": "1"},
    what="variables",
    at_most=1,
    wanted="`until` is one prescribed variable and its value, `until: {f: 200 pN}`, or `until: {survival: 1e-12}`",
)


ALL, NONE = "all", "none"
NAMES = ByShape(OneOf("choice", lambda: (ALL,)), items=ListOf(Text(), "[T, phi]"))


class KeepSection(Section):
    """content of a store: what is kept of each run"""

    called = "the section keep"

    last: str | Sequence[str] = key(NAMES, "quantities at the end, a list or `all`", ())
    max: str | Sequence[str] = key(NAMES, "quantities whose largest value is kept", ())
    min: str | Sequence[str] = key(NAMES, "quantities whose least value is kept", ())
    series: str | Sequence[str] = key(
        NAMES, "quantities at every output time; `max` and `min` beside them tell what is brief", ()
    )
    events: str | Sequence[str] = key(NAMES, "events whose first time is kept", ())
    at_events: str | Sequence[str] = key(NAMES, "states as they are at these events, just before", (), name="at-events")
    reach: Mapping[str, float] = key(
        Entries(others=amount("[x]"), names=lambda case: case.units, what="variables"),
        "values by variable, the time at which each is first reached is kept: `reach: {phi: 0.95}`",
        {},
    )
    balances: str = key(
        OneOf("choice", lambda: (ALL, NONE)),
        "errors of the balances of each run; with `none` no ledger is integrated, and those that are checked tell them",
        ALL,
    )


NOTHING_SWEPT = f"a sweep needs `over` or `sample`: values of parameters, for example `{OVER}`."


class SweepSection(Section):
    """parameters of many runs"""

    called = "a sweep"

    over: Mapping[str, Tree] = key(
        _by_path(SWEPT, f"a sweep needs `over`: values of parameters, for example `{OVER}`"),
        f"values of parameters by path, a list or `{{from, to, points, spacing}}`, for example `{OVER}`",
        {},
    )
    combine: str = key(
        OneOf("way to combine", lambda: (GRID, "zip")), "every value with every other, or the first of each, ...", GRID
    )
    sample: SampleSection | None = key(Nested(SampleSection))
    until: Mapping[str, float] | None = key(
        SWEEP_END,
        "a prescribed ramp and the value at which each run ends, instead of `run.until`; or the survival of bonds at "
        "which it ends, for lifetimes",
    )
    checked: int | str = key(
        Integer(0, word=ALL),
        "runs of a store whose error is found, spread over the plan, and 100 of the hardest; 0 finds none in any sweep",
        1000,
    )
    keep: KeepSection | None = key(
        Nested(KeepSection), "what a store keeps of each run; if not given all ends, extremes and times of events"
    )


class LawsSection(Section):
    """a Python file with laws of one's own"""

    called = "a file of laws"

    file: str = key(Text(), "its name, beside the case", REQUIRED)
    sha256: str = key(Text(), "checksum of the file, without which any file of that name is meant", "")
    python: str = key(Text(), "the source itself, as a dataset keeps it", "")


class Document(Section):
    """a case"""

    called = "the case"

    title: str = key(Text(), "one line", "")
    source: str = key(Text(), "where the case comes from", "")
    description: str = key(Text(), "what the case shows", "")
    T_0: float | None = quantity("K", "reference temperature of energies and factors", above=0)
    laws: Sequence[Any] = key(
        ListOf(ByShape(Text(), mapping=Nested(LawsSection)), "- my_laws.py"),
        "Python files with laws of one's own: names, or `{file, sha256}`",
        (),
    )
    bodies: Mapping[str, BodySection] = key(
        Entries(others=Nested(BodySection), pattern=BODY_NAME, words="two bodies by name"),
        "the two bodies, of which the first is body 1, for example `bodies: {lower: {...}, upper: {...}}`; where the "
        "interface has a given temperature they may be left out, and have it too",
        {},
    )
    interface: InterfaceSection = key(Nested(InterfaceSection), default=InterfaceSection())
    surface: SurfaceSection | None = key(Nested(SurfaceSection, per_area=True))
    heat: Sequence[HeatTransfer] = key(ListOf(OneLaw(HeatTransfer)), "heat paths", ())
    surroundings: SurroundingsSection | None = key(Nested(SurroundingsSection))
    mechanics: MechanicsSection = key(Nested(MechanicsSection), default=MechanicsSection())
    loading: Mapping[str, Load] = key(LOADING, "prescribed variables", {})
    programme: Sequence[Mapping[str, StageSection]] = key(
        ListOf(STAGE, "- approach: {w_n: -1 um/s, until: {p: 10 kPa}}"), "stages of the loading", ()
    )
    initial: Mapping[str, Any] = key(INITIAL, "initial values of what evolves", {})
    run: RunSection | None = key(Nested(RunSection))
    reference: Tree | None = key(Deferred(REFERENCE), "an exact solution to compare with")
    sweep: SweepSection | None = key(Nested(SweepSection))

    remarks: Sequence[str] = ()
    """Remarks on values that may not be meant as they are read."""
