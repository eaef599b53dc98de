"""Exact solutions along prescribed histories: velocity steps of friction with memory, a gap that opens twice."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from surfacechem.errors import InputError
from surfacechem.references import get

SLIDER = {"m": 10.0, "k": 1e8, "V": 1e-3, "p": 1e5, "mu_b": 0.9, "mu_ub": 0.6, "mu_k": 0.4}
ROCK = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
STEPS = {"theta_i": 3.0, "v_i": 1e-6, "v_step": 1e-4, "t_1": 2.0, "t_2": 3.0}
ZONE = {"t_max": 8e7, "E_b": 1e15, "g_f": 24e-6, "H_r": 2.0, "g_1": 8e-6, "speed": 1e-6}
RATES = {
    "aging-velocity-steps": lambda v, x: np.exp(-x) - v / ROCK["L"],
    "slip-velocity-steps": lambda v, x: -v / ROCK["L"] * (np.log(v / ROCK["L"]) + x),
}

each_law = pytest.mark.parametrize("name", RATES)


def integrated(name, t):
    """Logarithm of the age by a Runge-Kutta method of high order, from step to step."""
    x, found = np.log(STEPS["theta_i"]), []
    edges = (0.0, STEPS["t_1"], STEPS["t_2"], t[-1])
    for start, end, v in zip(edges, edges[1:], (STEPS["v_i"], STEPS["v_step"], STEPS["v_i"]), strict=False):
        times = np.unique([*t[(t > start) & (t <= end)], end])
        run = solve_ivp(lambda _, x, v=v: RATES[name](v, x), (start, end), [x], "DOP853", times, rtol=1e-13, atol=1e-13)
        found += run.y[0][np.isin(times, t)].tolist()
        x = run.y[0][-1]
    return np.array(found)


@each_law
def test_the_age_solves_its_law(name):
    t = np.linspace(0.05, 10.0, 200)
    exact = get(name)(**ROCK, **STEPS).solution(t)["ln_theta"]
    np.testing.assert_allclose(exact, integrated(name, t), atol=1e-11)


@each_law
def test_friction_jumps_by_a_and_settles_by_a_minus_b(name):
    steps = get(name)(**ROCK, **{**STEPS, "theta_i": 10.0, "t_2": 1e3})
    values = steps.solution([1.0, STEPS["t_1"], np.nextafter(2.0, 3.0), 900.0])
    friction = values[f"t_{steps.law}"] / ROCK["p"]
    ten = np.log(STEPS["v_step"] / STEPS["v_i"])
    np.testing.assert_allclose(friction, 0.6 + np.array([0, 0, 0.01 * ten, -0.005 * ten]), rtol=1e-12)


@each_law
def test_extreme_slips_and_direct_effects_stay_finite(name):
    steps = get(name)(**{**ROCK, "L": 1e-12, "a": 1e-5}, **STEPS)
    values = steps.solution(np.linspace(0.0, 1e6, 50))
    assert all(np.isfinite(value).all() for value in values.values())
    assert values["theta"][-1] == pytest.approx(1e-6, rel=1e-12)


def test_the_way_back_takes_less_slip_by_the_aging_law():
    """Slip in which friction has 1/e of its change left, after a tenfold step up and down."""
    x = np.linspace(0.0, 10.0, 100001)
    up, down = (np.log(1 + (ratio - 1) * np.exp(-x)) / np.log(ratio) for ratio in (10.0, 0.1))
    slips = [x[np.argmax(part < np.exp(-1))] for part in (up, down)]
    assert slips[1] / slips[0] == pytest.approx(0.25, abs=0.02)


def test_steps_in_the_wrong_order_are_refused():
    with pytest.raises(InputError, match="t_2 must not be below t_1 = 2"):
        get("aging-velocity-steps")(**ROCK, **{**STEPS, "t_2": 1.0})


def test_what_bilinear_debonding_dissipates_is_work_less_energy():
    zone = get("bilinear-debonding")(**ZONE)
    t = np.concatenate([np.linspace(a, b, 200001) for a, b in ((0.0, 0.08), (0.08, 8.0), (8.0, 16.0), (16.0, 40.0))])
    values = zone.solution(t)
    g, t_n, phi = (values[name] for name in ("g_n", "t_n", "phi"))
    work = np.concatenate([[0.0], np.cumsum(0.5 * (t_n[1:] + t_n[:-1]) * np.diff(g))])
    stored = 0.5 * phi * ZONE["E_b"] * g**2 + ZONE["H_r"] * (1 - phi)
    np.testing.assert_allclose(values["heat"], work - stored, atol=1e-6)
    assert values["heat"][-1] == pytest.approx(0.5 * 8e7 * 24e-6 - 2.0, rel=1e-14)
    assert t_n.max() == pytest.approx(8e7, rel=1e-4)


def test_bilinear_debonding_unloads_to_the_origin():
    zone = get("bilinear-debonding")(**ZONE)
    down, up = zone.solution([12.0])["t_n"], zone.solution([20.0])["t_n"]
    assert down == up == pytest.approx(zone.solution([8.0])["t_n"] / 2, rel=1e-14)


def test_a_line_that_does_not_fall_is_refused():
    with pytest.raises(InputError, match="g_f must be above t_max / E_b = 8e-08 m"):
        get("bilinear-debonding")(**{**ZONE, "g_f": 8e-8})


def test_stick_slip_debonding_without_stronger_bonds_is_stick_slip():
    t = np.linspace(0.0, 3.0, 3998)
    ours = get("stick-slip-debonding")(**{**SLIDER, "mu_b": 0.6}).solution(t)
    plain = get("stick-slip")(m=10.0, k=1e8, V=1e-3, t_s=6e4, t_k=4e4).solution(t)
    for name, values in plain.items():
        np.testing.assert_allclose(ours[name], values, atol=1e-10 * np.abs(values).max())


def test_stick_slip_debonding_closes_its_energy():
    """Work of the spring's end is heat, elastic and kinetic energy."""
    slider = get("stick-slip-debonding")(**SLIDER)
    t = np.linspace(0.0, 3.0, 30001)
    values = slider.solution(t)
    spring, v = values["spring_traction"], values["v"]
    np.testing.assert_allclose(spring, SLIDER["k"] * (SLIDER["V"] * t - values["u_t"]), atol=1e-6)
    first = next(slider.cycles())
    edges = np.unique([*t, first.stick_time, first.duration])
    work = np.interp(t, edges, np.concatenate([[0.0], np.cumsum(_averages(slider, edges) * np.diff(edges))]))
    energy = spring**2 / (2 * SLIDER["k"]) + 0.5 * SLIDER["m"] * v**2 + values["heat"]
    np.testing.assert_allclose(SLIDER["V"] * work, energy, atol=1e-3 * energy.max())
    assert values["phi"][t > first.stick_time].max() == 0.0


def _averages(slider, edges):
    spring = slider.solution(edges)["spring_traction"]
    return (spring[1:] + spring[:-1]) / 2


def test_bonds_too_strong_for_one_direction_are_refused():
    with pytest.raises(InputError, match="exact for mu_k <= mu_ub <= mu_b <= 2 mu_k"):
        get("stick-slip-debonding")(**{**SLIDER, "mu_b": 1.5})
