"""The command ``stability``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from surfacechem.cli.commands import Quiet, Tolerance, studied
from surfacechem.cli.guard import refuse_unwritable

CODES = """\b
Exit codes:
  0    finished; what failed or is wrong is in the report
  2    bad input; nothing was computed
  5    what was computed could not be written where it should be
  130  interrupted, or 128 and the number of another signal; nothing was written
"""


def stability(
    regimes: Annotated[
        list[str] | None, typer.Argument(metavar="[REGIME]...", help="Names of regimes; all if none is given.")
    ] = None,
    solvers: Annotated[
        str | None, typer.Option("--solvers", help="Names of solvers, with commas between; all if not given.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Four values of each regime, from mild to extreme.")] = False,
    search: Annotated[
        int | None, typer.Option("--search", help="Rounds of the search for worst corners; 12 if not given, 0: none.")
    ] = None,
    rtol: Tolerance = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Name of .nc, .svg, .png and .html; stability if not given.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Solve dangerous regimes over decades of their parameter with several solvers, and report what each keeps."""
    from surfacechem.studies.report import targets
    from surfacechem.studies.stability.matrix import RTOL, SOLVERS
    from surfacechem.studies.stability.study import ROUNDS
    from surfacechem.studies.stability.study import stability as compared

    target = output or Path("stability")
    files = targets(target)
    for file in files.values():
        refuse_unwritable(file)
    names = SOLVERS if solvers is None else tuple(part.strip() for part in solvers.split(",") if part.strip())
    study = studied(
        lambda: compared(
            *(regimes or ()),
            solvers=names,
            rtol=RTOL if rtol is None else rtol,
            quick=quick,
            rounds=ROUNDS if search is None else search,
        ),
        quiet,
    )
    study.write(target)
    if not quiet:
        typer.echo(study.page.text())
        typer.echo(f"\nwritten to {', '.join(map(str, files.values()))}")
