"""Long series of which `make unit` runs a part, spread evenly, and `make slow` the rest."""

from collections.abc import Iterable
from typing import Any

import pytest


def every(count: int, values: Iterable[Any]) -> list[Any]:
    """Parameters of a test: one of so many is quick, from the first on; the others are slow."""
    rows = [value if isinstance(value, tuple) else (value,) for value in values]
    return [pytest.param(*row, marks=[] if i % count == 0 else [pytest.mark.slow]) for i, row in enumerate(rows)]
