"""Cantera's ReactorNet under the contract, and the reactor that holds a system of this package in a network.

Cantera has one absolute tolerance for all variables, so variables of unlike tolerances are given in units of
these. Values inside the last step come from the integrator's polynomial, whose derivatives it provides at its end.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any, NoReturn, Self

import cantera
import numpy as np

from surfacechem.errors import InputError, refuse_unknown
from surfacechem.solve.adapters.dense_step import DenseStep, Steps, at_nodes, hermite, on_step
from surfacechem.solve.adapters.stepping import MOST_TOGETHER, Method, StepError, SteppingSolver, View
from surfacechem.solve.contract import Array, Counters
from surfacechem.tolerances import FORMULA_EPS, TINY

NAMES = ("cantera",)

LEDGER_UNIT = 1e100
"""Unit of the ledger, in SI units: so large that the ledger does not contribute to the integrator's error norm."""

LONGEST_STEP = 0.1
"""Longest step, as a part of the arc: Cantera cannot be made to end a step at an event."""

ASKED_AHEAD = 1.0
"""How far ahead of the present time [s] Cantera asks CVODES for a step."""

LONGER = 1000.0
"""How much longer steps may become until derivatives are due anew: as many times as CVODES's increments of variables
exceed those at which its derivatives, times the step at which it takes them, are roundoff."""

FACTORIALS = np.cumprod(np.maximum(np.arange(13.0), 1.0))
"""Factorials up to the highest order of CVODES."""

CONTENTS = """
phases:
- name: interface
  thermo: ideal-surface
  kinetics: surface
  species: [open, {names}]
  reactions: all
  site-density: 1.0 kmol/m^2
species:
- {{name: open, composition: {{}}, thermo: {{model: constant-cp}}}}
{species}
reactions:
{reactions}
"""


MULTIPLIERS_ONLY = (
    "the phase of an interface stands for its reactions and their multipliers only. Its state is the scene's: read "
    "`interface['phi']` and `interface.T`, and set it under `initial`."
)


class Contents(cantera.Interface):
    """A Cantera surface whose reactions have multipliers; it has no state and refuses access to one."""

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse attributes that would have no effect; private names are Cantera's."""
        if name != "name" and not name.startswith("_"):
            raise InputError(MULTIPLIERS_ONLY)
        super().__setattr__(name, value)


def _refuse_state(_: object) -> NoReturn:
    raise InputError(MULTIPLIERS_ONLY)


for _name in (
    *("T", "P", "X", "Y", "TP", "TPX", "TPY", "coverages", "concentrations", "state", "density", "electric_potential"),
    *("site_density", "net_rates_of_progress", "net_production_rates", "advance_coverages"),
    *("set_unnormalized_coverages", "set_unnormalized_mole_fractions", "set_unnormalized_mass_fractions"),
):
    setattr(Contents, _name, property(_refuse_state))


def contents(reactions: Sequence[str] = ("bond",)) -> Any:
    """Return a Cantera surface for a scene: one reaction for each of its own, the rate constant as multiplier."""
    species = (f"- {{name: {name}, composition: {{}}, thermo: {{model: constant-cp}}}}" for name in reactions)
    entries = (f"- {{equation: open => {name}, rate-constant: {{A: 1, b: 0, Ea: 0}}}}" for name in reactions)
    text = CONTENTS.format(names=", ".join(reactions), species="\n".join(species), reactions="\n".join(entries))
    return Contents(yaml=text, name="interface")


@cache
def _nothing() -> Any:
    """Return an empty surface for reactors that require one, cached: Cantera takes half a millisecond to read it."""
    return contents()


class BackOffError(Exception):
    """Rates do not exist here, but a shorter step may end where they do."""


class Derivatives:
    """Makes CVODES take its derivatives anew as its steps become longer.

    It keeps them for up to fifty steps, of which each may be ten times as long as the last. At a first step as short as
    the fastest reaction, their roundoff is small beside the inverse of that step, but not of later ones: it would hold
    back what Newton's method corrects, which then seems to have converged. After a failure they are taken anew.
    """

    def __init__(self, t: float) -> None:
        self.begun = self.tried = t
        """Start and end [s] of the step that is tried."""
        self.shortest = np.inf
        """The shortest step since they were due [s]."""

    def check(self, t: float) -> None:
        """Raise BackOffError at the end [s] of a step for which they are due."""
        if t > self.tried:
            self.begun = self.tried  # shorter steps are tried only from the same start
        self.tried, step = t, t - self.begun
        due = step > LONGER * self.shortest
        if step > 0:
            self.shortest = step if due else min(self.shortest, step)
        if due:
            raise BackOffError("derivatives are due")


def _switch(name: str) -> property:
    """Return a read-only switch of Cantera's reactors, for settings that would have no effect."""

    def change(self: StateVectorReactor, on: bool) -> None:
        kept, instead = self.switches[name]
        if on != kept:
            raise InputError(f"{name} of {self.name} is always {kept}. {instead}")

    return property(lambda self: self.switches[name][0], change)


class hook:  # noqa: N801 - a decorator
    """A method that Cantera calls, with its signature: Cantera asks for it in every reactor that is made."""

    def __init__(self, method: Callable[..., Any]) -> None:
        self.method, self.signature = method, inspect.signature(partial(method, None))

    def __get__(self, reactor: Any, _: type) -> Callable[..., Any]:
        bound = partial(self.method, reactor)
        bound.__signature__ = self.signature  # type: ignore[attr-defined]
        return bound


class StateVectorReactor(cantera.ExtensibleReactor):
    """A reactor whose state and rates are not Cantera's; the only place that depends on Cantera's hooks.

    A subclass provides its variables, their number and their rates. Once these have raised an error other than
    BackOffError, every later call raises it too, since Cantera repeats a failed evaluation with ever smaller steps.
    """

    surface: Any
    names: tuple[str, ...]
    error: Exception | None = None
    switches: Mapping[str, tuple[bool, str]]
    """Fixed switches of Cantera's reactors: whether they are on, and the alternative to them, in words."""
    asked: float = 0.0
    """Time of the last evaluation [s]: after a step of the integrator, its end."""
    derivatives: Derivatives | None = None
    """Those of the integrator, if this reactor lets them be taken anew: one does so for all of its network."""

    def __new__(cls, surface: Any, *_: Any, name: str = "(none)") -> Self:
        """Keep the given surface: Cantera would take a clone without the Python attributes."""
        made = super().__new__(cls, surface, clone=False, name=name)  # type: ignore[call-arg]
        made.surface = surface
        return made

    chemistry_enabled, energy_enabled = _switch("chemistry_enabled"), _switch("energy_enabled")

    def start(self) -> Array:
        """Return the present values of the variables."""
        raise NotImplementedError

    def put(self, x: Array) -> None:
        """Set the values of the variables."""

    def rates(self, t: float) -> Array:
        """Return the time derivatives of the variables at time t [s], for the values last put."""
        raise NotImplementedError

    def attempt(self, evaluate: Callable[[float], Array], t: float) -> Array:
        """Evaluate for Cantera at a time [s]; an error is raised again at every later call."""
        if self.error is not None:
            raise self._failure(self.error)
        try:
            return evaluate(t)
        except BackOffError:
            raise
        except Exception as error:
            self.error = error
            raise self._failure(error) from None

    def _failure(self, error: Exception) -> Exception:
        """Return a new exception for Cantera, so that its traceback keeps no objects alive."""
        return cantera.CanteraError(f"{type(error).__name__}: {error}")

    # -- Cantera 3.2's hooks ---------------------------------------------------------------------------------------

    @hook
    def replace_initialize(self, _start: float) -> None:
        if self.surfaces:
            self.error = InputError(
                f"a ReactorSurface on {self.name} has no gas to react with. Put it on the reactor of the gas."
            )
            raise self.error
        self.n_vars = len(self.names)

    @hook
    def replace_get_state(self, y: Any) -> None:
        y[:] = self.start()

    @hook
    def replace_update_state(self, y: Any) -> None:
        self.put(np.array(y))

    @hook
    def replace_update_connected(self, _pressure: bool) -> None:
        """Do nothing: other reactors do not read the contents."""

    @hook
    def replace_eval(self, t: float, _lhs: Any, rhs: Any) -> None:  # its left side is one
        self.asked = t
        if self.derivatives is not None:
            self.derivatives.check(t)
        np.asarray(rhs)[:] = self.attempt(self.rates, t)

    @hook
    def replace_component_name(self, i: int) -> str:
        return self.names[i]

    @hook
    def replace_component_index(self, name: str) -> int:
        if name not in self.names:  # the accounts of the ledger, in an artificial unit, are not offered
            known = [each for each in self.names if not each.endswith(f" / {LEDGER_UNIT:g}")]
            refuse_unknown([name], known, f"{self.name} has no component '{{}}'")
        return self.names.index(name)


class _SystemReactor(StateVectorReactor):
    """The equations of an arc, and the ledger if rates come from external code.

    Published mechanisms have reactions that run both ways far faster than anything else changes. Their balance along
    the integrator's polynomial is inaccurate, and they magnify this error in a quadrature along it, but not if the
    integrator itself sums the ledger.
    """

    def __init__(self, surface: Any, view: View, t: float, x: Array) -> None:
        super().__init__(surface)
        self._due = Derivatives(t).check
        lines = view.program.n_ledger if view.program.external else 0
        unit = np.concatenate((np.maximum(view.atol, TINY), np.full(lines, LEDGER_UNIT)))
        self.tolerance = float(unit[0]) if np.all(unit == unit[0]) else 1.0
        self.unit = unit / self.tolerance
        self.count = len(x)
        self.names = tuple(f"x{i}" for i in range(len(unit)))
        self._x = np.empty_like(unit) if lines or len(view.algebraic) else view.y
        self.scaled = self._x if self.tolerance != 1.0 else np.empty_like(unit)
        """Present variables in their units, into which Cantera's are copied."""
        self.scaled[:] = np.concatenate((x, np.zeros(lines))) / self.unit
        self._scaled, self._differential = self.scaled.data, self._x[: self.count] if lines else self._x
        self._reach, self._slopes = view.reach, view.rates if lines else view.slopes

    def start(self) -> Array:
        return self.scaled

    # Cantera calls these more often than the steps that it takes, so they go no further than to the equations.

    @hook
    def replace_update_state(self, y: Any) -> None:
        self._scaled[:] = y  # NumPy takes ten times as long to copy it

    @hook
    def replace_eval(self, t: float, _lhs: Any, rhs: Any) -> None:
        if self.error is not None:
            raise self._failure(self.error)
        self._due(t)
        if self.scaled is not self._x:
            np.multiply(self.scaled, self.unit, self._x)
        try:
            found = self._reach(t, self._differential)
        except Exception as error:
            self.error = error
            raise self._failure(error) from None
        # Cantera itself rejects rates that are not finite, as it does this error.
        if not found:
            raise BackOffError("no consistent state")
        # A buffer is read in a third of the time of a sequence.
        np.divide(self._slopes(), self.unit, np.frombuffer(rhs))


def last_step(net: Any, start: float, end: float) -> DenseStep:
    """Return the last step of a network, from the derivatives of its integrator's polynomial at the present time."""
    now, orders = float(net.time), np.arange(int(net.solver_stats["last_order"]) + 1)
    rows = np.array([net.get_derivative(k) for k in orders.tolist()]) / FACTORIALS[: len(orders), None]

    y = partial(on_step, now, 1.0, rows)
    return DenseStep(start, end, y, y)


class _Stretch(Method):
    together = MOST_TOGETHER

    def __init__(self, view: View, t: float, end: float, y: Array, ydot: Array) -> None:
        self.view, self.reactor = view, _SystemReactor(_nothing(), view, t, y[view.differential])
        self.net = cantera.ReactorNet([self.reactor])
        self.net.rtol, self.net.atol = view.problem.rtol, self.reactor.tolerance
        self.net.initial_time = t
        self.longest = min(LONGEST_STEP * (end - t), view.problem.spacing)
        self.first = max(view.first_step(ASKED_AHEAD, y, ydot), np.spacing(t))
        """Longest first step [s]."""
        self.t, self.end = t, end
        self.last: Array | None = None
        """Variables, in their units, and their first two derivatives after the last step."""
        self.failure: Exception | None = None

    def several(self, most: int) -> Steps:
        state, step, derivative, end = self.reactor.scaled, self.net.step, self.net.get_derivative, self.end
        times, ends = [self.t], np.empty((most + 1, 3, len(state)))
        ends[0] = state if self.last is None else self.last
        growing = self.view.growing_size(self.t, (ends[0, 0] * self.reactor.unit)[: self.reactor.count])
        longest = min(self.longest, max(growing, FORMULA_EPS * end))
        while len(times) <= most and times[-1] < end and self.failure is None:
            # Cantera has no stop time, and a step beyond the end would miss what changes there.
            self.net.max_time_step = min(longest, max(end - times[-1], FORMULA_EPS * end), self.first)
            self.first = np.inf
            try:
                now, row = step(), ends[len(times)]
                if not now > times[-1]:  # Cantera would go on, across a pole, too
                    raise StepError("the step size fell to zero")
                row[0], row[1] = state, derivative(1)
                try:
                    row[2] = derivative(2)
                except cantera.CanteraError:
                    row[2] = 0.0  # the first polynomial is a straight line
                times.append(now)
            except (cantera.CanteraError, ArithmeticError, StepError) as error:
                self.failure = error  # an event may lie before it
        if len(times) == 1:
            raise StepError(str(self.failure)) from self.failure
        if self.last is None:  # the first polynomial is a straight line
            ends[0, 1:] = ends[1, 1:]
        self.t, self.last = times[-1], ends[len(times) - 1]
        rows = hermite(np.diff(times), ends[: len(times)] * self.reactor.unit)
        return Steps(np.array(times), partial(self._step, times, rows), at_nodes(rows[..., : self.reactor.count]))

    def _step(self, times: Sequence[float], rows: Array, k: int) -> DenseStep:
        """Return a step between these times from the coefficients of its polynomial, with its ledger if any."""
        start, end, n = times[k], times[k + 1], self.reactor.count
        y = partial(on_step, end, end - start, rows[k][:, :n])
        gained = partial(on_step, end, end - start, rows[k][:, n:]) if rows.shape[2] > n else None
        return DenseStep(start, end, y, y, gained)

    @property
    def counters(self) -> Counters:
        if self.last is None:  # Cantera complains of a network without a step
            return Counters()
        told = self.net.solver_stats
        return Counters(
            residuals=int(told["rhs_evals"] + told["lin_rhs_evals"]),
            rejected=int(told["err_test_fails"] + told["nonlinear_conv_fails"]),
            jacobians=int(told["jac_evals"]),
            factorizations=int(told["lin_solve_setups"]),
        )


class CanteraSolver(SteppingSolver):
    """BDF of variable order in Cantera's ReactorNet; algebraic variables are eliminated inside the right-hand side."""

    name = "cantera"
    counts_rejected = True

    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:
        self.check(len(y[view.differential]) + bool(view.program.external))
        return _Stretch(view, t, end, y, ydot)


def make(_name: str) -> CanteraSolver:
    """Return the solver."""
    return CanteraSolver()
