"""What keeps a command safe: outputs are tried before anything is computed, and an interrupt is answered at once."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

R = TypeVar("R")


class _TriedError(Exception):
    """Ends an attempt to write."""


def refuse_unwritable(target: Path) -> None:
    """InputError where a file could not be written, so that nothing is computed in vain; leaves no trace."""
    from surfacechem.netcdf import replacing

    with suppress(_TriedError), replacing(target):
        raise _TriedError


def interruptible(work: Callable[[], R]) -> R:
    """Do the work in another thread, so that an interrupt is answered while compiled code runs."""
    done: list[R] = []
    failed: list[BaseException] = []

    def task() -> None:
        try:
            done.append(work())
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=task, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.5)
    if failed:
        raise failed[0]
    return done[0]
