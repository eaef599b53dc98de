"""Waiting for compiled code, which does not look at signals."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

R = TypeVar("R")


def wait_for(work: Callable[[], R]) -> R:
    """Do the work in another thread, so that an interrupt is answered meanwhile.

    >>> wait_for(lambda: 42)
    42
    """
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
