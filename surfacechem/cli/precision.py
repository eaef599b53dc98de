"""The command ``precision``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from surfacechem.cli.commands import STATUS, Changes, Quiet, studied
from surfacechem.cli.guard import refuse_unwritable
from surfacechem.errors import InputError, Place

MOST_DECADES = 20

CODES = """\b
Exit codes:
  0    finished; solves that failed are in the report
  2    bad input; nothing was computed
  4    a case has no reference on which two methods agree; all else is written
  5    what was computed could not be written where it should be
  130  interrupted, or 128 and the number of another signal; nothing was written
"""


def precision(
    cases: Annotated[list[str], typer.Argument(metavar="CASE...", help="Case files, or names of shipped cases.")],
    solvers: Annotated[
        str | None, typer.Option("--solvers", help="Names of solvers, with commas between; all if not given.")
    ] = None,
    tolerances: Annotated[
        str | None,
        typer.Option("--tolerances", help="Relative tolerances, 1e-4,1e-8, or their decades, 1e-4..1e-8."),
    ] = None,
    variables: Annotated[
        str | None, typer.Option("--variables", help="Variables whose errors count; the states if not given.")
    ] = None,
    repeat: Annotated[int | None, typer.Option("--repeat", help="Timed rounds; 5 if not given.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Name of .nc, .svg, .png and .html; precision if not given.")
    ] = None,
    changes: Changes = None,
    quiet: Quiet = False,
) -> None:
    """Run cases with several solvers over tolerances: error against run time, as table, netCDF, figure and report."""
    from surfacechem.studies.precision.comparing import precision as compared
    from surfacechem.studies.report import targets

    files = targets(output or Path("precision"))
    given = {"solvers": _listed(solvers), "variables": _listed(variables), "tolerances": _tolerances(tolerances)}
    settings = {name: values for name, values in given.items() if values is not None}
    for target in files.values():
        refuse_unwritable(target)
    rounds = {} if repeat is None else {"repeat": repeat}
    study = studied(lambda: compared(cases, overrides=changes or (), **settings, **rounds), quiet)  # type: ignore[arg-type]
    study.write(output or Path("precision"))
    if not quiet:
        typer.echo(study.page.text())
        typer.echo(f"\nwritten to {', '.join(map(str, files.values()))}")
    if STATUS[study.status]:
        raise typer.Exit(STATUS[study.status])


def _listed(text: str | None) -> list[str] | None:
    return None if text is None else [part.strip() for part in text.split(",") if part.strip()]


def _tolerances(text: str | None) -> list[float] | None:
    """Numbers with commas between, or all decades of a range.

    >>> _tolerances("1e-4..1e-6"), _tolerances("1e-3, 1e-7")
    ([0.0001, 1e-05, 1e-06], [0.001, 1e-07])
    """
    if text is None:
        return None
    loose, dots, tight = text.partition("..")
    if not dots:
        return [_number(part, text) for part in text.split(",") if part.strip()]
    first, last = sorted((_number(loose, text), _number(tight, text)), reverse=True)
    if not 0 < last <= first:
        raise InputError(f"'{text}' is no range of tolerances, for example 1e-4..1e-12.", Place(path="--tolerances"))
    count = min(round(math.log10(first / last)), MOST_DECADES)
    return [float(f"{first * 10.0**-k:.12g}") for k in range(count + 1)]


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(
            f"'{whole}' are no tolerances; give numbers, 1e-4,1e-8, or decades, 1e-4..1e-12.",
            Place(path="--tolerances"),
        ) from None
