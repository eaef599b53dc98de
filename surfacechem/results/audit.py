"""Energy, entropy and sites along a run, against what the ledger says they should be.

The equations satisfy both laws of thermodynamics as they stand, so the residuals measure the integration. A law that
dissipates less than nothing shows in ``least``.

Source: Sauer, Duong & Mandadapu (2021), sections 3.3, 3.4 and 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.solve.contract import Points
from surfacechem.solve.run import Trajectory

Array = NDArray[np.float64]

OPEN = 1e-6
"""Relative residual above which a balance counts as open at tolerances up to 1e-9; more at looser ones."""

EPSILON = float(np.finfo(float).eps)
ROUNDINGS = 10
"""Number of last digits that add up in a balance, beside one a step."""

UNRESOLVED = 1e-2
"""An exchange of which rounding may be this part, or more, is not resolved."""

SLACK = 10.0
"""So many tolerances of what a law turns over, and of the states on which its production depends, are error of the
integration."""


@dataclass(frozen=True)
class Audit:
    """Residuals of the balances at the output times and the least dissipation of each law."""

    energy: Array
    """Total energy minus what was supplied since the start [J/m^2], shape (times,)."""
    entropy: Array
    """Total entropy minus what was supplied and produced since the start [J/(m^2 K)], shape (times,)."""
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
    """Energy that the last digits of the states stand for over all steps [J/m^2]."""
    entropy_rounding: float
    """Entropy that the last digits of the states stand for over all steps [J/(m^2 K)]."""
    least: Mapping[str, float]
    """Least entropy production of each dissipative law over all steps and outputs [W/(m^2 K)]."""
    destroyed: Mapping[str, float]
    """Part of what each dissipative law turns over that it destroys, beyond rounding; nothing where that is less than
    the last digit of the total."""
    destroyed_together: float
    """The same of all laws together."""

    @property
    def energy_error(self) -> float:
        """Largest energy residual, relative to the energy exchanged, or to that stored where it is no more than its
        rounding.
        """
        return _resolved(self.energy, self.energy_scale, self.energy_stored, self.energy_rounding)

    @property
    def entropy_error(self) -> float:
        """Largest entropy residual, relative to that exchanged or produced, or to that stored where it is no more than
        its rounding.
        """
        return _resolved(self.entropy, self.entropy_scale, self.entropy_stored, self.entropy_rounding)

    @property
    def site_error(self) -> float:
        """Largest site residual."""
        return float(np.max(np.abs(self.sites), initial=0.0))

    @cached_property
    def violations(self) -> tuple[str, ...]:
        """Laws that destroyed entropy beyond the tolerance of the run, or whose production is not a number."""
        most = SLACK * self.rtol
        return tuple(law for law, low in self.least.items() if not (low >= 0 or self.destroyed[law] <= most))

    @property
    def destroys(self) -> bool:
        """Whether a law destroyed entropy, or all of them together did."""
        return bool(self.violations) or not self.destroyed_together <= SLACK * self.rtol

    @cached_property
    def findings(self) -> tuple[str, ...]:
        """What is wrong with the balances, in words; nothing, as a rule."""
        found = [f"the law {law.replace('_', ' ')} destroys entropy" for law in self.violations]
        if self.destroys and not found:
            found = ["the laws together destroy entropy"]
        # What is exchanged may be less than the rounding of a body's heat content.
        known = _relative(np.maximum(np.abs(self.energy) - self.energy_rounding, 0), self.energy_scale)
        open_balances = (("energy", known), ("sites", self.site_error))
        limit = max(OPEN, OPEN * self.rtol / 1e-9)
        found += [
            f"the balance of {name} is open by {error:.1e}" for name, error in open_balances if not error <= limit
        ]
        return tuple(found)


def _relative(residual: Array, scale: float) -> float:
    worst = float(np.max(np.abs(residual), initial=0.0))
    return worst / scale if scale > 0 else worst


def _resolved(residual: Array, scale: float, stored: float, rounding: float) -> float:
    """Relative residual; where what was exchanged is lost in the last digits of what is stored, relative to this."""
    unresolved = float(np.max(np.abs(residual), initial=0.0)) <= rounding and UNRESOLVED * scale <= rounding
    return _relative(residual, max(scale, stored) if unresolved else scale)


def audit(trajectory: Trajectory) -> Audit:
    """Audit of a trajectory."""
    return _Books(trajectory).audit()


class _Books:
    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        self.system = trajectory.model.system
        self.names = [item.name for item in self.system.outputs]
        ledger = trajectory.result.ledger_outputs
        # Transitions at the very start come before the first output.
        self.ledger = ledger - ledger[:1]
        self.outputs = trajectory.outputs

    def column(self, name: str) -> Array:
        return self.outputs[:, self.names.index(name)]

    def booked(self, kind: str) -> Array:
        """Ledger columns of a kind, shape (times, accounts)."""
        columns = [j for j, account in enumerate(self.system.ledger) if account.kind == kind]
        return self.ledger[:, columns]

    def between(self) -> Array:
        """Energies supplied and dissipated by the ends of the steps: a brief load may come and go between outputs."""
        steps = self.trajectory.result.steps
        kinds = ("energy supply", "dissipation")
        columns = [j for j, account in enumerate(self.system.ledger) if account.kind in kinds]
        return np.zeros((0, 0)) if steps is None else steps.ledger[:, columns]

    def rounding(self) -> float:
        """Rounding of the total energy at each step, added up, and that of the time in which work was done."""
        return EPSILON * self.energy_stored * self.roundings + self._untimed()

    @cached_property
    def energy_stored(self) -> float:
        """Largest energy in the total, or behind the rounding of its terms [J/m^2]."""
        return max(self.trajectory.roundings["E_total"] / EPSILON, _largest([self.column("E_total")]))

    @cached_property
    def entropy_stored(self) -> float:
        """Largest entropy in the total, or behind the rounding of its terms [J/(m^2 K)]."""
        return max(self.trajectory.roundings["S_total"] / EPSILON, self.turned, _largest([self.column("S_total")]))

    def _untimed(self) -> float:
        """Energy within the last digits of time: of a history that is steep in it no more is known."""
        steps, model, result = self.trajectory.result.steps, self.trajectory.model, self.trajectory.result
        if steps is None or not len(steps.t):
            return 0.0
        later = model.evaluate(result, steps.t * (1 + EPSILON), steps.y, steps.ydot, steps.segment)
        now = self.trajectory.everywhere["E_total"][len(result.times) :]
        return _largest([later[:, self.names.index("E_total")] - now])

    @cached_property
    def roundings(self) -> int:
        """Number of last digits that add up."""
        steps = self.trajectory.result.steps
        return ROUNDINGS + (0 if steps is None else len(steps.t))

    @cached_property
    def turned(self) -> float:
        """Largest entropy that was exchanged or produced [J/(m^2 K)]."""
        return _largest([self.changes("S_"), self.booked("entropy supply"), self.booked("entropy production")])

    @cached_property
    def entropy_rounding(self) -> float:
        """Rounding of the total entropy at each step, added up [J/(m^2 K)]."""
        return EPSILON * self.entropy_stored * self.roundings

    def changes(self, prefix: str) -> Array:
        """Changes of the named totals since the start, shape (times, totals)."""
        columns = [j for j, name in enumerate(self.names) if name.startswith(prefix) and name[2:] in ("1", "2", "c")]
        return self.outputs[:, columns] - self.outputs[:1, columns]

    def residual(self, total: str, kinds: tuple[str, ...]) -> Array:
        residual = self.column(total) - self.column(total)[:1]
        for kind in kinds:
            residual = residual - self.booked(kind).sum(axis=1)
        return residual

    def audit(self) -> Audit:
        exchanged = [self.changes("U_"), self.booked("energy supply"), self.booked("dissipation"), self.between()]
        least, destroyed, together = self.production()
        return Audit(
            energy=self.residual("E_total", ("energy supply",)),
            entropy=self.residual("S_total", ("entropy supply", "entropy production")),
            sites=self.sites(),
            energy_scale=_largest(exchanged),
            entropy_scale=self.turned,
            rtol=self.trajectory.run.rtol,
            energy_stored=self.energy_stored,
            entropy_stored=self.entropy_stored,
            energy_rounding=self.rounding(),
            entropy_rounding=self.entropy_rounding,
            least=least,
            destroyed=destroyed,
            destroyed_together=together,
        )

    def sites(self) -> Array:
        accounts = [(j, a.law) for j, a in enumerate(self.system.ledger) if a.kind == "bonds"]
        states = [state.name for state in self.system.states]
        y = self.trajectory.result.outputs
        residuals = np.zeros((len(y), 1 + len(accounts)))
        for k, (j, name) in enumerate(accounts):
            bonds = y[:, states.index(name)] if name in states else self.column(name)
            residuals[:, k] = np.abs(bonds - bonds[:1] - self.ledger[:, j])
        return np.asarray(residuals.max(axis=1))

    def production(self) -> tuple[dict[str, float], dict[str, float], float]:
        """Least entropy production of each law over outputs and steps, and the part that it destroys, and all do."""
        values = self.trajectory.within_bounds
        laws = [a.law for a in self.system.ledger if a.kind == "entropy production"]
        columns = {law: self._before_end(values[f"sigma_{law}"]) for law in laws if len(values.get(f"sigma_{law}", ()))}
        least = {law: float(column.min()) for law, column in columns.items()}
        destroyed = {law: 0.0 if low >= 0 else self._destroyed([law]) for law, low in least.items()}
        together = self._destroyed(list(columns)) if any(destroyed.values()) else 0.0
        return least, destroyed, together

    def _destroyed(self, laws: list[str]) -> float:
        """Part of the entropy that laws turn over together that they destroy, by the ledger or at the ends of steps.

        Nothing where it is less than the last digit of the total, which then is the same with it and without.
        """
        points, ledger = self._points, self._points.ledger.copy()
        rates = np.array([self.trajectory.within_bounds[f"sigma_{law}"][-len(points.t) :] for law in laws]).sum(axis=0)
        if self.trajectory.status == "stopped":  # a law that ends there may have no value
            rates[-1:] = np.nan_to_num(rates[-1:], posinf=0.0, neginf=0.0)
            ledger[-1:] = np.where(np.isfinite(ledger[-1:]), ledger[-1:], ledger[-2:-1])
        booked = np.diff(ledger[:, [self._account(law) for law in laws]].sum(axis=1))
        seen = rates[1:] * self._lengths
        amount, whole = lost(booked, seen)
        if amount <= SLACK * self.trajectory.run.rtol * whole:
            return 0.0
        rounded = self._rounding_of(laws, np.flatnonzero((booked < 0) | (seen < 0)), len(booked))
        digits = EPSILON * np.abs(ledger).sum(axis=1)
        amount, whole = lost(booked, seen, rounded * np.diff(points.t) + digits[1:] + digits[:-1])
        return 0.0 if amount <= EPSILON * self.entropy_stored else _share(float(amount), float(whole))

    @cached_property
    def _points(self) -> Points:
        """The steps, where they are known, else the outputs."""
        result, rates = self.trajectory.result, self.trajectory.rates
        if result.steps is not None and len(result.steps.t) > 1:
            return result.steps
        return Points(result.times, result.outputs, rates, result.ledger_outputs, segment=result.segment)

    @cached_property
    def _lengths(self) -> Array:
        """Lengths of the steps whose ends tell of them: where a stretch ends production may jump."""
        result, points = self.trajectory.result, self._points
        return np.where(np.diff(result.segments_at(points.t, points.segment)) > 0, 0.0, np.diff(points.t))

    def _account(self, law: str) -> int:
        """Column of the ledger that holds the entropy that a law has produced."""
        accounts = enumerate(self.system.ledger)
        return next(j for j, a in accounts if a.kind == "entropy production" and a.law == law)

    def _rounding_of(self, laws: list[str], chosen: NDArray[np.int64], count: int) -> Array:
        """What is rounded of the production of laws during chosen ones of so many steps [W/(m^2 K)]: by how much last
        digits of all that it depends on change it at the ends of a step, and errors within the tolerance of the states.
        """
        model, result, points = self.trajectory.model, self.trajectory.result, self._points
        ends = np.union1d(chosen, chosen + 1)
        segment = None if points.segment is None else points.segment[ends]
        rows = model.inputs(result, points.t[ends], points.y[ends], points.ydot[ends], segment)
        columns = [self.names.index(f"sigma_{law}") for law in laws]
        n, known = len(self.system.states), max(EPSILON, SLACK * self.trajectory.run.rtol)
        part = np.full(rows.shape[1], EPSILON)
        part[1 : 1 + 2 * n] = known
        least = np.zeros(rows.shape[1])
        least[1 : 1 + n] = SLACK * result.problem.atol
        filler, filled = model.program.filler, model.program.filled(rows.copy())
        read = filler.reads(rows) if filler else None
        now = model.output_function(filled)[:, columns]
        found = EPSILON * np.abs(now)
        for j in range(rows.shape[1]):
            if filler and j in filler.positions:
                continue
            moved = filled.copy()
            moved[:, j] += part[j] * np.abs(rows[:, j]) + least[j]
            if filler and not np.array_equal(filler.reads(moved), read):  # asking what is outside is slow
                moved = filler(moved)
            then = model.output_function(moved)[:, columns]
            found += np.nan_to_num(np.abs(then - now))
        rates = np.zeros(count + 1)
        rates[ends] = found.sum(axis=1)
        return np.maximum(rates[1:], rates[:-1])

    def _before_end(self, values: Array) -> Array:
        """The values but for that of the last step, where a law that ends there may have none."""
        ended = self.trajectory.status == "stopped" and len(values) > 1 and not np.isfinite(values[-1])
        return values[:-1] if ended else values


def lost(booked: Array, seen: Array, rounded: Array | float = 0.0) -> tuple[Any, Any]:
    """What is destroyed and what is turned over along the last axis: by the ledger, or at the ends of the steps if that
    is more.

    >>> [float(x) for x in lost(np.array([1.0, -0.25]), np.array([0.75, -0.5]), 0.125)]
    [0.375, 1.25]
    """
    amounts = [np.maximum(-produced - rounded, 0.0).sum(axis=-1) for produced in (booked, seen)]
    wholes = [np.abs(produced).sum(axis=-1) for produced in (booked, seen)]
    return np.maximum(*amounts), np.maximum(*wholes)


def _share(part: float, whole: float) -> float:
    return part / whole if whole != 0 else 0.0


def _largest(columns: list[Array]) -> float:
    return max((float(np.max(np.abs(c), initial=0.0)) for c in columns), default=0.0)
