"""Equations for readers: they hold where the guarded ones do, name no guard, and read as a paper would print them."""

import numpy as np
import pytest
import symengine
import sympy
from case_runs import load

import surfacechem
from surfacechem.compile.typeset import CONSTANTS, PaperPrinter, equations, readable, statements
from surfacechem.expressions import where
from surfacechem.runs.listing import plain

pytestmark = pytest.mark.around

SHOWN = ["stick-slip", "elastic-bonds-at-a-gap", "vinculin-catch-bond", "cohesive-cycles", "thermal-press"]


def assembled(name):
    return load(name).system


def a_state(system):
    """Numbers for every symbol of a scene, the named quantities among them, near its start."""
    random = np.random.default_rng(3)
    point = {p.symbol: p.at(0.0) for p in system.parameters} | {symengine.Symbol("t"): 0.5}
    for state in system.states:
        point |= {state.symbol: state.scale * random.uniform(0.6, 0.9), state.dot: state.scale * random.normal()}
    for item in system.named:
        point[symengine.Symbol(item.name)] = number(item.expression, point)
    return point | {symbol: value for symbol, (value, _) in CONSTANTS.items() if symbol.is_Symbol}


def number(expression, point):
    return float(symengine.sympify(expression).subs(point).n(53, real=True))


@pytest.mark.parametrize("name", SHOWN)
def test_what_is_shown_holds_wherever_no_guard_is_in_play(name):
    system = assembled(name)
    point, found = a_state(system), statements(system)
    for state, row in system.rows.items():
        sides = [(number(line.left, point), number(line.right, point)) for line in found if line.name == state]
        exact = abs(number(row, point))
        errors = [abs(abs(left - right) - exact) / max(abs(left), abs(right), exact) for left, right in sides]
        assert min(errors) < 1e-7, state
    for item in system.named:
        shown = [number(line.right, point) for line in found if line.name == item.name]
        exact = number(item.expression, point)
        assert not shown or min(abs(each - exact) for each in shown) <= 1e-7 * abs(exact), item.name


def test_a_slide_and_its_bonds_read_as_in_a_paper():
    found = [(line.left, " ".join(line.pieces), line.when) for line in equations(assembled("stick-slip"))[0]]
    force = r"= \frac{k_{t}\,\left(w_t - u_t\right) - t_{\mathrm{coulomb}}}{m_{t}}"
    slides = (r"\dot{v}", force, "slides backward or slides forward")
    assert found[:3] == [(r"\dot{u}_t", "= v", ""), slides, (r"\dot{v}", "= 0", "sticks")]
    rates, symbols = equations(assembled("elastic-bonds-at-a-gap"))
    rate = next(line for line in rates if line.when == "between its bounds")
    assert r"\exp\left(\frac{f\,x_{\mathrm{off}}}{k_{\mathrm{B}}\,T_c}\right)" in rate.pieces[0]
    assert symbols["loading.g_n.level"] == "g_n"


def test_what_is_no_guard_stays():
    x, y = symengine.symbols("x y")
    assert [readable(where(x > 0, x, 0.0 * x)), readable(where(x < 0, -x, x))] == [symengine.Max(0, x), abs(x)]
    for kept in (where(x > y, x**2, y), where(x > 0, y, symengine.Integer(0))):
        assert readable(kept) == kept


def as_text(system):
    return [plain(" ".join((line.left, *line.pieces))) for line in equations(system)[0]]


def test_every_quantity_is_shown_where_nothing_evolves():
    bodies, law = {name: {"temperature": "300 K"} for name in "ab"}, {"penalty": {"E_n": "1 MPa/um"}}
    case = surfacechem.load({"bodies": bodies, "interface": {"potential": [law]}, "loading": {"g_n": 0}})
    assert "t_n = " in " ".join(as_text(case.system))


def test_the_fall_of_friction_has_no_guard_at_rest():
    law = {"stribeck": {"mu_s": 0.5, "mu_k": 0.3, "v_s": "2 mm/s", "delta": 1.0}}
    heat = {"temperature": "T", "capacity": "constant", "C": "20 kJ/m^2/K"}
    slider = {
        "T_0": "293 K",
        "bodies": {"block": heat, "base": heat},
        "interface": {"temperature": "T", "friction": [law]},
        "mechanics": {"tangential": {"k": "5 kPa/mm", "m": "500 kg/m^2"}},
        "loading": {"p": "50 kPa", "w_t": {"ramp": {"rate": "0.5 mm/s"}}},
        "initial": {"T": "293 K"},
        "run": {"until": "30 s"},
    }
    fall = "p (μ_k + (μ_s - μ_k) exp(- (v/v_s)^δ))"
    falls = [f"t_stribeck = -{fall.replace('(v', '(-v')}", f"t_stribeck = {fall}", "t_stribeck = 0"]
    assert as_text(surfacechem.load(slider).system)[-3:] == falls


def test_a_turn_of_sliding_has_no_guard_at_rest(monkeypatch):
    """Nor of its speed, by what no time resolves; the symbol of a magnitude has its bars already.

    For sines SymPy would search up to minutes, and find nothing shorter.
    """
    monkeypatch.setattr("sympy.simplify", lambda whole: whole if not whole.has(sympy.sin) else pytest.fail("a search"))
    for name in ("anisotropic-slide", "pulled-at-an-angle"):
        (turn,) = (line for line in as_text(load(name).system) if line.startswith("dα/dt |v|"))
        assert turn.startswith("dα/dt |v| = 1/m_t (")
        assert "10^" not in turn


def test_a_range_of_gaps_in_which_a_law_is_continued_is_no_part_of_it():
    approach = as_text(load("snap-in").system)[0]
    assert "(g_0^6/g_n^6 - 5))/(5 g_n^4) + k_n" in approach
    assert "for" not in approach


def test_a_charge_is_printed_by_the_name_of_the_constant():
    assert "i_electron = R_R1 e" in as_text(load("lithium-charging").system)


def test_choices_and_functions_are_text_without_words_of_latex():
    x, y = symengine.symbols("x y")
    inner = where(x > 0, abs(y), symengine.sin(x) + 1)
    shown = PaperPrinter({}).text(where(symengine.And(x < 1, y < 2), inner**2 / y, y))
    assert plain(shown) == "(((|y|^2 for x > 0; (sin(x) + 1)^2 otherwise))/y for x < 1 ∧ y < 2; y otherwise)"
    assert plain(r"m\,\ddot{g}_n = \mathcal{F}\left(g_n\right)") == "m d²g_n/dt² = F (g_n)"
    rate = as_text(load("rate-and-state-stick-slip").system)
    assert "(d ln θ)/(d t) = e^(-ln θ) - (|v|)/L" in rate
