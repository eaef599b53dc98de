"""The shipped cases, each compiled and run once by a worker, whichever tests ask for it."""

from functools import cache

import surfacechem
from surfacechem.results.solution import Solution

load = cache(surfacechem.load)
"""A case, compiled once."""


@cache
def solved(name: str) -> Solution:
    """A case as it stands, run once."""
    return load(name).run()
