"""Steady states of mechanisms, and the control of their rates by each reaction and by the temperature.

Source of the degree of rate control: Campbell (2017), ACS Catal. 7, 2770, doi 10.1021/acscatal.7b00115.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from surfacechem.contracts.terms import RateLaw
from surfacechem.errors import InputError, listed, refuse_unknown
from surfacechem.format import Overrides, Source
from surfacechem.model.system import System
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.runs.at_rest import refuse_histories
from surfacechem.runs.listing import Rows, Sheet
from surfacechem.runs.simulation import load
from surfacechem.scene import BondingVariable, Interface
from surfacechem.solve.adapters.evaluation import Evaluation
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Model, Run
from surfacechem.studies.mechanism_report import null_space
from surfacechem.tolerances import CBRT_EPS, CONSERVED_RATE, EPS, LINE_ERROR, LOOSE_RTOL, NEGLIGIBLE, RUN_EPS, TINY

LONGER_BY, MOST_ATTEMPTS = 10.0, 16
"""Factor by which the next attempt is longer if the steady state was not reached, and number of attempts."""

TRACE_COVERAGE = EPS**2
"""Coverage [1] below which changes are no longer relative to the coverage: the rounding of a rounding."""

LONGEST_GROWTH = -math.log(TRACE_COVERAGE)
"""Growth, as a logarithm, by which a trace comes to cover all: a run that lasts longer has left a state at rest that is
not stable, unless it began there without any disturbance."""


class SteadyState(NamedTuple):
    """Steady state of a mechanism: coverages by species, and requested rates, in SI units.

    ``control`` are degrees of rate control, d ln(rate) / d ln(factor on a reaction), by rate and reaction; they sum to
    one. ``barriers`` are apparent activation energies, R T^2 d ln(rate) / dT [J/mol], if the temperature is held.
    """

    title: str
    time: float
    """Time of a run that has reached it [s]."""
    coverages: Mapping[str, float]
    states: Mapping[str, float]
    """All other states, such as temperatures and potentials, by name."""
    rates: Mapping[str, float]
    control: Mapping[str, Mapping[str, float]]
    barriers: Mapping[str, float]
    equations: Mapping[str, str]
    """Equations of the reactions."""
    units: Mapping[str, str]
    """Units of the rates and of these states."""

    def __str__(self) -> str:
        """Return tables of coverages, rates and control."""
        names = [*self.rates]
        barriers = {name: f"apparent barrier {value / 1e3:.4g} kJ/mol" for name, value in self.barriers.items()}
        control = [
            (label, equation, *(f"{self.control[name][label]:+.4f}" for name in names))
            for label, equation in self.equations.items()
            if any(abs(self.control[name][label]) >= LINE_ERROR / 10 for name in names)
        ]
        tables: dict[str, Rows] = {
            "Coverages": [(name, f"{value:.6g}") for name, value in self.coverages.items()],
            "States": [(name, f"{value:.6g} {self.units[name]}") for name, value in self.states.items()],
            "Rates": [
                (name, f"{value:.6g} {self.units[name]}", barriers.get(name, "")) for name, value in self.rates.items()
            ],
            "Degree of rate control": [("", "", *names), *control],
        }
        shown = {title: rows for title, rows in tables.items() if rows}
        return str(Sheet(self.title, [("steady", f"after {self.time:.3g} s")], shown))


def steady(source: Source, of: Sequence[str] = (), overrides: Overrides = ()) -> SteadyState:
    """Return the steady state of a case with a mechanism, and the control of its rates.

    Parameters
    ----------
    source
        As for :func:`surfacechem.load`. Only the state may change in time.
    overrides
        As for :func:`surfacechem.load`.
    of
        Names of quantities, ``production_CO2`` for instance; by default all productions in neighbours.

    Returns
    -------
    SteadyState
        Coverages, rates, degrees of rate control and apparent barriers [J/mol]; printed as a table.

    Raises
    ------
    InputError
        If the case has a history or jumps, or reaches no steady state.
    """
    simulation = load(source, overrides)
    case = simulation.case
    with case.locating():
        system = simulation.system.with_multipliers()
        labels = system.reactions
        refuse_histories(system)
        if system.has_arcs:
            names = listed(list(dict.fromkeys(edge.name for edge in system.edges)), 4)
            message = f"the scene has jumps ({names}), so that a steady state is not the root of one set of equations."
            raise InputError(message, path="interface")
        interface = case.scene.interface
        rest = _Rest(Model(system), case.run, _wanted(system, of), interface)
        _refuse_many(rest, interface)
        if not of:
            rest.drop_small()
        rates, held = rest.rates_that_matter(), _held(system, rest.values)
        found = [*zip(rest.quantities, rest.x.tolist(), strict=True)]
    changes = np.array([rest.response([f"multiplier.{label}"]) / rates for label in labels])
    barriers = GAS_CONSTANT * rest.values[held[0]] * rest.response(held) / rates if held else np.empty(0)
    return SteadyState(
        case.title,
        rest.time,
        {q.species: x if x > TRACE_COVERAGE else 0.0 for q, x in found if q.species},
        {q.name: x for q, x in found if not q.species},
        dict(zip(rest.wanted, rates.tolist(), strict=True)),
        {
            name: dict(zip(labels, column, strict=True))
            for name, column in zip(rest.wanted, changes.T.tolist(), strict=True)
        },
        dict(zip(rest.wanted, barriers.tolist(), strict=False)),
        {label: system.find(f"R_{label}").quantity.long_name.removeprefix("net rate of ") for label in labels},
        rest.units,
    )


def _wanted(system: System, of: Sequence[str]) -> dict[str, int]:
    """Return the indices of quantities among the outputs, by name; of all productions if none is named."""
    names = system.output_columns
    refuse_unknown(of, names, "the case has no quantity '{}'")
    wanted = [*of] or [name for name in names if name.startswith("production_")]
    if not wanted:
        rate = next((name for name in names if name.startswith("R_")), "NAME")
        raise InputError(f"nothing is made in a neighbour: name the rates that matter, `--of {rate}` for instance.")
    return {name: names[name] for name in wanted}


def _conserved(coverages: Sequence[BondingVariable], reactions: Sequence[RateLaw]) -> list[dict[str, float]]:
    """Return the weights of conserved sums of coverages, by coverage: sites of each kind, a spectator species."""
    changes = [law.stoichiometry() for law in reactions]
    own = [{str(j): nu for j, change in enumerate(changes) if (nu := change.get(item.name))} for item in coverages]
    return [
        {item.name: weight * item.density for item, weight in zip(coverages, weights, strict=True) if weight}
        for weights in null_space(own)
    ]


def _taken(law: RateLaw) -> set[str]:
    """Return the names of the coverages that a reaction takes."""
    return {name for name, nu in law.stoichiometry().items() if nu < 0}


def _refuse_many(rest: _Rest, interface: Interface) -> None:
    """Raise InputError if reactions have used up a species, and the state at rest depends on what they made of it."""
    names = {q.name for q, x in zip(rest.quantities, rest.x.tolist(), strict=True) if x > TRACE_COVERAGE}
    there = [coverage for coverage in interface.variables if coverage.name in names]
    going = [law for law in interface.reactions if not (law.one_way and _taken(law) - names)]
    kept = [[weights.get(coverage.name, 0.0) for coverage in there] for weights in rest.conserved]
    if len(_conserved(there, going)) > np.linalg.matrix_rank(np.reshape(kept, (len(kept), len(there)))):
        ended = listed([law.label for law in interface.reactions if law not in going], 4)
        message = f"{ended} used up what they take, and the state at rest depends on what they had made until then."
        remedy = "Ask for the state alone, with `until: steady` under `run`."
        raise InputError(f"{message} {remedy}", path="interface.mechanism")


HELD_TEMPERATURE = re.compile(r"(bodies\..+|interface)\.temperature\.level|loading\.T\w*\.level")
"""Paths of parameters that are temperatures of bodies and interface."""


def _held(system: System, values: Mapping[str, float]) -> list[str]:
    """Return the parameters that are temperatures of bodies and interface, if all are held at the same value."""
    if any(state.is_temperature for state in system.states):
        return []
    paths = [parameter.path for parameter in system.parameters if HELD_TEMPERATURE.fullmatch(parameter.path)]
    return paths if len({values[path] for path in paths}) == 1 else []


class _Rest:
    """The equations at their steady state, with multipliers and temperatures that can be varied."""

    def __init__(self, model: Model, run: Run, wanted: dict[str, int], interface: Interface) -> None:
        self.model, self.values, self.wanted = model, model.values(), wanted
        self.conserved = _conserved(interface.variables, interface.reactions)
        self.time = run.times[-1]
        for _ in range(MOST_ATTEMPTS):
            reached = model.solve(replace(run, times=(0.0, self.time), picture=None))
            if reached.status != "finished":
                raise InputError(f"the case reaches no steady state: {reached.reason}.")
            problem = reached.result.problem
            self.evaluation = Evaluation(problem.program, reached.result.y, problem.parameters[-1])
            states = [model.system.states[j] for j in self.evaluation.free]
            self.quantities = [state.quantity for state in states]
            # Fractions, whose scale is 1, change relative to themselves down to a trace; not so a potential near zero.
            self._floor = np.array([TRACE_COVERAGE if state.scale == 1 else state.scale for state in states])
            kept = [[weights.get(quantity.name, 0.0) for quantity in self.quantities] for weights in self.conserved]
            self._conserved = np.reshape(kept, (-1, len(states)))
            found = self._root(start := reached.result.y[self.evaluation.free])
            if found is not None and np.all(np.abs(found - start) <= NEGLIGIBLE * np.abs(found) + run.rtol):
                self.x, self.largest = found, np.abs(reached.outputs).max(axis=0)
                growth = np.linalg.eigvals(self._slopes(self.rates, found) / self._sizes(found)[:, None])
                fastest = float(growth.real.max())
                grows = fastest > CONSERVED_RATE * float(np.abs(growth).max())  # beyond rounding
                if not (grows and fastest * self.time < LONGEST_GROWTH):
                    return
            self.time *= LONGER_BY
        raise InputError(f"the case did not reach a steady state within {self.time / LONGER_BY:.3g} s.")

    @property
    def units(self) -> dict[str, str]:
        """Units of the requested quantities and of all states other than coverages."""
        asked = (self.model.system.outputs[j].quantity for j in self.wanted.values())
        return {quantity.name: quantity.unit for quantity in (*asked, *self.quantities) if not quantity.species}

    def _sizes(self, x: Array) -> Array:
        """Return the sizes of the states, of which their changes are parts."""
        return np.asarray(np.abs(x) + self._floor)

    def rates(self, x: Array) -> Array:
        """Return the time derivatives of the states."""
        self.evaluation.put(0.0, x)
        return self.evaluation.ydot[self.evaluation.free].copy()

    def outputs(self, x: Array) -> Array:
        """Return the requested quantities."""
        self.evaluation.put(0.0, x)
        return np.asarray(self.model.output_function(self.evaluation.inputs)[[*self.wanted.values()]])

    def rates_that_matter(self) -> Array:
        """Return the requested quantities; InputError if one of them is zero."""
        rates = self.outputs(self.x)
        for (name, j), rate in zip(self.wanted.items(), rates, strict=True):
            if abs(rate) <= LOOSE_RTOL * self.largest[j]:
                raise InputError(f"{name} is zero at rest, so nothing controls it. Ask for what goes on there.")
        return rates

    def drop_small(self) -> None:
        """Leave out productions that are zero."""
        sizes = np.abs(self.outputs(self.x))
        kept = zip(self.wanted.items(), sizes > LOOSE_RTOL * sizes.max(), strict=True)
        self.wanted = dict(item for item, made in kept if made)

    def response(self, paths: Sequence[str]) -> Array:
        """Return the change of the quantities, including that of the state, per relative change of these parameters."""
        parameters, columns = self.evaluation.parameters, [self.model.system.parameter_columns[path] for path in paths]
        first = parameters[columns].copy()
        ends = []
        for sign in (1, -1):
            parameters[columns] = first * (1 + sign * CBRT_EPS)
            ends.append((self.rates(self.x), self.outputs(self.x)))
            parameters[columns] = first
        (up, out_up), (down, out_down) = ends
        moved = self._solve(self._slopes(self.rates, self.x), -(up - down) / (2 * CBRT_EPS), self.x)
        part = CBRT_EPS / max(float(np.max(np.abs(moved) / self._sizes(self.x))), 1.0)
        following = (self.outputs(self.x + part * moved) - self.outputs(self.x - part * moved)) / (2 * part)
        return np.asarray((out_up - out_down) / (2 * CBRT_EPS) + following)

    def _root(self, x: Array) -> Array | None:
        """Return the steady state near x by Newton's method, with the same conserved sums; None if it fails."""
        for _ in range(20):
            step = self._solve(self._slopes(self.rates, x), -self.rates(x), x)
            x = x + step
            if not np.all(np.isfinite(x)):
                return None
            if np.all(np.abs(step) <= RUN_EPS * self._sizes(x) + TRACE_COVERAGE):
                return x
        return None

    def _slopes(self, of: Callable[[Array], Array], x: Array) -> Array:
        """Return the derivatives of the rates, or of the energy, by relative changes of the states."""
        columns = []
        for j, size in enumerate(self._sizes(x)):
            step = np.zeros(len(x))
            step[j] = CBRT_EPS * size
            columns.append((of(x + step) - of(x - step)) / (2 * CBRT_EPS))
        return np.array(columns).T

    def _energy(self, x: Array) -> Array:
        """Return the total energy, if nothing supplies any, as one of no or one conserved quantities."""
        system = self.model.system
        if any(account.kind == "energy supply" for account in system.ledger):
            return np.empty(0)
        self.evaluation.put(0.0, x)
        return np.asarray(self.model.output_function(self.evaluation.inputs)[[system.output_columns["E_total"]]])

    def _solve(self, slopes: Array, right: Array, x: Array) -> Array:
        """Return the change of the state that changes the rates by ``right`` and keeps what is conserved unchanged; NaN
        where there are no rates.
        """
        sizes = self._sizes(x)
        kept = np.vstack((self._conserved * sizes, self._slopes(self._energy, x)))
        still = np.diag(~slopes.any(axis=1))  # a state that nothing moves stays what it is
        matrix = np.vstack((slopes + still, kept))
        if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(right))):
            return np.full(len(x), np.nan)
        # Rows are scaled, since rates and conserved sums differ by many decades.
        rows = np.maximum(np.abs(matrix).max(axis=1), TINY)
        found, *_ = np.linalg.lstsq(matrix / rows[:, None], np.append(right, np.zeros(len(kept))) / rows, rcond=None)
        return np.asarray(found * sizes)
