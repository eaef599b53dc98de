"""Expressions that are alike: loops over one give what each of them by itself gives, and another grid needs no code."""

import itertools
from unittest.mock import patch

import numpy as np
import pytest
import symengine

import surfacechem
from surfacechem.compile import alike
from surfacechem.compile.alike import loops_of
from surfacechem.compile.program import compile_function

T, k = symengine.symbols("T k")


def cells(count):
    """States of cells, rows that each reads with its neighbour, and sums over all of them."""
    x = symengine.symbols(f"x0:{count}")
    pairs = list(itertools.pairwise(x))
    rows = [k * (i + 0.5) * (a - b) / T + symengine.log(a) ** 2 for i, (a, b) in enumerate(pairs)]
    sums = [symengine.Add(*((a - b) ** 2 / (a * b) for a, b in pairs)), symengine.Add(T, *(c * c for c in x))]
    return x, [*rows, *sums, k * T, symengine.Integer(0)]


@pytest.mark.parametrize("count", [2, 8, 9, 16, 100])
def test_loops_are_what_each_expression_is(count):
    x, expressions = cells(count)
    inputs = [T, k, *x]
    rows = np.random.default_rng(count).uniform(0.5, 2.0, (3, len(inputs)))
    together, apart = (compile_function(inputs, expressions, own) for own in (x, ()))
    np.testing.assert_allclose(together(rows), apart(rows), rtol=1e-13, atol=1e-14)
    np.testing.assert_array_equal(together(rows[0]), together(rows)[0])


def test_what_is_alike_is_one_form_along_the_cells():
    x, expressions = cells(50)
    loops, rest = loops_of([T, k, *x], expressions, x)
    assert [loop.count for loop in loops] == [49, 49, 50]
    assert [place for place, item in enumerate(rest) if item != 0] == [50, 51]


def test_what_has_no_code_for_vectors_stands_by_itself():
    x = symengine.symbols("x0:20")
    expressions = [symengine.gamma(c) for c in x]
    loops, rest = loops_of(x, expressions, x)
    assert (loops, rest) == ([], expressions)


def test_choices_are_loops_too():
    x = symengine.symbols("x0:20")
    expressions = [(i + 0.5) * symengine.Piecewise((symengine.exp(c), c < T), (c, True)) for i, c in enumerate(x)]
    (_,), rest = loops_of([T, *x], expressions, x)
    assert set(rest) == {0}
    together, apart = (compile_function([T, *x], expressions, own) for own in (x, ()))
    values = np.linspace(0.1, 3.0, 21)
    np.testing.assert_allclose(together(values), apart(values), rtol=1e-14)


def conducting(cells):
    return surfacechem.load("epoxy-cure-thick", {"bodies.laminate.conduction.cells": cells, "run.until": "1 s"})


def test_the_jacobian_is_that_of_each_row():
    model = conducting(40).model
    program, system = model.program, model.system
    rng = np.random.default_rng(1)
    inputs = np.concatenate([[0.0], rng.uniform(300, 400, program.n), rng.uniform(-1, 1, program.n)])
    inputs = np.concatenate([inputs, [p.value for p in system.parameters]])
    by_state, by_rate = program.derivatives(inputs)
    for j in range(program.n):
        for place, found in ((1 + j, by_state), (1 + program.n + j, by_rate)):
            step = 1e-6 * max(abs(inputs[place]), 1.0)
            low, high = inputs.copy(), inputs.copy()
            low[place] -= step
            high[place] += step
            slope = (program.residual(high) - program.residual(low)) / (high[place] - low[place])
            np.testing.assert_allclose(found[:, j], slope, rtol=1e-5, atol=1e-5 * np.max(np.abs(by_state)))


def test_another_grid_needs_no_code_for_its_cells():
    code = [conducting(40).model]
    with patch.object(alike, "object_code", side_effect=AssertionError):
        code.append(conducting(60).model)
    assert [model.program.n for model in code] == [46, 66]
