"""Compiled Jacobians and derivatives of laws are those of what they belong to, by differences in 60 digits.

In every scene and mode, every shipped case and each of its modes, and every formula of every law.
"""

import inspect
import itertools
import random

import law_values
import mpmath
import numpy as np
import pytest
import scenes
import scenes_mechanics
import symengine
import thermodynamics as laws

import surfacechem
from surfacechem.compile.program import compile_program
from surfacechem.expressions import derivative
from surfacechem.format import names
from surfacechem.model.assemble import assemble
from surfacechem.model.system import System
from surfacechem.results import spatial

SCENES = [pytest.param(scene, {}, id=scene.__name__) for scene in scenes.ALL]
SCENES += [
    pytest.param(m.scene, modes, id=f"{m.__name__}{list(modes.values())}")
    for m in scenes_mechanics.ALL
    for modes in m.modes
]
STEP = mpmath.mpf(10) ** -25
SEEDS = range(2)


def slope(formula, x, point) -> mpmath.mpf:
    """Central difference over one variable; its error is 1e-50 of the third derivative."""
    step = STEP * max(abs(point[x]), mpmath.mpf(10) ** -9)
    ahead, behind = (laws.number(formula, point | {x: point[x] + sign * step}) for sign in (1, -1))
    return (ahead - behind) / (2 * step)


def jacobian_is_right(system: System, point) -> None:
    states, rates = [s.symbol for s in system.states], [s.dot for s in system.states]
    rows, parameters = system.residual(), [p.symbol for p in system.parameters]
    program = compile_program(system.t, states, rates, parameters, rows)
    compiled = program.jacobian([float(point[x]) for x in system.inputs])
    found = np.concatenate(compiled.reshape(2, program.n, program.n), axis=1)
    for row, equation in enumerate(rows):
        # A derivative may be a difference of large terms: relative to what it does to its equation.
        size = max(abs(float(point[y]) * value) for y, value in zip([*states, *rates], found[row], strict=True))
        for column, x in enumerate([*states, *rates]):
            if x not in equation.free_symbols:
                assert found[row, column] == 0
                continue
            exact = float(slope(equation, x, point))
            rounding = 1e-12 * size / max(abs(float(point[x])), 1e-300)
            assert found[row, column] == pytest.approx(exact, rel=1e-9, abs=rounding)


@pytest.mark.parametrize(("scene", "modes"), SCENES)
def test_jacobian_of_every_scene(scene, modes):
    system = assemble(scene())
    for seed in SEEDS:
        jacobian_is_right(system, laws.consistent_point(system, seed, modes))


@pytest.mark.parametrize("name", names())
def test_jacobian_of_every_case_in_each_mode(name):
    """Away from what the equations ask for, too: every rate is drawn at random."""
    system = assemble(spatial.few(surfacechem.load(name).case.scene))
    for values in itertools.product(*(mode.words for mode in system.modes)):
        modes = dict(zip((mode.name for mode in system.modes), values, strict=True))
        for seed in SEEDS:
            draw = random.Random(seed)
            point = laws.start_point(system, seed, modes)
            rates = {s.dot: mpmath.mpf(draw.uniform(-1, 1) * (abs(s.initial) or s.scale)) for s in system.states}
            jacobian_is_right(system, point | rates)


@pytest.mark.parametrize("name", law_values.every())
def test_derivatives_of_every_law(name):
    law = law_values.every()[name]
    for seed in SEEDS:
        draw = random.Random(f"{name}{seed}")
        made = law_values.instance(law, draw)
        for _formula, method in law_values.formulas(made):
            symbols = {x: symengine.Symbol(x) for x in inspect.signature(method).parameters}
            point = {s: mpmath.mpf(law_values.argument(made, x, draw)) for x, s in symbols.items()}
            for expression in law_values.parts(method(**symbols) if symbols else ()):
                value = abs(laws.number(expression, point))
                for x in symbols.values():
                    found = laws.number(derivative(expression, x), point)
                    rounding = 1e-12 * value / abs(point[x])  # of constants that differentiation multiplies
                    assert mpmath.almosteq(found, slope(expression, x, point), 1e-12, rounding)
