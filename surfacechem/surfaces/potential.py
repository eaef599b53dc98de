"""Free energy of two curved surfaces, and heat conductance between them, over the approach, from a few integrals.

The energy is a potential of the gap like any other, so that every gap model can use it. In a scene with surfaces
quantities per area are those of the whole pair: N for Pa, J for J/m^2, kg for kg/m^2.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, cached_property, partial
from typing import Any, Self

import numpy as np

from surfacechem.contracts.terms import HeatTransfer, Law, PairEnergy, Potential, Shape, option
from surfacechem.documents.cache_folder import PACKAGE, Fingerprint, cached, fingerprint
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, derivative, symengine
from surfacechem.surfaces.approach import ApproachEnergy, fitted, straight
from surfacechem.surfaces.forces import (
    GAP,
    Contact,
    PairForces,
    between_flats,
    density,
    interaction,
    kinks,
    length,
    level_approaches,
    over_gap,
    pair_traction,
    slices_of,
)
from surfacechem.surfaces.inner_sums import kernel, laws_by_extent
from surfacechem.surfaces.patches import Budget, OutOfReachError
from surfacechem.surfaces.projection import Array, Surface
from surfacechem.tolerances import ERROR_FLOOR, FORMULA_EPS, GAP_EPS, NEGLIGIBLE, RUN_EPS, SQRT_EPS

INTEGRATED_CURVES: dict[Fingerprint, tuple[ApproachEnergy, ...]] = {}
"""Curves that have been integrated, by the fingerprint of their laws and surfaces."""

log = logging.getLogger(__name__)

SOURCES = [*(path for room in ("surfaces", "laws", "contracts") for path in sorted((PACKAGE / room).glob("*.py")))]
SOURCES += [PACKAGE / f"{name}.py" for name in ("expressions", "quantities", "tolerances")]
"""Source files that integrals depend on, including the common parts of the laws."""


class _IntegrationTime(threading.local):
    """Time spent on integrals over surfaces so far, by thread."""

    seconds = 0.0


INTEGRATION_TIME = _IntegrationTime()


@contextmanager
def integrating() -> Iterator[None]:
    """Count the time of a block as time spent on integrals."""
    start = time.perf_counter()
    try:
        yield
    finally:
        INTEGRATION_TIME.seconds += time.perf_counter() - start


def curves_of(integrated: Callable[[], Sequence[ApproachEnergy]], *given: Any) -> tuple[ApproachEnergy, ...]:
    """Return curves that follow from what is given; they are integrated once, and stored in the cache.

    Surfaces that differ only in their numbers, as in a sweep, have the same ones.
    """
    mark = fingerprint(*given)
    if mark not in INTEGRATED_CURVES:
        with integrating():
            found = cached(mark, SOURCES, integrated)
        log.info("running")
        INTEGRATED_CURVES[mark] = tuple(map(ApproachEnergy.of, found))
    return INTEGRATED_CURVES[mark]


CALLED = "`surface.approach`"
"""Key of the range of approaches in a case."""

JUMP_SAMPLES = 2000
"""Number of points between which a law is tested for jumps."""


def first_jump(law: Callable[[Array], Array], places: Array) -> float | None:
    """Return the first jump, between increasing points, of a law's energy, the first of its values (n, 2)."""
    a, b = places[:-1], places[1:]
    low, high = law(a)[:, 0], law(b)[:, 0]
    sizes = np.maximum(np.abs(low), np.abs(high))
    # Far out a law may be the roundoff of a difference.
    least = np.maximum(NEGLIGIBLE * sizes, FORMULA_EPS * sizes.max())
    while np.any(b - a > SQRT_EPS * (np.abs(a) + np.abs(b))):
        middle = (a + b) / 2
        between = law(middle)[:, 0]
        lower = np.abs(between - low) > np.abs(high - between)
        a, low = np.where(lower, a, middle), np.where(lower, low, between)
        b, high = np.where(lower, middle, b), np.where(lower, between, high)
        # The interval is too short to distinguish points: the remaining change is a jump.
        if np.all(b - a <= GAP_EPS):
            break
    jumps = np.abs(high - low) > least
    return float(a[jumps][0]) if jumps.any() else None


class CurvedSurfaces(Potential):
    """Free energy [J] of two curved surfaces at the approach g_n, from laws of pairs of points and of the gap."""

    positive = ()
    called = CALLED

    shapes: tuple[Shape, Shape] = option("shapes of body 1 and body 2")
    pairs: Sequence[PairEnergy] = option("laws of the distance of two points", default=())
    gap_laws: Sequence[Potential] = option("laws of the gap, integrated over it", default=())
    heat_laws: Sequence[HeatTransfer] = option("conductances over the gap, integrated over it", default=())
    approach: tuple[float, float] = option("least and largest approach [m]")
    accuracy: float = option("relative accuracy of the force")

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """Range of approaches in which the energy is known."""
        return {"g_n": self.approach}

    def of_run(self, values: Mapping[str, float]) -> Self:
        """Return the surfaces with a run's numbers for the pair laws, by path."""
        paths = [{name: f"{law.path}.{name}" for name, _ in law.specs()} for law in self.pairs]
        own = [{name: values[path] for name, path in each.items() if path in values} for each in paths]
        return replace(self, pairs=tuple(law.given(each) for law, each in zip(self.pairs, own, strict=True)))

    def thinned(self, stretch: float) -> Self:
        """Return the surfaces with densities reduced by the stretch of the area; shapes are unchanged."""
        if stretch == 1:
            return self
        own = [{name: getattr(law, name) / stretch for name in ("n_1", "n_2")} for law in self.pairs]
        return replace(self, pairs=tuple(law.given(each) for law, each in zip(self.pairs, own, strict=True)))

    def surfaces(self, d: float) -> tuple[Surface, Surface]:
        """Return the two surfaces at an approach [m]."""
        return Surface(self.shapes[0]), Surface(self.shapes[1], True, d)

    def with_parts(self, bind: Callable[[Law, str, str], Any]) -> Self:
        """Return the surfaces with symbols for the parameters of the pair laws; gap laws are inside integrals."""
        bound = tuple(bind(law, f"surface.pair.{law.name()}", "") for law in self.pairs)
        return self.bind({"pairs": bound, "curves": self.curves, "strongest": self.strongest})

    def surrogate(self) -> Self:
        """Return the surfaces with linear energies in place of integrals."""
        line = straight(*self.approach)
        curves = tuple(line for law in self.pairs for _ in self.parts(law)), line if self.gap_laws else None
        return self.bind({"curves": curves, "strongest": self.approach[0]})

    @property
    def error(self) -> float:
        """Largest relative error of the force of a law."""
        curves, over_the_gap = self.curves
        return max(curve.error for curve in (*curves, *([over_the_gap] if over_the_gap else [])))

    def perturbed(self) -> Self:
        """Return the surfaces with all repulsion too strong, and all attraction too weak, by its error."""
        curves, over_the_gap = self.curves
        signs = [math.copysign(1.0, factor) for law in self.pairs for factor, _ in self.parts(law)]
        found = tuple(curve.perturbed(sign * curve.factor) for curve, sign in zip(curves, signs, strict=True))
        return self.bind({"curves": (found, over_the_gap and over_the_gap.perturbed()), "strongest": self.strongest})

    @cached_property
    def strongest(self) -> float:
        """Approach at which the tension is largest [m]."""
        g = symengine.Symbol("g_n")
        force = symengine.Lambdify([g], [derivative(self.energy(g), g)])
        low, high = self.approach
        places = (np.geomspace if low > 0 else np.linspace)(low, high, JUMP_SAMPLES)[1:-1]
        return float(places[np.argmax(force(places[:, None]))])

    @property
    def peaks(self) -> Mapping[str, float]:
        """Gap at which the tension is largest."""
        return {"g_n": self.strongest}

    def parts(self, law: PairEnergy) -> list[tuple[Expression, PairEnergy]]:
        """Return the laws of which a law is the sum, each with its factor."""
        if law.parts is not None:
            # In units of a length for which powers of the distance are of moderate size.
            return list(law.parts(max(abs(end) for end in self.approach)))
        return [(1.0, law.given({"n_1": 1.0, "n_2": 1.0}))]

    @cached_property
    def curves(self) -> tuple[tuple[ApproachEnergy, ...], ApproachEnergy | None]:
        """Energies over the approach: of the parts of all pair laws per product of densities, and of the gap laws."""
        parts = [part for law in self.pairs for _, part in self.parts(law)]
        given = self.shapes, parts, self.gap_laws, self.approach, self.accuracy
        curves = curves_of(lambda: self.integrated(parts), *given)
        return curves[: len(parts)], next(iter(curves[len(parts) :]), None)

    def integrated(self, parts: Sequence[PairEnergy]) -> list[ApproachEnergy]:
        """Return energies over the approach of some parts from their integrals."""
        self._refuse_jumps()
        if self.heat_laws:
            # Raise an error for an infinite conductance before any force is integrated.
            with self.at_approach(self.approach[0]):
                heat = [density(law) for law in self.heat_laws]
                over_gap(*self.surfaces(self.approach[0]), [], kinks(self.heat_laws), heat, NEGLIGIBLE)
        # Errors of the samples must not be taken for errors of a polynomial.
        rtol, finer = self.accuracy, max(self.accuracy / 64, RUN_EPS)

        met: dict[float, PairForces] = {}
        budget = Budget(rtol)

        def of_pairs(k: int, d: float) -> tuple[float, float, float]:
            if d not in met:
                with self.at_approach(d):
                    met[d] = interaction(*self.surfaces(d), parts, finer, budget)
            return float(met[d].energy[k]), float(met[d].force_1[k, 2]), met[d].error

        ends = level_approaches(*self.surfaces(0.0), sorted({law.cutoff for law in parts if math.isfinite(law.cutoff)}))
        found = [fitted(partial(of_pairs, k), *self.approach, rtol, ends, budget=budget) for k in range(len(parts))]
        if not self.gap_laws:
            return found
        laws, levels = [density(law) for law in self.gap_laws], kinks(self.gap_laws)
        cuts = level_approaches(*self.surfaces(0.0), levels)
        floor, spent = (0.0, 0.0), Budget(rtol)

        @cache
        def of_gap(d: float) -> tuple[float, float, float]:
            with self.at_approach(d):
                contact = over_gap(*self.surfaces(d), laws, levels, (), finer, floor, spent)
            return contact.energy, float(contact.force_1[2]), contact.error

        # Where bodies just touch, or a law has decayed, the force is roundoff: use the scale of the whole range.
        for d in self.approach:
            energy, force, _ = of_gap(d)
            floor = max(floor[0], NEGLIGIBLE * abs(energy)), max(floor[1], NEGLIGIBLE * abs(force))
        return [*found, fitted(of_gap, *self.approach, rtol, cuts, floor, spent)]

    def _refuse_jumps(self) -> None:
        """Raise InputError if the energy of a law jumps, where it has no force."""
        least, largest = self.approach
        far = largest + length(*self.surfaces(largest))
        beyond = np.geomspace(abs(largest) or far * NEGLIGIBLE, far, JUMP_SAMPLES)
        gaps = np.concatenate([np.linspace(least, largest, JUMP_SAMPLES)[:-1], beyond])
        distances = np.geomspace(max(least, far * SQRT_EPS), far, JUMP_SAMPLES)
        known = [(law, kernel(law), distances, "r") for law in self.pairs]
        for law, energy, places, name in [*known, *((law, density(law), gaps, GAP) for law in self.gap_laws)]:
            at = first_jump(energy, places)
            if at is not None:
                text = f"the energy of {law.name()} jumps at {name} = {at:.6g} m, where it has no force"
                raise InputError(f"{text}; let it change over a length.", law.place)

    @contextmanager
    def at_approach(self, d: float) -> Iterator[None]:
        """Name the approach in messages of errors raised in a block."""
        try:
            yield
        except InputError as error:
            raise InputError(f"at the approach g_n = {d:.4g} m {error.message}", self.place) from None

    def energy(self, g_n: Expression) -> Expression:
        """Return the free energy [J]."""
        curves, over_the_gap = self.curves
        whole, waiting = 0.0 * g_n if over_the_gap is None else over_the_gap.energy(g_n), iter(curves)
        for law in self.pairs:
            for factor, _ in self.parts(law):
                whole += law.n_1 * law.n_2 * factor * next(waiting).energy(g_n)
        return whole

    def repulsion(self) -> Expression:
        """Return zero: repulsion cannot be separated from attraction."""
        return 0.0

    def contact(self, d: float, pairs: bool = True, budget: Budget | None = None) -> Contact:
        """Return the contact at an approach by the gap laws, and by the pair laws' energy between flats."""
        heat = [density(law) for law in self.heat_laws]
        # Conductances may have kinks where laws of force have none.
        levels = self._levels(pairs, self.heat_laws)
        return over_gap(*self.surfaces(d), self._local(pairs), levels, heat, self.accuracy, self._floor, budget)

    def _levels(self, pairs: bool, heat: Sequence[HeatTransfer] = ()) -> list[float]:
        """Return the gaps at which local laws have kinks; for pair laws these are the distances of their kinks."""
        found = [kink for extent in laws_by_extent(self.pairs) for kink in extent.kinks] if pairs else []
        return sorted({*kinks((*self.gap_laws, *heat)), *found})

    def totals(self, approaches: Array, stretches: Array) -> Array:
        """Return results for each approach at its stretch of the area, shape (8, n).

        Force on body 1 [N], its moments about x and y [N m], force of the local law [N], least gap [m], number of
        places with it, area of contact [m^2], conductance [W/K].
        """

        def found() -> list[list[float]]:
            rows, budget = [], Budget(self.accuracy)
            budget.integrals = len(approaches) * (1 + bool(self.pairs) + bool(self.pairs and self.gap_laws))
            for number, (d, stretch) in enumerate(zip(approaches.tolist(), stretches.tolist(), strict=True)):
                log.info("forces at output times", extra={"done": number, "total": len(approaches)})
                own = self.thinned(stretch)
                (force, moment), local = own.forces(d, budget), own.contact(d, budget=budget)
                ours = [force[2], *moment[:2], local.force_1[2], local.gap, local.places, local.area, local.conductance]
                rows.append([float(x) for x in ours])
            return rows

        laws = self.pairs, self.gap_laws, self.heat_laws
        return np.transpose(
            cached(fingerprint(self.shapes, *laws, self.accuracy, self.approach, approaches, stretches), SOURCES, found)
        )

    @cached_property
    def _floor(self) -> tuple[float, float]:
        """Small parts of energy [J] and force [N] of the gap laws at the ends of the range."""
        floor = 0.0, 0.0
        for pair in map(self.surfaces, self.approach):
            found = over_gap(*pair, self._local(True), self._levels(True), rtol=NEGLIGIBLE, floor=floor)
            force = abs(float(found.force_1[2]))
            floor = max(floor[0], NEGLIGIBLE * abs(found.energy)), max(floor[1], NEGLIGIBLE * force)
        return floor

    def tractions(
        self, x: Array, normals: Array, gaps: Array, approaches: Array, stretches: Array
    ) -> tuple[Array, bool]:
        """Return normal tractions (k, n) on body 1 [Pa], tension positive, and True if pair laws are summed.

        At points (n, 3) with normals and gaps (k, n), at approaches (k,) with their stretches of the area. Over a rough
        body 2, or if sums over it exceed their budget, tractions are those of the local law.
        """
        own, upper = [self.thinned(stretch) for stretch in stretches.tolist()], self.surfaces(0.0)[1]

        def local(pairs: bool) -> Array:
            laws = [one._local(pairs) for one in own]
            found = [sum((law(gap)[..., 1] for law in each), 0 * gap) for each, gap in zip(laws, gaps, strict=True)]
            return np.array(found)

        if not self.pairs or math.isfinite(self.shapes[1].grain):
            return local(pairs=True), False
        budget, summed, rtol = Budget(self.accuracy), [], max(self.accuracy, ERROR_FLOOR)
        budget.integrals = len(own) * len(slices_of(len(x), upper))
        try:
            for k, (one, d) in enumerate(zip(own, approaches.tolist(), strict=True)):
                log.info("fields at output times", extra={"done": k, "total": len(own)})
                summed.append(pair_traction(x, normals, replace(upper, approach=d), one.pairs, rtol, budget))
        except OutOfReachError:
            return local(pairs=True), False
        return np.array(summed) + local(pairs=False), True

    def _local(self, pairs: bool) -> list[Callable[[Array], Array]]:
        return [*map(density, self.gap_laws), *(map(between_flats, self.pairs) if pairs else ())]

    def forces(self, d: float, budget: Budget | None = None) -> tuple[Array, Array]:
        """Return force [N] and moment about the origin [N m] on body 1 at an approach, from all laws."""
        force, moment = np.zeros((2, 3))
        if self.pairs:
            pair = interaction(*self.surfaces(d), self.pairs, self.accuracy, budget)
            force, moment = pair.force_1.sum(axis=0), pair.moment_1.sum(axis=0)
        if self.gap_laws:
            rest = self.contact(d, pairs=False, budget=budget)
            force, moment = force + rest.force_1, moment + rest.moment_1
        return force, moment


class CurvedConductance(HeatTransfer):
    """Conductance [W/K] between two curved bodies at the approach g_n, from one per area over the gap."""

    called = CALLED

    law: HeatTransfer = option("conductance per area, a law of the gap")
    pair: CurvedSurfaces = option("the two surfaces")

    @property
    def channel(self) -> str:  # type: ignore[override]
        """Carrier of the heat."""
        return self.law.channel

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """Range of approaches in which the conductance is known."""
        return self.pair.limits

    def surrogate(self) -> Self:
        """Return the law with a linear conductance in place of integrals."""
        return self.bind({"curve": straight(*self.pair.approach)})

    @property
    def error(self) -> float:
        """Relative error of the conductance, and of its slope."""
        return self.curve.error

    def perturbed(self) -> Self:
        """Return the law, larger by its error."""
        return self.bind({"curve": self.curve.perturbed()})

    @cached_property
    def curve(self) -> ApproachEnergy:
        """The conductance over the approach."""
        pair, law, levels = self.pair, density(self.law), kinks([self.law])
        budget = Budget(pair.accuracy)

        def sample(d: float) -> tuple[float, float, float]:
            finer = max(pair.accuracy / 64, RUN_EPS)
            with pair.at_approach(d):
                found = over_gap(*pair.surfaces(d), [], levels, [law], finer, budget=budget)
            return found.conductance, found.conductance_slope, found.error

        def integrated() -> list[ApproachEnergy]:
            # Conductance and slope are fitted like energy and force.
            cuts = level_approaches(*pair.surfaces(0.0), levels)
            return [fitted(sample, *pair.approach, pair.accuracy, cuts, budget=budget)]

        (curve,) = curves_of(integrated, pair.shapes, self.law, pair.approach, pair.accuracy)
        return curve

    def conductance(self, g_n: Expression) -> Expression:
        """Return the conductance [W/K]."""
        return self.curve.energy(g_n)
