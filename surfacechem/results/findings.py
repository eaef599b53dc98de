"""Findings on a run for its reader, in words, in addition to its balances and events.

They are about pairs of rates that contradict the equilibrium of the potential, rates too fast to be resolved, laws
outside their validity or range, and fluxes and errors that make a result meaningless.

Where the interface is in equilibrium every reaction runs as often forward as back, so that k_f/k_r is the equilibrium
constant K(g, T), including the elastic energy of the bonds. A reversible law satisfies this by construction; two
one-way laws do so only if their parameters agree.

Source: Onsager (1931), Phys. Rev. 37, 405 (detailed balance); Sauer, Duong & Mandadapu (2021), section 4.3 (entropy).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.expressions import EXPONENT_CAP
from surfacechem.model.system import CappedLaw, Caution, Range, RatePair, System
from surfacechem.results.accuracy import Accuracy
from surfacechem.results.audit import Audit, largest
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import EPS, ERROR_FLOOR, NEGLIGIBLE, RUN_EPS

LOST_FLUX = NEGLIGIBLE / 10
"""Relative change of a flux by the last bit of a temperature, above which the flux is lost: of four digits none is
certain. It is relative to the largest flux.
"""

LARGE_ERROR, MISSED_BY = 1e-2, 10
"""Relative error above which there is a warning, and multiple of the requested accuracy that is allowed without one."""

ROUNDED_DEPARTURE = NEGLIGIBLE
"""Departures below this are rounding of published numbers."""


@dataclass(frozen=True)
class BalanceVerdict:
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
    found = []
    for pair in trajectory.model.system.notes_of(RatePair):
        values = trajectory.everywhere(pair.departure)
        if len(values):  # a run that ends at its start has none
            low, high = float(np.min(values)), float(np.max(values))
            found.append(BalanceVerdict(pair.title, low, high, pair.law not in audit.violations))
    return tuple(found)


def findings(trajectory: Trajectory, accuracy: Accuracy | None) -> list[str]:
    """Return all findings except the verdicts, in words."""
    system, rows = trajectory.model.system, np.empty((0, 0))
    if [*system.notes_of(CappedLaw), *system.notes_of(Caution)]:  # arguments of compiled functions at outputs and steps
        model, result, steps = trajectory.model, trajectory.result, trajectory.result.steps
        rows = model.inputs(result, result.times, result.outputs, trajectory.rates, result.segment)
        if steps is not None:
            rows = np.concatenate([rows, model.inputs(result, steps.t, steps.y, steps.ydot, steps.segment)])
    return [
        *_extrapolations(trajectory),
        *_capped_rates(system, rows),
        *active_cautions(system, rows),
        *_lost_fluxes(trajectory),
        *_inaccurate(trajectory, accuracy),
    ]


def _capped_rates(system: System, rows: NDArray[np.float64]) -> list[str]:
    """Return warnings about laws whose rate exceeded exp(EXPONENT_CAP) at one of the states."""
    found = []
    for law in system.notes_of(CappedLaw) if len(rows) else ():
        # Interpreted rather than compiled, since they are needed once.
        exponents = [system.expand(expression) for expression in law.exponents]
        values = symengine.Lambdify(system.inputs, exponents, backend="lambda")(rows)
        largest = float(np.nanmax(values, initial=-np.inf))
        if largest > EXPONENT_CAP:
            found.append(
                f"{law.title}: the logarithm of its rate coefficient (SI) reached {largest:.4g}; above "
                f"{EXPONENT_CAP:g} the rate goes on along its tangent: it is instantaneous, but not the one stated"
            )
    return found


def active_cautions(system: System, rows: NDArray[np.float64]) -> list[str]:
    """Return the cautions that apply at one of the states, given as arguments of compiled functions."""
    cautions = system.notes_of(Caution)
    if not (cautions and len(rows)):
        return []
    expressions = [system.expand(item.expression) for item in cautions]
    values = symengine.Lambdify(system.inputs, expressions, backend="lambda")(rows).reshape(len(rows), -1)
    least, size = np.nanmin(values, axis=0), np.nanmax(np.abs(values), axis=0)
    return [item.text for item, x in zip(cautions, least < -RUN_EPS * size, strict=True) if x]


def _inaccurate(trajectory: Trajectory, found: Accuracy | None) -> list[str]:
    """Return a warning of an error that is unknown, well beyond the requested accuracy, or too large for a result."""
    if found is not None and math.isnan(found.error) and trajectory.status == "finished":
        return [f"the error is not known: {found.source.partition(': ')[2]}"]
    if found is None or not found.error > (LARGE_ERROR if found.asked is None else MISSED_BY * found.asked):
        return []
    wanted = "" if found.asked is None else f", where {found.asked:.0e} was asked"
    worst = max(found.variables, key=lambda name: found.variables[name], default="the result")
    return [f"the error of {worst} is {found.error:.1e}{wanted}"]


def _lost_fluxes(trajectory: Trajectory) -> list[str]:
    """Return a warning about fluxes through conductances so large that the temperature difference is roundoff."""
    fluxes = {name: size for name, size in trajectory.roundings.items() if name.startswith("q_")}
    everywhere, duration = trajectory.everywhere, trajectory.result.t
    most = max((largest(everywhere(name)) for name in fluxes), default=0.0)
    # Heat that roundoff carries over the whole run is compared with the heat content, independent of its zero.
    content = trajectory.roundings.get("E_total", 0.0) / EPS
    least = ERROR_FLOOR * max(largest(everywhere("E_total")), content)
    lost = [name for name, size in fluxes.items() if size > LOST_FLUX * most and size * duration > least]
    advice = "let the two share one temperature, or use the heat_into variables, which are exact"
    return [f"{', '.join(lost)}: lost to rounding, as the conductance is very large; {advice}"] if lost else []


def _extrapolations(trajectory: Trajectory) -> list[str]:
    """Return warnings about laws that the run has used outside their range."""
    found = []
    for limit in trajectory.model.system.notes_of(Range):
        values = trajectory.everywhere(limit.variable)
        low, high = float(np.min(values, initial=math.inf)), float(np.max(values, initial=-math.inf))
        rounding = RUN_EPS * max(abs(low), abs(high))
        if low < limit.low - rounding or high > limit.high + rounding:
            span = f"{limit.variable} ran from {low:.6g} to {high:.6g}"
            found.append(f"{limit.law} is an extrapolation: {span}, its range is {limit.low:g} to {limit.high:g}")
    return found
