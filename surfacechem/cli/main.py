"""The command line, with the commands in the usual order of use. Each imports its modules when it is called."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from surfacechem.cli.commands import (
    DIFFERENT,
    EXIT_CODES,
    PRECISION_CODES,
    STABILITY_CODES,
    Accuracy,
    CaseName,
    Changes,
    Commands,
    Quiet,
    SolverName,
    SolverNames,
    Tolerance,
    Verbose,
    case_names,
    check_picture,
    is_dataset,
    law_names,
    leave_with,
    load_case,
    part_of,
    plan_of_runs,
    refuse_unwritable,
    run_settings,
    solve,
    split_list,
    tell_of_compilation,
    write_store,
    written_to,
)
from surfacechem.cli.terminal import show, show_page
from surfacechem.errors import InputError, Place, refuse_unknown

if TYPE_CHECKING:
    from surfacechem.studies.report import Study

MOST_DECADES = 20

app = typer.Typer(
    cls=Commands,
    help="Contact interfaces that bond, slide, break and heat.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        from surfacechem.documents.cache_folder import version

        typer.echo(f"surfacechem {version('surfacechem')}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[bool, Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Contact interfaces that bond, slide, break and heat."""


@app.command(epilog=EXIT_CODES)
def new(
    file: Annotated[
        Path, Argument(metavar="FILE.yaml", help="The case file to write; an existing file is never overwritten.")
    ],
    like: Annotated[
        str, Option("--from", metavar="NAME", help="The shipped case to copy.", autocompletion=case_names)
    ] = "exothermic",
) -> None:
    """Start a case of your own from a shipped one."""
    from surfacechem.results.netcdf import replacing
    from surfacechem.runs.listing import case_text

    if file.suffix.lower() not in (".yaml", ".yml"):
        raise InputError(f"a case is YAML: give {file.with_suffix('.yaml').name}.", Place(path=str(file)))
    if file.exists():
        raise InputError("is there already; give another name.", Place(path=str(file)))
    text = case_text(like)
    with replacing(file) as temporary:
        temporary.write_text(text, encoding="utf-8")
    starts = ["run", "sweep"] if "\nsweep:" in text else ["run"]
    commands = " or ".join(f"`surfacechem {start} {file}`" for start in starts)
    typer.echo(f"{file}, from {like}. Next: `surfacechem check {file}`, then {commands}.")


@app.command(epilog=EXIT_CODES)
def cases(name: Annotated[str | None, Argument(help="Print this case.", autocompletion=case_names)] = None) -> None:
    """List the cases that come with the package, or print one."""
    from surfacechem.runs.listing import case_table, case_text

    if name:
        typer.echo(case_text(name), nl=False)
    else:
        show(case_table())


@app.command(epilog=EXIT_CODES)
def laws(
    name: Annotated[
        str | None, Argument(help="Show this law, or all laws of this contract, in full.", autocompletion=law_names)
    ] = None,
    file: Annotated[
        Path | None, Option("--from", metavar="FILE.py", help="A file with laws of your own; its code is executed.")
    ] = None,
    check: Annotated[
        bool, Option("--check", help="Check the laws of the file: documentation, units, derivatives, thermodynamics.")
    ] = False,
) -> None:
    """List the laws by contract, show one, or check laws of your own."""
    from surfacechem import laws as every
    from surfacechem.documents import document
    from surfacechem.format.cases import read_laws
    from surfacechem.runs.check import report
    from surfacechem.runs.listing import law_list, law_page

    own = [*read_laws(document.read(file), str(file))] if file else []
    if check and not own:
        raise InputError("gives no file to check: add `--from my_laws.py`.", Place(path="--check"))
    if check:
        text, well = report(own)
        typer.echo(text)
        raise typer.Exit(0 if well else DIFFERENT)
    with every.known(own):
        if name:
            typer.echo(law_page(name))
        else:
            show(*law_list())


@app.command(epilog=EXIT_CODES)
def check(
    case: CaseName,
    changes: Changes = None,
    solver: SolverName = None,
    rtol: Tolerance = None,
    accuracy: Accuracy = None,
) -> None:
    """Describe a case in words, without running it."""
    from surfacechem.results.error_estimates import reasons
    from surfacechem.runs.check import consistent_start, groups, start_warnings, warnings
    from surfacechem.runs.summaries import check_summary, swept_in_words
    from surfacechem.solve import AUTO

    simulation = load_case(case, changes)
    system, scene = simulation.system, simulation.case.scene
    if system.is_static:
        show(check_summary(simulation.case.title, system, scene, None, [], warnings(system)))
        return
    settings = run_settings(simulation, solver, rtol, accuracy)
    model = simulation.model
    values = model.values()
    with simulation.case.locating():
        problem = model.problem(settings, values)
    if model.program.rates is None:  # its search finds the start
        tell_of_compilation()
    start, end = consistent_start(model, values), settings.times[-1]
    numbers = groups(model, scene, values, start, end)
    found = [*warnings(system), *start_warnings(model, problem, start, end)]
    why = reasons(problem, settings, system.has_moving_gap) if settings.solver == AUTO else ()
    settings = model.chosen(settings, values)
    swept = ""
    if simulation.case.sweep is not None:
        from surfacechem.runs.streaming import steps_of
        from surfacechem.runs.sweeps import parameter_names

        plan = simulation.plan()
        swept = swept_in_words(plan, parameter_names(system, plan))
        swept += f"; {steps_of(simulation)}" if simulation.case.sweep.keep else ""
    show(check_summary(simulation.case.title, system, scene, settings, numbers, found, why, swept))


@app.command(epilog=EXIT_CODES)
def run(
    case: CaseName,
    output: Annotated[Path | None, written_to(".nc, .csv or .parquet; default <case name>.nc.")] = None,
    changes: Changes = None,
    solver: SolverName = None,
    rtol: Tolerance = None,
    accuracy: Accuracy = None,
    error: Annotated[
        str,
        Option(
            "--error",
            help="Where the error is from: auto (the exact solution, else a second run), estimate (a second run at a "
            "tighter tolerance), balances (no second run; not with an accuracy).",
        ),
    ] = "auto",
    talk: Verbose = None,
) -> None:
    """Run a case, write its dataset and print a summary."""
    from surfacechem.results.netcdf import dataset_path
    from surfacechem.runs.summaries import run_summary

    simulation = load_case(case, changes)
    settings = run_settings(simulation, solver, rtol, accuracy)
    target = output or Path(f"{simulation.case.name}.nc")
    refuse_unwritable(dataset_path(target), read=[simulation.case.file])
    solution = solve(lambda: simulation.run(run=settings, error=error), talk)
    solution.write(target)  # also if the run failed: its partial result helps to find the reason
    if talk is not False:
        show(run_summary(solution, target, details=talk is True))
    for warning in solution.warnings if talk is False else ():
        typer.echo(f"surfacechem: warning: {warning}", err=True)
    leave_with(solution.status, solution.reason if talk is False else "")


@app.command(epilog=EXIT_CODES)
def plot(
    sources: Annotated[
        list[str],
        Argument(
            metavar="FILE.nc|CASE...",
            help="A dataset, a store (.zarr), or a case to run first; several go into one figure.",
        ),
    ],
    output: Annotated[
        Path | None,
        written_to(".png, .svg or .pdf; default <name>.png, of a sweep <name>-sweep.png, of several comparison.png."),
    ] = None,
    variables: Annotated[str | None, Option("--variables", help="Variables to plot, separated by commas.")] = None,
    against: Annotated[
        str | None,
        Option("--against", metavar="VARIABLE", help="A variable as the axis, instead of time or what is swept."),
    ] = None,
    celsius: Annotated[bool, Option("--celsius", help="Temperatures in degrees Celsius.")] = False,
    changes: Changes = None,
    talk: Verbose = None,
) -> None:
    """Plot runs over time or a variable, or sweeps over parameters."""
    from surfacechem.results.netcdf import begin_reading

    files = list(filter(is_dataset, sources))
    if changes and len(files) == len(sources):
        raise InputError("a dataset is plotted as it is; give a case to change values of.", Place(path="--set"))
    for source in files:
        begin_reading(Path(source))
    from surfacechem import plots

    shown = {source: plots.opened(source) for source in files}
    own = Path(sources[0]).stem
    if "sweep" in getattr(shown.get(sources[0]), "attrs", ()):
        own = f"{own.removesuffix('-sweep')}-sweep"  # a sweep and a run of one name have a figure each
    target = output or Path("comparison.png" if len(sources) > 1 else f"{own}.png")
    check_picture(target)
    solutions = {case: solve(load_case(case, changes).run, talk) for case in sources if case not in shown}
    shown |= {case: solution.data for case, solution in solutions.items()}
    figure = plots.figure([shown[source] for source in sources], split_list(variables), against, celsius)
    plots.write(figure, target)
    if talk is not False:
        typer.echo(str(target))
    for solution in solutions.values():
        leave_with(solution.status, solution.reason)


@app.command(epilog=EXIT_CODES)
def report(
    source: Annotated[
        str, Argument(metavar="FILE.nc|CASE", help="A dataset of a run or a sweep, or a case to run first.")
    ],
    output: Annotated[Path | None, written_to("HTML file; default <name>.html.")] = None,
    changes: Changes = None,
    talk: Verbose = None,
) -> None:
    """Write a report about a run or a sweep: one HTML page.

    Scene, equations, figures, events, balances, error against run time. It needs no network.
    """
    from surfacechem.studies import run_report

    is_file = is_dataset(source)
    if is_file and changes:
        raise InputError("a dataset is reported as it is; give a case to change values of.", Place(path="--set"))
    target = run_report.report_path(output or f"{Path(source).stem}.html")
    refuse_unwritable(target)
    solution = None if is_file else solve(load_case(source, changes).run, talk)
    solve(lambda: run_report.write(solution.data if solution else source, target), talk)
    if talk is not False:
        typer.echo(str(target))
    if solution:
        leave_with(solution.status, solution.reason)


@app.command(epilog=EXIT_CODES)
def sweep(
    case: CaseName,
    output: Annotated[
        Path | None, written_to(".nc, .csv, .parquet, or .zarr for any size; default <case name>-sweep.nc.")
    ] = None,
    over: Annotated[
        list[str] | None,
        Option("--over", metavar="PATH=VALUES", help="Values, [1, 2] or {from, to, points, spacing}; repeatable."),
    ] = None,
    until: Annotated[
        str | None, Option("--until", metavar="NAME=VALUE", help="End each run when this ramp reaches the value.")
    ] = None,
    resume: Annotated[bool, Option("--resume", help="Continue an unfinished store.")] = False,
    part: Annotated[
        str | None,
        Option("--part", metavar="K/N", help="Compute part K of N of a store, for example as one job of an array job."),
    ] = None,
    cluster: Annotated[
        str | None, Option("--cluster", metavar="ADDRESS", help="Compute on the workers of this Dask scheduler.")
    ] = None,
    only: Annotated[
        str | None,
        Option("--only", metavar="STATUS", help="Repeat runs of the store with this status, failed say, beside it."),
    ] = None,
    changes: Changes = None,
    talk: Verbose = None,
) -> None:
    """Sweep parameters of a case into one dataset or store.

    A store (.zarr) may be of any size, is resumed where it was interrupted, and may be computed in parts.
    """
    from tempfile import TemporaryDirectory

    from surfacechem.documents.document import assignments
    from surfacechem.results.netcdf import dataset_path
    from surfacechem.runs.summaries import sweep_summary

    simulation = load_case(case, changes)
    values, end = assignments(over or ()) or None, assignments([until] if until else ()) or None
    if output is not None and output.suffix == ".zarr":
        numbers, again = part_of(part), resume or part is not None
        plan, store = plan_of_runs(output, only, again) if only else (simulation.plan(values, end), output)
        return write_store(partial(simulation.stream, plan, store, resume=resume, part=numbers), talk, cluster)
    for option, given in {"--resume": resume, "--part": part, "--cluster": cluster, "--only": only}.items():
        if given:
            raise InputError("belongs to a store: give `-o NAME.zarr`.", Place(path=option))
    target = dataset_path(output or f"{simulation.case.name}-sweep.nc")
    refuse_unwritable(target, read=[simulation.case.file])
    if getattr(simulation.case.sweep, "keep", None) is not None:
        plan = simulation.plan(values, end)
        with TemporaryDirectory(prefix=f".{target.stem}-", dir=target.parent) as folder:
            return write_store(partial(simulation.stream, plan, Path(folder) / "sweep.zarr"), talk, file=target)
    solution = solve(lambda: simulation.sweep(values, end), talk)
    solution.write(target)
    if talk is not False:
        show(sweep_summary(solution, target, details=talk is True))
    leave_with(solution.status)


@app.command(epilog=EXIT_CODES)
def evaluate(
    case: CaseName,
    points: Annotated[
        Path | None,
        Argument(
            metavar="[POINTS.csv]", help="States, one per row; the first line names them with units: g_n [nm], phi [1]."
        ),
    ] = None,
    output: Annotated[
        Path | None, written_to(".nc, .csv or .parquet; default with points: <case name>-points.nc.")
    ] = None,
    changes: Changes = None,
    quiet: Quiet = False,
) -> None:
    """Evaluate a case at given states, with exact derivatives.

    Tractions, fluxes, rates, energies, entropies and heat capacities, without a run.
    """
    from surfacechem.results.netcdf import dataset_path
    from surfacechem.runs.points import read_points
    from surfacechem.runs.summaries import points_summary

    simulation = load_case(case, changes)
    target = dataset_path(output or f"{simulation.case.name}-points.nc") if points or output else None
    if target:
        refuse_unwritable(target, read=[simulation.case.file, *([points] if points else [])])
    found = simulation.evaluated(read_points(points, simulation.evaluator) if points else None)
    if target:
        found.write(target)
    if not quiet:
        show(points_summary(found, target))
    for warning in found.warnings if quiet else ():
        typer.echo(f"surfacechem: warning: {warning}", err=True)
    if reason := next(filter(None, found.refused), ""):
        leave_with("stopped", reason if quiet else "")


@app.command()
def equations(
    case: CaseName,
    form: Annotated[
        str, Option("--format", help="python, which runs; latex or text, to read: without guards, by mode.")
    ] = "python",
    changes: Changes = None,
) -> None:
    """Print the equations of a case, as Python that runs, as LaTeX, or as text."""
    refuse_unknown([form], ("python", "latex", "text"), "no format '{}'", Place(path="--format"))
    from surfacechem import format as cases
    from surfacechem.results import spatial

    read = cases.load(case, changes or ())
    title = read.title
    # The equations of thousands of cells have the same form.
    if spatial.is_divided(read.scene):
        read, title = replace(read, scene=spatial.few(read.scene)), f"{title}, written out for {spatial.FEW} cells"
    if form == "text":
        from surfacechem.studies.run_report import equation_sheet

        show(equation_sheet(read.system(), title))
    elif form == "latex":
        from surfacechem.compile.typeset import latex

        typer.echo(latex(read.system(), title), nl=False)
    else:
        from surfacechem.compile.printing import python

        typer.echo(python(read.system(), title), nl=False)


@app.command(epilog=EXIT_CODES)
def mechanism(
    file: Annotated[str, Argument(metavar="FILE", help="A Cantera surface mechanism, or a shipped one.")],
    phase: Annotated[str | None, Option("--phase", help="The phase, where the file has several.")] = None,
    temperature: Annotated[str, Option("--temperature", "-T", help="Range or single value.")] = "280..360 K",
    force: Annotated[str, Option("--force", help="Force per bond: range or single value.")] = "0..100 pN",
    output: Annotated[Path | None, written_to("Plot to .png, .svg or .pdf.")] = None,
) -> None:
    """Print species, reactions and rates of a mechanism, and check their consistency."""
    from surfacechem.mechanism import load_mechanism
    from surfacechem.studies import mechanism_report as report

    temperatures = report.span(temperature, "K", "--temperature", above=0.0)
    forces = report.span(force, "N", "--force")
    if output:
        check_picture(output)
    curves = report.Curves(load_mechanism(Path(file if Path(file).suffix else f"{file}.yaml"), phase, evaluate=True))
    typer.echo(report.mechanism_sheet(curves, temperatures, forces))
    if output:
        from surfacechem import plots

        plots.write(report.figure(curves, temperatures, forces), output)
        typer.echo(f"\nwritten to {output}")


@app.command(epilog=EXIT_CODES)
def steady(
    case: CaseName,
    of: Annotated[
        list[str] | None,
        Option("--of", metavar="NAME", help="A rate, production_CO2 say; repeatable. All that is made, if not given."),
    ] = None,
    changes: Changes = None,
) -> None:
    """Find the steady state of a mechanism, and what controls its rates."""
    from surfacechem.studies.steady import steady

    typer.echo(steady(case, of or (), changes or ()))


@app.command(epilog=EXIT_CODES)
def rerun(
    file: Annotated[Path, Argument(metavar="FILE.nc", help="A dataset that a run has written.")],
    output: Annotated[Path | None, written_to("Write the new dataset here.")] = None,
    allow_code: Annotated[
        bool, Option("--allow-code", help="Execute the laws whose source code the dataset contains; read it first.")
    ] = False,
    talk: Verbose = None,
) -> None:
    """Repeat the run of a dataset and compare bit for bit."""
    from surfacechem.results.netcdf import dataset_path
    from surfacechem.runs import rerun as again

    record = again.read(file)
    if output:
        refuse_unwritable(dataset_path(output), read=[file])
    solution = solve(lambda: again.run_again(record, allow_code), talk)
    if output:
        solution.write(output)
    different = again.differences(record, solution)
    if different:
        typer.echo(f"surfacechem: {file}: {len(different)} variables differ: {', '.join(different)}", err=True)
        raise typer.Exit(DIFFERENT)
    if talk is not False:
        typer.echo(f"{file}: all {len(record.variables)} variables are bit for bit the same")
        if output:
            typer.echo(f"written to {output}")


@app.command(epilog=PRECISION_CODES)
def precision(
    cases: Annotated[list[str], Argument(metavar="CASE...", help="Case files, or names of shipped cases.")],
    solvers: SolverNames = None,
    tolerances: Annotated[
        str | None, Option("--tolerances", help="Relative tolerances: a list, 1e-4,1e-8, or all decades, 1e-4..1e-8.")
    ] = None,
    variables: Annotated[
        str | None, Option("--variables", help="Variables whose errors count; default: the states.")
    ] = None,
    repeat: Annotated[int | None, Option("--repeat", help="Number of timed rounds; default 5.")] = None,
    output: Annotated[
        Path | None, written_to("Base name of the .nc, .svg, .png and .html files; default precision.")
    ] = None,
    changes: Changes = None,
    talk: Verbose = None,
) -> None:
    """Measure error against run time of several solvers.

    Writes a table, netCDF, a figure and a report.
    """
    from surfacechem.studies import precision as studies

    settings = {
        "solvers": split_list(solvers),
        "tolerances": None if tolerances is None else _tolerances(tolerances),
        "variables": split_list(variables),
        "repeat": repeat,
    }
    study = partial(studies.precision, cases, overrides=changes or ())
    _run_study(study, settings, output or Path("precision"), talk)


@app.command(epilog=STABILITY_CODES)
def stability(
    regimes: Annotated[
        list[str] | None, Argument(metavar="[REGIME]...", help="Names of regimes; default: all.")
    ] = None,
    solvers: SolverNames = None,
    quick: Annotated[bool, Option("--quick", help="Four values of each regime, from mild to extreme.")] = False,
    search: Annotated[
        int | None,
        Option("--search", help="Rounds of the search for the worst corner of each regime; default 12, 0 for none."),
    ] = None,
    rtol: Tolerance = None,
    output: Annotated[
        Path | None, written_to("Base name of the .nc, .svg, .png and .html files; default stability.")
    ] = None,
    talk: Verbose = None,
) -> None:
    """Solve difficult regimes with several solvers.

    Each over decades of its parameter; reports how many digits each solver keeps.
    """
    from surfacechem.studies import stability as studies

    settings = {"solvers": split_list(solvers), "rtol": rtol, "rounds": search}
    study = partial(studies.stability, *(regimes or ()), quick=quick)
    _run_study(study, settings, output or Path("stability"), talk)


@app.command(epilog=EXIT_CODES)
def figures(
    name: Annotated[str, Argument(metavar="LIST", help="A list of figures, or a shipped one: paper, published.")],
    output: Annotated[Path, Option("-o", "--output", help="Folder of the figures.")] = Path("figures"),
    suffix: Annotated[str, Option("--format", help="svg, png or pdf.")] = "svg",
    talk: Verbose = None,
) -> None:
    """Run and draw all figures of a list.

    Each with its exact curve and the distance from it.
    """
    from surfacechem.studies.figures import read_list, write_all

    content = read_list(name)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be made: {error.strerror}.", Place(path=str(output))) from None
    check_picture(output / f"figure.{suffix}")

    for target, caption in solve(lambda: write_all(content, output, suffix), talk):
        if talk is not False:
            typer.echo(f"{target}\n  {caption}")


@app.command()
def schema() -> None:
    """Print the JSON Schema of case files."""
    from surfacechem.format.schema import text

    typer.echo(text(), nl=False)


def _run_study(study: Callable[..., Study], settings: Mapping[str, Any], target: Path, talk: bool | None) -> None:
    """Run a study, which takes minutes, with the given settings; write and print it."""
    from surfacechem.studies.report import targets

    files = targets(target).values()
    refuse_unwritable(*files)
    given = {name: value for name, value in settings.items() if value is not None}
    found = solve(partial(study, **given), talk)
    found.write(target)
    if talk is not False:
        show_page(found.page)
        typer.echo(f"\nwritten to {', '.join(map(str, files))}")
    leave_with(found.status)


def _tolerances(text: str) -> list[float]:
    """Parse numbers separated by commas, or all decades of a range.

    >>> _tolerances("1e-4..1e-6"), _tolerances("1e-3, 1e-7")
    ([0.0001, 1e-05, 1e-06], [0.001, 1e-07])
    """
    place = Place(path="--tolerances")
    loose, dots, tight = text.partition("..")
    try:
        values = [float(part) for part in ((loose, tight) if dots else split_list(text) or ())]
    except ValueError:
        message = f"'{text}' are no tolerances; give numbers, 1e-4,1e-8, or decades, 1e-4..1e-12."
        raise InputError(message, place) from None
    if not dots:
        return values
    last, first = sorted(values)
    if not 0 < last <= first < math.inf:
        raise InputError(f"'{text}' is no range of tolerances, for example 1e-4..1e-12.", place)
    count = min(round(math.log10(first) - math.log10(last)), MOST_DECADES)
    # Rounded to twelve digits, so that a decade is 1e-5 and not 9.999999999999999e-06.
    return [float(f"{first * 10.0**-k:.12g}") for k in range(count + 1)]
