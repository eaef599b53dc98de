"""Summaries of runs and scenes for the command line: one fact per line."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surfacechem.contracts.terms import Load, Varying
from surfacechem.errors import listed
from surfacechem.quantities import VARIABLES
from surfacechem.results.event_table import entropy_destroyed, event_counts, event_summary
from surfacechem.runs.listing import Rows, Sheet, counted
from surfacechem.solve import AUTO, CALLING_PYTHON, OWN
from surfacechem.solve.jumps import ADMISSIBLE

if TYPE_CHECKING:
    from surfacechem.contracts.terms import Law
    from surfacechem.format.plans import Plan
    from surfacechem.model.system import System
    from surfacechem.results.accuracy import Accuracy
    from surfacechem.results.audit import Audit
    from surfacechem.results.solution import Solution
    from surfacechem.results.store import Store
    from surfacechem.runs.check import Group
    from surfacechem.runs.checking import Checked
    from surfacechem.runs.points import PointResults
    from surfacechem.runs.streaming import Stream
    from surfacechem.runs.sweeps import SweepSolution
    from surfacechem.scene import Scene
    from surfacechem.solve.run import Model, Run

REGIMES = {
    "isothermal": "bodies and interface are held at one temperature; the heat that this takes is an output.",
    "prescribed temperatures": "bodies and interface follow given temperatures; the heat that this takes is an output.",
    "perfect contact": "both bodies and the interface share one temperature; the heat fluxes follow from the balances.",
    "one-sided perfect contact": "the interface shares the temperature of one body; heat passes to the other by laws.",
    "separate interface temperature": "the interface has its own temperature; heat passes to the bodies by laws.",
    "medium without temperature": "heat crosses it by laws; interface heat goes into the bodies in fixed shares.",
    "no medium": "the bodies touch directly; interface heat goes into them in fixed shares.",
    "perfect contact without a medium": "the bodies share one temperature and there is no medium between them.",
}


MOST_ALIKE = 4
"""Largest number of laws of one name whose parameters are listed."""

MOST_EVENTS, MOST_RUNS = 30, 100
"""Largest numbers of events of a run, and of runs of a sweep, that are listed."""


def duration(seconds: float) -> str:
    """Return a time in a suitable unit.

    >>> duration(0.00123), duration(75.0)
    ('1.23 ms', '75 s')
    """
    for unit, count in (("s", 1), ("ms", 1_000), ("us", 1_000_000)):
        if seconds * count >= 1:
            return f"{seconds * count:.3g} {unit}"
    return f"{seconds:.1g} s"


MOST_STATES = 12
"""Number of states that a summary names: those of a mechanism may be hundreds."""


def states(system: System) -> str:
    """List the states by name, of many the first ones; algebraic ones are marked."""
    names = [f"{name} (algebraic)" if state.algebraic else name for name, state in system.own_states.items()]
    names += [f"{profile.name} ({len(profile.points) - 1} cells)" for profile in system.profiles]
    return listed(names, MOST_STATES) or "nothing: everything is prescribed"


def run_summary(solution: Solution, written: Path | None, details: bool = False) -> Sheet:
    """Summarise a run: states, solver, end, accuracy, speed and file; with ``details`` errors, counts and events."""
    from surfacechem.solve import solver

    trajectory, counters = solution.trajectory, solution.trajectory.result.counters
    run, system, jumps = trajectory.run, trajectory.model.system, trajectory.jumps
    rejected = f", {counters.rejected} rejected" if solver(run.solver).counts_rejected else ""
    steps = f"{counters.steps} steps{rejected}, {counters.residuals} residuals"
    integrals = solution.integrals_seconds if system.in_totals else 0.0
    facts = [
        ("solved", _solved(system, run)),
        (solution.status, solution.reason),
        ("error", _accuracy(solution.accuracy) if solution.accuracy else ""),
        ("time", f"{_speed(trajectory.seconds, trajectory.model, integrals)}; {steps}"),
        ("events", event_summary(jumps, solution.audit.energy_scale, system.unit("J/m^2")) if jumps else ""),
        ("balances", _balances(solution.audit, system.unit("W/(m^2 K)"))),
        *(("pair", str(verdict)) for verdict in solution.verdicts if verdict.consistent),
        *(("warning", warning) for warning in solution.warnings),
        ("written", str(written or "")),
    ]
    return Sheet(solution.title or "untitled", facts, _details(solution) if details else {})


def _details(solution: Solution) -> dict[str, Rows]:
    """Return tables of the error of each variable, of all counts, and of the events of a run."""
    jumps = solution.trajectory.jumps
    errors = solution.accuracy.everywhere if solution.accuracy else {}
    counts = [(name, value) for name, value in solution.attributes.items() if name.startswith("count_")]
    more = [("...", f"{len(jumps) - MOST_EVENTS} more", "")] if len(jumps) > MOST_EVENTS else []
    return {
        "Errors": [(name, f"{error:.2g}") for name, error in errors.items()],
        "Counts": [(name.removeprefix("count_"), str(value)) for name, value in counts],
        "Events": [(f"{j.t:.9g} s", j.edge.name, j.verdict) for j in jumps[:MOST_EVENTS]] + more,
    }


def _speed(seconds: float, model: Model, integrals: float) -> str:
    """Describe the times of runs, of compilation, and of integrals over surfaces if there are any."""
    surfaces = f"surfaces {duration(integrals)}, " if model.system.in_totals else ""
    return f"{surfaces}run {duration(seconds)}, compile {duration(model.compile_seconds)}"


def _solved(system: System, run: Run, steps: str = "") -> str:
    """Describe a system and how it was solved; ``steps`` in words if another method than the solver's took them."""
    return f"{states(system)}; {system.regime}; {steps or run.solver} at rtol {run.rtol:g}"


def _accuracy(accuracy: Accuracy) -> str:
    worst = max(accuracy.variables, key=lambda name: accuracy.variables[name], default="")
    where = f" in {worst}" if worst else ""
    known = accuracy.everywhere
    most = max(known, key=known.__getitem__, default="")
    if most and known[most] > 10 * accuracy.error:
        where += f"; of what follows from the states up to {known[most]:.2g}, in {most}"
    asked = "" if accuracy.asked is None else f"; {accuracy.asked:.0e} was asked"
    return accuracy.source if math.isnan(accuracy.error) else f"{accuracy.error:.2g}{where}{asked} ({accuracy.source})"


def _balances(audit: Audit, unit: str) -> str:
    residuals = f"energy {audit.energy_error:.1e}, entropy {audit.entropy_error:.1e}, sites {audit.site_error:.1e}"
    if not audit.least:
        return f"{residuals}; nothing dissipates"
    if audit.violations:
        worst = sorted(audit.violations, key=audit.least.__getitem__)
        told = [f"{law} ({audit.least[law]:.3g} {unit})" for law in worst]
        return f"{residuals}; ENTROPY DESTROYED by {listed(told)}"
    if audit.destroys:
        return f"{residuals}; ENTROPY DESTROYED by all laws together"
    least = min(audit.least.values())
    error = ", within the error of the run" if least < 0 else ""
    return f"{residuals}; every law dissipates (least {least:.2g} {unit}{error})"


def sweep_summary(solution: SweepSolution, written: Path | None, details: bool = False) -> Sheet:
    """Summarise a sweep: parameters, ends of runs, accuracy, speed and file; with ``details`` the end of each run."""
    error = ""
    if accuracy := solution.accuracy:
        known = accuracy.known
        error = f"{known.max():.2g} ({accuracy.source})" if len(known) else f"unknown ({accuracy.source})"
        error = "; ".join(filter(None, (error, accuracy.unknown)))
    speed = _speed(solution.seconds, solution.model, solution.before_seconds)
    energy, entropy, sites = (f"{solution.worst(balance):.1e}" for balance in ("energy", "entropy", "site"))
    count = sum(audit.destroys for audit in solution.audits)
    verdict = f"ENTROPY DESTROYED in {counted(count, 'run')}" if count else "no law destroys entropy"
    verdict += ", jumps do" if any(entropy_destroyed(run.jumps) for run in solution.runs) else ""
    facts = [
        ("swept", swept_in_words(solution.plan, solution.parameters)),
        ("solved", _solved(solution.system, solution.run)),
        ("ended", f"{counted(len(solution.runs), 'run')}: {solution.ends}"),
        ("error", error),
        ("time", f"{speed}; {solution.steps} steps"),
        ("events", _sweep_events(solution)),
        ("balances", f"energy {energy}, entropy {entropy}, sites {sites}; {verdict}"),
        *(("warning", warning) for warning in solution.warnings),
        ("written", str(written or "")),
    ]
    return Sheet(solution.title or "untitled", facts, {"Runs": _run_rows(solution)} if details else {})


def _run_rows(solution: SweepSolution) -> Rows:
    """Return rows with the ends of the runs of a sweep, or of the first ones, and their parameters."""
    errors, reasons = [""] * MOST_RUNS, [run.reason for run in solution.runs]
    if accuracy := solution.accuracy:
        errors = ["error unknown" if math.isnan(error) else f"error {error:.2g}" for error in accuracy.errors]
        whys = [f"; unknown: {why.removeprefix('unknown: ')}" if why else "" for why in accuracy.reasons]
        reasons = [f"{reason}{why}" for reason, why in zip(reasons, whys, strict=True)]
    shown = range(min(len(solution.runs), MOST_RUNS))
    runs = zip(_points_told(solution, shown), solution.runs, errors, reasons, strict=False)
    rows = [(given, run.status, error, reason) for given, run, error, reason in runs]
    if more := len(solution.runs) - len(shown):
        rows.append(("...", f"{more} more", "", ""))
    return rows


def _points_told(solution: SweepSolution, numbers: Sequence[int]) -> list[str]:
    """Return the parameters of the runs with these numbers in words."""
    points = solution.plan.at(np.array(numbers))
    told = ([f"{n} = {solution.plan.told(p, x)}" for x in points[p]] for n, p in solution.parameters.items())
    return [*map(", ".join, zip(*told, strict=True))]


def swept_in_words(plan: Plan, names: Mapping[str, str]) -> str:
    """Describe the parameters of a plan: number of values and range of each, and the draws of a sample."""
    axes = []
    for (name, path), axis in zip(names.items(), plan.axes, strict=False):
        first, last = axis.at(np.array([0, -1]) % len(axis))
        span = plan.told(path, first, last) if len(axis) > 1 else plan.told(path, first)
        axes.append(f"{name} ({span}, {counted(len(axis), 'value')})")
    parts = [(" with " if plan.zipped else " by ").join(axes)] if axes else []
    if plan.sample is not None:
        drawn = ", ".join([*names][len(plan.axes) :])
        parts.append(f"{plan.sample.runs} draws of {drawn} ({plan.sample.method}, seed {plan.sample.seed})")
    name, value = plan.until or ("", 0.0)
    unit = VARIABLES[name].unit if name in VARIABLES else ""
    return " by ".join(parts) + (f", each until {name} = {value:g} {unit}".rstrip() if name else "")


def points_summary(found: PointResults, written: Path | None) -> Sheet:
    """Summarise points: quantities and non-zero derivatives of a single one; of many, their number and the file."""
    refused = [(i, why) for i, why in enumerate(found.refused) if why]
    rows, count, derivatives = [], len(found.refused), len(found.slopes)
    fact = "points", f"{count}, with {len(found.values)} quantities and {derivatives} derivatives each"
    if count == 1:
        slopes = [slope for slope in found.slopes if slope.values[0]]
        rows = [(c.name, f"{c.values[0]:.12g}", c.unit, c.long_name) for c in (*found.values, *slopes)]
        zero = derivatives - len(slopes)
        fact = "zero", f"{zero} derivatives, which are not listed" if zero else ""
    more = f", and {len(refused) - 1} more" if len(refused) > 1 else ""
    why = f"point {refused[0][0]}: {refused[0][1]}{more}" if refused else ""
    told = [("warning", warning) for warning in found.warnings]
    return Sheet(
        found.title or "untitled", [fact, ("refused", why), *told, ("written", str(written or ""))], {"": rows}
    )


def _sweep_events(solution: SweepSolution) -> str:
    """Describe the jumps of all runs, and the verdicts of the second law on them."""
    runs = [run.jumps for run in solution.runs]
    jumps = [jump for run in runs for jump in run]
    if not jumps:
        return ""
    found = []
    for verdict in sorted({jump.verdict for jump in jumps} - {ADMISSIBLE}):
        guilty = [{jump.edge.name for jump in run if jump.verdict == verdict} for run in runs]
        names = ", ".join(sorted(set().union(*guilty)))
        found.append(f"{names}: {verdict} in {sum(map(bool, guilty))} of {len(runs)} runs")
    destroyed = [entropy_destroyed(run) for run in runs]
    if (most := max(destroyed)) > 0:
        (at,) = _points_told(solution, [destroyed.index(most)])
        found.append(f"at worst {-most:.3g} {solution.system.unit('J/(m^2 K)')} at {at}")
    return f"{event_counts(jumps)}; {', '.join(found) or 'all admissible'}"


def check_summary(
    title: str,
    system: System,
    scene: Scene,
    run: Run | None,
    groups: Sequence[Group],
    warnings: Sequence[str],
    choices: Sequence[Sequence[str]] = (),
    sweep: str = "",
) -> Sheet:
    """Describe a scene in words, with its dimensionless numbers and warnings; ``sweep`` describes its sweep."""
    sections: dict[str, Sequence[Sequence[str]]] = {
        "Choices": choices,
        "States": _state_rows(system, scene),
        "Roles": [(role.variable, role.role, role.by) for role in system.roles if role.role != "internal"],
        "Modes": [(mode.name, mode.legend) for mode in system.modes if len(mode.words) > 1],
        "Transitions": list(dict.fromkeys((item.name, item.reason) for item in system.edges)),
        "Loads": _load_rows(scene),
        "Laws": _law_rows(scene),
        "Surfaces": surface_rows(scene),
        "Numbers": [(g.name, f"{g.value:.4g} {g.unit if g.unit != '1' else ''}".rstrip(), g.text) for g in groups],
        "Warnings": [(warning,) for warning in warnings],
    }
    facts = [
        ("regime", f"{system.regime}: {REGIMES.get(system.regime, '')}"),
        ("run", _plan(system, run)),
        ("compiled", _compiled(system, run) if run is not None else ""),
        ("sweep", sweep),
    ]
    return Sheet(title or "untitled", facts, sections)


def _law_rows(scene: Scene) -> list[tuple[str, ...]]:
    """Return rows with the laws of a scene and their parameters; of many of one name only their number."""
    from surfacechem.runs.check import laws_of

    every = laws_of(scene)
    kinds = [(law.contract, law.name()) for law in every]
    few = {kind for kind, count in Counter(kinds).items() if count <= MOST_ALIKE}
    pairs = zip(kinds, every, strict=True)
    rows = Counter((*kind, _numbers(law) if kind in few else "") for kind, law in pairs)
    return [(kind, f"{name}, {count} times" if count > 1 else name, told) for (kind, name, told), count in rows.items()]


def _load_rows(scene: Scene) -> list[tuple[str, ...]]:
    """Return rows with what is prescribed and its history: temperatures that are held, and loads."""
    ends = [*((body.name, body.temperature) for body in scene.bodies), ("interface", scene.interface.temperature)]
    loads = {f"T of {name}": load for name, load in ends if isinstance(load, Load)} | {**scene.loading}
    # Temperatures have names of a case's own.
    units = {name: VARIABLES[name].unit if name in VARIABLES else "K" for name in loads}
    return [(name, load.name(), _numbers(load, units[name])) for name, load in loads.items()]


def surface_rows(scene: Scene) -> list[tuple[str, ...]]:
    """Return rows with the shapes of both bodies, the interactions between them, and the range of approaches."""
    surface: Any = scene.surface
    if surface is None:
        return []
    rows = [(body.name, law.name(), _numbers(law)) for body, law in zip(scene.bodies, surface.shapes, strict=True)]
    for words, laws in (("pair", surface.pairs), ("gap", surface.gap_laws), ("heat", surface.heat_laws)):
        rows += [(words, law.name(), _numbers(law)) for law in laws]
    low, high = surface.approach
    return [*rows, ("approach", f"{low:g} to {high:g} m", f"integrated to {surface.accuracy:g}")]


def _numbers(law: Law, x: str = "1") -> str:
    """List what of a law differs from its defaults: parameters, names, lengths of lists; ``x`` is the loaded unit."""
    found, specs = [], dict(law.specs())
    for item in dataclasses.fields(law):
        value = getattr(law, item.name)
        size, varies = (value.value, ", varying") if isinstance(value, Varying) else (value, "")
        if isinstance(size, float) and value != item.default and item.name in specs:
            found.append(f"{item.name} = {size:g} {specs[item.name].resolved(x).unit}".removesuffix(" 1") + varies)
        elif isinstance(value, tuple | list) and value:
            named = all(isinstance(part, str) for part in value)
            found.append(" - ".join(value) if named else f"{len(value)} {item.name}")
    return ", ".join(found)


def _plan(system: System, run: Run | None) -> str:
    """Describe solver, outputs, breakpoints and kinks of a run."""
    if run is None:
        return "none, as everything is given; `surfacechem evaluate` gives its quantities at any state"
    outputs = f"{len(run.times)} output times" if run.picture is None else "outputs that follow the run"
    parts = [f"{run.solver} at rtol {run.rtol:g}, {outputs} to t = {run.times[-1]:g} s"]
    if inside := sum(0 < t < run.times[-1] for t in system.breakpoints):
        parts.append(f"{inside} breakpoint{'s' if inside > 1 else ''}")
    if kinks := [margin.reason for margin in system.margins if not margin.terminal]:
        parts.append(f"kinks: {', '.join(kinks)}")
    return "; ".join(parts)


def _compiled(system: System, run: Run) -> str:
    """Describe which parts of a run are machine code, and which run in Python."""
    if run.solver in CALLING_PYTHON:
        return "the equations; Cantera makes the steps, and asks Python for every right-hand side"
    if run.solver not in (*OWN, AUTO):
        return f"the equations; {run.solver} is called from Python for every step, which looks for events"
    if system.solves_jumps:
        return "equations, steps and events; what follows at a transition is searched for in Python"
    return "all of the run; Python prepares it and looks at its results"


def _state_rows(system: System, scene: Scene) -> list[tuple[str, ...]]:
    """Return rows of states with unit, kind, initial value and meaning; the states inside a body are one row."""
    starts = {state.name: state.initial for state in system.states}
    rows: list[tuple[str, ...]] = []
    for s in system.own_states.values():
        kind, start = ("algebraic", "guess") if s.algebraic else ("evolved", "from")
        rows.append((s.name, f"[{s.quantity.unit}]", kind, f"{start} {s.initial:g}", s.quantity.long_name))
    asked = {body.name: body.conduction.accuracy for body in scene.bodies if body.conduction}
    for p in system.profiles:
        start, accuracy = f"from {starts[p.states[0]]:g}" if p.states else "", asked[p.body]
        # For an accuracy a run finds their number.
        cells = f"as many cells as an accuracy of {accuracy:g} takes" if accuracy else f"{len(p.points) - 1} cells"
        rows.append((p.name, "[K]", "evolved", start, f"temperatures across {p.body}, in {cells}"))
    return rows


def _store_balances(stream: Stream, chunks: Sequence[int], checked: Checked | None) -> str:
    """Describe the worst energy balance of some chunks of a store, and the runs that destroy entropy."""
    told = "not kept"
    if stream.chunks.keep.balances:
        errors = [np.fmax.reduce(stream.store.read("energy_error", number), initial=0.0) for number in chunks]
        told = f"energy {np.fmax.reduce(errors, initial=0.0):.1e} at worst"
    destroys = checked.destroys if checked is not None else 0
    return told + (f"; ENTROPY DESTROYED in {counted(destroys, 'run')}" if destroys else "")


def store_summary(stream: Stream, store: Store, checked: Checked | None, file: Path | None = None) -> tuple[str, Sheet]:
    """Return the status and the summary of a sweep into a store, or through a store into a file."""
    from surfacechem.runs.keeping import STATUSES
    from surfacechem.runs.sweeps import parameter_names

    chunks, layout = stream.chunks, store.layout
    done = [number for number in range(layout.chunks) if (store.marks / str(number)).exists()]
    ends = np.zeros(len(STATUSES), np.int64)
    for number in done:
        ends += np.bincount(store.read("status", number), minlength=len(STATUSES))
    names = parameter_names(chunks.model.system, chunks.plan)
    words = ", ".join(f"{count} {word}" for count, word in zip(ends.tolist(), STATUSES, strict=True) if count)
    facts = [
        ("swept", swept_in_words(chunks.plan, names)),
        ("solved", _solved(chunks.model.system, chunks.run, chunks.lanes.title if chunks.lanes else "")),
        ("ended", ": ".join(filter(None, (f"{ends.sum()} of {counted(chunks.plan.size, 'run')}", words)))),
        ("error", str(checked or "")),
        ("balances", _store_balances(stream, done, checked)),
        ("written", str(file) if file else f"{store.path}, {len(done)} of {layout.chunks} chunks"),
    ]
    stopped = 0 < ends.sum() == ends[STATUSES.index("stopped")]  # a part of few chunks may have none
    status = "failed" if ends[STATUSES.index("failed")] else "stopped" if stopped else "finished"
    return status, Sheet(chunks.simulation.case.title or "untitled", facts)
