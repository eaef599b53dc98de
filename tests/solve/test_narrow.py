"""What is brief in a run is seen, whatever makes it so, and by the estimate of the error too."""

from dataclasses import replace

import numpy as np
import pytest
import symengine as se
from narrow_scenes import scene
from sampling import every
from scipy.integrate import solve_ivp
from scipy.special import erf
from solver_problems import DY, T, Y, problem, scalar

from surfacechem.contracts.terms import HeatTransfer, parameter
from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation
from surfacechem.solve import solver
from surfacechem.solve.segments import Passing

CLOSE = 1e-8
"""Relative error of scenes in which only the time of what is brief is rounded: to 1e-16 of a run, of 1e-8 of it."""


def ends(simulation, run=None):
    """What a run ends with, by name, and its accuracy."""
    solution = simulation.run(run=run)
    result, system = solution.trajectory.result, simulation.system
    found = dict(zip((state.name for state in system.states), result.y, strict=True))
    found |= dict(zip((account.quantity.name for account in system.ledger), result.ledger, strict=True))
    return found, solution


def check_scene(seed, rtol):
    """A random scene ends where it should, or says how far from there it may be; at a tolerance, if above zero."""
    case = scene(seed)
    simulation = Simulation(load_text(case.text))
    found, solution = ends(simulation, replace(simulation.case.run, rtol=rtol) if rtol else None)
    assert solution.trajectory.status == "finished", case.text
    near = CLOSE + case.rounded + 10 * solution.accuracy.error + 3 * rtol
    for name, value in case.expected.items():
        error = abs(found[name] - value) / (case.size or abs(value) or 1.0)
        assert error <= near, (name, found[name], value, case.text)


LOOSE = every(2, [(seed, rtol) for rtol in (1e-2, 1e-3) for seed in (10, 216, 227, 326, 359)])


@pytest.mark.parametrize(("seed", "rtol"), [*((seed, 0.0) for seed in (*range(5), 16, *range(6, 10), 43)), *LOOSE])
def test_no_narrow_layer_is_passed_over(seed, rtol):
    check_scene(seed, rtol)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(1000, 1600, 20))
def test_no_narrow_layer_of_many_scenes_is_passed_over(block):
    for seed in range(block, block + 20):
        check_scene(seed, 0.0)


PLATES = """
T_0: 300 K
bodies:
  lower: {temperature: T_1, C: 1 kJ/m^2/K, capacity: constant}
  upper: {temperature: T_2, C: 1 kJ/m^2/K, capacity: constant}
initial: {T_1: 300 K, T_2: 400 K}
"""

TAPPING = f"""title: A hot plate that taps on a cold one once a second
{PLATES}
heat:
  - gap-conductance: {{between: [lower, upper], h_0: 3e5, C_trans: 1e8, k_gas: 0, g_0: 1 um, epsilon_1: 0.05,
                      epsilon_2: 0.05}}
loading: {{g_n: {{harmonic: {{mean: 1 mm, amplitude: 1 mm, frequency: 1, phase: 1}}}}}}
run: {{until: 3 s}}
"""

LAYER = f"""title: A conductance that is high in a part of the gap
{PLATES}
heat:
  - gap-table: {{between: [lower, upper], gaps: [0, 485 um, 500 um, 515 um, 1 mm],
                conductances: [0.01, 0.01, 3333, 0.01, 0.01]}}
loading: {{g_n: {{ramp: {{start: 1 mm, rate: -10 um/s}}}}}}
run: {{until: 100 s}}
"""


class Resonance(HeatTransfer):
    r"""A conductance that is high around one gap, of which it does not tell.

    .. math:: h = h_0 e^{-(g_n - g_0)^2 / w^2}

    Source: made up for a test.
    """

    h_0: float = parameter("W/(m^2 K)", "highest conductance", at_least=0)
    g_0: float = parameter("m", "gap of the highest conductance")
    w: float = parameter("m", "half of its width", above=0)

    def conductance(self, g_n):
        """Conductance [W/(m^2 K)]."""
        return self.h_0 * se.exp(-(((g_n - self.g_0) / self.w) ** 2))


def resonant(h_0, w, g_0=4.373e-4):
    """A ramp through a resonance, and the temperatures at its end."""
    case = load_text(LAYER)
    law = Resonance(between=("lower", "upper"), h_0=h_0, g_0=g_0, w=w)
    left = 50 * np.exp(-2 * np.sqrt(np.pi) * h_0 * w / 1e-5 / 1e3)
    return Simulation(replace(case, scene=replace(case.scene, heat=(law,)))), [350 - left, 350 + left]


def test_a_mass_that_turns_beside_a_cohesive_zone_feels_it():
    """Far from the zone it swings freely: between, for some millionths of a swing, it is integrated by itself."""
    swing, nearest, g_0, t_max, k, end = 4e-4, 5e-12, 1e-11, 1e-3, 40.0, 0.9
    zone = f"potential: [{{exponential-cohesive-zone: {{t_max: {t_max}, g_0: {g_0}, E_n: 1e12}}}}]"
    text = f"""{PLATES}
interface: {{temperature: 300 K, {zone}}}
mechanics: {{normal: {{m: 1.0, k: {k}}}}}
loading: {{w_n: {nearest + swing!r}}}
run: {{until: {end} s}}
"""
    start = f"T_2: 400 K, g_n: {nearest + 2 * swing!r}, v_n: 0}}"
    found, solution = ends(Simulation(load_text(text.replace("T_2: 400 K}", start))))
    w, edge, mean = np.sqrt(k), 60 * g_0, nearest + swing

    def rates(_, y):
        return [y[1], k * (mean - y[0]) - t_max * y[0] / g_0 * np.exp(1 - y[0] / g_0)]

    def leaves(t, y):
        return y[0] - edge if t > 0 else -1.0

    leaves.terminal, leaves.direction = True, 1
    met = np.arccos((edge - mean) / swing)
    inside = solve_ivp(rates, (0, 1), [edge, -swing * w * np.sin(met)], "DOP853", events=leaves, rtol=1e-12, atol=1e-22)
    (gone,), ((g, v),) = inside.t_events[0], inside.y_events[0]
    left = w * (end - gone) - met
    assert found["g_n"] == pytest.approx(mean + (g - mean) * np.cos(left) + v / w * np.sin(left), rel=1e-6)
    assert solution.accuracy.error < 1e-5


def test_what_no_law_tells_of_is_seen_by_looking():
    """A peak of a few per cent of a run has a point at which the equations are looked at."""
    simulation, expected = resonant(1e3, 1e-5)
    found, solution = ends(simulation)
    np.testing.assert_allclose([found["T_1"], found["T_2"]], expected, rtol=1e-9)
    assert solution.accuracy.error < 1e-8


def test_the_second_run_looks_closer():
    """What the first one misses is told by the second, which looks elsewhere."""
    simulation, expected = resonant(5e4, 1e-7, g_0=3.9e-4)
    found, solution = ends(simulation)
    assert abs(found["T_1"] - expected[0]) > 1
    assert abs(found["T_1"] - expected[0]) <= 1.001 * expected[0] * solution.accuracy.error


def test_a_sweep_ends_pieces_where_each_run_needs_it():
    """The layer lies at another time for each speed; some do not reach it."""
    simulation = Simulation(load_text(LAYER))
    rates = [-10e-6, -7e-6, -4e-6, -20e-6]
    swept = simulation.sweep({"loading.g_n.ramp.rate": rates})
    singly = [simulation.run({"loading.g_n.ramp.rate": rate}).trajectory.result.y for rate in rates]
    np.testing.assert_array_equal([run.result.y for run in swept.runs], singly)


@pytest.mark.parametrize("method", ["radau", "dop853"])
@pytest.mark.parametrize("h", [0.02])
def test_a_step_is_held_against_the_equations_between_its_stages(h, method):
    """y' = a bell of time; without a look the first step is the whole run."""
    program = scalar(DY - se.exp(-(((T - 0.437) / h) ** 2)), Y * DY)
    asked = problem(program, [1.0], [0.0, 1.0], 1e-9)
    exact = 1.0 + h * np.sqrt(np.pi) / 2 * (erf(0.563 / h) + erf(0.437 / h))
    found = solver(method).solve(replace(asked, spacing=1 / 60))
    assert found.y[0] == pytest.approx(exact, rel=1e-8)
    assert found.ledger[0] == pytest.approx(0.5 * (exact**2 - 1), rel=1e-8)


@pytest.mark.parametrize(
    ("rate", "ledger", "looked"), [(T - Y, 1 / Y, False), (T - Y, se.exp(-Y), True), (T - Y, Y**5, True)]
)
def test_explicit_steps_are_held_against_equations_that_may_be_brief(rate, ledger, looked):
    """A product of few states is not brief, nor is the inverse of one that hardly changes."""
    asked = problem(scalar(DY - rate, ledger), [1.0], [0.0, 1.0], 1e-9, spacing=1 / 60)
    found, blind = (solver("dop853").solve(each) for each in (asked, replace(asked, spacing=np.inf)))
    assert (found.counters.residuals > blind.counters.residuals) == looked
    assert np.array_equal(found.y, blind.y)


def test_passages_are_found_in_any_number():
    """A gap that passes a place twice a period, and turns twice."""
    text = TAPPING.replace("mean: 1 mm", "mean: 0.5 mm").replace("frequency: 1,", "frequency: 1000,")
    system = Simulation(load_text(text)).system
    values = {p.path: p.at(0.0) for p in system.parameters}
    table = np.array([[values[p.path] for p in system.parameters]])
    passing, many = Passing(system), 100_000
    pieces, _ = passing.pieces(np.array([0.0, 3.0]), table, values, many)
    turns = [(k + 0.5) * np.pi for k in range(6002)]
    touches = [np.pi + np.arcsin(0.5) + 2 * k * np.pi for k in range(3001)] + [
        2 * np.pi - np.arcsin(0.5) + 2 * k * np.pi for k in range(3001)
    ]
    expected = np.sort([(x - 1) / (2000 * np.pi) for x in (*turns, *touches)])
    expected = expected[(expected > 0) & (expected < 3)]
    np.testing.assert_allclose(pieces[1:-1], expected, rtol=1e-13)
    segments = np.array([[0.0, 3.0], [0.0, 0.9 * expected[0]], [0.9 * expected[0], expected[1]]])
    assert passing.cut(segments, np.tile(table, (3, 1, 1)), values, many).tolist() == [True, False, True]


@pytest.mark.parametrize("far", ["10 nm", "1 mm"])
def test_the_strongest_attraction_on_a_way_is_in_the_dataset(far):
    path = f"{{table: {{times: [0 s, 0.4321 s, 1 s], values: [{far}, 0.22 nm, {far}]}}}}"
    text = f"""{PLATES}
interface:
  temperature: 300 K
  potential: [lennard-jones-flat-flat: {{n_1: 2e19 1/m^2, n_2: 3e19 1/m^2, psi_0: 4e-21 J, g_0: 0.3 nm}}]
loading: {{g_n: {path}}}
run: {{until: 1 s, rtol: 1e-8}}
"""
    run = Simulation(load_text(text)).run(error="balances").dataset
    strongest = 5 ** (-1 / 6) * 3e-10  # where the slope of the tension is zero
    assert run["g_n"].values[run["t_n"].values.argmax()] == pytest.approx(strongest, rel=1e-7)
