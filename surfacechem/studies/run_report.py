"""Report of a run or a sweep as one page: scene in words and as a drawing, equations, figures, events, balances, rerun.

All of it comes from the dataset; the scene is read from the case in it.
"""

from __future__ import annotations

import html
import inspect
import logging
import re
import shlex
from base64 import b64encode
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from surfacechem import format as cases
from surfacechem.compile.typeset import Equation, equations
from surfacechem.errors import InputError, Place
from surfacechem.format.plans import recorded_plan
from surfacechem.model.system import System
from surfacechem.plots import drawing, figure, opened, save
from surfacechem.results import spatial
from surfacechem.results.dataset import Results, changes_of
from surfacechem.results.netcdf import Data
from surfacechem.results.solution import Solution
from surfacechem.runs.check import laws_of
from surfacechem.runs.listing import FORMULA, Sheet, plain, source
from surfacechem.runs.simulation import Simulation
from surfacechem.runs.summaries import REGIMES, duration, points_summary, run_summary, surface_rows, sweep_summary
from surfacechem.runs.sweeps import SweepSolution
from surfacechem.solve.run import values_of
from surfacechem.studies.report import Page, PageSection, PageTable, Typeset

if TYPE_CHECKING:
    import xarray

log = logging.getLogger(__name__)

MOST_EVENTS = 100
"""Largest number of events that a page lists."""

QUICK_SECONDS = 1.0
"""Largest run time [s] at which a page repeats a case at looser tolerances."""

TOLERANCES = tuple(10.0**-digits for digits in (4, 6, 8, 10))


def page(data: Data | xarray.Dataset | str | Path) -> Page:
    """Return the report of a dataset of a run or a sweep, or of its file."""
    dataset = opened(data)
    place = Place(str(data)) if isinstance(data, str | Path) else None
    if "keep" in dataset.attrs:
        raise InputError("is a sweep that keeps a part of its runs, of which there is no report; plot it.", place)
    if "case" not in dataset.attrs or "status" not in dataset.attrs:
        raise InputError("this is no dataset of a run or of a sweep.", place)
    attributes, omissions = dataset.attrs, []
    items = [(f"{path} = {value:g}", unit) for path, (value, unit) in changes_of(attributes).items()]
    told = ", ".join(text if unit in ("", "1") else f"{text} {unit}" for text, unit in items)
    changed = [f"Numbers differ from those of the case, which was changed in Python: {told}."] if told else []
    command, again = _again(data, attributes)
    told = attributes.get("warnings", "none")
    warnings = [] if told == "none" else [f"Warning: {text}." for text in told.split("; ")]
    sections = [PageSection("What happened", [_ending(attributes), *changed, *warnings], figure=True)]
    try:
        if not attributes["case"]:
            raise InputError("the scene was built in Python, and the dataset holds no case.")
        case = cases.load_text(attributes["case"], mechanism_text=attributes.get("mechanism"))
        sections += [*_scene(case, attributes), *_events(dataset), _balances(attributes), *_precision(case, attributes)]
    except InputError as error:  # a report does not execute code that the dataset carries
        sections += [*_events(dataset), _balances(attributes)]
        omissions.append(f"The scene and its equations: {error.message}")
    untitled = replace(dataset, attrs={**attributes, "title": ""})  # the page has the title above
    told_again = [again, *([f"$ {command}"] if command else []), *changed]
    sections.append(PageSection("How to run it again", told_again, code=attributes["case"], details=True))
    return Page(attributes.get("title", "untitled"), command, sections, omissions, lambda: figure(untitled))


def _again(data: Data | xarray.Dataset | str | Path, attributes: Mapping[str, Any]) -> tuple[str, str]:
    """Return the command that repeats the run of a dataset, empty if there is none, and its requirements."""
    if not attributes["case"]:
        return "", "The scene was built in Python; its script runs it again."
    if isinstance(data, str | Path):
        command = f"surfacechem rerun {shlex.quote(Path(data).name)}"
        return command, "The dataset holds the case, the mechanism and the settings of the run."
    if "sweep" in attributes:
        changes = _values(attributes)
        again = f'load("case.yaml").sweep_plan(recorded_plan({attributes["sweep"]!r}), {changes})'
        return "", f"In Python, with the case below: {again}; recorded_plan is in surfacechem.format.plans."
    needed = "The command needs the case below as case.yaml, and beside it the files that it names"
    beyond = " What was changed in Python, a written dataset has alone." if "departures" in attributes else ""
    return "surfacechem run case.yaml", f"{needed}.{beyond}"


def report_path(path: str | Path) -> Path:
    """Return the path of a report; InputError if its suffix is that of another format."""
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"a report is HTML: give {target.stem or 'report'}.html.", Place(str(path)))
    return target


def write(data: Data | xarray.Dataset | str | Path, path: str | Path) -> Path:
    """Save the report of a dataset as one HTML file, whole or not at all."""
    target = report_path(path)
    page(data).write(target)
    return target


def glance(results: Results) -> str:
    """Return a summary and a small figure as HTML, for a notebook."""
    if isinstance(results, Solution):
        sheet = run_summary(results, None)
    else:
        sheet = sweep_summary(results, None) if isinstance(results, SweepSolution) else points_summary(results, None)  # type: ignore[arg-type]
    shown = f"<pre>{html.escape(str(sheet))}</pre>"
    if "status" not in results.attributes:  # points have no figure
        return shown
    picture = BytesIO()
    save(results.plot(), picture, "png")
    return f'{shown}<img style="max-width:34em" src="data:image/png;base64,{b64encode(picture.getvalue()).decode()}">'


def _ending(attributes: Any) -> str:
    """Describe the end, the accuracy and the speed of a run."""
    text = f"{attributes['status']}: {attributes['reason']}; {attributes['solver']} at rtol {attributes['rtol']:g}."
    if "error" in attributes:
        text += f" Error {attributes['error']:.2g} ({attributes['error_source']})."
    text += f" Run time {duration(attributes['run_seconds'])}, {attributes['count_steps']} steps."
    if "integrals_seconds" in attributes:
        text += f" Integrals over the surfaces took {duration(attributes['integrals_seconds'])}."
    return text


def _values(attributes: Mapping[str, Any]) -> dict[str, float]:
    """Return the changes of a run to its case, in SI, by path."""
    return {path: value for path, (value, _) in changes_of(attributes).items()}


def _scene(case: cases.Case, attributes: Mapping[str, Any]) -> Iterator[PageSection]:
    """Yield sections on the scene of a run: words, drawing, and equations."""
    system, changed = case.system(), case
    for path, value in _values(attributes).items():
        with suppress(InputError):  # not every change of a run can be an override of a case
            changed = cases.load_text(changed.text, mechanism_text=case.mechanism_text, overrides={path: value})
    scene = changed.scene
    regime = f"{system.regime}: {REGIMES.get(system.regime, '')}"
    rows = [(role.variable, role.role, role.by) for role in system.roles if role.role != "internal"]
    words = [text for text in (case.description, case.source and f"Source: {case.source}", regime) if text]
    variables = PageTable(("variable", "role", "by"), rows, "Variables")
    tables, acting = [variables], laws_of(scene)
    surface: Any = scene.surface
    if surface is not None:
        tables.append(PageTable(("body or law", "kind", "numbers"), surface_rows(scene), "Surfaces"))
        acting += [*surface.pairs, *surface.gap_laws, *surface.heat_laws]
    stated = []
    for law in acting:
        name = f"{law.contract}: {law.name().replace('-', ' ')}"
        for block in FORMULA.findall(f"{inspect.getdoc(type(law))}\n"):
            pieces = re.split(r"(?<=[,;]) *\\quad *", " ".join(block.split()))
            stated.append(Equation("", tuple(pieces), name, source(type(law))))
    yield PageSection("The scene", words, tables, drawings=[lambda: drawing.figure(scene)])
    yield PageSection("Laws", equations=list(dict.fromkeys(stated)))
    if spatial.is_divided(scene):  # the equations of all cells have the same form
        system = replace(case, scene=spatial.few(case.scene)).system()
    lines, symbols = equations(system)
    yield PageSection("Equations", tables=[_numbers(system, symbols, attributes)], equations=lines, details=True)


def _numbers(system: System, symbols: Mapping[str, str], attributes: Mapping[str, Any]) -> PageTable:
    """Return the table of parameters and initial values of a run, with values of the case that differ, and sweeps."""
    own, changes, units = values_of(system), _values(attributes), system.changeable
    values = {path: f"{value:.6g}" for path, value in values_of(system, changes).items()}
    values |= dict.fromkeys(recorded_plan(attributes["sweep"]).paths if "sweep" in attributes else (), "swept")
    texts = {p.path: p.spec.text for p in system.parameters if p.path in units}
    evolved = [state for state in system.own_states.values() if not state.algebraic]
    texts |= {state.path: f"{state.at_start[0].long_name} at the start" for state in evolved}
    notes = {path: f"; {own[path]:.6g} in the case" for path, value in changes.items() if value != own[path]}
    rows = [
        (Typeset(symbols[path]), values[path], units[path], f"{text} ({path}){notes.get(path, '')}")
        for path, text in texts.items()
    ]
    return PageTable(("symbol", "value", "unit", "meaning"), rows, "Numbers")


def equation_sheet(system: System, title: str) -> Sheet:
    """Return the equations as text for a terminal, each with its meaning and the modes in which it holds.

    What is compiled is guarded besides; one line says so.
    """
    rows = [
        (plain(" ".join((line.left, *line.pieces))), "; ".join(filter(None, (line.text, line.when))))
        for line in equations(system)[0]
    ]
    left_out = "guards against overflow, division by zero and what no time resolves; `--format python` has them"
    return Sheet(f"{title}: {system.regime}", [("left out", left_out)], {"": rows})


def _events(dataset: Data) -> list[PageSection]:
    """Return the section on the events of a run with their verdicts."""
    if "event_time" not in dataset or len(dataset["event_time"].dims) != 1:
        return []
    names = [name for name in ("event_name", "event_reason", "event_verdict") if name in dataset]
    columns = [dataset[name].values.tolist() for name in names]
    times = [f"{t:.9g}" for t in dataset["event_time"].values.tolist()]
    rows = [*zip(times, *columns, strict=True)]
    heading = ("time [s]", *(name.removeprefix("event_") for name in names))
    more = [f"{len(rows) - MOST_EVENTS} more are in the dataset."] if len(rows) > MOST_EVENTS else []
    return [PageSection("Events", more, [PageTable(heading, rows[:MOST_EVENTS])])]


def _balances(attributes: Any) -> PageSection:
    """Return the section on the residuals of the balances."""
    rows = [(name, f"{attributes[f'{name}_error']:.2g}") for name in ("energy", "entropy", "site")]
    rows.append(("laws that destroy entropy", attributes.get("entropy_violations", "none")))
    return PageSection("Balances", tables=[PageTable(("balance", "largest residual, relative"), rows)])


def _precision(case: cases.Case, attributes: Any) -> Iterator[PageSection]:
    """Yield the section on error against run time: the case at looser tolerances, if that is quick."""
    # Only the results of the case itself can be compared with runs of it.
    if "sweep" in attributes or "departures" in attributes or attributes["run_seconds"] > QUICK_SECONDS:
        return
    simulation, rows = Simulation(case), []
    tolerances = [*(tolerance for tolerance in TOLERANCES if tolerance > case.run.rtol), case.run.rtol]
    for number, rtol in enumerate(tolerances):
        log.info("again at rtol %g", rtol, extra={"done": number, "total": len(tolerances)})
        solution = simulation.run(run=replace(case.run, rtol=rtol, solver=attributes["solver"], accuracy=None))
        error = f"{solution.accuracy.error:.1e}" if solution.accuracy else ""
        steps = f"{solution.trajectory.result.counters.steps}"
        rows.append((f"{rtol:g}", error, duration(solution.trajectory.seconds), steps))
    heading = ("relative tolerance", "error", "run time", "steps")
    table = PageTable(heading, rows, f"error: {attributes.get('error_source', 'unknown')}")
    yield PageSection("Error against run time", tables=[table])
