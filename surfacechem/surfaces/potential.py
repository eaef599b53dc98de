"""Free energy of two curved surfaces as a function of their approach, from integrals at a few approaches.

It is a potential of the gap like any other, so that every gap model can be driven by it. In a scene with surfaces all
that is per area elsewhere is that of the whole pair: N for Pa, J for J/m^2, kg for kg/m^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Self

import numpy as np

from surfacechem.contracts.terms import HeatTransfer, Law, PairEnergy, Potential, Shape, option
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, decay, derivative, log, where
from surfacechem.surfaces.curved_gap import Contact, bends, between_flats, density, over_gap
from surfacechem.surfaces.pairwise import PairForces, interaction
from surfacechem.surfaces.projection import Array, Surface
from surfacechem.tolerances import NEGLIGIBLE

DEGREE = 14
"""Degree of the polynomials in the approach."""

SHORTEST = 2.0**-26
"""Part of the range of approaches below which no piece is divided; at a kink of the force its error does not count."""

MOST_PIECES = 200

Samples = Callable[[float], tuple[float, float]]
"""Energy [J] and force [N], tension positive, at an approach [m]."""


@dataclass(frozen=True)
class ApproachPiece:
    """Between two approaches the force as a polynomial of x, -1 to 1; where ``powers`` the slope of ln E over ln d."""

    low: float
    high: float
    coefficients: tuple[float, ...]
    start: float
    """Energy [J] at the lower end, or its logarithm."""
    powers: bool

    def energy(self, d: Expression) -> Expression:
        """Energy at an approach [J]."""
        ends = (math.log(self.low), math.log(self.high)) if self.powers else (self.low, self.high)
        half = (ends[1] - ends[0]) / 2
        x = ((log(d) if self.powers else d) - (ends[0] + half)) / half
        whole = np.polynomial.Polynomial(self.coefficients).integ(lbnd=-1).coef.tolist()
        # A sum of powers, whose higher derivatives are no longer than itself.
        found = self.start + half * sum(c * x**k for k, c in enumerate(whole))
        return decay(-found) if self.powers else found


@dataclass(frozen=True)
class ApproachEnergy:
    """Energy over the approach in pieces; a sign where it is a power law of one sign."""

    pieces: tuple[ApproachPiece, ...]
    force: float
    """Its slope at the least approach [N]."""
    sign: float = 1.0

    def energy(self, d: Expression) -> Expression:
        """Energy at an approach [J]; nearer than the first, where only trial states of a solver are, along a line."""
        first, result = self.pieces[0], self.pieces[-1].energy(d)
        for piece in reversed(self.pieces[:-1]):
            result = where(d < piece.high, piece.energy(d), result)
        wall = first.energy(first.low) + self.force * (d - first.low)
        return self.sign * where(d < first.low, wall, result)


KNOWN: dict[str, tuple[tuple[ApproachEnergy, ...], ApproachEnergy | None]] = {}
"""Curves that have been integrated, by what they are the curves of."""


def fitted(samples: Samples, low: float, high: float, rtol: float, cuts: Sequence[float] = ()) -> ApproachEnergy:
    """The energy between two approaches, so that its slope is the force within a relative error.

    It bends at the approaches ``cuts``. InputError where it is not smooth elsewhere.

    An energy of one sign at positive approaches is fitted by its logarithm, in which a power is a straight line.
    """
    at: dict[float, tuple[float, float]] = {}

    def sample(d: float) -> tuple[float, float]:
        if d not in at:
            at[d] = samples(d)
        return at[d]

    first = sample(low)  # what has no force there is refused before anything else is computed
    inside = [cut for cut in cuts if low < cut < high]
    powers = low > 0 and not inside and one_sign([sample(d)[0] for d in (low, math.sqrt(low * high), high)])
    found = divided(sample, [low, *inside, high], powers, rtol)
    return joined(found, *first, powers)


def one_sign(energies: Sequence[float]) -> bool:
    """Whether energies are all above or all below zero."""
    return min(energies) > 0 or max(energies) < 0


def divided(sample: Samples, ends: Sequence[float], powers: bool, rtol: float) -> list[tuple[float, float, Array]]:
    """Pieces that are halved until a polynomial is the force on each; at a kink until they are too short to count."""
    found: list[tuple[float, float, Array]] = []
    waiting = list(pairwise(ends))[::-1]
    while waiting:
        a, b = waiting.pop()
        if len(found) + len(waiting) > MOST_PIECES:
            raise InputError(f"the accuracy {rtol:g} of the force over the approach is out of reach near {a:.4g} m.")
        coefficients = polynomial(sample, a, b, powers, rtol)
        if coefficients is not None:
            found.append((a, b, coefficients))
        elif b - a > SHORTEST * (ends[-1] - ends[0]):
            middle = math.sqrt(a * b) if powers else (a + b) / 2
            # The lower half is the next, so that pieces are found in order.
            waiting += [(middle, b), (a, middle)]
        else:
            found.append((a, b, np.zeros(1)))
    return found


def approach_at(x: float, a: float, b: float, powers: bool) -> float:
    """The approach at -1 <= x <= 1."""
    return math.sqrt(a * b) * (b / a) ** (x / 2) if powers else (a + b) / 2 + x * (b - a) / 2


def polynomial(sample: Samples, a: float, b: float, powers: bool, rtol: float) -> Array | None:
    """Coefficients of what is fitted between two approaches; None where they miss what is between the nodes."""

    def value(x: float) -> float:
        d = approach_at(x, a, b, powers)
        energy, force = sample(d)
        return force * d / energy if powers else force

    nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    values = np.array([value(x) for x in nodes])
    fit = np.polynomial.chebyshev.Chebyshev.fit(nodes, values, DEGREE, domain=[-1, 1])
    size = float(np.max(np.abs(values)))
    # Between the nodes, and near the ends, where an interpolation errs most.
    if any(abs(fit(x) - value(x)) > rtol * size for x in (-0.97, -0.52, 0.14, 0.71, 0.99)):
        return None
    return np.asarray(fit.convert(kind=np.polynomial.Polynomial, domain=[-1, 1], window=[-1, 1]).coef)


def joined(found: list[tuple[float, float, Array]], energy: float, force: float, powers: bool) -> ApproachEnergy:
    """Pieces whose energies go on where the one before ends."""
    start, pieces = math.log(abs(energy)) if powers else energy, []
    for a, b, coefficients in found:
        piece = ApproachPiece(a, b, tuple(map(float, coefficients)), start, powers)
        pieces.append(piece)
        end = piece.energy(b)
        start = math.log(end) if powers else end
    sign = math.copysign(1.0, energy) if powers else 1.0
    return ApproachEnergy(tuple(pieces), sign * force, sign)


class CurvedSurfaces(Potential):
    """Free energy [J] of two curved surfaces at the approach g_n, from laws of pairs of points and of the gap."""

    positive = ()

    shapes: tuple[Shape, Shape] = option("shapes of body 1 and body 2")
    pairs: Sequence[PairEnergy] = option("laws of the distance of two points", default=())
    gap_laws: Sequence[Potential] = option("laws of the gap, integrated over it", default=())
    heat_laws: Sequence[HeatTransfer] = option("conductances over the gap, integrated over it", default=())
    approach: tuple[float, float] = option("least and largest approach [m]")
    accuracy: float = option("relative accuracy of the force")

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """The approaches between which it is known."""
        return {"g_n": self.approach}

    def surfaces(self, d: float) -> tuple[Surface, Surface]:
        """The two surfaces at an approach [m]."""
        return Surface(self.shapes[0]), Surface(self.shapes[1], True, d)

    def with_parts(self, bind: Callable[[Law, str, str], Any]) -> Self:
        """The same with the parameters of the pair laws as symbols; those of the gap are in its integrals."""
        bound = tuple(bind(law, f"surface.pair.{law.name()}", "") for law in self.pairs)
        return self.bind({"pairs": bound, "curves": self.curves, "strongest": self.strongest})

    @cached_property
    def strongest(self) -> float:
        """The approach at which the tension is largest [m]."""
        import symengine

        g = symengine.Symbol("g_n")
        force = symengine.Lambdify([g], [derivative(self.energy(g), g)])
        low, high = self.approach
        places = np.geomspace(low, high, 2000) if low > 0 else np.linspace(low, high, 2000)
        return float(places[np.argmax(force(places[1:-1, None]))])

    @property
    def peaks(self) -> Mapping[str, float]:
        """Where the tension is largest."""
        return {"g_n": self.strongest}

    @cached_property
    def unit(self) -> float:
        """A length that makes powers of the distance numbers of usual size [m]."""
        return max(abs(end) for end in self.approach)

    def parts(self, law: PairEnergy) -> list[tuple[Expression, PairEnergy]]:
        """Laws of which one is a sum, each with its factor."""
        if law.parts is not None:
            return list(law.parts(self.unit))
        return [(1.0, law.given({"n_1": 1.0, "n_2": 1.0}))]

    @cached_property
    def curves(self) -> tuple[tuple[ApproachEnergy, ...], ApproachEnergy | None]:
        """Energies over the approach of the parts of all pair laws per product of densities, and of the gap laws."""
        parts = [part for law in self.pairs for _, part in self.parts(law)]
        # Other numbers of the same surfaces, as in a sweep, have the same integrals.
        key = repr((self.shapes, parts, self.gap_laws, self.approach, self.accuracy))
        if key not in KNOWN:
            KNOWN[key] = self._integrated(parts)
        return KNOWN[key]

    def _integrated(self, parts: Sequence[PairEnergy]) -> tuple[tuple[ApproachEnergy, ...], ApproachEnergy | None]:
        """Those energies from their integrals."""
        # Errors of the samples must not look like what a polynomial misses.
        rtol, finer = self.accuracy, self.accuracy / 64

        met: dict[float, PairForces] = {}

        def of_pairs(k: int, d: float) -> tuple[float, float]:
            if d not in met:
                met[d] = self._at(d, lambda: interaction(*self.surfaces(d), parts, finer))
            return float(met[d].energy[k]), float(met[d].force_1[k, 2])

        found = [fitted(partial(of_pairs, k), *self.approach, rtol) for k in range(len(parts))]
        if not self.gap_laws:
            return tuple(found), None
        laws, levels = [density(law) for law in self.gap_laws], bends(self.gap_laws)

        floor = 0.0

        def of_gap(d: float) -> tuple[float, float]:
            contact = self._at(d, lambda: over_gap(*self.surfaces(d), laws, levels, rtol=finer, floor=floor))
            return contact.energy, float(contact.force_1[2])

        # Where bodies just touch the force is that of rounding; what counts is that in the range.
        floor = NEGLIGIBLE * max(abs(of_gap(d)[1]) for d in self.approach)
        return tuple(found), fitted(of_gap, *self.approach, rtol, levels)

    def _at(self, d: float, compute: Callable[[], Any]) -> Any:
        """What is computed at an approach, which messages name."""
        try:
            return compute()
        except InputError as error:
            raise InputError(f"at the approach g_n = {d:.4g} m {error.message}", self.place) from None

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J]."""
        curves, over_the_gap = self.curves
        whole, waiting = 0.0 * g_n if over_the_gap is None else over_the_gap.energy(g_n), iter(curves)
        for law in self.pairs:
            for factor, _ in self.parts(law):
                whole += law.n_1 * law.n_2 * factor * next(waiting).energy(g_n)
        return whole

    def repulsion(self) -> Expression:
        """None that could be told from the attraction."""
        return 0.0

    def contact(self, d: float, pairs: bool = True) -> Contact:
        """What the laws of the gap, and the pair laws by their energy between flats, give at an approach."""
        heat = [density(law) for law in self.heat_laws]
        return over_gap(*self.surfaces(d), self._local(pairs), bends(self.gap_laws), heat, self.accuracy, self._floor)

    @cached_property
    def _floor(self) -> float:
        """A small part of the force of the laws of the gap at the ends of the range [N]."""
        ends = [self.surfaces(d) for d in self.approach]
        found = [over_gap(*pair, self._local(True), bends(self.gap_laws), rtol=NEGLIGIBLE) for pair in ends]
        return NEGLIGIBLE * max(abs(float(item.force_1[2])) for item in found)

    def traction(self, gap: Array) -> Array:
        """Normal traction at a gap by the laws of the gap and by those of pairs between flats [Pa]."""
        return np.asarray(sum(law(gap)[..., 1] for law in self._local(True)))

    def _local(self, pairs: bool) -> list[Callable[[Array], Array]]:
        return [*map(density, self.gap_laws), *(map(between_flats, self.pairs) if pairs else ())]

    def forces(self, d: float) -> tuple[Array, Array]:
        """Force [N] and moment about the origin [N m] on body 1 at an approach, from all laws."""
        force, moment = np.zeros((2, 3))
        if self.pairs:
            pair = interaction(*self.surfaces(d), self.pairs, self.accuracy)
            force, moment = pair.force_1.sum(axis=0), pair.moment_1.sum(axis=0)
        if self.gap_laws:
            rest = self.contact(d, pairs=False)
            force, moment = force + rest.force_1, moment + rest.moment_1
        return force, moment
