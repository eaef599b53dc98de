"""Common parts of the commands: options, exit codes, errors as one message, interruptible runs, sweeps into a store."""

from __future__ import annotations

import gc
import logging
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TypeVar

import typer
from typer import Argument, Option
from typer.core import TyperGroup

from surfacechem.cli.terminal import BAR_DELAY, show
from surfacechem.errors import InputError, OutputError, Place, SurfacechemError, refuse_unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from surfacechem.format.plans import Plan
    from surfacechem.runs.simulation import Simulation
    from surfacechem.runs.streaming import Progress, Stream
    from surfacechem.solve.run import Run

R = TypeVar("R")

RARE_COLLECTION = (100_000, 20, 20)
"""Thresholds of Python's garbage collection: new objects between two collections, and collections of a generation
between two of the next older one.
"""

# Exit code of each status of a run.
STATUS_CODES = {"finished": 0, "stopped": 3, "failed": 4}

DIFFERENT, BAD_INPUT, NOT_WRITTEN, SIGNALLED = 1, 2, 5, 128

CODES = {
    0: "finished",
    DIFFERENT: "rerun: the new values are not bit for bit those of the file; laws --check: a law fails",
    BAD_INPUT: "bad input; nothing was computed",
    3: "physics stopped the run (of a sweep, every run) or refuses a point; what was reached is written, and why",
    4: "the run failed numerically; what it reached is written",
    NOT_WRITTEN: "the result could not be written",
    SIGNALLED + 2: "interrupted (128 plus its number for another signal); nothing was written",
}


def exit_codes(own: Mapping[int, str]) -> str:
    """Return the exit codes of a command for its help: its own, and those of every command."""
    every = {code: CODES[code] for code in (BAD_INPUT, NOT_WRITTEN, SIGNALLED + 2)} | dict(own)
    return "\b\nExit codes:\n" + "".join(f"  {code:<4} {every[code]}\n" for code in sorted(every))


EXIT_CODES = exit_codes(CODES)
NO_REFERENCE = "a case has no reference on which two methods agree; all else is written"
PRECISION_CODES = exit_codes({0: "finished; solves that failed are in the report", 4: NO_REFERENCE})
STABILITY_CODES = exit_codes({0: "finished; what failed or is wrong is in the report"})


class SignalledError(BaseException):
    """A signal has asked the process to end."""


class _TrialEndError(Exception):
    """End of the trial of an output."""


def _raise_signal(number: int, _frame: object) -> None:
    raise SignalledError(number)


@contextmanager
def _signals_raised() -> Iterator[None]:
    """Raise signals that end the process as exceptions inside this context, so that unfinished files are removed.

    Signals that the process ignores, by nohup for instance, stay ignored; a handler that is not Python's stays, since
    it could not be restored.
    """
    # Python handles signals only in its main thread.
    in_main = threading.current_thread() is threading.main_thread()
    wanted = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP") if in_main]
    usual = {number: signal.getsignal(number) for number in wanted if number}
    usual = {number: handler for number, handler in usual.items() if handler not in (None, signal.SIG_IGN)}
    try:
        for number in usual:
            signal.signal(number, _raise_signal)
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)


def end_by_signal(error: SignalledError, kept: str) -> NoReturn:
    """End the process as a signal asks, with a message on what is kept of the work."""
    (number,) = error.args
    word = "interrupted" if number == signal.SIGINT else f"ended by {signal.Signals(number).name}"
    _print_error(f"{word}; {kept}")
    os._exit(SIGNALLED + number)  # at once, without waiting for compiled code that runs in another thread


def _print_error(message: object) -> None:
    """Print a line on stderr; if that fails the exit code is all there is."""
    with suppress(OSError):
        typer.echo(f"surfacechem: {message}", err=True)


class Commands(TyperGroup):
    """Commands whose errors are one message on stderr and an exit code."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Run the command line, with rarer garbage collections: at the usual rate they take a tenth of a command,
        although imports create no garbage.
        """
        usual = gc.get_threshold()
        gc.set_threshold(*RARE_COLLECTION)
        try:
            return super().main(*arguments, **options)
        finally:
            gc.set_threshold(*usual)

    def invoke(self, ctx: Any) -> Any:
        """Run a command."""
        try:
            with _signals_raised():
                return super().invoke(ctx)
        except SurfacechemError as error:
            _print_error(error)
            raise typer.Exit(NOT_WRITTEN if isinstance(error, OutputError) else BAD_INPUT) from None
        except SignalledError as error:
            end_by_signal(error, "nothing was written.")
        except BrokenPipeError:
            raise  # the reader of the pipe has closed it
        except OSError as error:
            # Errors of files have their own messages: this one is of the standard output, which Python would try again.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            what = f"{error.filename}: cannot be used" if error.filename else "standard output: cannot be written"
            _print_error(f"{what}: {error.strerror or error}.")
            raise typer.Exit(NOT_WRITTEN) from None


def written_to(text: str) -> Any:
    """Return the option for the file of a command's output."""
    return Option("--output", "-o", help=text)


def case_names(incomplete: str) -> list[str]:
    """Return shipped cases and case files with this beginning, for shell completion."""
    from surfacechem.format import names

    files = [str(path) for path in Path().glob("*.yaml")]
    return [name for name in (*names(), *files) if name.startswith(incomplete)]


def law_names(incomplete: str) -> list[str]:
    """Return laws with this beginning."""
    from surfacechem.laws import FAMILIES, laws

    return [name for contract in FAMILIES for name in laws(contract) if name.startswith(incomplete)]


def paths(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the paths of parameters and initial values of the given case, for shell completion of changes."""
    from surfacechem.runs.simulation import load

    with suppress(SurfacechemError):
        # The option that is being completed has no value, so that nothing on the line has been told apart yet.
        values = [path for case in ctx.args[:1] for path in load(case).model.values()]
        return [f"{path}=" for path in values if path.startswith(incomplete)]
    return []


CaseName = Annotated[
    str, Argument(metavar="CASE", help="A case file, or the name of a shipped case.", autocompletion=case_names)
]
Changes = Annotated[
    list[str] | None,
    Option("--set", metavar="PATH=VALUE", help="Change a value of the case; repeatable.", autocompletion=paths),
]
SolverName = Annotated[str | None, Option("--solver", help="Solver, instead of that of the case.")]
SolverNames = Annotated[str | None, Option("--solvers", help="Names of solvers, separated by commas; default: all.")]
Tolerance = Annotated[float | None, Option("--rtol", help="Relative tolerance, instead of that of the case.")]
Accuracy = Annotated[
    float | None, Option("--accuracy", help="Relative accuracy to reach; solver and tolerance are chosen for it.")
]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Print nothing unless something is wrong.")]
TALK = "Print progress and more about the result, or nothing unless something is wrong."
Verbose = Annotated[bool | None, Option("--verbose/--quiet", "-v/-q", help=TALK, show_default=False)]


def is_dataset(source: str) -> bool:
    """True for the name of a dataset, by its suffix: a missing one must not be taken for the name of a case."""
    from surfacechem.results.netcdf import RUN_SUFFIXES

    return source.rstrip("/").endswith((*RUN_SUFFIXES, ".zarr"))


def load_case(case: str, changes: Sequence[str] | None) -> Simulation:
    """Load a case with its changes; the modules for runs are imported only here."""
    from surfacechem.runs.simulation import load

    return load(case, changes or ())


def run_settings(simulation: Simulation, solver: str | None, rtol: float | None, accuracy: float | None = None) -> Run:
    """Return the run settings of the case with the options of the command line; a tolerance switches off `auto`."""
    from surfacechem.results.accuracy import check_tolerance, first_tolerance
    from surfacechem.solve import AUTO, names
    from surfacechem.solve.run import OWN

    refuse_unknown([] if solver is None else [solver], (AUTO, *names), "no solver '{}'", Place(path="--solver"))
    if rtol is not None:
        check_tolerance(rtol, "--rtol")
    if accuracy is not None and not 0 < accuracy <= 1:
        raise InputError(f"{accuracy:g} is outside its range: > 0 and <= 1.", Place(path="--accuracy"))
    if rtol is not None and (accuracy is not None or solver == AUTO):
        raise InputError("the tolerance has two roles: give an accuracy or a tolerance.", Place(path="--rtol"))
    run = simulation.case.run
    if accuracy is not None:
        return replace(run, solver=solver or AUTO, rtol=first_tolerance(accuracy), accuracy=accuracy)
    run = replace(run, solver=solver or run.solver)
    if rtol is None:
        return run
    # The automatic choice of a solver needs an accuracy.
    return replace(run, solver=OWN if run.solver == AUTO else run.solver, rtol=rtol, accuracy=None)


def wait_for(work: Callable[[], R], tick: Callable[[], None] = lambda: None) -> R:
    """Do the work in another thread and call ``tick`` every half second: compiled code does not check signals, so that
    only the main thread can answer an interrupt.

    >>> wait_for(lambda: 42)
    42
    """
    from concurrent.futures import ThreadPoolExecutor, wait

    pool = ThreadPoolExecutor(1)
    try:
        future = pool.submit(work)
        while not future.done():
            wait([future], 0.5)  # without a timeout signals would not be answered
            tick()
        return future.result()
    finally:
        pool.shutdown(wait=False)


def tell_of_compilation(talk: bool | None = None, waits: bool = False) -> None:
    """Say so if the stepper, or more, has to be compiled."""
    from surfacechem.solve.radau import stepper

    if talk is not False and (waits or not stepper.LOOP.is_compiled):
        typer.echo("compiling the stepper, once on this machine; this takes a minute or less ...", err=True)


def solve(run: Callable[[], R], talk: bool | None, waits: bool = False) -> R:
    """Return the solution with its columns and audit computed, so that only writing is left.

    ``talk`` is the option of the command line, ``waits`` True if more than the stepper has to be compiled. A
    terminal shows a progress bar after a while.
    """
    from surfacechem.cli.terminal import progress_bar

    def whole() -> R:
        found = run()
        getattr(found, "columns", None)  # computed on first access
        return found

    tell_of_compilation(talk, waits)
    with progress_bar(talk) as bar:
        bar.tell("running")
        return wait_for(whole, bar.tick)


def refuse_unwritable(*targets: Path, read: Sequence[str | Path] = ()) -> None:
    """Raise InputError if a file cannot be written, or is one of those that are read; leave no trace of the test."""
    from surfacechem.results.netcdf import replacing

    for target in targets:
        if target.exists() and any(Path(source).exists() and target.samefile(source) for source in read):
            raise InputError("is what is read; give another file.", Place(str(target)))
        # The same steps as in writing a dataset, without content.
        with suppress(_TrialEndError), replacing(target):
            raise _TrialEndError


def check_picture(target: Path) -> None:
    """Raise InputError if the suffix is no format of pictures, or if the file cannot be written."""
    kind = target.suffix.lower().removeprefix(".")
    refuse_unknown([kind], ("png", "svg", "pdf"), "no format '{}'", Place(path=str(target)))
    refuse_unwritable(target)


def split_list(text: str | None) -> list[str] | None:
    """Split words at commas; None stays None."""
    return None if text is None else [part.strip() for part in text.split(",") if part.strip()]


def leave_with(status: str, reason: str = "") -> None:
    """Exit with the code of a status; a reason is printed on stderr."""
    if code := STATUS_CODES[status]:
        if reason:
            _print_error(f"{status}: {reason}")
        raise typer.Exit(code)


log = logging.getLogger(__name__)


def write_store(
    prepared: Callable[[], Stream], talk: bool | None, cluster: str | None = None, file: Path | None = None
) -> None:
    """Run a sweep into a store; after an interrupt the message says how to resume. The store is converted to a
    ``file``, netCDF or a table, if one is given.
    """
    from surfacechem.results.netcdf import save_kept
    from surfacechem.runs.summaries import store_summary

    with client_at(cluster) as client:
        stream = prepared()
        try:
            store = solve(lambda: stream.run(None, client, log_progress()), talk, waits=stream.chunks.waits)
            errors = solve(stream.check, talk)
        except SignalledError as error:
            if file:
                raise
            # A chunk without its mark counts as missing.
            end_by_signal(error, "what is stored is kept: go on with --resume.")
    status, sheet = store_summary(stream, store, errors, file)
    if file:
        with store.dataset as data:
            save_kept(data, file)
    if talk is not False:
        show(sheet)
    leave_with(status)


def plan_of_runs(source: Path, status: str, goes_on: bool) -> tuple[Plan, Path]:
    """Return the plan of the runs of a store with this status, and the path of the store next to it for them: a new
    one, or the last one if ``goes_on``.
    """
    from surfacechem.runs.streaming import failed_runs

    def numbered(k: int) -> Path:
        return source.with_name(f"{source.stem}-{status}{f'-{k}' if k > 1 else ''}.zarr")

    new = next(k for k in count(1) if not numbered(k).exists())
    return failed_runs(source, status), numbered(max(new - goes_on, 1))


def part_of(text: str | None) -> tuple[int, int]:
    """Parse the number of a part, and the number of parts.

    >>> part_of("3/16"), part_of(None)
    ((3, 16), (1, 1))
    """
    if text is None:
        return 1, 1
    match = re.fullmatch(r"(\d+)/(\d+)", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError(f"'{text}' is no part; give its number and that of all, 3/16.", Place(path="--part"))
    return int(match[1]), int(match[2])


@contextmanager
def client_at(address: str | None) -> Iterator[Any]:
    """Open the client of a scheduler; None without an address."""
    if address is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        message = "a cluster needs dask.distributed, which is not installed: pip install 'surfacechem[cluster]'."
        raise InputError(message, Place(path="--cluster")) from None
    try:
        client: Any = Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        message = f"no scheduler answers at {address}: {' '.join(str(error).split())}"
        raise InputError(message, Place(path="--cluster")) from None
    with client:
        yield client


def log_progress() -> Callable[[Progress], None]:
    """Return a callback that logs the progress of a sweep with its speed."""
    begun = time.monotonic()

    def report(now: Progress) -> None:
        # Runs that were stored before do not count for the speed.
        rate = (now.done - now.resumed) / max(time.monotonic() - begun, BAR_DELAY)
        log.info("%.0f runs/s, %d failed", rate, now.failed, extra={"done": now.done, "total": now.runs})

    return report
