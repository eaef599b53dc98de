"""Printed equations: they run, they agree with the machine code, and two of them are approved as they stand."""

import ast
import io
import linecache
import tokenize
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scenes

import surfacechem
from surfacechem import format as cases
from surfacechem.compile import printing
from surfacechem.compile.typeset import latex
from surfacechem.expressions import magnitude
from surfacechem.model.assemble import assemble
from surfacechem.solve.run import Model
from surfacechem.tolerances import FORMULA_EPS

pytestmark = pytest.mark.around

APPROVED = Path(__file__).parents[1] / "approved"


def random_states(system, count=5):
    random = np.random.default_rng(7)
    for _ in range(count):
        scale = np.array([state.scale for state in system.states])
        y = scale * random.uniform(0.6, 1.0, len(scale))
        yield random.uniform(0, 2), y, scale * random.normal(size=len(scale)), [p.at(0.0) for p in system.parameters]


def functions_of(model):
    """The compiled functions with the expressions of their results."""
    system, program = model.system, model.program
    functions = {
        "residual": (program.residual, list(system.rows.values())),
        "outputs": (model.output_function, [item.expression for item in system.outputs]),
        "ledger": (program.ledger, [account.rate for account in system.ledger]),
        "margins": (program.margins, [each.masked for each in (*system.event_margins, *system.edges)]),
    }
    return {name: (f, [system.expand(e) for e in rows]) for name, (f, rows) in functions.items() if f is not None}


def two_pathways_and_their_limits():
    """A mechanism whose conditions hold piecewise terms, which hold others."""
    return surfacechem.load("vinculin-catch-bond").case.scene


SHOWN = [two_pathways_and_their_limits, scenes.coupled, scenes.reacting_film]
assembled = cache(lambda scene: assemble(scene()))
printed = cache(lambda scene: printing.executable(assembled(scene)))


def source_of(module):
    return "".join(linecache.getlines(module.__file__))


@pytest.mark.parametrize(
    "scene",
    [*SHOWN, *(pytest.param(each, marks=pytest.mark.slow) for each in scenes.ALL if each not in SHOWN)],
    ids=lambda scene: scene.__name__,
)
def test_printed_equations_agree_with_machine_code_and_are_short_enough_to_read(scene):
    system, module = assembled(scene), printed(scene)
    model = Model(system)
    functions = functions_of(model)
    for t, y, ydot, parameters in random_states(system):
        inputs = np.concatenate([[t], y, ydot, parameters])
        point = dict(zip(system.inputs, inputs.tolist(), strict=True))
        for name, (function, expressions) in functions.items():
            exact = function(inputs)
            if name == "margins":  # what is not in play is printed as open
                exact = np.where(system.active_guards(np.array(parameters)), exact, 1.0)
            error = np.abs(np.array(getattr(module, name)(t, y, ydot, parameters)) - exact)
            for i in np.flatnonzero(~(error <= FORMULA_EPS * np.abs(exact))):
                assert error[i] <= FORMULA_EPS * float(magnitude(expressions[i]).subs(point).n(53, real=True)), name
        exact = np.concatenate(model.program.derivatives(inputs), axis=1)
        found = np.concatenate(module.jacobian(t, y, ydot, parameters), axis=1)
        assert np.all(np.abs(found - exact) <= 1e-12 * np.max(np.abs(exact), axis=1, keepdims=True))
    code = [line for line in source_of(module).splitlines() if "#" not in line]
    breakable = [line for line in code if " " in line.strip() and "conductance" not in line]
    assert max(map(len, breakable)) <= 120


@pytest.mark.parametrize("scene", [scenes.one_sided, scenes.sliding], ids=lambda scene: scene.__name__)
@pytest.mark.parametrize(("form", "suffix"), [(printing.python, "py.txt"), (latex, "tex.txt")])
def test_print_is_approved(scene, form, suffix):
    """To approve a change, write the new text over the file in tests/approved and read the difference."""
    text = form(assemble(scene()), scene.__name__.replace("_", " "))
    assert text == (APPROVED / f"{scene.__name__}.{suffix}").read_text(encoding="utf-8")


def test_parameters_are_those_of_the_scene_with_unit_and_path():
    system, module = assembled(scenes.coupled), printed(scenes.coupled)
    source = source_of(module)
    assert list(module.PARAMETERS) == [p.at(0.0) for p in system.parameters]
    t, y, ydot, parameters = next(random_states(system))
    assert module.residual(t, y, ydot) == module.residual(t, y, ydot, parameters)
    comments = [t.string for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.type == tokenize.COMMENT]
    for p in system.parameters:
        assert any(f"# {p.symbol} " in c and f"[{p.spec.unit}]" in c and f"({p.path})" in c for c in comments)
        assert repr(p.at(0.0)) in source


def test_a_module_shows_in_tracebacks_what_its_functions_read_and_no_more():
    system, module = assembled(scenes.cure), printed(scenes.cure)
    assert linecache.getline(module.__file__, 1).startswith('"""')
    with pytest.raises(ZeroDivisionError) as caught:
        module.residual(0.0, [0.1, 0.0], [0.0, 0.0])
    assert str(caught.traceback[-1].path) == module.__file__
    source = printing.python(system, 'A "quoted" title\n"""\nimport os # \\')
    residual = source[source.index("def residual") : source.index("def outputs")]
    assert "R_arrhenius =" in residual
    assert "E_total =" not in residual
    assert ast.get_docstring(ast.parse(source)).startswith("A \"quoted\" title ''' import os # /")
    assert [type(node).__name__ for node in ast.parse(source).body[:2]] == ["Expr", "Import"]


@pytest.mark.parametrize("name", ["area-stretch", "press-conductance"])
def test_every_piece_of_a_history_is_printed(name):
    """The printed module finds the numbers that the compiled code is given, on both sides of every breakpoint."""
    case = cases.load(name)
    model = Model(case.system())
    assert any(p.load and p.field for p in model.system.parameters)
    module, problem = printing.executable(model.system), model.problem(case.run, model.values())
    breaks = problem.segments
    times = np.concatenate([breaks, breaks[:-1] + np.diff(breaks) * 0.3, np.nextafter(breaks[:-1], np.inf)])
    for t in times.tolist():
        row = problem.parameters[np.searchsorted(breaks[1:-1], t)].tolist()
        at = module.parameters_at(t)
        assert [at[j] for j in module.CHANGING] == [row[j] for j in module.CHANGING]
        y, ydot = problem.y0.tolist(), [0.0] * len(problem.y0)
        assert module.residual(t, y, ydot) == module.residual(t, y, ydot, at)
    text = latex(model.system, name)
    assert all(f"from {start!r} s on" in text for start, _ in module.PIECES[1:])


def test_the_printed_velocity_steps_are_those_of_the_run():
    # At even times, none of which is a step of the loads, where the printed histories have one side only.
    trajectory = surfacechem.run("rate-and-state-velocity-steps", ["run.outputs=201"]).trajectory
    module, result = printing.executable(trajectory.model.system), trajectory.result
    for t, y, ydot, row in zip(result.times, result.outputs, trajectory.rates, trajectory.outputs, strict=True):
        printed = module.outputs(t, y.tolist(), ydot.tolist())
        np.testing.assert_allclose(printed, row, rtol=1e-13, atol=1e-13 * np.max(np.abs(row)))
