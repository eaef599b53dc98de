"""Expressions as machine code and as readable Python, and the cache folder of compiled code.

Compilation of code and import of libraries on first use do not count as run time. Work that is slow only once is done
inside ``PREPARATION``, as a block or a decorator.

>>> before = PREPARATION.seconds
>>> with PREPARATION:
...     import decimal
>>> PREPARATION.seconds > before
True
"""

import threading
import time
from contextlib import ContextDecorator
from types import TracebackType


class _Stopwatch(ContextDecorator, threading.local):
    """A stopwatch for each thread; nested blocks count once."""

    seconds = 0.0
    """Time spent so far [s]."""
    _depth = 0
    _start = 0.0

    def __enter__(self) -> None:
        if self._depth == 0:
            self._start = time.perf_counter()
        self._depth += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._start


PREPARATION = _Stopwatch()
