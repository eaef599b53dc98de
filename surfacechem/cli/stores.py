"""Sweeps into a store from the command line: progress, ends of runs, and resuming after an interrupt."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from surfacechem.cli.commands import SignalledError, end_by_signal, leave_with, solve
from surfacechem.cli.terminal import BAR_DELAY, show
from surfacechem.errors import InputError, Place

if TYPE_CHECKING:
    from collections.abc import Callable

    from surfacechem.format.plans import Plan
    from surfacechem.runs.simulation import Simulation
    from surfacechem.runs.streaming import Progress

log = logging.getLogger(__name__)


def goes_to_store(output: Path | None, options: dict[str, object]) -> bool:
    """True if a sweep goes into a store; InputError for an option that is only for stores."""
    if output is not None and output.suffix == ".zarr":
        return True
    for name, value in options.items():
        if value:
            raise InputError("belongs to a store: give `-o NAME.zarr`.", Place(path=name))
    return False


def write(
    simulation: Simulation,
    planned: Callable[[], Plan],
    target: Path,
    talk: bool | None,
    resume: bool,
    part: str | None,
    cluster: str | None,
    only: str | None,
) -> None:
    """Run a sweep into a store; after an interrupt the message says how to resume. With ``only`` the runs of a store
    with this status are repeated, into another store next to it.
    """
    from surfacechem.runs.summaries import store_summary

    numbers = part_of(part)
    plan, target = plan_of_runs(target, only, resume or part is not None) if only else (planned(), target)
    with client_at(cluster) as client:
        stream = simulation.stream(plan, target, resume=resume, part=numbers)
        try:
            store = solve(lambda: stream.run(None, client, progress()), talk, brief=True, waits=stream.chunks.waits)
            errors = solve(stream.check, talk)
        except SignalledError as error:
            # A chunk without its mark counts as missing.
            end_by_signal(error, "what is stored is kept: go on with --resume.")
    status, sheet = store_summary(stream, store, errors)
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


def write_file(simulation: Simulation, plan: Plan, target: Path, talk: bool | None) -> None:
    """Run a sweep into a temporary store, and convert the complete store to one file, netCDF or a table."""
    from surfacechem.results.netcdf import save_kept
    from surfacechem.runs.summaries import store_summary

    with TemporaryDirectory(prefix=f".{target.stem}-", dir=target.parent) as folder:
        stream = simulation.stream(plan, Path(folder) / "sweep.zarr")
        store = solve(lambda: stream.run(on_progress=progress()), talk, brief=True, waits=stream.chunks.waits)
        status, sheet = store_summary(stream, store, solve(stream.check, talk), target)
        with store.dataset as data:
            save_kept(data, target)
    if talk is not False:
        show(sheet)
    leave_with(status)


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
        client: Any = Client(address, timeout=10, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        message = f"no scheduler answers at {address}: {' '.join(str(error).split())}"
        raise InputError(message, Place(path="--cluster")) from None
    with client:
        yield client


def progress() -> Callable[[Progress], None]:
    """Return a callback that logs the progress of a sweep with its speed."""
    begun = time.monotonic()

    def report(now: Progress) -> None:
        # Runs that were stored before do not count for the speed.
        rate = (now.done - now.resumed) / max(time.monotonic() - begun, BAR_DELAY)
        log.info("%.0f runs/s, %d failed", rate, now.failed, extra={"done": now.done, "total": now.runs})

    return report
