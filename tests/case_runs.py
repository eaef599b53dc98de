"""The shipped cases, each compiled and run once by a worker, whichever tests ask for it."""

from dataclasses import replace
from functools import cache

import surfacechem
from surfacechem.results.solution import Solution

load = cache(surfacechem.load)
"""A case, compiled once."""


@cache
def solved(name: str) -> Solution:
    """A case as it stands, run once."""
    return load(name).run()


@cache
def at_even_times(name: str) -> Solution:
    """A case without outputs that follow its run: those stand on both sides of jumps, whose times have an error."""
    settings = load(name).case.run
    return solved(name) if settings.picture is None else load(name).run(run=replace(settings, picture=None, looks=0.0))
