"""Waiting for compiled code, which does not look at signals and may not come back."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import TypeVar

R = TypeVar("R")


def wait_for(work: Callable[[], R], seconds: float = math.inf) -> R:
    """Do the work in another thread, so that an interrupt is answered meanwhile; TimeoutError after some seconds.

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
    end = time.monotonic() + seconds
    while thread.is_alive() and time.monotonic() < end:
        thread.join(min(0.5, seconds))
    if failed:
        raise failed[0]
    if not done:
        raise TimeoutError(f"no answer in {seconds:g} s")
    return done[0]
