"""Fits of a function of the approach to values and slopes at a few approaches, such as an energy and its force.

Between two approaches the slope is a Chebyshev interpolant. Each degree is twice the last, so that its nodes include
the earlier ones; where higher degrees do not help, the piece is halved. Source: Trefethen (2013), Approximation Theory
and Approximation Practice, chapters 2 and 8.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, by_ranges, decay, log
from surfacechem.surfaces.patches import Budget
from surfacechem.surfaces.projection import Array
from surfacechem.tolerances import NEGLIGIBLE, TINY

DEGREES = (2, 4, 8, 16, 32)
"""Degrees of the polynomials in the approach, tried in this order."""

SECOND_FIT_GAIN = 8
"""Factor by which a second fit is tighter, for which the errors of the integrals leave room."""

GAIN_DEGREE, PIECE_SAMPLES = 8, 9
"""Degree from which on a higher one is tested for its gain, and number of samples that a piece adds to its end."""

SHORTEST_PIECE = 2.0**-26
"""Fraction of the range of approaches below which a piece, at a kink of the force, is not divided; its error is
ignored.
"""

MOST_PIECES = 200

CHECK_PLACES = (-0.97, -0.52, 0.14, 0.71, 0.97)
"""Points of a piece, in addition to its ends, at which the error of a polynomial is tested."""

logger = logging.getLogger(__name__)

Samples = Callable[[float], tuple[float, float, float]]
"""Function from an approach [m] to energy [J], force [N], tension positive, and the relative error of both."""


class ApproachPiece(NamedTuple):
    """Force between two approaches as a polynomial of x, -1 to 1; with ``powers`` the slope of ln E over ln d."""

    low: float
    high: float
    coefficients: tuple[float, ...]
    start: float
    """Energy [J] at the lower end, or its logarithm."""
    powers: bool

    def _place(self, d: Expression) -> tuple[Expression, float]:
        """Return the coordinate of an approach in the piece, from -1 to 1, and half the length of the piece."""
        ends = (math.log(self.low), math.log(self.high)) if self.powers else (self.low, self.high)
        half = (ends[1] - ends[0]) / 2
        # Divide: a factor 1 / half would be expanded in high powers, and overflow.
        return (log(d) if self.powers else d) / half - (ends[0] / half + 1), half

    def force(self, d: float) -> float:
        """Return the slope of the energy at an approach [N]."""
        value = float(np.polynomial.polynomial.polyval(self._place(d)[0], self.coefficients))
        return value * self.energy(d) / d if self.powers else value

    def energy(self, d: Expression) -> Expression:
        """Return the energy at an approach [J]."""
        x, half = self._place(d)
        whole = np.polynomial.Polynomial(self.coefficients).integ(lbnd=-1).coef.tolist()
        # A sum of powers, since its derivatives are no longer expressions.
        found = self.start + half * sum(c * x**k for k, c in enumerate(whole))
        return decay(-found) if self.powers else found


class ApproachEnergy(NamedTuple):
    """Energy over the approach, in pieces, times a factor: the sign of the energy if logarithms are fitted."""

    pieces: tuple[ApproachPiece, ...]
    force: float
    """Slope of the first piece at the least approach [N]."""
    factor: float = 1.0
    error: float = 0.0
    """Largest relative error of the force; relative to at least a thousandth of its largest value in a piece, and to
    that value if the force changes sign there.
    """

    @classmethod
    def of(cls, numbers: Sequence[Any]) -> ApproachEnergy:
        """Return the energy from stored numbers."""
        pieces, *rest = numbers
        made = (ApproachPiece(a, b, tuple(coefficients), *others) for a, b, coefficients, *others in pieces)
        return cls(tuple(made), *rest)

    def perturbed(self, sign: float = 1.0) -> ApproachEnergy:
        """Return the energy increased by its error, or decreased for a negative sign."""
        return self._replace(factor=self.factor * (1 + sign * self.error))

    def energy(self, d: Expression) -> Expression:
        """Return the energy at an approach [J]; below the least, which only trial states reach, it is linear."""
        first, last = self.pieces[0], self.pieces[-1]
        wall = first.energy(first.low) + self.force * (d - first.low)
        ranges = [(first.low, wall), *((piece.high, piece.energy(d)) for piece in self.pieces[:-1])]
        return self.factor * by_ranges(d, ranges, last.energy(d))


class CachedSamples:
    """A function of the approach, evaluated once at each, and logged with the number of samples so far and expected.

    The expected number is that of the ``budget``.
    """

    def __init__(self, samples: Samples, budget: Budget) -> None:
        self.samples, self.budget = samples, budget
        self.at: dict[float, tuple[float, float, float]] = {}

    def __call__(self, d: float) -> tuple[float, float, float]:
        """Return the sample at an approach; log and compute it if it is not known yet."""
        if d not in self.at:
            amount = {"done": len(self.at), "total": max(self.budget.integrals, len(self.at) + 1)}
            logger.info("integral over the surfaces at the approach %.3g m", d, extra=amount)
            self.at[d] = self.samples(d)
        return self.at[d]


def straight(low: float, high: float) -> ApproachEnergy:
    """Return a linear energy, as a placeholder for one that is not known yet."""
    return ApproachEnergy((ApproachPiece(low, high, (1.0,), 0.0, powers=False),), 0.0)


def fitted(
    samples: Samples,
    low: float,
    high: float,
    rtol: float,
    cuts: Sequence[float] = (),
    floor: tuple[float, float] = (0.0, 0.0),
    budget: Budget | None = None,
) -> ApproachEnergy:
    """Fit the energy between two approaches, so that its slope is the force within a relative error.

    It may have kinks at the approaches ``cuts``; energies [J] and forces [N] below a ``floor`` count as equal to it;
    the ``budget`` gets the number of samples needed. InputError if it is not smooth elsewhere.

    An energy of one sign at positive approaches is fitted by its logarithm, in which a power is a straight line.
    """
    sample, inside = CachedSamples(samples, budget or Budget(rtol)), [cut for cut in cuts if low < cut < high]
    sample.budget.integrals = (1 + len(inside)) * PIECE_SAMPLES + 1
    first = sample(low)  # raises an error for a missing force before anything else is computed
    powers = low > 0 and not inside
    if powers:  # and all energies of one sign, above the floor
        energies = [sample(d)[0] for d in (low, math.sqrt(low * high), high)]
        powers = min(energies) > floor[0] or max(energies) < -floor[0]
    least = 0.0 if powers else floor[1]
    # Errors of the slope of ln E accumulate along the pieces: fit again with a tighter tolerance if needed.
    for aim in (rtol, rtol / SECOND_FIT_GAIN):
        curve = joined(divided(sample, [low, *inside, high], powers, aim, least), *first[:2], powers)
        # Between the samples the error may be larger, but hardly twice as large.
        error = float(2 * largest_error(curve, sample.at, least) + max(error for _, _, error in sample.at.values()))
        if error <= rtol:
            break
    return curve._replace(error=error)


def largest_error(curve: ApproachEnergy, at: Mapping[float, tuple[float, float, float]], least: float) -> float:
    """Return the largest difference between a curve's slope and the sampled forces, relative to the forces in each
    piece, or to ``least``.
    """
    worst = 0.0
    for piece in curve.pieces:
        if len(piece.coefficients) == 1:  # at a kink, too short to matter
            continue
        inside = {d: sample for d, sample in at.items() if piece.low <= d <= piece.high}
        units = [abs(energy) / d if piece.powers else 1.0 for d, (energy, _, _) in inside.items()]
        forces = np.array([force for _, force, _ in inside.values()])
        off = np.abs([curve.factor * piece.force(d) for d in inside] - forces) / units
        worst = max(worst, float(off.max()) / size_of(forces / units, least))
    return worst


def divided(
    sample: CachedSamples, ends: Sequence[float], powers: bool, rtol: float, least: float
) -> list[tuple[float, float, Array]]:
    """Halve pieces until a polynomial fits the force on each; at a kink until they are too short to matter."""
    found: list[tuple[float, float, Array]] = []
    waiting, place = list(pairwise(ends))[::-1], math.log if powers else float
    while waiting:
        sample.budget.integrals = len(sample.at) + len(waiting) * PIECE_SAMPLES
        a, b = waiting.pop()
        if len(found) + len(waiting) > MOST_PIECES:
            raise InputError(f"the accuracy {rtol:g} over the approach is out of reach near {a:.4g} m.")
        coefficients = polynomial(sample, a, b, powers, rtol, least)
        if coefficients is not None:
            found.append((a, b, coefficients))
        elif place(b) - place(a) > SHORTEST_PIECE * (place(ends[-1]) - place(ends[0])):
            middle = approach_at(0.0, a, b, powers)
            # The lower half comes next, so that pieces are found in order.
            waiting += [(middle, b), (a, middle)]
        else:
            found.append((a, b, np.array([(value_at(sample, a, powers) + value_at(sample, b, powers)) / 2])))
    return found


def value_at(sample: Samples, d: float, powers: bool) -> float:
    """Return the value that a polynomial interpolates at an approach: the force, or the slope of ln E over ln d."""
    energy, force, _ = sample(d)
    return force * d / energy if powers else force


def polynomial(sample: CachedSamples, a: float, b: float, powers: bool, rtol: float, least: float) -> Array | None:
    """Return a polynomial fitted between two approaches; None if a higher degree gains too little."""

    def value(x: float) -> float:
        return value_at(sample, approach_at(x, a, b, powers), powers)

    fit = None
    for degree in DEGREES:
        nodes = np.cos(np.pi * np.arange(degree + 1) / degree)
        values = np.array([value(x) for x in nodes])
        size, before = size_of(values, least), fit
        fit = np.polynomial.chebyshev.Chebyshev.fit(nodes, values, degree, domain=[-1, 1])
        if before is None:
            continue
        # The error is geometric in the degree: that of half the degree is the square root of this one's.
        largest = max(float(np.max(np.abs(values))), size)
        off, goal = float(np.max(np.abs(before(nodes) - values))) / largest, rtol * size / largest
        if off**2 <= goal and all(abs(fit(x) - value(x)) <= rtol * size for x in CHECK_PLACES):
            found = fit.trim(NEGLIGIBLE * rtol * size).convert(kind=np.polynomial.Polynomial, domain=[-1, 1])
            return np.asarray(found.coef)
        if degree >= GAIN_DEGREE and off ** (2 * DEGREES[-1] / degree) > goal:
            return None
    return None


def size_of(values: Array, least: float) -> float:
    """Return the size to which errors in a piece are relative: the least value of one sign, or a part of the
    largest.
    """
    sizes = np.abs(values)
    one_sided = values.min() >= 0 or values.max() <= 0
    return float(max(sizes.min() if one_sided else sizes.max(), NEGLIGIBLE * sizes.max(), least, TINY))


def approach_at(x: float, a: float, b: float, powers: bool) -> float:
    """Return the approach at -1 <= x <= 1; exact at the ends."""
    if abs(x) == 1:
        return b if x > 0 else a
    return math.sqrt(a * b) * (b / a) ** (x / 2) if powers else (a + b) / 2 + x * (b - a) / 2


def joined(found: list[tuple[float, float, Array]], energy: float, force: float, powers: bool) -> ApproachEnergy:
    """Join pieces to an energy that is continuous."""
    start, pieces = math.log(abs(energy)) if powers else energy, []
    for a, b, coefficients in found:
        piece = ApproachPiece(a, b, tuple(map(float, coefficients)), start, powers)
        pieces.append(piece)
        end = piece.energy(b)
        start = math.log(end) if powers else end
    factor = math.copysign(1.0, energy) if powers else 1.0
    return ApproachEnergy(tuple(pieces), factor * force, factor)
