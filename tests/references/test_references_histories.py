"""Exact solutions along prescribed histories: velocity steps of friction with memory, a gap that opens twice."""

import numpy as np
import pytest

from surfacechem.errors import InputError
from surfacechem.references import get

SLIDER = {"m": 10.0, "k": 1e8, "V": 1e-3, "p": 1e5, "mu_b": 0.9, "mu_ub": 0.6, "mu_k": 0.4}
ROCK = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
STEPS = {"theta_i": 3.0, "v_i": 1e-6, "v_step": 1e-4, "t_1": 2.0, "t_2": 3.0}
ZONE = {"t_max": 8e7, "E_b": 1e15, "g_f": 24e-6, "H_r": 2.0, "g_1": 8e-6, "speed": 1e-6}


@pytest.mark.parametrize("name", ["aging-velocity-steps", "slip-velocity-steps"])
def test_friction_jumps_by_a_and_settles_by_a_minus_b(name):
    steps = get(name)(**ROCK, **{**STEPS, "theta_i": 10.0, "t_2": 1e3})
    values = steps.solution([1.0, STEPS["t_1"], np.nextafter(2.0, 3.0), 900.0])
    friction = values[f"t_{steps.law}"] / ROCK["p"]
    ten = np.log(STEPS["v_step"] / STEPS["v_i"])
    np.testing.assert_allclose(friction, 0.6 + np.array([0, 0, 0.01 * ten, -0.005 * ten]), rtol=1e-12)


@pytest.mark.parametrize("name", ["aging-velocity-steps", "slip-velocity-steps"])
def test_extreme_slips_and_direct_effects_stay_finite(name):
    steps = get(name)(**{**ROCK, "L": 1e-12, "a": 1e-5}, **STEPS)
    values = steps.solution(np.linspace(0.0, 1e6, 50))
    assert all(np.isfinite(value).all() for value in values.values())
    assert values["theta"][-1] == pytest.approx(1e-6, rel=1e-12)


def test_stick_slip_debonding_without_stronger_bonds_is_stick_slip():
    t = np.linspace(0.0, 3.0, 3998)
    ours = get("stick-slip-debonding")(**{**SLIDER, "mu_b": 0.6}).solution(t)
    plain = get("stick-slip")(m=10.0, k=1e8, V=1e-3, t_s=6e4, t_k=4e4).solution(t)
    for name, values in plain.items():
        np.testing.assert_allclose(ours[name], values, atol=1e-10 * np.abs(values).max())


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("aging-velocity-steps", {**ROCK, **STEPS, "t_2": 1.0}, "t_2 must not be below t_1 = 2"),
        ("bilinear-debonding", {**ZONE, "g_f": 8e-8}, "g_f must be above t_max / E_b = 8e-08 m"),
        ("stick-slip-debonding", {**SLIDER, "mu_b": 1.5}, "exact for mu_k <= mu_ub <= mu_b <= 2 mu_k"),
    ],
)
def test_what_has_no_solution_is_refused(name, given, message):
    with pytest.raises(InputError, match=message):
        get(name)(**given)
