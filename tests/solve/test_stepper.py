"""The compiled stepper: hard problems with known answers, events, batches, failures."""

import math
from dataclasses import replace

import numpy as np
import pytest
import symengine as se
from scipy.special import spence
from solver_problems import (
    CONDUCTANCE,
    DY,
    T,
    Y,
    coupled_nodes,
    exothermic,
    exothermic_exact,
    exothermic_problem,
    linear_decay,
    problem,
    robertson,
    robertson_dae,
    robertson_sums,
    scalar,
    solved_as_arrays,
)

from surfacechem.compile.program import compile_program
from surfacechem.solve import names, solver
from surfacechem.solve.contract import Guard, Problem, Status
from surfacechem.solve.radau import solver as radau_solver
from surfacechem.solve.radau.solver import Dop853, Radau, consistent, put_rates
from surfacechem.solve.radau.stepper import END, FIRST_COUNTER
from surfacechem.solve.radau.tables import (
    COLLOCATION,
    DEFECT,
    DENSE,
    EXPLICIT,
    EXPLICIT_ERRORS,
    EXPLICIT_NODES,
    FROM_PARTS,
    GAMMA,
    INVERSE,
    NEWTON_NODES,
    NODES,
    PAIR_VALUES,
    SCAN_RATES,
    SCAN_VALUES,
    SCANNED,
    STAGES,
    TO_PARTS,
)

radau = Radau()
ROBERTSON = [2.083340149701255e-08, 8.333360770334713e-14]
"""Hairer & Wanner II, IV.10, at t = 1e11."""


@pytest.mark.parametrize("k", range(3))
def test_order_conditions(k: int) -> None:
    """C(s): A c^(q-1) = c^q / q, and B(2s-1): b c^(q-1) = 1 / q."""
    s = STAGES[k]
    a, c = COLLOCATION[k, :s, :s], NODES[k, :s]
    for q in range(1, s + 1):
        np.testing.assert_allclose(a @ c ** (q - 1), c**q / q, rtol=1e-13, atol=1e-16)
    for q in range(1, 2 * s):
        assert a[-1] @ c ** (q - 1) == pytest.approx(1 / q, rel=1e-14)
    np.testing.assert_allclose(a @ INVERSE[k, :s, :s], np.eye(s), atol=1e-13)


each_member = pytest.mark.parametrize("k", range(3))


@each_member
def test_parts_are_eigenvectors(k):
    """The inverse of the collocation matrix in its real eigenbasis: a number and a rotation with growth each pair."""
    s = STAGES[k]
    blocks = np.zeros((s, s))
    blocks[0, 0] = GAMMA[k]
    for i, value in zip(range(1, s, 2), PAIR_VALUES[k], strict=False):
        blocks[i : i + 2, i : i + 2] = [[value.real, -value.imag], [value.imag, value.real]]
    found = FROM_PARTS[k, :s, :s] @ blocks @ -TO_PARTS[k, :s, :s]
    np.testing.assert_allclose(found, INVERSE[k, :s, :s], rtol=1e-11, atol=1e-11)


@each_member
def test_scanned_points_lie_on_the_polynomial(k):
    s, points = STAGES[k], SCANNED[k, : 4 * k + 9]
    polynomial = np.poly1d([*np.random.default_rng(k).normal(size=s), 0.0])
    stages = polynomial(NODES[k, :s])
    rows = slice(len(points)), slice(s)
    np.testing.assert_allclose(SCAN_VALUES[k][rows] @ stages, polynomial(points), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(SCAN_RATES[k][rows] @ stages, polynomial.deriv()(points), rtol=1e-11, atol=1e-12)
    assert np.all(np.diff(points) > 0)
    assert list(SCAN_VALUES[k, len(points) - 1, :s]) == [0.0] * (s - 1) + [1.0]


@each_member
def test_the_scanned_correction_is_that_of_dense_output(k):
    s, points = STAGES[k], SCANNED[k, : 4 * k + 9]
    shape = DEFECT[k, s + 1]
    for i in range(s, -1, -1):
        shape = shape * (points - NEWTON_NODES[k, i]) + DEFECT[k, i]
    np.testing.assert_allclose(SCAN_VALUES[k, : len(points), s], shape * points, atol=1e-12)


def test_order_conditions_of_the_explicit_steps() -> None:
    """Quadratures of order 8 by the step, of order 7 by its polynomial at all of its nodes, and the nodes as sums."""
    np.testing.assert_allclose(EXPLICIT.sum(axis=1), EXPLICIT_NODES, atol=1e-14)
    for q in range(1, 8):
        powers = EXPLICIT_NODES ** (q - 1)
        assert EXPLICIT[12] @ powers == pytest.approx(1 / q, rel=1e-13)
        np.testing.assert_allclose(DENSE @ powers, NODES[2] ** q / q, atol=2e-13)
    assert EXPLICIT[12] @ EXPLICIT_NODES**7 == pytest.approx(1 / 8, rel=1e-13)
    np.testing.assert_allclose(EXPLICIT_ERRORS @ np.stack([EXPLICIT_NODES**q for q in range(3)]).T, 0.0, atol=1e-13)


def test_explicit_steps_go_on_implicitly_from_where_a_problem_is_stiff() -> None:
    """Robertson's problem, whose transient is over long before its end; one that is not stiff stays explicit."""
    steps, smooth = Dop853(), exothermic_problem(1e-10)
    long = problem(robertson_sums(), [1.0, 0.0, 0.0], [0.0, 1e11], 1e-10, atol=1e-20)
    stiff, mild = steps.solve(long), steps.solve(smooth)
    assert stiff.status.success
    assert stiff.counters.jacobians > 0 == mild.counters.jacobians
    np.testing.assert_allclose(stiff.y, radau.solve(long).y, rtol=1e-7)
    np.testing.assert_allclose(mild.outputs, exothermic_exact(smooth.times), rtol=1e-10)


def test_rates_by_their_formula_are_those_of_the_linear_systems(monkeypatch) -> None:
    result = radau.solve(exothermic_problem(1e-10))
    program, times, y, parameters = result.problem.program, result.times, result.outputs, result.problem.parameters[0]
    solved = consistent(program, times, y, np.zeros_like(y), parameters)
    rows = np.hstack([times[:, None], y, np.full_like(y, np.nan), np.tile(parameters, (len(times), 1))])
    monkeypatch.delattr("surfacechem.solve.radau.stepper.Loop.run")  # nothing is solved
    put_rates(program, rows)
    np.testing.assert_allclose(rows[:, 3:5], solved.ydot, rtol=4e-15)
    np.testing.assert_allclose(rows[:, 4], 2.0 * np.exp(-2.0 * times), rtol=1e-7)


@pytest.mark.parametrize("rtol", [10.0**-digits for digits in range(3, 14)])
@pytest.mark.parametrize(
    ("make", "digits"),
    # Cancelling rates of 1e-9, known to 1e-25, integrated over 1e11 s: no method finds more digits of the first two.
    [(robertson, 1e-7), (robertson_dae, 1e-7), (robertson_sums, 1e-13)],
)
def test_robertson(make, digits: float, rtol: float) -> None:
    result = radau.solve(problem(make(), [1.0, 0.0, 0.0], [0.0, 1e11], rtol, atol=rtol * 1e-10))
    assert result.status == Status.FINISHED
    assert np.max(np.abs(result.y[:2] / ROBERTSON - 1)) < 10 * rtol + digits
    assert result.counters.steps < 400
    assert result.counters.rejected < 0.15 * result.counters.steps


def follower(times) -> Problem:
    """A variable that follows another within 1e-9 s, and its ledger."""
    t, x, y, dx, dy = se.symbols("t x y dx dy")
    program = compile_program(t, [x, y], [dx, dy], [], [dx + x, dy - 1e9 * (1 / (1 + x**4) - y)], ledger=[y])
    return problem(program, [3.0, 1 / 82], [0.0, 3.0], 1e-11, times=times)


@pytest.mark.parametrize("count", [61, 2001])
def test_outputs_are_as_good_as_step_ends_where_a_variable_follows_another(count: int) -> None:
    times = np.linspace(0.0, 3.0, count)
    result = radau.solve(follower(times))
    exact = 1 / (1 + (3.0 * np.exp(-times)) ** 4)
    lag = 4 * exact**2 * (3.0 * np.exp(-times)) ** 4 * 1e-9
    np.testing.assert_allclose(result.outputs[count // 12 :, 1], (exact - lag)[count // 12 :], rtol=1e-10)
    integral = np.log((np.exp(4 * times) + 81) / 82) / 4 - 1e-9 * (exact - exact[0])
    np.testing.assert_allclose(result.ledger_outputs[:, 0], integral, rtol=1e-10, atol=1e-12)
    # Steps are repeated in parts, however many outputs there are, and the steps themselves do not depend on these.
    assert result.counters.steps < result.counters.factorizations < 4 * result.counters.steps
    assert np.array_equal(result.y, radau.solve(follower(times[[0, -1]])).y)


@pytest.mark.parametrize("conductance", CONDUCTANCE)
def test_sum_row_keeps_the_mean_temperature(conductance: float) -> None:
    """Two nodes, capacities 1e-15 and 2, heated with 3 W: the total energy is exact whatever the conductance."""
    result = radau.solve(problem(coupled_nodes(conductance), [300.0, 300.0], [0.0, 10.0], 1e-10))
    assert result.status == Status.FINISHED
    np.testing.assert_allclose(result.y, [315.0, 315.0], rtol=1e-9)


def test_initial_layer_far_below_rounding() -> None:
    """y' = -(y - cos t) / 1e-200: the first step is of the layer's own size."""
    program = scalar(DY + 1e200 * (Y - se.cos(T)))
    result = radau.solve(problem(program, [2.0], [0.0, 1.0], 1e-8, record_steps=True))
    assert result.status == Status.FINISHED
    assert result.steps is not None
    assert result.steps.t[1] < 1e-199
    assert result.y[0] == pytest.approx(np.cos(1.0), rel=1e-8)


@pytest.mark.parametrize("name", ["radau", "dop853"])
@pytest.mark.parametrize(("k", "power"), [(50.0, 1), (5.0, 1), (500.0, 2), (50.0, 2)])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10, 1e-12])
def test_a_kink_that_no_margin_tells_of_is_stepped_through_to_the_tolerance(rtol, k, power, name) -> None:
    """A rate that bends as y = t - 1 passes zero: steps across it are rejected, those tried in their place, too."""
    t, y, dy, p = se.symbols("t y dy p")
    beyond = 0.5 if power == 1 else 0.05
    exact = math.expm1(k * beyond) / k if power == 1 else math.tan(math.sqrt(k) * beyond) / math.sqrt(k)
    program = compile_program(t, [y], [dy], [p], [dy - 1 - se.Piecewise((p * y**power, y > 0), (0.0, True))])
    ended = solver(name).solve(problem(program, [-1.0], [0.0, 1 + beyond], rtol, atol=1e-6 * rtol, parameters=[k]))
    assert ended.y[0] == pytest.approx(exact, rel=10 * rtol)


def test_what_grows_from_below_the_tolerance_is_not_damped() -> None:
    """y' = 1e30 y (1 - y) + 1e-3 from y = 0: a long implicit step would rest on the unstable equilibrium."""
    program = scalar(DY - 1e30 * Y * (1 - Y) - 1e-3)
    end = 7.6e-29
    result = radau.solve(problem(program, [0.0], [0.0, 1.0], 1e-8, atol=1e-14, times=[end, 1.0]))
    assert result.status == Status.FINISHED
    grown = np.exp(1e30 * end - np.log(1e33))
    # Close to the absolute tolerance it is known to a few per cent, which last as it grows.
    np.testing.assert_allclose(result.outputs[:, 0], [grown / (1 + grown), 1.0], rtol=1e-2)


def test_what_grows_by_another_from_below_the_tolerance_is_not_damped() -> None:
    """A branching chain: y' = z f - 0.1 y + 1e-25 and z' = y f - 0.1 z with f = 1 - y - z grow by 0.9 from nothing."""
    (y, z), (dy, dz) = se.symbols("y z"), se.symbols("dy dz")
    rows = [dy - z * (1 - y - z) + y / 10 - 1e-25, dz - y * (1 - y - z) + z / 10]
    program = compile_program(se.Symbol("t"), [y, z], [dy, dz], [], rows)
    result = radau.solve(problem(program, [0.0, 0.0], [0.0, 1e4], 1e-6, atol=1e-12, times=[50.0, 1e4]))
    # Half of the source feeds the mode that grows.
    grown = 1e-25 / 2 / 0.9 * np.exp(0.9 * 50.0)
    np.testing.assert_allclose(result.outputs, [[grown, grown], [0.45, 0.45]], rtol=2e-2)


def test_vanishing_capacity_ends_at_zero_temperature() -> None:
    """C T / T0 T' = -Q: T = T0 sqrt(1 - 2 t / tau) reaches zero with infinite slope."""
    t, temperature, rate = se.symbols("t T dT")
    program = compile_program(
        t, [temperature], [rate], [], [2.0 * temperature / 300 * rate + 600.0], margins=[temperature]
    )
    result = radau.solve(problem(program, [300.0], [0.0, 2.0], 1e-10, margins=(Guard.stop(),)))
    assert result.status in (Status.EVENT, Status.STEP_UNDERFLOW)
    assert result.t == pytest.approx(0.5, rel=1e-9)
    assert abs(result.y[0]) < 1e-2


def test_algebraic_variable_and_ledger() -> None:
    """y' = -z, 0 = z^3 + z - y - y^3 has z = y; the ledger of z is 1 - y."""
    t, y, z, dy, dz = se.symbols("t y z dy dz")
    program = compile_program(t, [y, z], [dy, dz], [], [dy + z, z**3 + z - y - y**3], ledger=[z])
    assert program.algebraic == (False, True)
    for name in names:
        result = solver(name).solve(problem(program, [1.0, 5.0], [0.0, 2.0], 1e-8, times=np.linspace(0, 2, 21)))
        assert result.status == Status.FINISHED
        np.testing.assert_allclose(result.outputs, np.exp(-result.times)[:, None] * [1, 1], rtol=2e-6)
        np.testing.assert_allclose(result.ledger_outputs[:, 0], 1 - np.exp(-result.times), atol=2e-6)


@pytest.mark.parametrize("name", names)
def test_segments_change_parameters(name: str) -> None:
    t, y, dy, rate = se.symbols("t y dy rate")
    program = compile_program(t, [y], [dy], [rate], [dy - rate])
    times, segments, levels = np.array([0.5, 1.0, 1.5, 3.0]), np.array([0.0, 1.0, 3.0]), np.array([[1.0], [-2.0]])
    case = Problem(program, np.zeros(1), times, segments, levels, 1e-8, np.array([1e-10]))
    np.testing.assert_allclose(solver(name).solve(case).outputs[:, 0], [0.5, 1.0, 0.0, -3.0], atol=1e-8)


@pytest.mark.parametrize("name", names)
def test_terminal_event(name: str) -> None:
    result = solver(name).solve(
        problem(linear_decay(), [1.0], [0.0, 10.0], 1e-9, margins=(Guard.stop(),), times=np.arange(11.0))
    )
    assert result.status == Status.EVENT
    assert result.t == pytest.approx(np.log(2), rel=1e-6 if name != "radau" else 1e-11)
    assert list(result.times) == [0.0]
    assert list(result.events.index) == [0]


def oscillator(*margins):
    t, x, v, dx, dv = se.symbols("t x v dx dv")
    values = [margin(t, x, v) for margin in margins]
    return compile_program(t, [x, v], [dx, dv], [], [dx - v, dv + x], margins=values)


@pytest.mark.parametrize("name", names)
def test_margin_zero_at_the_start_does_not_fire(name: str) -> None:
    case = problem(oscillator(lambda t, x, v: x), [0.0, 1.0], [0.0, 4.0], 1e-8, margins=(Guard.stop(),))
    assert solver(name).solve(case).t == pytest.approx(np.pi, rel=1e-6)


@pytest.mark.parametrize("name", names)
def test_kinks_restart(name: str) -> None:
    """x' = v, v' = -sign(x): parabolas of period 4 sqrt(2), exact between kinks."""
    t, x, v, dx, dv = se.symbols("t x v dx dv")
    sign = se.Piecewise((1.0, x > 0), (-1.0, True))
    program = compile_program(t, [x, v], [dx, dv], [], [dx - v, dv + sign], margins=[x])
    result = solver(name).solve(problem(program, [1.0, 0.0], [0.0, 9.0], 1e-9, margins=(Guard.restart(),)))
    assert result.status == Status.FINISHED
    np.testing.assert_allclose(result.events.t, np.sqrt(2) * np.array([1.0, 3.0, 5.0]), rtol=1e-6)
    assert len(result.events.t) == 3
    phase = 9.0 - 5 * np.sqrt(2)
    np.testing.assert_allclose(result.y[0], -(np.sqrt(2) * phase - phase**2 / 2), rtol=1e-5)


def test_steps_and_seconds_are_limited(monkeypatch) -> None:
    case, batches, run_one = oscillator(), [], radau_solver._run_one
    assert radau.solve(problem(case, [1.0, 0.0], [0.0, 1e9], 1e-10, max_steps=50)).status == Status.MAX_STEPS
    monkeypatch.setattr(radau_solver, "_run_one", lambda *given: batches.append(run_one(*given)) or batches[-1])
    limits = {"max_steps": 10**12, "max_seconds": 0.05, "record_steps": True}
    endless = radau.solve(problem(case, [1.0, 0.0], [0.0, 1e12], 1e-10, **limits))
    assert endless.status == Status.STOPPED
    assert [batch.counts[0, FIRST_COUNTER] for batch in batches] == [endless.counters.steps] * 2


def test_batch_is_deterministic_and_equals_single_runs() -> None:
    rng = np.random.default_rng(1)
    parameters = np.array([2.0, 300.0, 300.0, 1.0, 0.5]) * rng.uniform(0.5, 1.5, (600, 1, 5))
    y0 = np.stack([parameters[:, 0, 2], np.zeros(600)], axis=1)
    atol = np.array([1e-8, 1e-10])
    alone = problem(exothermic(), y0[7], [0.0, 2.5], 1e-8, atol=atol, times=[1.0, 2.5], parameters=parameters[7])
    one, two = (solved_as_arrays(alone, y0, parameters, threads) for threads in (1, 2))
    assert [each.tobytes() for each in one] == [each.tobytes() for each in two]
    ends, counts, _ = one
    assert np.all(counts[:, END] == Status.FINISHED)
    assert radau.solve(alone).y.tobytes() == ends[7, 1:3].tobytes()
    for i in (0, 599):
        np.testing.assert_allclose(ends[i, 1:3], exothermic_exact(2.5, parameters[i, 0]), rtol=1e-7)


def test_consistent_states_in_rows() -> None:
    t, y, z, dy, dz = se.symbols("t y z dy dz")
    program = compile_program(t, [y, z], [dy, dz], [], [dy + z, z**3 + z - y])
    y_values = np.linspace(-5.0, 5.0, 11)
    found = consistent(program, 0.0, np.stack([y_values, np.ones(11)], axis=1), np.zeros((11, 2)), [])
    assert np.all(found.valid)
    np.testing.assert_allclose(found.y[:, 1] ** 3 + found.y[:, 1], y_values, atol=1e-13)
    np.testing.assert_allclose(found.ydot[:, 0], -found.y[:, 1], rtol=1e-14)


def test_batch_with_times_of_their_own_and_events() -> None:
    """Runs that end at different times, and where each crosses half of its way."""
    t, y, dy, k = se.symbols("t y dy k")
    program = compile_program(t, [y], [dy], [k], [dy + k * y], margins=[y - 0.5])
    rates = np.array([1.0, 10.0, 100.0])
    ends = 3.0 / rates
    given = {"atol": 1e-17, "margins": (Guard.restart(),), "record_steps": True}
    part = np.array([0.0, 0.5, 1.0])
    problems = [
        problem(program, [1.0], [0.0, end], 1e-11, parameters=[rate], times=part * end, **given)
        for rate, end in zip(rates, ends, strict=True)
    ]
    results = radau.solve_all(problems)
    np.testing.assert_allclose([result.t for result in results], ends)
    np.testing.assert_allclose(
        [result.outputs[:, 0] for result in results], np.exp([[0.0, -1.5, -3.0]] * 3), rtol=1e-10
    )
    np.testing.assert_allclose([result.events.t[0] for result in results], np.log(2.0) / rates, rtol=1e-10)
    for result, each in zip(results, problems, strict=True):
        assert result.steps.y.tobytes() == radau.solve(each).steps.y.tobytes()


def test_a_return_code_without_words_ends_the_step():
    """The wrapper of SUNDIALS looks its message up and raises KeyError where it has none."""
    from surfacechem.solve.adapters.stepping import StepError
    from surfacechem.solve.adapters.sundials import _Stretch

    class Library:
        def init_step(self, *_start):
            raise KeyError(-60)

    with pytest.raises(StepError, match="return code -60"):
        _Stretch(Library(), 5, 0.0, 1.0, np.zeros(1))


# -- steps serve the ledger too where the states hardly feel what it integrates ---------------------------------------

RTOL = 1e-11


def booked(rate, end, x_0=0.0, group=0, begin=0.0):
    """A quadrature beside x' = 1 - x: its values at the end of a run, and the steps and refusals."""
    t, x, dx = se.symbols("t x dx")
    program = compile_program(t, [x], [dx], [], [dx - 1 + x], ledger=[rate(t, x, dx)])
    program = replace(program, groups=(group,))
    result = radau.solve(problem(program, [x_0], [begin, end], RTOL, times=[end]))
    assert result.status == Status.FINISHED
    return result.ledger[0], result.counters


def wall(t):
    """Power of the repulsion 1/g^9 on the gap g = 1/10 + (t - 1)^2."""
    return -9 * (se.Rational(1, 10) + (t - 1) ** 2) ** -10 * 2 * (t - 1)


def test_work_on_a_gap_that_is_moved_through_a_steep_wall():
    work, counters = booked(lambda t, x, dx: wall(t), 1.5)
    exact = 0.35**-9 - 1.1**-9
    assert work == pytest.approx(exact, abs=1e-9 * 0.1**-9)
    assert counters.rejected > 0
    open_work, few = booked(lambda t, x, dx: wall(t), 1.5, group=-1)
    assert abs(open_work - exact) > 1e-6 * 0.1**-9
    assert few.steps < counters.steps


def test_work_in_a_segment_that_is_brief_for_the_run():
    """The power of 1/(0.1 + s^2) as s goes from -1 to 1/2, in steps of 1e-5 as time resolves them."""

    def power(t, x, dx):
        s = 1e11 * (t - 1) - 1
        return -1e11 * 2 * s / (se.Rational(1, 10) + s**2) ** 2

    work, _ = booked(power, 1 + 1.5e-11, begin=1.0)
    assert work == pytest.approx(1 / 0.35 - 1 / 1.1, abs=1e-2)


def test_logarithm_of_a_coverage_that_starts_at_zero():
    """The integral of ln(x) dx from 0 is x ln(x) - x."""
    entropy, _ = booked(lambda t, x, dx: dx * se.log(se.Max(x, 1e-300)), 1.0)
    x = 1 - np.exp(-1.0)
    assert entropy == pytest.approx(x * np.log(x) - x, abs=1e-8)


def test_rates_that_are_all_but_singular_at_the_start():
    """Steps come to where they resolve them in a few trials: more would use up the patience with the ledger."""
    logarithm, _ = booked(lambda t, x, dx: se.log(x + 1e-25), 1.0)
    assert logarithm == pytest.approx(spence(1 - np.exp(-1.0)) - np.pi**2 / 6, abs=1e-8)
    _, counters = booked(lambda t, x, dx: se.log(t + 1e-25), 1.0)
    assert counters.rejected < 20


def test_a_rate_that_is_noise_does_not_hold_up_a_run():
    """The rate is the rounding of x + 10^6."""
    _, counters = booked(lambda t, x, dx: ((x + 1e6) - 1e6) - x, 5.0)
    _, alone = booked(lambda t, x, dx: ((x + 1e6) - 1e6) - x, 5.0, group=-1)
    assert counters.steps < 10 * alone.steps + 100


def test_singular_capacity() -> None:
    t, x, y, dx, dy = se.symbols("t x y dx dy")
    program = compile_program(t, [x, y], [dx, dy], [], [dx + dy - 1, 2 * dx + 2 * dy - 1])
    result = radau.solve(problem(program, [0.0, 0.0], [0.0, 1.0], 1e-6))
    assert result.status == Status.SINGULAR
