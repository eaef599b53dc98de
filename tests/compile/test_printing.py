"""Printed equations: they run, they agree with the machine code, and two of them are approved as they stand."""

import ast
import io
import linecache
import math
import tokenize
from pathlib import Path

import numpy as np
import pytest
import scenes
import symengine

import surfacechem
from surfacechem import format as cases
from surfacechem.compile import printing
from surfacechem.documents import shipped
from surfacechem.model.assemble import assemble
from surfacechem.solve.run import Model

APPROVED = Path(__file__).parents[1] / "approved"
PRINTED = [scenes.one_sided, scenes.sliding]


def random_states(system, count=20):
    random = np.random.default_rng(7)
    for _ in range(count):
        scale = np.array([state.scale for state in system.states])
        y = scale * random.uniform(0.6, 1.0, len(scale))
        yield random.uniform(0, 2), y, scale * random.normal(size=len(scale)), [p.at(0.0) for p in system.parameters]


def compiled(model):
    program = model.program
    functions = {"residual": program.residual, "outputs": model.output_function, "ledger": program.ledger}
    return {name: f for name, f in (functions | {"margins": program.margins}).items() if f is not None}


def expanded(system, name):
    expressions = {
        "residual": list(system.rows.values()),
        "outputs": [item.expression for item in system.outputs],
        "ledger": [account.rate for account in system.ledger],
        "margins": [m.masked for m in system.moving_margins()] + [item.masked for item in system.edges],
    }[name]
    return [system.expand(e) for e in expressions]


def magnitude(expression, point):
    """Scale of the rounding: the value if the terms of every sum in it had the same sign."""
    if isinstance(expression, symengine.Add):
        return sum(magnitude(term, point) for term in expression.args)
    if isinstance(expression, symengine.Mul):
        return math.prod(magnitude(factor, point) for factor in expression.args)
    if isinstance(expression, symengine.Pow) and expression.args[1].is_Number and expression.args[1] > 0:
        return magnitude(expression.args[0], point) ** float(expression.args[1])
    value = abs(float(symengine.sympify(expression).subs(point).n(53, real=True)))
    return value + 1.0 if "log" in str(expression) else value


def two_pathways_and_their_limits():
    """A mechanism whose conditions hold piecewise terms, which hold others."""
    return surfacechem.load("vinculin-catch-bond").case.scene


@pytest.mark.parametrize("scene", [*scenes.ALL, two_pathways_and_their_limits], ids=lambda scene: scene.__name__)
def test_printed_source_agrees_with_machine_code(scene):
    system = assemble(scene())
    model, module = Model(system), printing.executable(system)
    functions = {name: (function, expanded(system, name)) for name, function in compiled(model).items()}
    for t, y, ydot, parameters in random_states(system):
        inputs = np.concatenate([[t], y, ydot, parameters])
        point = dict(zip(system.inputs, inputs.tolist(), strict=True))
        for name, (function, expressions) in functions.items():
            exact = function(inputs)
            if name == "margins":  # what is not in play is printed as open
                exact = np.where(system.in_play(parameters), exact, 1.0)
            error = np.abs(np.array(getattr(module, name)(t, y, ydot, parameters)) - exact)
            for i in np.flatnonzero(~(error <= 1e-13 * np.abs(exact))):
                assert error[i] <= 1e-13 * magnitude(expressions[i], point), name


def test_conditions_with_piecewise_terms_have_a_latex_form():
    text = printing.latex(assemble(two_pathways_and_their_limits()))
    assert text.count(r"\begin{cases}") == text.count(r"\end{cases}") > 0
    assert printing.APART not in text


def test_parameters_default_to_those_of_the_scene():
    system = assemble(scenes.coupled())
    module = printing.executable(system)
    assert list(module.PARAMETERS) == [p.at(0.0) for p in system.parameters]
    t, y, ydot, parameters = next(random_states(system))
    assert module.residual(t, y, ydot) == module.residual(t, y, ydot, parameters)


@pytest.mark.parametrize("scene", PRINTED, ids=lambda scene: scene.__name__)
@pytest.mark.parametrize("form", ["python", "latex"])
def test_print_is_approved(scene, form):
    """To approve a change, write the new text over the file in tests/approved and read the difference."""
    text = getattr(printing, form)(assemble(scene()), scene.__name__.replace("_", " "))
    suffix = {"python": "py.txt", "latex": "tex.txt"}[form]
    assert text == (APPROVED / f"{scene.__name__}.{suffix}").read_text(encoding="utf-8")


@pytest.mark.parametrize("scene", scenes.ALL, ids=lambda scene: scene.__name__)
def test_lines_are_short_enough_to_read(scene):
    source = printing.python(assemble(scene()))
    code = [line for line in source.splitlines() if "#" not in line]
    breakable = [line for line in code if " " in line.strip() and "conductance" not in line]
    assert max(map(len, breakable)) <= 120
    ast.parse(source)


def test_every_parameter_is_printed_in_full_with_unit_and_path():
    system = assemble(scenes.coupled())
    source = printing.python(system)
    comments = [t.string for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.type == tokenize.COMMENT]
    for p in system.parameters:
        assert any(f"# {p.symbol} " in c and f"[{p.spec.unit}]" in c and f"({p.path})" in c for c in comments)
        assert repr(p.at(0.0)) in source


def test_source_shows_in_tracebacks():
    module = printing.executable(assemble(scenes.cure()))
    assert linecache.getline(module.__file__, 1).startswith('"""')
    with pytest.raises(ZeroDivisionError) as caught:
        module.residual(0.0, [0.1, 0.0], [0.0, 0.0])
    assert str(caught.traceback[-1].path) == module.__file__


def test_only_what_a_function_reads_is_printed():
    system = assemble(scenes.cure())
    source = printing.python(system)
    residual = source[source.index("def residual") : source.index("def outputs")]
    assert "R_arrhenius =" in residual
    assert "E_total =" not in residual


def test_text_cannot_leave_its_comment():
    system = assemble(scenes.cure())
    source = printing.python(system, 'A "quoted" title\n"""\nimport os # \\')
    assert ast.get_docstring(ast.parse(source)).startswith("A \"quoted\" title ''' import os # /")
    assert [type(node).__name__ for node in ast.parse(source).body[:2]] == ["Expr", "Import"]


def test_latex_is_balanced():
    for scene in scenes.ALL:
        text = printing.latex(assemble(scene()))
        assert text.count("{") == text.count("}")
        assert text.count(r"\begin{cases}") == text.count(r"\end{cases}")
        assert text.count("&=") == text.count("&& ")


WITH_TABLES = sorted(path.stem for path in shipped.cases().glob("*.yaml") if "table:" in path.read_text())


@pytest.mark.parametrize("name", WITH_TABLES)
def test_every_piece_of_a_history_is_printed(name):
    """The printed module finds the numbers that the compiled code is given, on both sides of every breakpoint."""
    case = cases.load(name)
    model = Model(case.system())
    assert any(p.load and p.field for p in model.system.parameters)
    module, system = printing.executable(model.system), model.system
    problem = model.problem(case.run, model.values())
    breaks = problem.segments
    times = np.concatenate([breaks, breaks[:-1] + np.diff(breaks) * 0.3, np.nextafter(breaks[:-1], np.inf)])
    for t in times.tolist():
        row = problem.parameters[np.searchsorted(breaks[1:-1], t)].tolist()
        at = module.parameters_at(t)
        assert [at[j] for j in module.CHANGING] == [row[j] for j in module.CHANGING]
        y, ydot = problem.y0.tolist(), [0.0] * len(problem.y0)
        assert module.residual(t, y, ydot) == module.residual(t, y, ydot, at)
    text = printing.latex(system)
    assert all(f"from {start!r} s on" in text for start, _ in module.PIECES[1:])


def test_the_printed_velocity_steps_are_those_of_the_run():
    solution = surfacechem.run("rate-and-state-velocity-steps")
    system, result = solution.trajectory.model.system, solution.trajectory.result
    module, names = printing.executable(system), [item.name for item in system.outputs]
    for t, y, ydot, row in zip(
        result.times, result.outputs, solution.trajectory.rates, solution.trajectory.outputs, strict=True
    ):
        printed = module.outputs(t, y.tolist(), ydot.tolist())
        np.testing.assert_allclose(printed, row, rtol=1e-13, atol=1e-13 * np.max(np.abs(row)), err_msg=str(names))
