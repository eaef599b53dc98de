"""Both laws of thermodynamics on assembled equations, to 40 digits: no solver is involved."""

import random
from collections.abc import Callable, Mapping

import mpmath
import symengine

from surfacechem.model.system import System

BITS = 200
DIGITS = 40
mpmath.mp.prec = BITS


def number(expression, point) -> mpmath.mpf:
    """The value of an expression at a point, to BITS bits; doubles in it count as the exact numbers they are."""
    return _value(symengine.sympify(expression), dict(point))


def _value(expression, known) -> mpmath.mpf:
    """The value of an expression, and in ``known`` that of each of its parts, which may occur many times."""
    if expression in known:
        return known[expression]
    if expression.is_Number:
        return _mpf(expression)
    if expression == symengine.E:
        return +mpmath.e
    name = type(expression).__name__
    if name == "Piecewise":
        pairs = zip(expression.args[::2], expression.args[1::2], strict=True)
        known[expression] = next(_value(value, known) for value, condition in pairs if _holds(condition, known))
    else:
        arguments = [_value(argument, known) for argument in expression.args]
        known[expression] = OPERATIONS.get(name, getattr(mpmath, name.lower(), None))(*arguments)
    return known[expression]


def _mpf(value) -> mpmath.mpf:
    if isinstance(value, symengine.Rational):
        top, bottom = value.get_num_den()
        return mpmath.mpf(int(top)) / int(bottom)
    return mpmath.mpf(float(value))


def _holds(condition, known) -> bool:
    if condition in (True, symengine.true):
        return True
    left, right = (_value(argument, known) for argument in condition.args)
    return {"StrictLessThan": left < right, "LessThan": left <= right}[type(condition).__name__]


OPERATIONS = {
    "Add": lambda *terms: mpmath.fsum(terms),
    "Mul": lambda *factors: mpmath.fprod(factors),
    "Pow": lambda base, exponent: base**exponent,
}


def start_point(system: System, seed: int, modes: Mapping[str, float] | None = None) -> dict:
    """Parameters as they are, states moved a little at random, time early in the run; modes as given."""
    draw = random.Random(seed)
    point = {parameter.symbol: mpmath.mpf(parameter.at(0.0)) for parameter in system.parameters}
    point |= {mode.symbol: mpmath.mpf(modes[mode.name]) for mode in system.modes if mode.name in (modes or {})}
    point[system.t] = mpmath.mpf(draw.uniform(0.0, 0.1))
    for state in system.states:
        inside = (
            state.initial + draw.uniform(0.05, 0.4) if state.scale == 1.0 else state.initial * draw.uniform(0.95, 1.05)
        )
        point[state.symbol] = mpmath.mpf(min(inside, 0.95) if state.scale == 1.0 else inside)
        point[state.dot] = mpmath.mpf(0)
        if state.name in ("v", "speed") and "slip" in (modes or {}):
            point[state.symbol] *= mpmath.mpf(modes["slip"])
    return point


def put_away(system: System, point: dict, draw_of: Callable[[str], random.Random]) -> None:
    """Move a point away from equilibrium, with rates drawn at random."""
    for state in system.states:
        draw = draw_of(state.name)
        size = abs(float(point[state.symbol])) or state.scale
        point[state.symbol] += mpmath.mpf(size * draw.uniform(0.01, 0.05))
        point[state.dot] = mpmath.mpf(size * draw.uniform(-1, 1))


def consistent_point(system: System, seed: int, modes: Mapping[str, float] | None = None) -> dict:
    """A point at which the equations hold to DIGITS digits: Newton on derivatives, algebraic variables and gaps in
    equilibrium.
    """
    point = start_point(system, seed, modes)
    rows, free = system.residual(), [state.symbol if state.algebraic else state.dot for state in system.states]
    held = {state.name: state.symbol for state in system.states}
    for e in system.equilibria:
        residual = system.expand(e.residual)
        felt = (held[name] for name in (e.state, *e.coupled))
        moved = next((gap for gap in felt if number(symengine.diff(residual, gap), point) != 0), None)
        if moved is not None:
            rows, free = [*rows, residual], [*free, moved]
    slopes = [[symengine.diff(row, unknown) for unknown in free] for row in rows]
    for _ in range(80):
        matrix = mpmath.matrix([[number(entry, point) for entry in row] for row in slopes])
        step = mpmath.lu_solve(matrix, -mpmath.matrix([number(row, point) for row in rows]))
        for unknown, change in zip(free, step, strict=True):
            point[unknown] += change
        if all(abs(change) <= 1e-50 * (1 + abs(point[u])) for u, change in zip(free, step, strict=True)):
            return point
    raise AssertionError("no consistent point")


STEP = mpmath.mpf(10) ** -25


def slope(formula, x, point) -> mpmath.mpf:
    """Central difference over one variable; its error is 1e-50 of the third derivative."""
    step = STEP * max(abs(point[x]), mpmath.mpf(10) ** -9)
    ahead, behind = (number(formula, point | {x: point[x] + sign * step}) for sign in (1, -1))
    return (ahead - behind) / (2 * step)


def rate(system: System, name: str) -> list:
    """Terms of the time derivative of a named quantity that depends on t and the states."""
    total = system.expand(symengine.Symbol(name))
    slopes = [symengine.diff(total, state.symbol) * state.dot for state in system.states]
    return [symengine.diff(total, system.t), *slopes]


def booked(system: System, *kinds: str) -> list:
    return [system.expand(account.rate) for account in system.ledger if account.kind in kinds]


def closes(totals, parts, point, digits: int = DIGITS) -> bool:
    """Whether the totals add up to the parts, relative to the largest of them."""
    left, right = ([number(term, point) for term in terms] for terms in (totals, parts))
    scale = max(abs(value) for value in [*left, *right])
    return bool(abs(sum(left) - sum(right)) <= scale * mpmath.mpf(10) ** -digits)


def first_law_holds(system: System, point, digits: int = DIGITS) -> bool:
    """dE/dt is what is supplied."""
    return closes(rate(system, "E_total"), booked(system, "energy supply"), point, digits)


def second_law_holds(system: System, point, digits: int = DIGITS) -> bool:
    """dS/dt is what is supplied and produced."""
    return closes(rate(system, "S_total"), booked(system, "entropy supply", "entropy production"), point, digits)


def productions(system: System, point) -> dict[str, mpmath.mpf]:
    """Entropy production of each law."""
    accounts = [account for account in system.ledger if account.kind == "entropy production"]
    return {account.law: number(system.expand(account.rate), point) for account in accounts}
