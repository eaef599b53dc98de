"""Audit of energy, entropy and sites along a run, against the ledger, and findings on it for its reader, in words.

The equations satisfy both laws of thermodynamics exactly, so the residuals measure the integration. A law with negative
entropy production shows in ``least``.

The findings are about pairs of rates that contradict the equilibrium of the potential, rates too fast to be resolved,
laws outside their validity or range, and fluxes and errors that make a result meaningless. Where the interface is in
equilibrium every reaction runs as often forward as back, so that k_f/k_r is the equilibrium constant K(g, T), including
the elastic energy of the bonds. A reversible law satisfies this by construction; two one-way laws do so only if their
parameters agree.

Source: Sauer, Duong & Mandadapu (2021), sections 3.3, 3.4 and 4.3; Onsager (1931), Phys. Rev. 37, 405 (detailed
balance).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function
from surfacechem.errors import MOST_LISTED, listed
from surfacechem.expressions import EXPONENT_CAP, without
from surfacechem.model.system import Range, RatePair, System, Total
from surfacechem.results.accuracy import Accuracy
from surfacechem.solve.contract import Array, Points
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import EPS, ERROR_FLOOR, NEGLIGIBLE, RUN_EPS, SQRT_EPS

OPEN_BALANCE, TIGHTEST_JUDGED = 1000.0, SQRT_EPS / 16
"""Relative residual, in tolerances of the run, above which a balance counts as open: errors of smooth runs stay below a
hundred tolerances. Runs tighter than TIGHTEST_JUDGED, 9e-10, are judged by this tolerance, since rounding adds up, too.
"""

LAST_DIGITS = 10
"""Number of last digits that add up in a balance, in addition to one per step."""

ROUNDED_PART = 1e-2
"""Ratio of rounding to an exchanged amount, from which on the amount is not resolved."""

ERROR_MARGIN = 10.0
"""Error of the integration, in tolerances: of a law's turnover, and of the states on which its production depends."""


@dataclass(frozen=True)
class Audit:
    """Residuals of the balances at the output times and the least dissipation of each law."""

    energy: Array
    """Total energy minus the energy supplied since the start [J/m^2], shape (times,)."""
    entropy: Array
    """Total entropy minus the entropy supplied and produced since the start [J/(m^2 K)], shape (times,)."""
    sites: Array
    """Largest residual of the site balances [1], shape (times,)."""
    energy_scale: float
    """Largest energy that was exchanged [J/m^2]."""
    entropy_scale: float
    """Largest entropy that was exchanged or produced [J/(m^2 K)]."""
    rtol: float
    """Relative tolerance of the run."""
    energy_stored: float
    """Largest energy whose last digits the total energy cannot resolve [J/m^2]."""
    entropy_stored: float
    """Largest entropy whose last digits the total entropy cannot resolve [J/(m^2 K)]."""
    energy_rounding: float
    """Energy of the last digits of the states, summed over all steps [J/m^2]; if less is exchanged than the work of
    errors within the tolerance of the states, this work."""
    entropy_rounding: float
    """Entropy of the last digits of the states, summed over all steps [J/(m^2 K)]."""
    least: Mapping[str, float]
    """Least entropy production of each dissipative law over all steps and outputs [W/(m^2 K)]."""
    losses: Callable[[], tuple[Mapping[str, float], float]]
    """Function for the destroyed fractions; it is slow if the surroundings have to be asked for rates."""

    def __repr__(self) -> str:
        """Return the three largest residuals in a line."""
        return f"<Audit: energy {self.energy_error:.1e}, entropy {self.entropy_error:.1e}, sites {self.site_error:.1e}>"

    @cached_property
    def _worst(self) -> tuple[float, float]:
        """Largest residuals of energy and entropy."""
        return largest(self.energy), largest(self.entropy)

    @cached_property
    def _lost(self) -> tuple[Mapping[str, float], float]:
        return self.losses()

    @property
    def destroyed(self) -> Mapping[str, float]:
        """Fraction of its turnover that each dissipative law destroys, beyond rounding; zero if the amount is less than
        the last digit of the total.
        """
        return self._lost[0]

    @property
    def destroyed_together(self) -> float:
        """Fraction of their turnover that all laws together destroy."""
        return self._lost[1]

    @property
    def energy_error(self) -> float:
        """Largest energy residual relative to the exchanged energy, or to the stored one if that is lost in its
        rounding.
        """
        return float(resolved(self._worst[0], self.energy_scale, self.energy_stored, self.energy_rounding))

    @property
    def entropy_error(self) -> float:
        """Largest entropy residual relative to the entropy exchanged or produced, or to the stored one if that is lost
        in its rounding.
        """
        return float(resolved(self._worst[1], self.entropy_scale, self.entropy_stored, self.entropy_rounding))

    @property
    def site_error(self) -> float:
        """Largest site residual."""
        return float(np.max(np.abs(self.sites), initial=0.0))

    @cached_property
    def violations(self) -> tuple[str, ...]:
        """Laws that destroyed entropy beyond the tolerance of the run, or whose production is NaN."""
        most = ERROR_MARGIN * self.rtol
        return tuple(law for law, low in self.least.items() if not (low >= 0 or self.destroyed[law] <= most))

    @property
    def destroys(self) -> bool:
        """True if a law destroyed entropy, or all laws together did."""
        return bool(self.violations) or not self.destroyed_together <= ERROR_MARGIN * self.rtol

    @cached_property
    def findings(self) -> tuple[str, ...]:
        """Defects of the balances in words, usually none."""
        laws = [law.replace("_", " ") for law in self.violations]
        found = [f"the law {law} destroys entropy" for law in laws]
        if len(laws) > MOST_LISTED:
            found = [f"the laws {listed(laws)} destroy entropy"]
        if self.destroys and not found:
            found = ["the laws together destroy entropy"]
        # The exchanged amount may be less than the rounding of a body's heat content.
        roundings, scales = (self.energy_rounding, self.entropy_rounding), (self.energy_scale, self.entropy_scale)
        energy, entropy = (
            np.maximum(worst - rounding, 0) / (scale if scale > 0 else 1.0)
            for worst, rounding, scale in zip(self._worst, roundings, scales, strict=True)
        )
        open_balances = (("energy", energy), ("entropy", entropy), ("sites", self.site_error))
        limit = OPEN_BALANCE * max(self.rtol, TIGHTEST_JUDGED)
        found += [
            f"the balance of {name} is open by {error:.1e}" for name, error in open_balances if not error <= limit
        ]
        return tuple(found)


def resolved(worst: Any, scale: Any, stored: Any, rounding: Any) -> Any:
    """Return the largest residual, of one run or of many, relative to the exchanged amount; if that is lost in the last
    digits of the stored one, relative to the latter.
    """
    unresolved = (worst <= rounding) & (ROUNDED_PART * scale <= rounding)
    size = np.where(unresolved, np.maximum(scale, stored), scale)
    return worst / np.where(size > 0, size, 1.0)


def residuals(totals: Sequence[Total], values: Any, ledger: Array) -> list[tuple[Array, Any]]:
    """Return the residuals of the balances of totals at the outputs of one run or of many, and the largest amounts
    exchanged up to then.

    ``values`` has the totals and their parts [..., times] by column, ``ledger`` the accounts [..., times, accounts].
    """
    # NumPy is slow with a few numbers in each of many rows, not with a few rows of many.
    accounts, found = np.moveaxis(ledger, -1, 0), []
    for (whole, *parts), own, booked in totals:
        amounts = np.array([values[whole], *[accounts[j] for j in own], *[values[j] for j in parts]])
        # Transitions at the very start are booked before the first output.
        amounts -= amounts[..., :1].copy()
        residual = amounts[0] - amounts[1 : 1 + booked].sum(axis=0)
        exchanged = np.abs(amounts[1:]).max(axis=0, initial=0.0)
        found.append((residual, np.ascontiguousarray(exchanged.T).max(axis=0, initial=0.0)))
    return found


class Balances(NamedTuple):
    """Residuals of the balances at the output times of a run, each with its largest amount exchanged up to then."""

    energy: tuple[Array, Any]
    entropy: tuple[Array, Any]
    sites: Array

    @classmethod
    def of(cls, trajectory: Trajectory) -> Balances:
        """Return the residuals along a trajectory."""
        system, ledger, values = trajectory.model.system, trajectory.result.ledger_outputs, trajectory.tables[0].T
        sites = np.zeros(len(ledger))
        for j in system.account_columns.get("bonds", ()):
            bonds = values[system.variable_columns[system.ledger[j].law]]
            sites = np.maximum(sites, np.abs(bonds - bonds[:1] - (ledger[:, j] - ledger[:1, j])))
        energy, entropy = residuals(system.totals, values, ledger)
        return cls(energy, entropy, sites)


def audit(trajectory: Trajectory) -> Audit:
    """Audit a trajectory."""
    model, result, steps = trajectory.model, trajectory.result, trajectory.result.steps
    system, (energies, *_) = model.system, model.system.totals
    (energy, exchanged), (entropy, turned), sites = Balances.of(trajectory)
    energy_scale, entropy_scale = float(exchanged), float(turned)
    if steps:  # a brief load may come and go between outputs; the ends of steps resolve it
        energy_scale = max(energy_scale, largest(steps.ledger[:, energies.accounts]))
    both = [total.variables[0] for total in system.totals]
    E, S = np.abs(trajectory.tables[0][:, both]).max(axis=0, initial=0.0).tolist()
    energy_stored = max(trajectory.roundings["E_total"] / EPS, E)
    entropy_stored = max(trajectory.roundings["S_total"] / EPS, entropy_scale, S)
    roundings, untimed = LAST_DIGITS, 0.0
    if steps and len(steps.t):
        roundings += len(steps.t)
        if system.energy_has_histories:  # a steep one is known only to within the last digits of time
            later = model.evaluate(result, steps.t * (1 + EPS), steps.y, steps.ydot, steps.segment)
            untimed = largest(later[:, system.output_columns["E_total"]] - trajectory.tables[1][:, both[0]])
    rounding = EPS * energy_stored * roundings + untimed
    left = largest(energy)
    if left > rounding + OPEN_BALANCE * TIGHTEST_JUDGED * energy_scale:
        # Tractions of a spring gap without load are differences of large ones: their work is an error.
        errors = _exchanged_by_errors(trajectory)
        if left <= errors and ROUNDED_PART * energy_scale <= errors:
            rounding, energy_stored = errors, max(energy_stored, errors / (ERROR_MARGIN * trajectory.run.rtol))
    least = least_productions(trajectory)
    return Audit(
        energy=energy,
        entropy=entropy,
        sites=sites,
        energy_scale=energy_scale,
        entropy_scale=entropy_scale,
        rtol=trajectory.run.rtol,
        energy_stored=energy_stored,
        entropy_stored=entropy_stored,
        energy_rounding=rounding,
        entropy_rounding=EPS * entropy_stored * roundings,
        least=least,
        losses=partial(_losses, trajectory, least, entropy_stored),
    )


def least_productions(trajectory: Trajectory) -> dict[str, float]:
    """Return the least entropy production of each law over outputs and steps."""
    least, system, within = {}, trajectory.model.system, trajectory.within_bounds
    for law in (system.ledger[j].law for j in system.account_columns.get("entropy production", ())):
        rates = within.everywhere(f"sigma_{law}")
        if len(rates):
            past = _is_past_its_end(trajectory, rates[-1]) and len(rates) > 1
            least[law] = float((rates[:-1] if past else rates).min())
    return least


def _is_past_its_end(trajectory: Trajectory, value: float) -> bool:
    """True if the last point does not count for a law's production, since the run stopped at the end of the law.

    There the production has no value, or the point is at the same instant as the one before it, by roundoff on either
    side.
    """
    steps = trajectory.result.steps
    at_once = ERROR_MARGIN * trajectory.run.rtol
    brief = steps is not None and len(steps.t) > 1 and bool(steps.t[-1] - steps.t[-2] <= at_once * steps.t[-1])
    return trajectory.status == "stopped" and (brief or not np.isfinite(value))


def _losses(trajectory: Trajectory, least: Mapping[str, float], stored: float) -> tuple[Mapping[str, float], float]:
    """Return the fraction that each law destroys, and the fraction that all destroy together."""
    laws = [law for law, low in least.items() if not low >= 0]
    destroyed = _destroyed(trajectory, [[law] for law in laws], stored)
    together = _destroyed(trajectory, [list(least)], stored) if any(destroyed) else [0.0]
    return dict.fromkeys(least, 0.0) | dict(zip(laws, destroyed, strict=True)), together[0]


def _destroyed(trajectory: Trajectory, groups: list[list[str]], stored: float) -> list[float]:
    """Return the fraction of the entropy turned over by each group of laws that the group destroys, by the ledger or at
    the ends of steps.

    Zero if the amount is less than the last digit of the total, which it then does not change.
    """
    if not groups:
        return []
    points, system = _steps(trajectory), trajectory.model.system
    booked, seen, digits = np.array([_turned_over(trajectory, points, laws) for laws in groups]).swapaxes(0, 1)
    amounts, wholes = losses_of(booked, seen)
    left = np.flatnonzero(~(amounts <= ERROR_MARGIN * trajectory.run.rtol * wholes))
    destroyed, booked, seen = np.zeros(len(groups)), booked[left], seen[left]
    if not len(left):
        return destroyed.tolist()
    outputs = [[system.output_columns[f"sigma_{law}"] for law in groups[g]] for g in left]
    chosen = np.flatnonzero(((booked < 0) | (seen < 0)).any(axis=0))
    for rounded in _rounding_of(trajectory, points, trajectory.model.output_function, outputs, chosen):
        amounts, wholes = losses_of(booked, seen, rounded * np.diff(points.t) + digits[left])
        destroyed[left] = np.divide(amounts, wholes, out=np.zeros(len(left)), where=wholes != 0)
        destroyed[left[amounts <= EPS * stored]] = 0.0
        if not destroyed.any():
            break
    return destroyed.tolist()


def _turned_over(trajectory: Trajectory, points: Points, laws: list[str]) -> tuple[Array, Array, Array]:
    """Return the entropy that laws produce in each step, by the ledger and by its end, and the ledger's last digits."""
    result, ledger, accounts = trajectory.result, points.ledger.copy(), trajectory.model.system.ledger
    made = [trajectory.within_bounds.everywhere(f"sigma_{law}")[-len(points.t) :] for law in laws]
    rates = np.array(made).sum(axis=0)
    if len(rates) > 1 and _is_past_its_end(trajectory, rates[-1] + ledger[-1].sum()):
        rates[-1], ledger[-1] = 0.0, ledger[-2]
    columns = [j for j, a in enumerate(accounts) if a.kind == "entropy production" and a.law in laws]
    # The production at the end of a step stands for the step, except for the first of an arc: it may jump between arcs.
    first = np.diff(result.segments_at(points.t, points.segment)) > 0
    digits = EPS * np.abs(ledger).sum(axis=1)
    seen = rates[1:] * np.where(first, 0.0, np.diff(points.t))
    return np.diff(ledger[:, columns].sum(axis=1)), seen, digits[1:] + digits[:-1]


def _steps(trajectory: Trajectory) -> Points:
    """Return the ends of the steps of a run, or its outputs if steps were not recorded."""
    result = trajectory.result
    if result.steps is not None and len(result.steps.t) > 1:
        return result.steps
    return Points(result.times, result.outputs, trajectory.rates, result.ledger_outputs, segment=result.segment)


def _exchanged_by_errors(trajectory: Trajectory) -> float:
    """Return the energy that errors within the tolerance of the states would exchange over all steps [J/m^2]."""
    ledger, points, (energies, *_) = trajectory.model.program.ledger, _steps(trajectory), trajectory.model.system.totals
    if ledger is None or len(points.t) < 2:
        return 0.0
    powers = next(_rounding_of(trajectory, points, ledger, [energies.accounts], np.arange(len(points.t) - 1)))
    return float(powers[0] @ np.diff(points.t))


def _rounding_of(
    trajectory: Trajectory, points: Points, function: Function, groups: list[list[int]], chosen: NDArray[np.int64]
) -> Iterator[Array]:
    """Yield the rounding of the sum of each group of columns of a function, the production of laws for instance, in
    chosen steps, shape (groups, steps).

    It is the change at the ends of a step by the last digits of all arguments, and by errors of the states within the
    tolerance. First by arguments of cheap evaluations, then one by one by those for which surroundings have to be
    asked.
    """
    model, result = trajectory.model, trajectory.result
    ends = np.union1d(chosen, chosen + 1)
    segment = None if points.segment is None else points.segment[ends]
    rows = model.inputs(result, points.t[ends], points.y[ends], points.ydot[ends], segment)
    n, part, least = len(model.system.states), np.full(rows.shape[1], EPS), np.zeros(rows.shape[1])
    part[1 : 1 + 2 * n] = max(EPS, ERROR_MARGIN * trajectory.run.rtol)
    least[1 : 1 + n] = ERROR_MARGIN * result.problem.atol
    external, filled = model.program.external, model.program.filled(rows.copy())
    read = external.reads(rows) if external else np.empty(0)
    columns = list(chain.from_iterable(groups))
    now = function(filled)[:, columns]
    found = EPS * np.abs(now)

    def change(moved: Array) -> Array:
        with np.errstate(invalid="ignore"):  # what stays infinite has changed by nothing more than its last digits
            return np.nan_to_num(np.abs(function(moved)[:, columns] - now))

    def rounding() -> Array:
        rates = np.zeros((len(groups), len(points.t)))
        parts = np.split(found, np.cumsum([len(group) for group in groups[:-1]]), axis=1)
        rates[:, ends] = [part.sum(axis=1) for part in parts]
        return np.maximum(rates[:, 1:], rates[:, :-1])

    asking = []
    for j in range(rows.shape[1]):
        if external and j in external.positions:
            continue
        moved = filled.copy()
        moved[:, j] += part[j] * np.abs(rows[:, j]) + least[j]
        if external and not np.array_equal(external.reads(moved), read):
            asking.append(moved)
        else:
            found += change(moved)
    yield rounding()
    if external:
        for moved in asking:  # only if the surroundings read the changed state
            found += change(external(moved))
            yield rounding()


def losses_of(booked: Array, seen: Array, rounded: Array | float = 0.0) -> tuple[Any, Any]:
    """Return the amounts destroyed and turned over along the last axis, by the ledger or by the ends of steps if more.

    >>> [float(x) for x in losses_of(np.array([1.0, -0.25]), np.array([0.75, -0.5]), 0.125)]
    [0.375, 1.25]
    """
    amounts = [np.maximum(-produced - rounded, 0.0).sum(axis=-1) for produced in (booked, seen)]
    wholes = [np.abs(produced).sum(axis=-1) for produced in (booked, seen)]
    return np.maximum(*amounts), np.maximum(*wholes)


def largest(values: Any) -> float:
    """Return the largest absolute value; zero for an empty array."""
    return float(np.max(np.abs(values), initial=0.0))


LOST_FLUX = NEGLIGIBLE / 10
"""Relative change of a flux by the last bit of a temperature, above which the flux is lost: of four digits none is
certain. It is relative to the largest flux.
"""

LARGE_ERROR, MISSED_BY = 1e-2, 10
"""Relative error above which there is a warning, and multiple of the requested accuracy that is allowed without one."""

ROUNDED_DEPARTURE = NEGLIGIBLE
"""Departures below this are rounding of published numbers."""


class BalanceVerdict(NamedTuple):
    """Range of ln(k_f/k_r) - ln K(g, T) along a run, and whether the pair of rates always produced entropy."""

    title: str
    low: float
    high: float
    dissipates: bool

    @property
    def largest(self) -> float:
        """Largest departure."""
        return max(abs(self.low), abs(self.high))

    @property
    def consistent(self) -> bool:
        """True if the rates satisfy detailed balance, up to rounding of their parameters."""
        return self.largest <= ROUNDED_DEPARTURE

    def __str__(self) -> str:
        """Return the verdict in words."""
        entropy = "entropy production stayed positive" if self.dissipates else "it DESTROYED ENTROPY"
        return f"{self.title}: {in_words(self.low, self.high)}; {entropy}"


def in_words(low: float, high: float) -> str:
    """Describe a range of departures.

    >>> in_words(-2.3, 0.0)
    'k_f/k_r departs from the equilibrium constant K(g, T) by a factor exp(-2.3) at most'
    """
    worst = low if abs(low) > abs(high) else high
    if not math.isfinite(worst):
        return "one of the two never runs, so that k_f/k_r is not K(g, T)"
    if abs(worst) <= ROUNDED_DEPARTURE:
        return f"k_f/k_r is K(g, T) to within {abs(worst):.1e}"
    return f"k_f/k_r departs from the equilibrium constant K(g, T) by a factor exp({worst:.3g}) at most"


def verdicts(trajectory: Trajectory, audit: Audit) -> tuple[BalanceVerdict, ...]:
    """Return the verdict on each pair of rates, over all outputs and steps."""
    ranges = trajectory.ranges  # a run that ends at its start has none
    pairs = trajectory.model.system.notes_of(RatePair) if ranges else ()
    lawful = [pair.law not in audit.violations for pair in pairs]
    return tuple(BalanceVerdict(p.title, *ranges[p.departure], own) for p, own in zip(pairs, lawful, strict=True))


def findings(trajectory: Trajectory, found: Accuracy | None) -> Iterator[str]:
    """Yield all findings except the verdicts, in words."""
    system, rows = trajectory.model.system, np.empty((0, 0))
    if system.capped_laws or system.cautions[0]:  # arguments of compiled functions at outputs and steps
        model, result, steps = trajectory.model, trajectory.result, trajectory.result.steps
        rows = model.inputs(result, result.times, result.outputs, trajectory.rates, result.segment)
        if steps is not None:
            rows = np.concatenate([rows, model.inputs(result, steps.t, steps.y, steps.ydot, steps.segment)])
    yield from extrapolations(system, trajectory.ranges, trajectory.values)
    for law, exponents in system.capped_laws if len(rows) else ():
        largest = float(np.nanmax(exponents(rows), initial=-np.inf))
        if largest > EXPONENT_CAP:
            reached = f"{law.title}: the logarithm of its rate coefficient (SI) reached {largest:.4g}"
            tangent = "the rate goes on along its tangent: it is instantaneous, but not the one stated"
            yield f"{reached}; above {EXPONENT_CAP:g} {tangent}"
    yield from active_cautions(system, rows)
    yield from _lost_fluxes(trajectory)
    # An error that is unknown, well beyond the requested accuracy, or too large for a result.
    if found is not None and math.isnan(found.error) and trajectory.status == "finished":
        yield f"the error is not known: {found.source.partition(': ')[2]}"
    elif found is not None and found.error > (LARGE_ERROR if found.asked is None else MISSED_BY * found.asked):
        wanted = "" if found.asked is None else f", where {found.asked:.0e} was asked"
        worst = max(found.variables, key=lambda name: found.variables[name], default="the result")
        yield f"the error of {worst} is {found.error:.1e}{wanted}"


def active_cautions(system: System, rows: NDArray[np.float64]) -> list[str]:
    """Return the cautions that apply at one of the states, given as arguments of compiled functions."""
    cautions, function = system.cautions
    if not (cautions and len(rows)):
        return []
    values = function(rows).reshape(len(rows), -1)
    least, size = np.nanmin(values, axis=0), np.nanmax(np.abs(values), axis=0)
    return [item.text for item, x in zip(cautions, least < -RUN_EPS * size, strict=True) if x]


def _lost_fluxes(trajectory: Trajectory) -> list[str]:
    """Return a warning about fluxes through conductances so large that the temperature difference is roundoff."""
    fluxes = {name: size for name, size in trajectory.roundings.items() if name.startswith("q_")}
    sizes = {name: max(-low, high) for name, (low, high) in trajectory.ranges.items()}
    most, duration = max((sizes.get(name, 0.0) for name in fluxes), default=0.0), trajectory.result.t
    # Heat that roundoff carries over the whole run is compared with the heat content, independent of its zero.
    content = trajectory.roundings.get("E_total", 0.0) / EPS
    least = ERROR_FLOOR * max(sizes.get("E_total", 0.0), content)
    lost = [name for name, size in fluxes.items() if size > LOST_FLUX * most and size * duration > least]
    advice = "let the two share one temperature, or use the heat_into variables, which are exact"
    return [f"{', '.join(lost)}: lost to rounding, as the conductance is very large; {advice}"] if lost else []


def extrapolations(system: System, ranges: Mapping[str, tuple[float, float]], values: Mapping[str, float]) -> list[str]:
    """Return warnings about laws that are used outside their range.

    ``ranges`` are the least and largest values by name, ``values`` those of the parameters by path.
    """
    found = []
    numbers = {item.symbol: values[item.path] for item in system.parameters if item.path in values}
    for limit in system.notes_of(Range):
        low, high = ranges.get(limit.variable, (math.inf, -math.inf))
        least, most = (float(without(end, numbers)) for end in (limit.low, limit.high))
        rounding = RUN_EPS * max(abs(low), abs(high))
        if low < least - rounding or high > most + rounding:
            span = f"{limit.variable} ran from {low:.6g} to {high:.6g}"
            found.append(f"{limit.law} is an extrapolation: {span}, its range is {least:g} to {most:g}")
    return found
