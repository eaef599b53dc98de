"""Machine code for eight cases at once: right to the last place, at every end of the range, for every case there is."""

import case_runs
import mpmath
import numpy as np
import pytest
import symengine
import zoo
from sampling import every

from surfacechem.compile.program import compile_function, solved_rates
from surfacechem.compile.vectors import LANES, compile_lanes
from surfacechem.expressions import magnitude
from surfacechem.tolerances import FORMULA_EPS

X, Y = symengine.symbols("x y")


def places_off(found, exact):
    return abs(found - float(exact)) / np.spacing(abs(float(exact)))


@pytest.mark.parametrize(
    ("name", "low", "high"), [("exp", -700, 709), ("exp", -1, 1), ("log", -700, 700), ("log", -0.4, 0.4)]
)
def test_exponentials_and_logarithms_are_right_to_one_place(name, low, high):
    code = compile_lanes([X], [getattr(symengine, name)(X)])
    for values in np.random.default_rng(0).uniform(low, high, (200, LANES)):
        given = np.exp(values) if name == "log" else values
        found = code(given[None])[0]
        exact = [getattr(mpmath, name)(mpmath.mpf(value)) for value in given]
        assert max(places_off(a, b) for a, b in zip(found, exact, strict=True)) <= 1.0


def test_ends_of_the_range_are_those_of_numpy():
    given = np.array(
        [0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 1e-310, -1.0, 710, -746, -744, 709.7, 1e300, 1e-320, 1, 2]
    )
    code = compile_lanes([X], [symengine.exp(X), symengine.log(X)])
    for part in given.reshape(-1, LANES):
        with np.errstate(all="ignore"):
            exact = np.exp(part), np.log(part)
        for found, wanted in zip(code(part[None]), exact, strict=True):
            assert np.array_equal(np.isnan(found), np.isnan(wanted))
            number = np.isfinite(wanted)
            assert np.array_equal(found[~number & ~np.isnan(wanted)], wanted[~number & ~np.isnan(wanted)])
            assert found[number] == pytest.approx(wanted[number], rel=3e-16, abs=1e-323)


@pytest.mark.parametrize(
    "expression",
    [
        X**-3 * Y, symengine.sqrt(X) / Y, X**0.95, X ** symengine.Rational(-1, 2), symengine.sinh(X), symengine.cosh(Y),
        symengine.tanh(X * Y), symengine.asinh(X), symengine.erf(X), symengine.atan(Y), symengine.Max(X, Y, 1.0),
        symengine.Min(X, Y), symengine.Abs(X - Y), symengine.sin(X) + symengine.cos(Y), symengine.Integer(3),
        symengine.Piecewise((X, symengine.And(X < 1, Y > 1)), (Y, symengine.Or(X > 2, Y < 0.5)), (X * Y, True)),
        symengine.Piecewise((1, symengine.Eq(X < 1, True)), (2, X <= Y), (3, True)),
    ],
)  # fmt: skip
def test_functions_are_those_of_scalar_code(expression):
    values = np.random.default_rng(1).uniform(0.1, 3, (2, LANES))
    scalar = symengine.Lambdify([X, Y], [expression], backend="llvm")(values.T.copy())
    assert compile_lanes([X, Y], [expression])(values) == pytest.approx(scalar.T, rel=1e-15)


def test_values_of_a_choice_are_formed_where_a_case_needs_them():
    """What is formed for one choice is there for another one, and for what comes behind both."""
    low, high = symengine.exp(X) * Y, symengine.log(X + Y)
    inner = symengine.Piecewise((high, Y < 2), (symengine.sqrt(low), True))
    chosen = symengine.Piecewise((low, X < 1), (inner + low, X < 2), (Y, True))
    others = symengine.Piecewise((high * chosen, Y < 1), (low, X < 3)), low + high
    code = compile_lanes([X, Y], [chosen, *others])
    for x, y in ((0.5, 0.5), (1.5, 0.5), (1.5, 2.5), (2.5, 1.5), (3.5, 0.5), (3.5, 1.5)):
        exponential, logarithm = np.exp(x) * y, np.log(x + y)
        second = (logarithm if y < 2 else np.sqrt(exponential)) + exponential
        first = exponential if x < 1 else second if x < 2 else y
        third = logarithm * first if y < 1 else exponential if x < 3 else np.nan
        wanted = [first, third, exponential + logarithm]
        # Alone, and where the others need every choice.
        alike = np.repeat([[x], [y]], LANES, axis=1)
        mixed = np.random.default_rng(3).uniform(0.1, 4, (2, LANES))
        mixed[:, 3] = x, y
        assert code(alike)[:, 0] == pytest.approx(wanted, rel=1e-15, nan_ok=True)
        assert np.array_equal(code(alike)[:, 0], code(mixed)[:, 3], equal_nan=True)


def test_a_function_without_code_is_told():
    with pytest.raises(NotImplementedError, match="gamma"):
        compile_lanes([X], [symengine.gamma(X)])


LARGE = ("closing-gas-gap", "elastic-bonds-at-a-gap")
"""Cases whose derivatives take seconds to compile."""
OF_CASES = sorted((m for m in zoo.MEMBERS.values() if "case" in m.tags), key=lambda member: member.name in LARGE)


@pytest.mark.parametrize("member", every(8, OF_CASES), ids=lambda member: member.name)
def test_rates_and_guards_of_a_case_are_those_of_its_scalar_code(member):
    model = case_runs.load(member.name).model
    program = model.program
    if program.lanes is None:
        pytest.skip("its equations do not give their rates one after another")
    problem = model.problem(case_runs.load(member.name).case.run, model.values({}))
    rows = np.repeat(
        np.concatenate([[0.0], problem.y0, np.zeros(program.n), problem.parameters[0]])[None], LANES, axis=0
    )
    rows[:, : 1 + program.n] *= 1 + 1e-3 * np.random.default_rng(2).uniform(size=(LANES, 1 + program.n))
    rates = program.rates(rows)
    rows[:, 1 + program.n : 1 + 2 * program.n] = rates
    wanted = [rates, *(code(rows) for code in (program.ledger,) if code)]
    inputs = np.concatenate([rows.T, program.lanes.constants(rows.T)])
    found = program.lanes.rates(inputs)
    for ours, theirs in zip(np.split(found, [program.n]), (part.T for part in wanted), strict=False):
        assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-13 * np.abs(theirs).max(initial=1e-300), nan_ok=True)
    code = program.implicit_lanes
    given = np.concatenate([rows.T, code.constants(rows.T)])
    stiffness, mass = program.derivatives(rows)
    slopes = np.linalg.solve(mass, -stiffness)
    # Tractions cancel in a rate, which is no more accurate than its terms.
    formulas = solved_rates(model.system.residual(), [state.dot for state in model.system.states])
    terms = compile_function(model.system.inputs, [magnitude(rate) for rate in formulas], model.system.cell_symbols)
    allowed = np.maximum(FORMULA_EPS * terms(rows).T, 1e-12 * np.abs(found[: program.n]))
    assert (np.abs(code.states(given) - found[: program.n]) <= allowed).all()
    n, found = program.n, code.slopes(given).T
    assert found[:, : n * n].reshape(slopes.shape) == pytest.approx(slopes, rel=1e-6, abs=1e-9 * np.abs(slopes).max())
    assert {*np.flatnonzero(found[0]).tolist()} <= code.nonzeros
    if program.margins is not None:
        guards = program.margins(rows).T
        assert program.lanes.margins(inputs) == pytest.approx(guards, rel=1e-9, abs=1e-12 * np.abs(guards).max())
