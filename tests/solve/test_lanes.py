"""Steps of eight runs at once: the results of one run at a time, whatever company a run has."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import case_runs
import narrow_scenes
import numpy as np
import pytest
import symengine as se
from sampling import every
from scipy.special import exp1
from solver_problems import DY, T, Y, exothermic_problem, problem, robertson_sums

import surfacechem
from surfacechem.compile.program import compile_program
from surfacechem.solve.contract import Guard
from surfacechem.solve.lanes import lane_batch
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import solve_arrays
from surfacechem.solve.radau.stepper import END, EVENTS, FIRST_COUNTER, OUTPUTS
from surfacechem.solve.run import Model
from surfacechem.tolerances import LINEAR_RTOL

RUNS = 11
"""Not a multiple of eight, so that lanes run empty."""

CASES = (
    ("exothermic", 0), ("endothermic-kappa-0p99", 0), ("biotin-streptavidin", 0), ("catch-bond", 0),
    ("closing-film", 0), ("epoxy-cure-adiabatic", 0), ("rate-and-state-velocity-steps", 0),
    ("press-conductance", 0), ("squeeze-film", 0),
    ("shared-load-rupture", 0), ("coulomb-stop", 0), ("one-sided-contact", 0), ("snap-in", 0), ("stick-slip", 0),
    ("three-temperatures", RUNS), ("slow-passage", 0), ("cohesive-cycles", None), ("press-hold-pull", RUNS),
)  # fmt: skip
"""Cases of smooth runs, breakpoints, kinks, rupture and stops, and how many runs are left to other steps: stiff ones,
and those with guards that start at zero; None where roundoff decides whether a guard touches zero."""
IMPLICIT_CASES = (
    ("dna-adhesive", 0), ("three-temperatures", 0), ("l-selectin-tether", 0), ("vinculin-catch-bond", 0),
    ("exothermic", 0), ("endothermic-kappa-0p99", 0), ("force-spectroscopy", 0), ("friction-ignited-bonding", 0),
    ("closing-film", 0), ("squeeze-film", 0), ("press-conductance", 0), ("rate-and-state-velocity-steps", 0),
    ("coulomb-stop", 0), ("one-sided-contact", 0), ("slow-passage", 0), ("stick-slip", 0), ("sticky-sphere", 0),
    ("press-hold-pull", 0), ("bouncing-plate", 0), ("cooling-to-zero", RUNS),
)  # fmt: skip
"""The same for implicit steps: the first is stiff, coverages start at zero, one grows from far below its tolerance, a
velocity from zero, and no step is short enough for the last.
"""
METHODS = [*((*case, False) for case in CASES), *((*case, True) for case in IMPLICIT_CASES)]
LAWS = ".bonding", "potential", "friction"


def arrays_of(simulation, runs=RUNS, implicit=False, rtol=1e-9):
    """A problem for steps in lanes, and columns of runs whose laws differ by a thousandth; at loose tolerances without
    accounts, for linearly implicit steps.
    """
    system = simulation.model.system
    model = simulation.model if rtol < LINEAR_RTOL else Model(replace(system, ledger=()))
    run = replace(simulation.case.run, solver="dop853", rtol=rtol)
    problem = replace(model.problem(run, model.values({})), line_error=0.0, record_steps=True)
    problem = replace(problem, explicit=not implicit, implicit_lanes=implicit)
    program = problem.program
    held = {item.symbol for item in (*system.modes, *system.registers)}
    free = [each.symbol not in held and any(part in each.path for part in LAWS) for each in system.parameters]
    own = np.flatnonzero(free)
    table = np.repeat(problem.parameters[None], runs, axis=0)
    table[:, :, own] *= 1 + 1e-3 * np.random.default_rng(0).uniform(-1, 1, (runs, 1, len(own)))
    y0 = np.repeat(problem.y0[None], runs, axis=0)
    peaks = np.zeros((1, program.n_ledger + program.n_margins))
    times = np.linspace(0, problem.segments[-1], 7)[None]
    return problem, (y0, table, np.array([problem.spacing]), peaks, problem.segments[None], times)


@pytest.fixture
def left(monkeypatch):
    """How many runs were left to other steps."""
    counted = [0]

    def counting(problem, *columns, room=None):
        counted[0] += len(columns[0])
        return solve_arrays(problem, *columns, room=room)

    monkeypatch.setattr(lane_batch, "solve_arrays", counting)
    return counted


def assert_alike(found, wanted, n, tolerance):
    for column in (END, EVENTS, OUTPUTS):
        assert np.array_equal(found.counts[:, column], wanted.counts[:, column])
    assert found.ends[:, 0] == pytest.approx(wanted.ends[:, 0], rel=10 * tolerance)
    states = slice(1, 1 + n)
    size = np.maximum(np.abs(wanted.ends[:, states]).max(axis=0), 1e-9)
    # Where bonds rupture, the state changes by much in the last digit of the time.
    steep = np.abs(wanted.ends[:, 1 + n : 1 + 2 * n]) * wanted.ends[:, :1]
    assert np.all(np.abs(found.ends - wanted.ends)[:, states] <= tolerance * (size + 1e-5 * steep))
    for i, reached in enumerate(wanted.counts[:, OUTPUTS]):
        # The last output of a run that has stopped there is its end.
        shown = slice(0, reached)
        assert found.outputs[i, shown, :n] == pytest.approx(wanted.outputs[i, shown, :n], rel=tolerance, abs=tolerance)


@pytest.mark.parametrize(("name", "others", "implicit"), every(2, METHODS))
def test_runs_are_those_of_one_at_a_time(name, others, implicit, left):
    problem, columns = arrays_of(case_runs.load(name), implicit=implicit)
    found = lane_batch.solve_batch(problem, *columns)
    assert others is None or left[0] == others
    wanted = solve_arrays(problem, *columns)
    assert_alike(found, wanted, problem.program.n, 3e-7)
    trials, expected = (each.counts[:, FIRST_COUNTER : FIRST_COUNTER + 2].sum(axis=1) for each in (found, wanted))
    assert np.all(trials <= 2 * expected + 10)
    n, q = problem.program.n, problem.program.n_ledger
    accounts = slice(1 + 2 * n, 1 + 2 * n + q)
    turned = np.abs(wanted.ends[:, accounts]).max(initial=1e-300)
    assert np.all(np.abs(found.ends - wanted.ends)[:, accounts] <= 1e-5 * turned)
    for i, reached in enumerate(wanted.counts[:, OUTPUTS]):
        apart = found.outputs[i, :reached, n:] - wanted.outputs[i, :reached, n:]
        assert np.all(np.abs(apart) <= 1e-5 * turned)


def test_accounts_of_no_group_shorten_no_step(left):
    """What is integrated but not balanced, as amounts that are made, is not held against its polynomial."""
    problem, columns = arrays_of(case_runs.load("exothermic"))
    accounted = lane_batch.solve_batch(problem, *columns)
    free = replace(problem, program=replace(problem.program, groups=(-1,) * problem.program.n_ledger))
    found = lane_batch.solve_batch(free, *columns)
    assert left[0] == 0
    assert np.all(found.counts[:, FIRST_COUNTER] <= accounted.counts[:, FIRST_COUNTER])
    assert np.all(found.counts[:, FIRST_COUNTER + 1] <= accounted.counts[:, FIRST_COUNTER + 1])
    assert found.ends[:, 1:3] == pytest.approx(accounted.ends[:, 1:3], rel=1e-7)


def test_a_step_onto_a_guard_may_be_shorter_than_time_resolves(left):
    """Close to rupture the coverage falls to zero within the last digit of the time."""
    simulation = case_runs.load("shared-load-rupture")
    problem, (y0, table, *others) = arrays_of(simulation, 64)
    load = [parameter.path for parameter in simulation.model.system.parameters].index("loading.t_n.level")
    table[:, :, load] = np.linspace(860.0, 900.0, 64)[:, None]
    problem = replace(problem, rtol=1e-6, record_steps=False)
    found = lane_batch.solve_batch(problem, y0, table, *others)
    assert left[0] == 0
    assert_alike(found, solve_arrays(problem, y0, table, *others), problem.program.n, 1e-5)


@pytest.mark.parametrize(("explicit", "rtol"), [(True, 1e-9), (False, 1e-9), (False, 1e-5)])
def test_a_kink_that_starts_at_zero_fires_once_it_has_left(explicit, rtol, left):
    """A load that rises from zero and returns to it: the kink there counts when it is met again."""
    t, (x, y, dx, dy), a = se.Symbol("t"), se.symbols("x y dx dy"), se.Symbol("a")
    program = compile_program(t, [x, y], [dx, dy], [a], [dx - a * (1 - 2 * t), dy + x * y], margins=[x])
    table = np.random.default_rng(0).uniform(1, 3, (RUNS, 1, 1))
    shared = problem(program, [0.0, 1.0], [0.0, 1.5], rtol, parameters=table[0], margins=(Guard.restart(),))
    alike = np.array([shared.spacing]), np.zeros((1, 1)), shared.segments[None], np.zeros((1, 0))
    columns = np.tile(shared.y0, (RUNS, 1)), table, *alike
    lanes = replace(shared, explicit=explicit, implicit_lanes=not explicit)
    found = lane_batch.solve_batch(lanes, *columns)
    assert left[0] == 0
    assert found.counts[:, EVENTS].tolist() == [1] * RUNS
    assert found.events[:, 0, 1] == pytest.approx(1.0, rel=1e-9)
    assert_alike(found, solve_arrays(shared, *columns), 2, 10 * rtol)


@pytest.mark.parametrize("explicit", [True, False])
def test_a_kink_within_roundoff_of_the_end_of_a_segment_fires_there(explicit, left):
    """Loads turn where they cross zero, to rounding: the next segment cannot tell on which side they were."""
    t, (y, dy), a = se.Symbol("t"), se.symbols("y dy"), se.Symbol("a")
    program = compile_program(t, [y], [dy], [a], [dy - a + y], margins=[a - t])
    shared = problem(program, [1.0], [0.0, 1.0], 1e-9, parameters=[0.3], margins=(Guard.restart(),))
    shared = replace(shared, segments=np.array([0.0, 0.3, 1.0]), parameters=np.full((2, 1), 0.3))
    zeros = np.nextafter(0.3, [0.0, 0.3, 1.0])
    table = np.repeat(zeros[:, None, None], 2, axis=1)
    columns = np.ones((3, 1)), table, np.array([shared.spacing]), np.zeros((1, 1)), shared.segments[None]
    columns = *columns, np.zeros((1, 0))
    lanes = replace(shared, explicit=explicit, implicit_lanes=not explicit)
    found = lane_batch.solve_batch(lanes, *columns)
    assert left[0] == 0
    assert found.counts[:, EVENTS].tolist() == [1, 1, 1]
    assert found.events[:, 0, 1] == pytest.approx(0.3, rel=1e-15)
    assert_alike(found, solve_arrays(shared, *columns), 1, 1e-8)


def test_a_step_onto_a_guard_that_fails_is_given_up(left):
    """Bonds that share a growing load and cool a light interface as they break: short of the guard a long step has
    seen, shorter ones may fail. All runs break, none by the stepper for single runs.
    """
    t, (phi, low, high, T, *rates) = se.Symbol("t"), se.symbols("phi low high T dphi dlow dhigh dT")
    ramp, rebinding, activation, capacity = given = se.symbols("ramp rebinding activation capacity")
    breaking = phi * se.exp(ramp * t / phi * 300 / T)
    bonding = se.exp(activation * (1 / 300.0 - 1 / T)) * (rebinding * (1 - phi) - breaking)
    sources = [bonding, T - low, T - high, (20 * bonding - 2 * T + low + high) / capacity]
    rows = [rate - source for rate, source in zip(rates, sources, strict=True)]
    program = compile_program(t, [phi, low, high, T], rates, given, rows, margins=[phi - 0.05])
    table = np.array([0.2, 1.0, 4000.0, 1e-9]) * np.random.default_rng(0).uniform(0.85, 1.15, (64, 1, 4))
    start = np.array([0.9, 300.0, 300.0, 300.0])
    shared = problem(program, start, [0.0, 100.0], 1e-6, parameters=table[0], margins=(Guard.stop(),))
    columns = np.tile(start, (64, 1)), table, np.array([shared.spacing]), np.zeros((1, 1)), shared.segments[None]
    found = lane_batch.solve_batch(replace(shared, implicit_lanes=True), *columns, np.zeros((1, 0)))
    assert left[0] == 0
    wanted = solve_arrays(shared, *columns, np.zeros((1, 0)))
    assert found.ends[:, 0] == pytest.approx(wanted.ends[:, 0], rel=1e-5)


def test_a_singular_start_takes_as_many_trials_as_time_resolves(left):
    """The production of entropy begins like the logarithm of a coverage, which no quadrature resolves."""
    problem, columns = arrays_of(case_runs.load("l-selectin-tether"), implicit=True)
    tight = replace(problem, rtol=1e-11, atol=1e-2 * problem.atol)
    found = lane_batch.solve_batch(tight, *columns)
    assert left[0] == 0
    assert_alike(found, solve_arrays(tight, *columns), problem.program.n, 1e-10)


def test_runs_without_guards(left):
    problem = replace(exothermic_problem(1e-9), explicit=True)
    one = problem.y0, problem.parameters, np.array(0.1), np.zeros(0), problem.segments, problem.times
    columns = [np.repeat(row[None], RUNS, axis=0) for row in one]
    found = lane_batch.solve_batch(problem, *columns)
    assert left[0] == 0
    assert_alike(found, solve_arrays(problem, *columns), 2, 1e-7)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9, 1e-11])
def test_robertson(rtol, left):
    """To 1e11 s at once, beside runs from other starts; its concentrations fall by fourteen decades."""
    shared = problem(robertson_sums(), [1.0, 0.0, 0.0], [0.0, 1e11], rtol, atol=rtol * 1e-10, implicit_lanes=True)
    y0 = np.array([[1.0, 0.0, 0.0], [0.5, 0.0, 0.5], [2.0, 0.0, 0.0]] * 4)
    columns = y0, np.zeros((len(y0), 1, 0)), np.array([shared.spacing]), np.zeros((1, 0)), shared.segments[None]
    found = lane_batch.solve_batch(shared, *columns, np.zeros((1, 0)))
    assert left[0] == 0
    exact = np.array([2.083340149701255e-08, 8.333360770334713e-14])  # Hairer & Wanner II, IV.10
    assert np.max(np.abs(found.ends[::3, 1:3] / exact - 1)) < 10 * rtol


def alike(program, start, given, end, rtol, method, **options):
    """Eight equal runs by one method; what they end with."""
    shared = problem(program, start, [0.0, end], rtol, parameters=given, **options, **dict.fromkeys(method, True))
    columns = np.tile(shared.y0, (8, 1)), np.tile(shared.parameters, (8, 1, 1)), np.array([shared.spacing])
    solve = lane_batch.solve_batch if method else solve_arrays
    found = solve(shared, *columns, np.zeros((1, 0)), shared.segments[None], np.zeros((1, 0)))
    assert not np.any(found.counts[:, END])
    return found.ends[:, 1 : 1 + program.n]


@pytest.mark.parametrize("method", [(), ("explicit",), ("implicit_lanes",)])
@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_growth_from_less_than_the_least_divisor(rtol, method):
    program = compile_program(T, [Y], [DY], [], [DY - Y * (1 - Y)])
    found = alike(program, [1e-299], [], 600.0, rtol, method, atol=0.0)
    assert found == pytest.approx(1 / (1 + 1e299 * np.exp(-600.0)), rel=100 * rtol, abs=0)


STIFF = [4, 8, 12, 20, 30, 100]
FREEZING = [(k, s, rtol) for k in STIFF for s in (1, 6) for rtol in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10)]


@pytest.mark.parametrize("method", [(), ("implicit_lanes",)])
@pytest.mark.parametrize(("stiff", "soft", "rtol"), every(5, FREEZING))
def test_what_becomes_slow_within_a_step_lags(stiff, soft, rtol, method):
    """Led by t at rates that fall exponentially by decades, y stays behind when they are slow."""
    fall, rate = np.log(10.0) * (stiff + soft), 10.0**stiff
    program = compile_program(T, [Y], [DY], [], [DY + rate * se.exp(-fall * T) * (Y - T)])
    slowest = 10.0**-soft / fall
    lag = np.exp(slowest) * exp1(slowest) / fall
    assert alike(program, [0.0], [], 1.0, rtol, method) == pytest.approx(1 - lag, rel=10 * rtol)


SUDDEN = [
    (30.0, -6.0, 0.001, 0.5, 0.0), (14.5, -14.3, 1e-3, 0.397, 0.0), (21.5, -13.2, 4e-4, 0.895, 0.0),
    (14.9, -7.0, 3.4e-4, 0.663, 5.8e11), (13.6, -14.2, 4.7e-3, 0.321, 1.2e8), (6.6, -3.2, 1e-3, 0.865, 4.4e8),
]  # fmt: skip


@pytest.mark.parametrize("method", [(), ("implicit_lanes",)])
@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-8])
@pytest.mark.parametrize(("stiff", "soft", "span", "at", "exchange"), SUDDEN)
def test_what_becomes_slow_within_a_thousandth_of_a_run_lags(stiff, soft, span, at, exchange, rtol, method):
    """Corrections by a matrix that is stiffer by 36 decades are nothing: what they close is roundoff; nor do steps pass
    over rates that vanish before their first stage. An exchange with a second state hides neither.
    """
    x, dx, *given = se.symbols("x dx upper lower width middle exchanged")
    upper, lower, width, middle, exchanged = given
    falling = upper + lower - (upper - lower) * se.tanh((T - middle) / width)
    led, taken = 10 ** (falling / 2) * (Y - se.sin(3.0 * T)), exchanged * (Y - x)
    program = compile_program(T, [Y, x], [DY, dx], given, [DY + led + taken, dx - taken])
    numbers = [stiff, soft, span, at, exchange]
    exact, found = (alike(program, [0.0, 0.0], numbers, 1.0, each, method, spacing=1 / 60) for each in (1e-12, rtol))
    assert found == pytest.approx(exact, rel=10 * rtol)


@cache
def kinetics(n):
    """A ring of reversible first-order reactions with exchanges of pairs, by mass action, and the heat of each kind."""
    t, y, rates = se.Symbol("t"), se.symbols(f"y:{n}"), se.symbols(f"r:{n}")
    forward, backward, exchange = (se.symbols(f"{name}:{n}") for name in "fbx")
    sources, heats = [0] * n, [0, 0]
    for i in range(n):
        following, second, third = ((i + k) % n for k in (1, 2, 3))
        turned = forward[i] * y[i] - backward[i] * y[following]
        paired = exchange[i] * y[i] * y[second]
        for j, change in ((i, -turned - paired), (following, turned + paired), (second, -paired), (third, paired)):
            sources[j] += change
        heats = [heats[0] + (i + 1) * turned, heats[1] + (2 * i - 5) * paired]
    rows = [rate - source for rate, source in zip(rates, sources, strict=True)]
    program = compile_program(t, y, rates, [*forward, *backward, *exchange], rows, ledger=heats)
    return replace(program, groups=(0, 0))


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-11])
def test_random_kinetics(rtol, n, left):
    """Rates over twelve decades, a third of the reactions stopped and half of the species absent at the start."""
    random = np.random.default_rng(n)
    rates = 10 ** random.uniform(-6, 6, (64, 1, 3 * n)) * (random.random((64, 1, 3 * n)) < 2 / 3)
    y0 = 10 ** random.uniform(-3, 0, (64, n)) * (random.random((64, n)) < 0.5)
    times = [0.01, 0.3, 1.0]
    shared = problem(kinetics(n), y0[0], [0.0, 1.0], rtol, parameters=rates[0], atol=1e-6 * rtol, times=times)
    columns = y0, rates, np.array([shared.spacing]), np.zeros((1, 2)), shared.segments[None], shared.times[None]
    found = lane_batch.solve_batch(replace(shared, implicit_lanes=True), *columns)
    assert left[0] <= 4
    single = solve_arrays(shared, *columns)
    exact = solve_arrays(replace(shared, rtol=max(1e-3 * rtol, 1e-12), atol=1e-3 * shared.atol), *columns)
    assert not np.any(found.counts[:, END])
    # What a species had, and what all accounts of a run have exchanged.
    had = np.maximum(np.abs(exact.outputs[:, :, :n]).max(axis=1), y0)
    exchanged = 30 * np.repeat(np.abs(exact.outputs[:, :, n:]).max(axis=(1, 2))[:, None], 2, axis=1)
    unit = rtol * (np.concatenate([had, exchanged], axis=1) + 1e-6)[:, None]
    missed, expected = (np.max(np.abs(each.outputs - exact.outputs) / unit) for each in (found, single))
    assert missed <= 10 * max(expected, 1)
    assert found.counts[:, FIRST_COUNTER].sum() <= 1.2 * single.counts[:, FIRST_COUNTER].sum()


@pytest.mark.parametrize("implicit", [False, True])
def test_work_in_a_segment_that_is_brief_for_the_run(implicit):
    """The power of 1/(0.1 + s^2) as s goes from -1 to 1/2, in steps of 1e-5 as time resolves them."""
    t, y, dy = se.symbols("t y dy")
    s = 1e11 * (t - 1) - 1
    power = -1e11 * 2 * s / (se.Rational(1, 10) + s**2) ** 2
    program = compile_program(t, [y], [dy], [], [dy - 1 + y], ledger=[power])
    shared = problem(replace(program, groups=(0,)), [0.0], [1.0, 1 + 1.5e-11], 1e-9)
    shared = replace(shared, implicit_lanes=implicit, explicit=not implicit)
    columns = np.zeros((3, 1)), np.zeros((3, 1, 0)), np.array([np.inf]), np.zeros((1, 1)), shared.segments[None]
    found = lane_batch.solve_batch(shared, *columns, np.zeros((1, 0)))
    assert found.ends[:, 3] == pytest.approx([1 / 0.35 - 1 / 1.1] * 3, abs=2e-4)


def test_runs_that_turn_stiff_take_implicit_steps_in_lanes(left):
    problem, columns = arrays_of(case_runs.load("three-temperatures"))
    found = lane_batch.solve_batch(replace(problem, implicit_lanes=True), *columns)
    assert left[0] == 0
    assert_alike(found, solve_arrays(problem, *columns), problem.program.n, 3e-7)


LINEAR_CASES = (
    ("dna-adhesive", 0), ("three-temperatures", 0), ("l-selectin-tether", 0), ("no-medium", 0), ("closing-film", 0),
    ("friction-ignited-bonding", 0), ("press-conductance", 0), ("stick-slip", 0), ("shared-load-rupture", 0),
    ("adiabatic-arrhenius", 0), ("cooling-to-zero", RUNS),
)  # fmt: skip
"""Stiff cases, those with events, and how many runs are left to other steps."""


@pytest.mark.parametrize(
    ("name", "others", "rtol"), every(3, [(*case, rtol) for rtol in (1e-4, 1e-6) for case in LINEAR_CASES])
)
def test_linearly_implicit_runs_keep_the_tolerance(name, others, rtol, left, monkeypatch):
    problem, columns = arrays_of(case_runs.load(name), implicit=True, rtol=rtol)
    # What they leave would be solved by these.
    monkeypatch.setattr(lane_batch, "RADAU", None)
    found = lane_batch.solve_batch(problem, *columns)
    assert left[0] == others
    exact = solve_arrays(replace(problem, rtol=1e-12, atol=1e-12 / rtol * problem.atol), *columns)
    assert_alike(found, exact, problem.program.n, 100 * rtol)


@pytest.mark.parametrize(
    ("n", "rtol", "accounts", "linear"),
    [(4, 1e-6, 0, True), (4, 9e-7, 0, False), (4, 1e-3, 1, False), (16, 1e-3, 0, True), (17, 1e-3, 0, False)],
)
def test_linearly_implicit_steps_are_for_loose_tolerances_without_accounts_and_for_small_systems(
    n, rtol, accounts, linear
):
    t, y, rates = se.Symbol("t"), se.symbols(f"y:{n}"), se.symbols(f"r:{n}")
    rows = [rate + i * x * sum(y) for i, (rate, x) in enumerate(zip(rates, y, strict=True), 1)]
    program = compile_program(t, y, rates, [], rows, ledger=[y[0]] * accounts)
    shared = problem(program, np.ones(n), [0.0, 1.0], rtol, implicit_lanes=True)
    methods = [lane_batch.ROSENBROCK, lane_batch.RADAU]
    assert list(lane_batch.methods_of(shared)) == methods[not linear :]


def test_threads_change_nothing():
    problem, (y0, table, *others) = arrays_of(case_runs.load("dna-adhesive"), 24, implicit=True)
    whole = lane_batch.solve_batch(problem, y0, table, *others).ends
    with ThreadPoolExecutor(3) as pool:
        parts = pool.map(
            lambda some: lane_batch.solve_batch(problem, y0[some], table[some], *others).ends,
            np.array_split(np.arange(24), 5),
        )
        assert np.array_equal(np.concatenate(list(parts)), whole)


@pytest.mark.parametrize(
    ("name", "implicit", "rtol"),
    [
        *((name, False, 1e-9) for name in ("exothermic", "shared-load-rupture", "closing-film", "three-temperatures")),
        *((name, True, 1e-9) for name in ("dna-adhesive", "l-selectin-tether", "closing-film", "cooling-to-zero")),
        *((name, True, 1e-5) for name in ("dna-adhesive", "shared-load-rupture", "cohesive-pull-off")),
    ],
)
def test_company_order_and_what_is_left_in_the_memory_change_nothing(name, implicit, rtol, monkeypatch):
    problem, (y0, table, *others) = arrays_of(case_runs.load(name), 21, implicit, rtol)
    whole = lane_batch.solve_batch(problem, y0, table, *others)
    used = SimpleNamespace(**{**vars(np), "zeros": lambda words, kind: np.full(words, -1, kind)})
    for module in (stepper, lane_batch):
        monkeypatch.setattr(module, "np", used)
    order = np.random.default_rng(1).permutation(21)
    for some in (order, np.array([7]), np.arange(3)):
        part = lane_batch.solve_batch(problem, y0[some], table[some], *others)
        for field in ("ends", "counts"):
            assert np.array_equal(getattr(part, field), getattr(whole, field)[some])
        for i, reached in enumerate(part.counts[:, OUTPUTS]):
            assert np.array_equal(part.outputs[i, :reached], whole.outputs[some[i], :reached])


def test_a_quotient_of_a_few_states_is_looked_at_only_where_its_divisor_changes(left):
    """The inverse of a state that nearly falls to zero is a brief peak, although no equation has a narrow feature."""
    t, (x, y, dx, dy) = se.Symbol("t"), se.symbols("x y dx dy")
    width = 3e-3
    program = compile_program(t, [x, y], [dx, dy], [], [dx - 2 * (t - 0.37), dy - width**8 / x**4])
    assert program.divisors == (True, False)
    shared = problem(program, [0.37**2 + width**2, 0.0], [0.0, 1.0], 1e-6, explicit=True, spacing=1 / 256)
    columns = [shared.y0[None], np.zeros((1, 1, 0)), np.array([shared.spacing]), np.zeros((1, 0))]
    columns += [shared.segments[None], np.zeros((1, 0))]
    ends = [solve(shared, *columns).ends[0, 2] for solve in (lane_batch.solve_batch, solve_arrays)]
    assert left[0] == 0
    assert ends == pytest.approx([width * 5 * np.pi / 16] * 2, rel=1e-5)


@pytest.mark.parametrize(("seed", "implicit"), every(19, [(seed, way) for way in (False, True) for seed in range(80)]))
def test_what_is_narrow_is_seen(seed, implicit, left):
    scene = narrow_scenes.scene(seed)
    simulation = surfacechem.load(scene.text)
    if simulation.model.program.lanes is None or simulation.model.jumper is not None:
        pytest.skip("not for these steps")
    problem, columns = arrays_of(simulation, 1, implicit)
    y = lane_batch.solve_batch(problem, *columns).ends[0, 1 : 1 + problem.program.n]
    wanted = solve_arrays(problem, *columns).ends[0, 1 : 1 + problem.program.n]
    assert y == pytest.approx(wanted, rel=1e-6, abs=1e-9)
