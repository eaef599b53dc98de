"""Whether a body may be one lump: its Biot and Fourier numbers, and by how much a lump errs.

A slab insulated behind, cooled through a conductance h at its face, relaxes at the rate zeta^2 alpha / L^2 with
zeta tan(zeta) = Bi; a lump at Bi alpha / L^2, which is faster.

Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, section 3.11.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import compile_function
from surfacechem.model.system import System

Array = NDArray[np.float64]

SMALL = 0.1
"""Biot number up to which a lump is taken for good: it errs by 3 % then."""

LONG = 2.0
"""Fourier number from which on a slab in perfect contact has become even: 1 % of a difference is left."""


@dataclass(frozen=True)
class Lumping:
    """A body's numbers: h L / k at its contact, infinite in perfect contact, and k t / (C L) over the run."""

    number: int
    body: str
    is_lump: bool
    biot: float
    fourier: float

    @property
    def fast(self) -> float:
        """Part by which a lump would relax too fast.

        >>> round(Lumping(1, "lower", True, 0.1, 1.0).fast, 4), round(Lumping(1, "lower", True, 1.0, 1.0).fast, 4)
        (0.0336, 0.351)
        """
        return self.biot / slowest(self.biot) ** 2 - 1

    @property
    def left(self) -> float:
        """Part of a difference within the body that is left at the end, its face held."""
        return math.exp(-(math.pi**2) * self.fourier / 4)

    def rows(self) -> Iterator[tuple[str, float, str]]:
        """Names, values and meanings for a summary."""
        if math.isfinite(self.biot):
            verdict = "" if not self.biot else f"; as a lump it would relax {self.fast:.2%} too fast"
            yield f"Bi_{self.number}", self.biot, f"h L / k of {self.body} at the start{verdict}"
        yield f"Fo_{self.number}", self.fourier, f"k t / (C L) of {self.body}: length of the run against conduction"

    def warnings(self) -> Iterator[str]:
        """What is wrong with a lump, and by how much."""
        if not self.is_lump:
            return
        remedy = "Give its `conduction` a number of cells."
        if math.isfinite(self.biot) and self.biot > SMALL:
            yield (
                f"{self.body} is one lump, but its Biot number is {self.biot:.3g}: cooled by itself it would relax "
                f"{self.fast:.1%} too fast. {remedy}"
            )
        if not math.isfinite(self.biot) and self.fourier < LONG:
            yield (
                f"{self.body} is one lump in perfect contact, but the run is short against conduction in it: "
                f"{self.left:.1%} of a difference within it would be left at the end. {remedy}"
            )


def slowest(biot: float) -> float:
    """The first root of zeta tan(zeta) = Bi.

    >>> round(slowest(1.0), 6), round(slowest(1e-12) ** 2 / 1e-12, 9)
    (0.860334, 1.0)
    """
    z = math.sqrt(biot / (1 + biot / 3)) if biot < 2 else math.pi / 2 * biot / (1 + biot)
    for _ in range(50):
        change = (z * math.sin(z) - biot * math.cos(z)) / (math.sin(z) * (1 + biot) + z * math.cos(z))
        z -= change
        if abs(change) <= 1e-15 * z:
            break
    return z


def lumpings(system: System, inputs: Array, end: float) -> list[Lumping]:
    """The numbers of the bodies that say how they conduct, at the inputs of compiled functions at the start."""
    found = []
    for c in system.conductors:
        expressions = [system.expand(item) for item in (c.resistance, c.capacity, c.conductance or 0)]
        resistance, capacity, h = compile_function(system.inputs, expressions)(inputs).tolist()
        biot = h * resistance if c.conductance is not None else math.inf
        found.append(Lumping(c.number, c.body, c.is_lump, biot, end / (resistance * capacity)))
    return found
