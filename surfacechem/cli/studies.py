"""The commands of studies of many runs: ``precision`` and ``stability``."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from surfacechem.cli.commands import (
    Changes,
    Quiet,
    SolverNames,
    Tolerance,
    exit_codes,
    leave_with,
    listed,
    refuse_unwritable,
    solved,
)
from surfacechem.errors import InputError, Place

if TYPE_CHECKING:
    from collections.abc import Callable

    from surfacechem.studies.report import Study

MOST_DECADES = 20

NO_REFERENCE = "a case has no reference on which two methods agree; all else is written"
PRECISION_CODES = exit_codes({0: "finished; solves that failed are in the report", 4: NO_REFERENCE})
STABILITY_CODES = exit_codes({0: "finished; what failed or is wrong is in the report"})


def precision(
    cases: Annotated[list[str], Argument(metavar="CASE...", help="Case files, or names of shipped cases.")],
    solvers: SolverNames = None,
    tolerances: Annotated[
        str | None, Option("--tolerances", help="Relative tolerances, 1e-4,1e-8, or their decades, 1e-4..1e-8.")
    ] = None,
    variables: Annotated[
        str | None, Option("--variables", help="Variables whose errors count; the states if not given.")
    ] = None,
    repeat: Annotated[int | None, Option("--repeat", help="Timed rounds; 5 if not given.")] = None,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Name of .nc, .svg, .png and .html; precision if not given.")
    ] = None,
    changes: Changes = None,
    quiet: Quiet = False,
) -> None:
    """Run cases with several solvers over tolerances: error against run time, as table, netCDF, figure and report."""
    from surfacechem.studies import precision as studies

    settings = {
        "solvers": None if solvers is None else listed(solvers),
        "tolerances": None if tolerances is None else _tolerances(tolerances),
        "variables": None if variables is None else listed(variables),
        "repeat": repeat,
    }
    given = {name: value for name, value in settings.items() if value is not None}
    _conduct(lambda: studies.precision(cases, overrides=changes or (), **given), output or Path("precision"), quiet)  # type: ignore[arg-type]


def stability(
    regimes: Annotated[
        list[str] | None, Argument(metavar="[REGIME]...", help="Names of regimes; all if none is given.")
    ] = None,
    solvers: SolverNames = None,
    quick: Annotated[bool, Option("--quick", help="Four values of each regime, from mild to extreme.")] = False,
    search: Annotated[
        int | None, Option("--search", help="Rounds of the search for worst corners; 12 if not given, 0: none.")
    ] = None,
    rtol: Tolerance = None,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Name of .nc, .svg, .png and .html; stability if not given.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Solve dangerous regimes over decades of their parameter with several solvers, and report what each keeps."""
    from surfacechem.studies import stability as studies

    settings = {"solvers": None if solvers is None else listed(solvers), "rtol": rtol, "rounds": search}
    given = {name: value for name, value in settings.items() if value is not None}
    _conduct(lambda: studies.stability(*(regimes or ()), quick=quick, **given), output or Path("stability"), quiet)  # type: ignore[arg-type]


def _conduct(run: Callable[[], Study], target: Path, quiet: bool) -> None:
    """Run a study, which takes minutes, so that it says on a terminal what it is at; write and print it."""
    from surfacechem.studies.report import targets

    files = targets(target).values()
    refuse_unwritable(*files)
    if sys.stderr.isatty() and not quiet:
        import logging

        logging.basicConfig(format="%(message)s ...")
        logging.getLogger("surfacechem").setLevel(logging.INFO)
    study = solved(run, quiet)
    study.write(target)
    if not quiet:
        typer.echo(study.page.text())
        typer.echo(f"\nwritten to {', '.join(map(str, files))}")
    leave_with(study.status)


def _tolerances(text: str) -> list[float]:
    """Numbers with commas between, or all decades of a range.

    >>> _tolerances("1e-4..1e-6"), _tolerances("1e-3, 1e-7")
    ([0.0001, 1e-05, 1e-06], [0.001, 1e-07])
    """
    place = Place(path="--tolerances")
    loose, dots, tight = text.partition("..")
    try:
        values = [float(part) for part in ((loose, tight) if dots else listed(text))]
    except ValueError:
        raise InputError(
            f"'{text}' are no tolerances; give numbers, 1e-4,1e-8, or decades, 1e-4..1e-12.", place
        ) from None
    if not dots:
        return values
    last, first = sorted(values)
    if not 0 < last <= first:
        raise InputError(f"'{text}' is no range of tolerances, for example 1e-4..1e-12.", place)
    count = min(round(math.log10(first / last)), MOST_DECADES)
    return [float(f"{first * 10.0**-k:.12g}") for k in range(count + 1)]
