r"""Force spectra: statistics of the growing load at which bonds rupture, evaluated along a single run.

Along a run in which a prescribed variable x grows, the survival is :math:`S=\phi/\phi_i` and the density of ruptures
:math:`-dS/dx`. The median is where S crosses one half, the mode where the density is largest, and both are located as
events; the mean is :math:`x_0+\int S\,dx`, integrated along with the state. Under a constant load the integral of S
over time is the mean lifetime.

Source: Evans & Ritchie (1997), Biophys. J. 72, 1541-1555, doi 10.1016/S0006-3495(97)78802-7.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, derivative
from surfacechem.model.system import Account, Margin, Named, System
from surfacechem.quantities import Quantity
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import LEAST_BONDED

INTACT = LEAST_BONDED**0.5
"""Largest survival at the end, 1e-6, for which the mean is known: half of the decades down to LEAST_BONDED, at which
all bonds count as ruptured and a run ends.
"""

MEDIAN_REASON, MODE_REASON = "half of the bonds are broken", "the density of ruptures is stationary"


def history(system: System, variable: str) -> Expression:
    """Return a prescribed variable that is linear in time as an expression; InputError for any other."""
    named = next((item for item in system.named if item.name == variable), None)
    if named is None:
        raise InputError(f"no law reads a prescribed {variable}.", path="sweep.until")
    expression = system.expand(named.expression)
    moving = {x for state in system.states for x in (state.symbol, state.dot)}
    slope = derivative(expression, system.t)
    if expression.free_symbols & moving or slope == 0 or system.t in slope.free_symbols:
        message = f"{variable} is no ramp; give it one under `loading`: {{ramp: {{rate: ...}}}}."
        raise InputError(message, path="sweep.until")
    return expression


def evolves_bonds(system: System) -> bool:
    """True if bonds evolve."""
    phi = symengine.Symbol("phi")
    return bool(system.expand(phi).free_symbols & {state.symbol for state in system.states})


def breaks_bonds(system: System) -> bool:
    """True if bonds evolve and only break, so that each has one force of rupture."""
    if not evolves_bonds(system):
        return False
    # If bonds form at phi = 0 they can rebind, and the loss of bonds does not count ruptures.
    names = {state.symbol for state in system.states if state.name == "phi" or state.name.startswith("theta_")}
    gone = _total(system, system.expand(symengine.Symbol("phi"))).subs(dict.fromkeys(names, 0))
    point = {p.symbol: p.at(0.0) for p in system.parameters} | {s.symbol: s.initial for s in system.states}
    point |= {s.dot: 0 for s in system.states} | {system.t: 0}
    value = symengine.sympify(gone).subs(point)
    return not (names and not value.free_symbols and float(value) > 0)


def with_rupture(system: System, variable: str) -> System:
    """Return the system with statistics of rupture over ``variable``, whose runs end when all bonds are broken."""
    unit = next(item.quantity.unit for item in system.named if item.name == variable)
    speed = derivative(history(system, variable), system.t)
    left, survival = _survival(system)
    falling = _total(system, survival)
    density = Quantity(f"density_{variable}", f"1/{unit}", f"density of ruptures over {variable}")
    mean = Quantity(f"mean_{variable}", unit, f"integral of the survival over {variable}")
    return replace(
        system,
        named=(*system.named, Named(left, survival), Named(density, -falling / speed)),
        ledger=(*system.ledger, Account(mean, survival * speed, "statistics")),
        margins=(
            *system.margins,
            Margin("intact", survival - LEAST_BONDED, "all bonds broke"),
            Margin("median", survival - 0.5, MEDIAN_REASON, terminal=False),
            Margin("mode", _total(system, falling), MODE_REASON, terminal=False),
        ),
    )


def with_lifetime(system: System, least: float) -> System:
    """Return the system with the time integral of the survival, whose runs end when the survival has fallen to
    ``least``; InputError if bonds can form again, or if ``least`` leaves too many.
    """
    if not breaks_bonds(system):
        message = "no lifetimes: no bonds evolve here, or they can form again, and none breaks once."
        raise InputError(message, path="sweep.until")
    if not 0 < least <= INTACT:
        message = f"lifetimes need few bonds to be left: the survival must be in (0, {INTACT:g}], not {least:g}."
        raise InputError(message, path="sweep.until")
    left, survival = _survival(system)
    integral = Quantity("lifetime", "s", "integral of the survival over time")
    return replace(
        system,
        named=(*system.named, Named(left, survival)),
        ledger=(*system.ledger, Account(integral, survival, "statistics")),
        margins=(*system.margins, Margin("intact", survival - least, "all bonds broke")),
    )


def _survival(system: System) -> tuple[Quantity, Expression]:
    """Return the bonding state over its initial value, which is a parameter."""
    phi = system.expand(symengine.Symbol("phi"))
    paths = {p.path: p.symbol for p in system.parameters}
    start = {s.symbol: paths[f"initial.{s.name}"] for s in system.states if f"initial.{s.name}" in paths}
    return Quantity("survival", "1", "bonds that are left, of those at the start"), phi / phi.subs(start)


def lifetimes(survival: Array, density: Array, speed: Array) -> Array:
    r"""Return mean lifetimes [s] at each load from runs at growing loads: :math:`\tau=S/(p\,\dot x)`, the survivors
    over their rate of rupture; NaN where hardly a bond is left. ``speed`` is the loading rate, one for each run.

    It is the lifetime at a constant load where bonds have no memory, and the same for all speeds. Source: Dudko, Hummer
    & Szabo (2008), PNAS 105, 15755, doi 10.1073/pnas.0806085105.

    >>> lifetimes(np.array([1.0, 0.5]), np.array([2e9, 1e9]), np.array([1e-10]))
    array([5., 5.])
    """
    known = (survival > INTACT) & (density > 0)
    found: Array = np.divide(survival, density * speed, out=np.full(survival.shape, np.nan), where=known)
    return found


def _total(system: System, expression: Expression) -> Expression:
    """Return the time derivative along a run; known rates of bonds are more accurate than slopes of states."""
    bonds = {account.law: system.expand(account.rate) for account in system.ledger if account.kind == "bonds"}
    total = derivative(expression, system.t)
    for state in system.states:
        total += derivative(expression, state.symbol) * bonds.get(state.name, state.dot)
    return total


def statistics(trajectory: Trajectory, load: str) -> dict[str, float]:
    """Return mode, median and mean of the ``load`` at rupture of a run of a system :func:`with_rupture`, or without a
    load the mean lifetime of a run of a system :func:`with_lifetime`; NaN where the run does not determine them.
    """
    model, result = trajectory.model, trajectory.result
    columns = model.system.output_columns
    end = model.evaluate(result, np.array([result.t]), result.y[None], result.ydot[None])[0]
    survivors = end[columns["survival"]]
    kinds = [account.kind for account in model.system.ledger]
    integral = float(result.ledger[kinds.index("statistics")])
    if not load:
        return {"lifetime": integral if survivors <= 1.01 * INTACT else math.nan}
    column, density = columns[load], columns[f"density_{load}"]
    words = [*(margin.reason for margin in model.margins), *(item.reason for item in model.system.edges)]
    reasons = np.array(words)[result.events.index]
    at = model.evaluate(result, result.events.t, result.events.y, result.events.ydot)
    halves = at[reasons == MEDIAN_REASON]
    peaks = np.array([end, trajectory.outputs[0], *at[reasons == MODE_REASON]])
    peak = np.argmax(peaks[:, density])
    return {
        # Of a density that still grows at the end, with bonds left, the peak would come later.
        "mode": float(peaks[peak, column]) if peak or survivors < INTACT else math.nan,
        "median": float(halves[0, column]) if len(halves) else math.nan,
        "mean": float(trajectory.outputs[0, column] + integral) if survivors < INTACT else math.nan,
    }
