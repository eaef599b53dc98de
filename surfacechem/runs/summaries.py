"""What the command line prints about a run and about a scene: plain text, one fact a line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.results.event_table import entropy_destroyed, event_counts, event_summary
from surfacechem.solve.jumps import ADMISSIBLE

if TYPE_CHECKING:
    from surfacechem.model.system import Profile, System
    from surfacechem.results.audit import Audit
    from surfacechem.results.solution import Solution
    from surfacechem.runs.check import Group
    from surfacechem.runs.sweep_dataset import SweepSolution
    from surfacechem.runs.sweeps import Sweep, SweepAccuracy
    from surfacechem.scene import Scene
    from surfacechem.solve.run import Run, Trajectory

REGIMES = {
    "isothermal": "bodies and interface are kept at one temperature; heat is what has to be supplied for it.",
    "prescribed temperatures": "bodies and interface follow given temperatures; heat is what that takes.",
    "perfect contact": "both bodies and the interface share one temperature; the heat fluxes follow from the balances.",
    "one-sided perfect contact": "the interface shares the temperature of one body; heat passes to the other by laws.",
    "separate interface temperature": "the interface has its own temperature; heat passes to the bodies by laws.",
    "medium without temperature": "heat crosses it by laws; interface heat goes into the bodies in fixed shares.",
    "no medium": "the bodies touch directly; interface heat goes into them in fixed shares.",
    "perfect contact without a medium": "the bodies share one temperature and there is no medium between them.",
}


def labelled(label: str, text: str) -> str:
    """A fact under its label."""
    return f"  {label:<10} {text}"


def columns(rows: Iterable[Sequence[str]]) -> list[str]:
    """Rows as text in columns."""
    table = [list(row) for row in rows]
    widths = [max(len(cell) for cell in column) for column in zip(*table, strict=True)]
    return ["  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in table]


def duration(seconds: float) -> str:
    """A time with a unit that fits.

    >>> duration(0.00123), duration(75.0)
    ('1.23 ms', '75 s')
    """
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.1g} s"


def states(system: System) -> str:
    """The states by name; algebraic ones say so."""
    lone = [state for state in system.states if state.name not in system.inside]
    names = [f"{state.name} (algebraic)" if state.algebraic else state.name for state in lone]
    names += [f"{profile.name} ({len(profile.points) - 1} cells)" for profile in system.profiles]
    return ", ".join(names) or "nothing: everything is prescribed"


def run_summary(solution: Solution, written: Path | None) -> str:
    """What was solved, how it ended, how accurate and how fast it was, and where it is."""
    trajectory, books = solution.trajectory, solution.audit
    system = trajectory.model.system
    lines = [
        solution.title or "untitled",
        labelled("solved", f"{states(system)}; {system.regime}; {_method(trajectory.run)}"),
        labelled(solution.status, solution.reason),
        *([labelled("error", _accuracy(solution))] if solution.accuracy else []),
        labelled("time", f"{_time(solution)}; {_work(trajectory)}"),
        *([labelled("events", event_summary(trajectory.jumps, books.energy_scale))] if trajectory.jumps else []),
        labelled("balances", _balances(books)),
        *(labelled("pair", str(verdict)) for verdict in solution.verdicts if verdict.consistent),
        *(labelled("warning", warning) for warning in solution.warnings),
        *([labelled("written", str(written))] if written else []),
    ]
    return "\n".join(lines)


def sweep_summary(solution: SweepSolution, written: Path | None) -> str:
    """What was swept, how the runs ended, how accurate and how fast they were, and where they are."""
    sweep, accuracy = solution.sweep, solution.accuracy
    axes = [f"{name} ({_span(axis.values)}, {len(axis.values)} values)" for name, axis in solution.axes.items()]
    speed = f"run {duration(sweep.seconds)}, compile {duration(sweep.model.compile_seconds)}"
    lines = [
        solution.title or "untitled",
        labelled("swept", " by ".join(axes)),
        labelled("solved", f"{states(solution.system)}; {solution.system.regime}; {_method(sweep.run)}"),
        labelled("ended", f"{len(sweep)} runs: {solution.ends}"),
        *([labelled("error", _sweep_accuracy(accuracy))] if accuracy else []),
        labelled("time", f"{speed}; {sweep.steps} steps"),
        *([labelled("events", events)] if (events := _sweep_events(solution)) else []),
        labelled("balances", _sweep_balances(sweep)),
        *([labelled("written", str(written))] if written else []),
    ]
    return "\n".join(lines)


def _sweep_accuracy(accuracy: SweepAccuracy) -> str:
    """The largest error that is known, and of how many runs none is."""
    known = accuracy.errors[np.isfinite(accuracy.errors)]
    missing = len(accuracy.errors) - len(known)
    if not len(known):
        return f"unknown ({accuracy.source})"
    return f"{known.max():.2g} ({accuracy.source})" + (f"; unknown in {missing} runs" if missing else "")


def _sweep_events(solution: SweepSolution) -> str:
    """What jumped in all runs, and what the second law says to it."""
    sweep = solution.sweep
    runs = [run.jumps for run in sweep]
    jumps = [jump for run in runs for jump in run]
    if not jumps:
        return ""
    found = []
    for verdict in sorted({jump.verdict for jump in jumps} - {ADMISSIBLE}):
        count = sum(any(jump.verdict == verdict for jump in run) for run in runs)
        found.append(f"{verdict} in {count} of {len(runs)} runs")
    destroyed = [entropy_destroyed(run) for run in runs]
    if (most := max(destroyed)) > 0:
        at = zip(solution.axes, solution.plan.points[destroyed.index(most)].values(), strict=True)
        found.append(f"at worst {-most:.3g} J/(m^2 K) at {', '.join(f'{name} = {value:g}' for name, value in at)}")
    return f"{event_counts(jumps)}; {', '.join(found) or 'all admissible'}"


def _sweep_balances(sweep: Sweep) -> str:
    """The worst of all runs."""
    worst = ", ".join(
        f"{name} {sweep.worst(kind):.1e}"
        for name, kind in (("energy", "energy"), ("entropy", "entropy"), ("sites", "site"))
    )
    count = sum(books.destroys for books in sweep.audits)
    return f"{worst}; " + (f"ENTROPY DESTROYED in {count} runs" if count else "no law destroys entropy")


def _span(values: Sequence[float]) -> str:
    return f"{values[0]:g} to {values[-1]:g}" if len(values) > 1 else f"{values[0]:g}"


def _method(run: Run) -> str:
    return f"{run.solver} at rtol {run.rtol:g}"


def _time(solution: Solution) -> str:
    trajectory = solution.trajectory
    return f"run {duration(trajectory.seconds)}, compile {duration(trajectory.model.compile_seconds)}"


def _work(trajectory: Trajectory) -> str:
    from surfacechem.solve import solver

    counters = trajectory.result.counters
    rejected = [f"{counters.rejected} rejected"] if solver(trajectory.run.solver).counts_rejected else []
    return ", ".join([f"{counters.steps} steps", *rejected, f"{counters.residuals} residuals"])


def _accuracy(solution: Solution) -> str:
    accuracy = solution.accuracy
    assert accuracy is not None
    worst = max(accuracy.variables, key=lambda name: accuracy.variables[name], default="")
    where = f" in {worst}" if worst else ""
    if math.isnan(accuracy.error):
        return accuracy.source
    asked = "" if accuracy.asked is None else f"; {accuracy.asked:.0e} was asked"
    return f"{accuracy.error:.2g}{where}{asked} ({accuracy.source})"


def _balances(books: Audit) -> str:
    residuals = f"energy {books.energy_error:.1e}, entropy {books.entropy_error:.1e}, sites {books.site_error:.1e}"
    if not books.least:
        return f"{residuals}; nothing dissipates"
    if books.destroys and not books.violations:
        return f"{residuals}; ENTROPY DESTROYED by all laws together"
    if books.violations:
        worst = ", ".join(f"{law} ({books.least[law]:.3g} W/(m^2 K))" for law in books.violations)
        return f"{residuals}; ENTROPY DESTROYED by {worst}"
    least = min(books.least.values())
    error = ", within the error of the run" if least < 0 else ""
    return f"{residuals}; every law dissipates (least {least:.2g} W/(m^2 K){error})"


def check_summary(
    title: str,
    system: System,
    scene: Scene,
    run: Run,
    groups: Sequence[Group],
    warnings: Sequence[str],
    choices: Sequence[Sequence[str]] = (),
) -> str:
    """A scene said back in words, with its numbers and what is odd about it."""
    sections = [
        title or "untitled",
        labelled("regime", f"{system.regime}: {REGIMES.get(system.regime, '')}"),
        labelled("run", _plan(system, run)),
        _section("Choices", choices),
        _section("States", _state_rows(system)),
        _section("Roles", [(role.variable, role.role, role.by) for role in system.roles if role.role != "internal"]),
        _section("Modes", _mode_rows(system)),
        _section("Transitions", [(item.name, item.reason) for item in system.edges]),
        _section("Laws", _law_rows(scene)),
        _section("Numbers", [(g.name, _value(g), g.text) for g in groups]),
        _section("Warnings", [(warning,) for warning in warnings]),
    ]
    return "\n".join(section for section in sections if section)


def _plan(system: System, run: Run) -> str:
    parts = [f"{_method(run)}, {len(run.times)} output times to t = {run.times[-1]:g} s"]
    inside = [t for t in system.breakpoints if 0 < t < run.times[-1]]
    if inside:
        parts.append(f"{len(inside)} breakpoint{'s' if len(inside) > 1 else ''}")
    if any(not margin.terminal for margin in system.margins):
        parts.append("kinks: " + ", ".join(m.reason for m in system.margins if not m.terminal))
    return "; ".join(parts)


def _section(heading: str, rows: Sequence[Sequence[str]]) -> str:
    return "\n".join([heading, *(f"  {line}" for line in columns(rows))]) if rows else ""


def _state_rows(system: System) -> list[tuple[str, ...]]:
    kinds = {True: "algebraic", False: "evolved"}
    return [
        (
            s.name,
            f"[{s.quantity.unit}]",
            kinds[s.algebraic],
            f"{'guess' if s.algebraic else 'from'} {s.initial:g}",
            s.quantity.long_name,
        )
        for s in system.states
        if s.name not in system.inside
    ] + [_profile_row(system, profile) for profile in system.profiles]


def _profile_row(system: System, profile: Profile) -> tuple[str, ...]:
    starts = {state.name: state.initial for state in system.states}
    start = f"from {starts[profile.states[0]]:g}" if profile.states else ""
    text = f"temperatures across {profile.body}, in {len(profile.points) - 1} cells"
    return profile.name, "[K]", "evolved", start, text


def _mode_rows(system: System) -> list[tuple[str, str]]:
    return [(mode.name, ", ".join(f"{value:g}: {word}" for value, word in mode.words.items())) for mode in system.modes]


def _law_rows(scene: Scene) -> list[tuple[str, str]]:
    from surfacechem.runs.check import laws_of

    return [(law.contract, law.name()) for law in laws_of(scene)]


def _value(group: Group) -> str:
    from surfacechem.runs.check import significant

    return significant(group.value) + ("" if group.unit == "1" else f" {group.unit}")
