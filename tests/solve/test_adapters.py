"""Solvers by name, and the honesty of the adapters: what a library gets wrong must not be reported as a success."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import symengine as se
from sampling import every
from solver_problems import DY, T, Y, problem, scalar

from surfacechem import load
from surfacechem.compile.program import compile_program
from surfacechem.errors import InputError
from surfacechem.model.system import State
from surfacechem.quantities import VARIABLES
from surfacechem.results.event_table import event_times
from surfacechem.solve import names, solver
from surfacechem.solve.adapters import stepping
from surfacechem.solve.contract import Guard, Problem, Status
from surfacechem.solve.diagnose import runaway, swiftest

pytestmark = pytest.mark.around


Z, DZ = se.symbols("z dz")
HOPELESS = [
    ([DY + se.sqrt(Y) + 1], 0.7),  # no real rate below y = 0
    ([DY - Y**2], 1.0 + 1e-5),  # it blows up at t = 1
    ([DY + Z, Z**2 + 1 + Y**2], 0.0),  # no consistent state
]


@pytest.mark.parametrize("name", ["cvode", "cantera"])
def test_a_library_that_takes_no_step_without_a_variable_says_so(name):
    alone = problem(compile_program(T, [Z], [DZ], [], [Z - T]), [0.0], [0.0, 1.0], 1e-6)
    with pytest.raises(InputError, match=f"{name} has nothing to integrate, since all variables follow from balances"):
        solver(name).solve(alone)
    assert solver("ida").solve(alone).y == pytest.approx([1.0])


@pytest.mark.parametrize("name", names)
@pytest.mark.parametrize(("rows", "last"), HOPELESS)
def test_what_cannot_go_on_is_no_success(name, rows, last):
    n = len(rows)
    program = compile_program(T, [Y, Z][:n], [DY, DZ][:n], [], rows)
    result = solver(name).solve(problem(program, [1.0] * n, [0.0, 5.0], 1e-6, max_steps=5_000))
    assert not result.status.success
    assert result.t <= last
    assert last == 0.0 or np.isfinite(result.y).all()


@pytest.mark.parametrize("name", ["cantera", "bdf", "scipy-radau", "cvode", "ida"])
def test_what_grows_from_below_the_tolerance_is_not_damped(name: str) -> None:
    """The same as of our stepper: a long step would rest on the unstable equilibrium, -1e-14, at any tolerance."""
    program = scalar(DY - Y * (1 - Y) - 1e-14)
    result = solver(name).solve(problem(program, [0.0], [0.0, 1e4], 1e-3, atol=1e-10))
    assert result.status.success
    assert result.y[0] == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "rates"),
    [
        *((name, (3.9e13, 4.2e12, 7.9e11, 1.9e12)) for name in ("cantera", "cvode")),
        ("bdf", (4.3e12, 6.4e13, 2.8e13, 1e11)),
    ],
)
def test_traces_in_fast_exchange_do_not_grow_by_the_roundoff_of_their_rates(name: str, rates) -> None:
    x, dx = se.symbols("x dx")
    f, g = rates[0] * Y - rates[1] * Z, rates[2] * Z - rates[3] * x
    program = compile_program(T, [Y, Z, x], [DY, DZ, dx], [], [DY + f, DZ - f + g, dx - g])
    result = solver(name).solve(problem(program, [1e-20] * 3, [0.0, 1e6], 1e-6, atol=1e-10))
    assert result.status.success
    assert result.counters.steps < 100


@pytest.mark.parametrize("name", ["cantera", "cvode"])
def test_a_first_transient_far_below_the_rounding_of_the_end(name: str) -> None:
    program = scalar(DY + 1e24 * (Y - 0.5 - se.exp(-T) / 2))
    result = solver(name).solve(problem(program, [0.5], [0.0, 1.0], 1e-6, atol=1e-12))
    assert result.status.success
    assert result.y[0] == pytest.approx(0.5 + np.exp(-1.0) / 2, rel=1e-6)


def steep(name: str, row, start: float, end: float, **more):
    """A run of y from 1 on, of which a library keeps the steps."""
    program = scalar(row, 2 * Y * DY)
    more |= {"times": [start, end], "record_steps": True}
    return solver(name).solve(problem(program, [1.0], [start, end], 1e-8, **more))


LAYER = Y * DY - 1e17
"""y = sqrt(1 + 2e17 (t - 1)), which doubles within 2e-17."""


@pytest.mark.parametrize("name", every(3, [name for name in names if name != "cantera"]))
def test_a_layer_within_the_last_digit_of_the_clock(name: str) -> None:
    result = steep(name, LAYER, 1.0, 2.0)
    assert result.status.success
    np.testing.assert_allclose(result.outputs[1], np.sqrt([2e17]), rtol=1e-6)
    np.testing.assert_allclose(result.ledger_outputs[1], [2e17], rtol=1e-6)


@pytest.mark.parametrize("name", ["lsoda", "bdf", "scipy-radau", "cvode", "ida"])
def test_steps_are_counted_while_the_clock_stands(name: str) -> None:
    assert steep(name, LAYER, 1.0, 2.0, max_steps=5).status is Status.STEP_UNDERFLOW


@pytest.mark.parametrize(("row", "start", "reason"), [(DY + 0.5 / Y, 0.0, "phi runs away"), (LAYER, 1.0, "None")])
def test_only_what_gets_faster_runs_away(row, start, reason):
    """What is too fast is named all the same."""
    result, states = steep("cantera", row, start, 2.0), [State(VARIABLES["phi"], 1.0, 1.0)]
    assert result.status is Status.STEP_UNDERFLOW
    assert str(runaway(states, result)).startswith(reason)
    assert swiftest(states, result) == f": phi = {result.y[0]:.3g} changes by {result.ydot[0]:.3g} 1/s"
    still = SimpleNamespace(status=result.status, y=result.y, ydot=np.zeros(1))
    assert swiftest(states, still).startswith(": no state changes there")


@pytest.mark.parametrize("name", names)
def test_outputs_right_after_the_start(name: str) -> None:
    result = solver(name).solve(problem(scalar(DY + Y), [1.0], [0.0, 1.0], 1e-10, times=[2e-10, 1.0]))
    np.testing.assert_allclose(1.0 - result.outputs[0], 2e-10, rtol=1e-4)


def test_problem_is_checked() -> None:
    with pytest.raises(ValueError, match="the program has 1 states, 0 parameters and 0 margins"):
        Problem(scalar(DY + Y), np.ones(1), np.zeros(0), np.array([0.0, 1.0]), np.zeros((1, 2)), 1e-6, np.ones(1))


@pytest.mark.parametrize("name", ["bdf", "scipy-radau"])
def test_factorizations_are_counted_where_the_library_tells(name: str) -> None:
    result = solver(name).solve(problem(scalar(DY + 1e4 * (Y - se.cos(T))), [1.0], [0.0, 1.0], 1e-6))
    assert result.counters.factorizations > 1


@pytest.mark.parametrize(("name", "rtol"), [("bdf", 1e-8), ("bdf", 1e-10), ("scipy-radau", 1e-10)])
def test_bonds_that_break_ever_faster_rupture(name: str, rtol: float) -> None:
    """They are three per cent of all where time tells no more of them apart."""
    simulation = load("shared-load-rupture")
    trajectory = simulation.model.solve(replace(simulation.case.run, rtol=rtol, solver=name, accuracy=None))
    assert trajectory.reason.startswith("the bonds ruptured near t = 1.11954")


@pytest.mark.parametrize("name", every(7, names))
def test_a_peak_before_an_event_is_seen(name: str) -> None:
    """Attachment peaks at touch, in the last hundredths of a long approach: a step may go on to where it is over."""
    simulation = load("press-hold-pull")
    run = replace(simulation.case.run, rtol=1e-7, solver=name, accuracy=None)
    times = event_times(simulation.model.solve(run))
    np.testing.assert_allclose(times["touch"], [0.5], rtol=1e-8)
    np.testing.assert_allclose(times["release"], [21.15942147473261], rtol=1e-5)


@pytest.mark.parametrize("solver", every(3, ["lsoda", "bdf", "scipy-radau"]))
def test_steps_looked_at_together_are_those_looked_at_one_by_one(solver, monkeypatch):
    """Events lie before what a library has stepped through already."""
    case = load("debonding", {"run.solver": solver})
    together = case.run(error="balances").dataset
    monkeypatch.setattr(stepping, "MOST_TOGETHER", 1)
    alone = case.run(error="balances").dataset
    for name in ("event_time", "time", "phi"):
        np.testing.assert_array_equal(together[name], alone[name])


@pytest.mark.parametrize("name", names)
def test_kinks_at_zero_fire_with_others_where_a_segment_ends_and_only_there(name: str) -> None:
    """In the next segment the second guard is zero; where steps are repeated after a peak up to an event, none ends."""
    p, kinks = se.Symbol("p"), (Guard.restart(),) * 2
    program = compile_program(T, [Y], [DY], [p], [DY - 1], margins=[1 - T, p * (0.1 + 0.2 - 0.3 * T)])
    first = problem(program, [0.0], [0.0, 1.0], 1e-8, parameters=[1.0], margins=kinks)
    both = replace(first, segments=np.array([0.0, 1.0, 2.0]), parameters=np.array([[1.0], [0.0]]))
    events = solver(name).solve(both).events
    assert events.index.tolist() == [0, 1]
    assert events.t == pytest.approx([1.0, 1.0], rel=1e-15)
    program = scalar(DY - se.exp(-(((T - 0.9) / 0.05) ** 2)), margins=[1 - T, (T - 1) ** 2 + 1e-17])
    assert solver(name).solve(problem(program, [1.0], [0.0, 5.0], 1e-6, margins=kinks)).events.index.tolist() == [0]
