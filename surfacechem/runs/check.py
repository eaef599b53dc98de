"""Check of a scene before it runs: dimensionless numbers, time scales, unused parameters.

A law of a user is checked against the requirements on every law: documentation, units, equal results for floats and
symbols, and the second law.
"""

from __future__ import annotations

import inspect
import math
import random
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.compile.program import compile_function
from surfacechem.contracts.terms import Friction, HeatTransfer, Law, Load, RateLaw, Varying, reads
from surfacechem.contracts.units import dimension
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression
from surfacechem.model.assemble import conductance_warnings
from surfacechem.model.automaton import INTERFACE
from surfacechem.model.system import Conductor, System
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT, VARIABLES
from surfacechem.results.audit import active_cautions
from surfacechem.scene import Scene
from surfacechem.solve.adapters.evaluation import Evaluation
from surfacechem.solve.contract import Array, Problem
from surfacechem.solve.diagnose import time_scales
from surfacechem.solve.run import Model
from surfacechem.tolerances import CONSERVED_RATE, FEW_EPS, NO_AMOUNT, TINY

LUMP_BIOT = 0.1
"""Largest Biot number at which a lump is accurate enough: its relaxation rate errs by 3 % there."""

EVEN_FOURIER = 2.0
"""Fourier number above which a slab in perfect contact has a uniform temperature: 1 % of a difference is left."""


@dataclass(frozen=True)
class Group:
    """A dimensionless number or a time scale that characterises a scene."""

    name: str
    value: float
    unit: str
    text: str


@dataclass(frozen=True)
class Start:
    """The linearised equations M dy' + K dy = 0 at a consistent initial state."""

    y: Array
    M: Array
    K: Array
    outputs: Mapping[str, float]
    inputs: Array
    """Arguments of compiled functions."""


def consistent_start(model: Model, values: Mapping[str, float]) -> Start | None:
    """Solve for rates and algebraic variables at the start; None if that breaks down."""
    system = model.system
    parameters = np.array([p.at(0.0) if p.load else values[p.path] for p in system.parameters])
    at = Evaluation(model.program, system.initial_state(values), parameters)
    if not at.put(0.0, at.y[at.free].copy()) or not np.all(np.isfinite(at.ydot)):
        return None
    K, M = model.program.derivatives(at.inputs)
    outputs = dict(zip((item.name for item in system.outputs), model.output_function(at.inputs).tolist(), strict=True))
    return Start(at.y, M, K, outputs, at.inputs)


def rates(start: Start) -> NDArray[np.complex128]:
    """Return the finite growth rates [1/s] of small disturbances at the start, except those of conserved quantities."""
    # Rows are scaled, since balances of energy and of sites differ by many decades.
    rows = np.maximum(np.abs(start.M).max(axis=1), np.abs(start.K).max(axis=1))
    scale = np.where(rows > 0, rows, 1.0)[:, None]
    evolves = np.any(start.M != 0, axis=0)
    unknown = np.where(evolves, start.M, start.K) / scale
    # Solved for the rates of evolved states and the values of algebraic ones; only the former are kept.
    growth = np.linalg.solve(unknown, -start.K[:, evolves] / scale)[evolves]
    values = np.asarray(np.linalg.eigvals(growth), dtype=np.complex128)
    largest = np.max(np.abs(values), initial=0.0)
    return np.asarray(values[np.abs(values) > CONSERVED_RATE * largest])


def groups(model: Model, scene: Scene, values: Mapping[str, float], start: Start | None, end: float) -> list[Group]:
    """Return the dimensionless numbers and time scales that follow from parameters and consistent initial state."""
    found = [*_bond_energy(scene), *_activation(scene, values)]
    if start is not None:
        found += _affinity(model.system, scene, start)
        found += _heat_paths(model.system, scene, start, end)
        found += _dissipation(model.system, start, end)
        found += [Group(*row[:2], "1", row[2]) for body in lumpings(model.system, start, end) for row in body.rows()]
        found += _time_scales(start, end)
        for pace, t in time_scales(model.system, values):
            found.append(Group("t / t_own", end / t, "1", f"length of the run in units of the {pace.text}"))
    return found


def number(value: float | Varying) -> float:
    """Return a parameter at the reference state."""
    return value.value if isinstance(value, Varying) else float(value)


def _bond_energy(scene: Scene) -> Iterator[Group]:
    """Yield the energy of bonds over the heat content."""
    C, T_0 = capacity_with_interface(scene), scene.T_0
    bonds = [law for law in scene.interface.potentials if law.name() == "bond-energy"]
    if C and T_0 and bonds:
        kappa_0, kappa_2 = (
            sum(number(getattr(law, name)) * number(vars(law)["K"]) for law in bonds) / (T_0 * C)
            for name in ("K_0", "K_2")
        )
        if kappa_0:
            yield Group("kappa_0", kappa_0, "1", "K_0 / (T_0 C): bond energy against heat content")
        if kappa_2:
            part = kappa_2 * (scene.initial.get("phi", 0.0) - number(vars(bonds[0])["phi_eq"])) ** 2
            verdict = "valid" if part < 1 else "NOT valid"
            text = f"K_2 / (T_0 C); kappa_2 (phi_i - phi_eq)^2 = {part:.6g} must be below 1: {verdict}"
            yield Group("kappa_2", kappa_2, "1", text)


def _activation(scene: Scene, values: Mapping[str, float]) -> Iterator[Group]:
    """Yield activation energies over the thermal energy at the start."""
    temperatures = [values[name] for name in ("initial.T_c", "initial.T", "initial.T_1") if name in values]
    for reaction in scene.interface.reactions:
        energy = number(getattr(reaction, "E_a", 0.0))
        if energy and temperatures:
            value = energy / (GAS_CONSTANT * temperatures[0])
            yield Group("E_a / (R_g T)", value, "1", f"activation of {reaction.title} at the start")


def capacity_with_interface(scene: Scene) -> float:
    """Return the heat capacity at T_0 of all at the interface's temperature; of both bodies without a medium."""
    node = scene.interface.temperature
    bodies = [body for body in scene.bodies if node is None or body.temperature == node]
    stores = [(body.energy, "C") for body in bodies] + [(law, "C_c") for law in scene.interface.potentials]
    return sum(number(getattr(law, name, 0.0)) for law, name in stores)


def _affinity(system: System, scene: Scene, start: Start) -> Iterator[Group]:
    states = dict(zip(system.state_columns, start.y.tolist(), strict=True))
    node = scene.interface.temperature if isinstance(scene.interface.temperature, str) else "T_c"
    T = states.get(node, start.outputs.get(node))
    if T is not None and start.outputs.get("mu"):
        yield Group("mu / (k_B T_c)", start.outputs["mu"] / (BOLTZMANN * T), "1", "affinity per bond at the start")


def _heat_paths(system: System, scene: Scene, start: Start, end: float) -> Iterator[Group]:
    """Yield the heat exchange of each path over the whole run, relative to the capacities."""
    capacities = {s.name: c for s, c in zip(system.states, np.diag(start.M), strict=True) if s.is_temperature}
    for profile in system.profiles:
        capacities[profile.surface] = sum(capacities.get(name, 0.0) for name in (profile.surface, *profile.states))
    nodes = {body.name: body.temperature for body in scene.bodies} | {"interface": scene.interface.temperature}
    for law in scene.heat:
        ends = [capacities.get(str(nodes.get(name)), 0.0) for name in law.between]
        if hasattr(law, "h") and any(c > 0 for c in ends):
            text = f"heat exchange {law.between[0]} - {law.between[1]} over the run against the smaller capacity"
            yield Group("h t / C", number(law.h) * end / min(c for c in ends if c > 0), "1", text)


def _dissipation(system: System, start: Start, end: float) -> Iterator[Group]:
    """Yield the dissipation over the whole run relative to the heat content."""
    stored = np.diag(start.M)
    heat = sum(value for name, value in start.outputs.items() if name.startswith("D_"))
    content = float(stored @ np.where((stored > 0) & (start.y > 1), start.y, 0.0))
    if heat and content > 0 and any(state.is_temperature for state in system.states):
        text = "dissipation at the start, kept up over the run, against heat content"
        yield Group("D t / (C T)", heat * end / content, "1", text)


def _time_scales(start: Start, end: float) -> Iterator[Group]:
    values = rates(start)
    falling, rising = -values.real[values.real < 0], values.real[values.real > 0]
    if len(falling):
        yield Group("t_fast", 1 / falling.max(), "s", "fastest relaxation at the start")
        yield Group("t_slow", 1 / falling.min(), "s", "slowest relaxation at the start")
        yield Group("stiffness", end * falling.max(), "1", "length of the run against the fastest relaxation")
    if len(rising):
        yield Group("t_growth", 1 / rising.max(), "s", "a disturbance grows by e in this time at the start")


def warnings(system: System) -> list[str]:
    """Return the warnings of the assembly, and warnings about given values without effect."""
    rows = [*system.residual(), *map(system.expand, _evaluated(system))]
    read = {symbol for row in rows for symbol in row.free_symbols}
    idle = [
        f"{p.path} = {p.at(0.0):g} has no effect on the equations."
        for p in system.parameters
        if p.symbol not in read and not p.internal and not p.path.startswith("initial.")
    ]
    # Between curved bodies a conductance is known over a range of approaches only, and grows under load.
    at_touch = () if system.in_totals else conductance_warnings(system)
    return [*system.warnings, *at_touch, *idle]


def _evaluated(system: System) -> list[Expression]:
    """Return the formulas that a run evaluates in addition to the equations."""
    formulas = [*[a.rate for a in system.ledger], *[m.masked for m in system.margins]]
    formulas += [*[i.expression for i in system.outputs], *[c.resistance for c in system.notes_of(Conductor)]]
    formulas += [x for item in system.edges for x in (item.masked, *item.modes.values(), *item.reset.values())]
    return [*formulas, *_heat_shares(system)]


def _heat_shares(system: System) -> list[Expression]:
    """Return the shares of the heat of jumps."""
    # Sliding and snap-through release all heat in the interface, none in supports.
    jumps = [item for item in system.edges if (item.equilibrates or item.reset) and not item.measure]
    supported = any(item.heat == "joint" for item in jumps)
    makers = [sinks for maker, sinks in system.sinks.items() if jumps and (supported or maker == INTERFACE)]
    return [sink.share for sinks in makers for sink in sinks]


def start_warnings(model: Model, problem: Problem, start: Start | None, end: float) -> list[str]:
    """Return warnings about the initial state, and about bodies that should not be lumped."""
    first = np.concatenate([np.zeros(1), problem.y0, np.zeros(len(problem.y0)), problem.parameters[0]])
    lumps = lumpings(model.system, start, end) if start is not None else []
    return [*active_cautions(model.system, first[None]), *(text for body in lumps for text in body.warnings())]


def laws_of(scene: Scene) -> list[Law]:
    """Return every law of a scene, in the order of the case file."""
    interface = scene.interface
    bodies = [body.energy for body in scene.bodies if body.energy is not None]
    return [*bodies, *interface.potentials, *interface.reactions, *interface.frictions, *scene.heat]


# -- lumped bodies ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lumping:
    """Biot number h L / k of a body at its contact, infinite in perfect contact, and Fourier number k t / (C L) of the
    run.

    A slab insulated at its back, cooled through a conductance h at its face, relaxes at the rate zeta^2 alpha / L^2
    with zeta tan(zeta) = Bi; a lump at Bi alpha / L^2, which is faster. Source: Carslaw & Jaeger (1959), Conduction of
    Heat in Solids, section 3.11.
    """

    number: int
    body: str
    is_lump: bool
    biot: float
    fourier: float

    @property
    def fast(self) -> float:
        """Relative excess of the relaxation rate of a lump.

        >>> round(Lumping(1, "lower", True, 0.1, 1.0).fast, 4), round(Lumping(1, "lower", True, 1.0, 1.0).fast, 4)
        (0.0336, 0.351)
        """
        return self.biot / first_root(self.biot) ** 2 - 1

    @property
    def left(self) -> float:
        """Fraction of a difference within the body that is left at the end if its face is held."""
        return math.exp(-(math.pi**2) * self.fourier / 4)

    def rows(self) -> Iterator[tuple[str, float, str]]:
        """Yield names, values and meanings for a summary."""
        if math.isfinite(self.biot):
            verdict = "" if not self.biot else f"; as a lump it would relax {self.fast:.2%} too fast"
            yield f"Bi_{self.number}", self.biot, f"h L / k of {self.body} at the start{verdict}"
        yield f"Fo_{self.number}", self.fourier, f"k t / (C L) of {self.body}: length of the run against conduction"

    def warnings(self) -> Iterator[str]:
        """Yield warnings about a lumped body, with the size of the error."""
        if not self.is_lump:
            return
        remedy = "Give its `conduction` a number of cells."
        if math.isfinite(self.biot) and self.biot > LUMP_BIOT:
            yield (
                f"{self.body} is one lump, but its Biot number is {self.biot:.3g}: cooled by itself it would relax "
                f"{self.fast:.1%} too fast. {remedy}"
            )
        if not math.isfinite(self.biot) and self.fourier < EVEN_FOURIER:
            yield (
                f"{self.body} is one lump in perfect contact, but the run is short against conduction in it: "
                f"{self.left:.1%} of a difference within it would be left at the end. {remedy}"
            )


def first_root(biot: float) -> float:
    """Return the first root of zeta tan(zeta) = Bi.

    >>> round(first_root(1.0), 6), round(first_root(1e-12) ** 2 / 1e-12, 9)
    (0.860334, 1.0)
    """
    z = math.sqrt(biot / (1 + biot / 3)) if biot < 2 else math.pi / 2 * biot / (1 + biot)
    for _ in range(50):
        change = (z * math.sin(z) - biot * math.cos(z)) / (math.sin(z) * (1 + biot) + z * math.cos(z))
        z -= change
        if abs(change) <= FEW_EPS * z:
            break
    return z


def lumpings(system: System, start: Start, end: float) -> list[Lumping]:
    """Return the numbers at the start of each body that states how it conducts."""
    found = []
    for c in system.notes_of(Conductor):
        expressions = [system.expand(item) for item in (c.resistance, c.capacity, c.conductance or 0)]
        resistance, capacity, h = compile_function(system.inputs, expressions)(start.inputs).tolist()
        biot = h * resistance if c.conductance is not None else math.inf
        found.append(Lumping(c.number, c.body, c.is_lump, biot, end / (resistance * capacity)))
    return found


DRAWS = 20
"""Number of random draws of parameters and variables; a choice."""

RANGE_PARTS, ROOM = (0.1, 0.9), 600.0
"""Fractions of a range between which values are drawn, and twice the room temperature [K]."""

READABLE = {*VARIABLES, "x", "T", "N_c", "M", "u", "r"}
"""Names that formulas may read in every scene, in addition to temperatures and coverages by name."""

GIVEN, VALUES = (0.0, 1.0, 3.0), (1.0, 2.0, 0.5)
OPTIONS: dict[str, Any] = {
    "between": ("lower", "upper"),
    "of": "T_c",
    **dict.fromkeys(("times", "pressures", "gaps"), GIVEN),
    **dict.fromkeys(("values", "conductances"), VALUES),
}
"""Values of options without a default."""

DOCUMENTED = {
    ".. math::": "no formula: write it under `.. math::` in the docstring",
    "Source:": "no source: write `Source: ...` into the docstring, with the range of validity",
    ">>> ": "no worked number: write one into the docstring, after `>>>`",
}


def problems(law: type[Law]) -> list[str]:
    """Return the requirements that a law violates, in words; empty if there are none."""
    found = [message for mark, message in DOCUMENTED.items() if mark not in (inspect.getdoc(law) or "")]
    found += [f"{name} has no meaning: say what it is" for name, spec in law.specs() if not spec.text]
    for name, spec in law.specs():
        try:
            dimension(spec.unit.replace("[x]", "1"))
        except InputError as error:
            found.append(f"{name}: {error.message}")
    read = reads(getattr(law, law.formula))[1:]
    unknown = [name for name in read if name not in READABLE and not name.startswith(("T", "theta_"))]
    found += [f"it reads '{name}', which no scene has.{suggestion(name, READABLE)}" for name in unknown]
    return found or [*worked_numbers(law), *first_error(law)]


def worked_numbers(law: type[Law]) -> Iterator[str]:
    """Run the worked numbers of the docstring in the namespace of the law's module, and yield those that fail."""
    import doctest  # takes a while

    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    known = vars(sys.modules[law.__module__])
    for example in doctest.DocTestFinder(recurse=False).find(law, law.__name__, globs=known):
        said: list[str] = []
        if runner.run(example, out=said.append).failed:
            lines = [line.strip() for line in "".join(said).splitlines() if line.strip()]
            yield f"its worked number is another: {' '.join(lines[-4:])}"


def first_error(law: type[Law]) -> Iterator[str]:
    """Yield the first error at random parameters and states, if any."""
    for seed in range(DRAWS):
        draw = random.Random(seed)
        try:
            made = _instance(law, draw)
            # Temperatures about that of a room, all else about one.
            names = reads(made.statement)
            values = {name: draw.uniform(*RANGE_PARTS) * (ROOM if name.startswith("T") else 1.0) for name in names}
            wrong = _differs(made, values) or second_law_violation(made, values)
        except (InputError, ArithmeticError, TypeError, ValueError, RuntimeError) as error:
            wrong = f"its formula fails: {type(error).__name__}: {error}"
        if wrong:
            yield wrong
            return  # one example is enough: the same error usually occurs everywhere


def _instance(law: type[Law], draw: random.Random) -> Any:
    """Return the law with random parameters within their ranges."""
    values = {name: option for name, option in OPTIONS.items() if name in dict(law.options())}
    for name, spec in law.specs():
        low = max(spec.above, spec.at_least)
        start = low if math.isfinite(low) else 0.0
        values[name] = start + draw.uniform(*RANGE_PARTS) * min(1.0, spec.at_most - start)
    made = law(**values)
    return made.bind(made.piece(0.5)) if isinstance(made, Load) else made


def _differs(law: Law, values: dict[str, float]) -> str:
    """Return a disagreement of floats and symbols, or a result that is not finite, in words; empty if there is none."""
    symbols = {name: symengine.Symbol(name) for name in values}
    number = law.statement(**values)
    if isinstance(number, tuple):  # a point in space, which tests of its law check
        return ""
    if not isinstance(number, int | float) or not math.isfinite(number):
        return f"its formula gives {number} at {_shown(values)}"
    other = float(symengine.sympify(law.statement(**symbols)).subs({symbols[x]: value for x, value in values.items()}))
    if abs(other - number) > NO_AMOUNT * max(abs(number), TINY):
        return f"floats give {number:.17g}, symbols {other:.17g} at {_shown(values)}: use `surfacechem.expressions`"
    return ""


def second_law_violation(law: Law, values: dict[str, float]) -> str:
    """Return a violation of the second law in words, of a law that drives instead of resisting; empty if none."""
    if isinstance(law, Friction) and "v" in values:
        for v in (0.7, -0.7):
            own = values | {"v": v} | ({"direction": math.copysign(1.0, v)} if "direction" in values else {})
            if law.statement(**own) * v < 0:
                return f"it drives sliding at {_shown(own)}: traction * v must not be below zero"
    if isinstance(law, RateLaw) and "mu" in values:
        for mu in (BOLTZMANN * ROOM, -BOLTZMANN * ROOM):
            if -mu * law.statement(**values | {"mu": mu}) < 0:
                return f"it runs uphill at mu = {mu:g} J: -mu * rate must not be below zero"
    if isinstance(law, HeatTransfer) and law.statement(**values) < 0:
        return f"heat flows from cold to hot at {_shown(values)}: a conductance must not be below zero"
    return ""


def _shown(values: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:.3g}" for name, value in values.items())


def report(found: list[type[Law]]) -> tuple[str, bool]:
    """Return the errors of each law as text, and True if there are none."""
    lines, well = [], True
    for law in found:
        wrong = problems(law)
        well = well and not wrong
        lines += [f"{law.name()} ({law.contract}): {'keeps what a law has to keep' if not wrong else ''}".rstrip()]
        lines += [f"  {text}" for text in wrong]
    return "\n".join(lines), well
