"""Friction that falls with its own heat, on springs without a mass: it slips in jumps where the spring is soft.

The oracles are plain SciPy. A slip without a mass or a damper is the limit of one with a small damper; within it
friction and damper turn into heat what the spring lets go, until friction at the temperatures of that heat holds it.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

CASE = """
T_0: 300 K
bodies:
  slider: {{temperature: {T_1}, capacity: {capacity}, C: {C_1}}}
  base: {{temperature: {T_2}, capacity: {capacity}, C: {C_2}}}
interface: {{{interface}friction: [{friction}]}}
mechanics: {{tangential: {{{mechanics}}}}}
heat: [{heat}]
surroundings: {{temperature: 300 K}}
loading: {{{loading}}}
initial: {{{initial}}}
run: {{until: {until}, outputs: {outputs}}}
"""
PERFECT = {
    "T_1": "T",
    "T_2": "T",
    "capacity": "constant",
    "C_1": 16,
    "C_2": 14,
    "interface": "temperature: T, ",
    "friction": "coulomb: {mu: {value: 0.7, times: [power: {exponent: -4}]}}",
    "mechanics": "k: 1e8",
    "heat": "",
    "loading": "p: 2e6, w_t: {ramp: {rate: 1e-3}}",
    "initial": "T: 300",
    "until": 30,
    "outputs": 31,
}


def run(**parts):
    case = load_text(CASE.format(**PERFECT | parts), "softening.yaml")
    solution = Simulation(case).run(error="balances")
    data = solution.dataset
    assert data.attrs["status"] == "finished", data.attrs["reason"]
    assert data.attrs["energy_error"] < 1e-9
    assert data.attrs["entropy_error"] < 1e-9
    assert data.attrs["entropy_violations"] == "none"
    return data


def after_slip(k, stretched, friction):
    """Stretch at which friction, warmed by the energy that the spring has let go, holds the spring; it is the first."""

    def pushed(stretch):
        return k * stretch - friction(k * (stretched**2 - stretch**2) / 2)

    stretches = stretched * (1 - np.linspace(0, 1, 20001) ** 2)
    pushes = np.array([pushed(x) for x in stretches])
    begun = int(np.argmax(pushes > 1e-9 * k * stretched))
    ends = begun + int(np.argmax(pushes[begun:] <= 0))
    return brentq(pushed, stretches[ends], stretches[ends - 1], xtol=1e-18, rtol=1e-15)


def falling(T, mu=0.7, exponent=-4.0):
    return mu * (T / 300) ** exponent


def quadratic(energy, C, T=300.0):
    """Temperature of what has the energy C T^2 / (2 T_0)."""
    return np.sqrt(T**2 + 600 * energy / C)


REGIMES = {
    "perfect contact": ({}, lambda E: falling(300 + E / 30)),
    "capacity in proportion to T": ({"capacity": "quadratic"}, lambda E: falling(quadratic(E, 30))),
    "one-sided": ({"T_2": "T_2", "initial": "T: 300, T_2: 300"}, lambda E: falling(300 + E / 16)),
    "capacity of its own": (
        {
            "T_1": "T_1",
            "T_2": "T_2",
            "interface": "temperature: T_c, potential: [constant-interface-capacity: {C_c: 20}], ",
            "initial": "T_1: 300, T_2: 300, T_c: 300",
            "heat": "conductance: {between: [slider, interface], h: 50}",
        },
        lambda E: falling(300 + E / 20),
    ),
    "shared": (
        {
            "T_1": "T_1",
            "T_2": "T_2",
            "interface": "partition: {slider: 0.7, base: 0.3}, ",
            "initial": "T_1: 300, T_2: 300",
        },
        lambda E: falling(1 / (0.7 / (300 + 0.7 * E / 16) + 0.3 / (300 + 0.3 * E / 14))),
    ),
    "static limit": (
        {"friction": "coulomb: {mu: {value: 0.6, times: [power: {exponent: -4}]}, mu_s: 0.7}"},
        lambda E: falling(300 + E / 30, 0.6),
    ),
    "elastic": (
        {
            "interface": "temperature: T, potential: [tangential-stiffness: {E_t: 4e8}], ",
            "mechanics": f"k: {4e8 / 3!r}",
        },
        lambda E: falling(300 + E / 30),
    ),
}


@pytest.mark.parametrize(("regime", "way"), [(regime, (-1) ** i) for i, regime in enumerate(REGIMES)])
def test_a_slip_ends_where_its_own_heat_lets_friction_hold_the_spring(regime, way):
    """Spring and elastic interface in series are one spring of 100 MPa/m."""
    parts, coefficient = REGIMES[regime]
    data = run(**parts, loading=f"p: 2e6, w_t: {{ramp: {{rate: {way * 1e-3}}}}}", until=16, outputs=5)
    k, p, V = 1e8, 2e6, 1e-3
    stretched = 0.7 * p / k
    left = after_slip(k, stretched, lambda energy: p * coefficient(energy))
    assert data.event_time[0] == pytest.approx(stretched / V, rel=1e-12)
    assert str(data.event_name.values[0]) == ("slip forward" if way > 0 else "slip backward")
    slid = data.u_t_after[0] - (data.g_t_after[0] if regime == "elastic" else 0.0)
    assert way * slid == pytest.approx(stretched - left, rel=1e-9)
    assert data.event_released[0] == pytest.approx(k * (stretched**2 - left**2) / 2, rel=1e-9)
    assert data.event_entropy[0] > 0


def test_a_stiff_spring_slides_steadily():
    """Friction falls by 4 (mu p)^2 / (C T_0) = 871 MPa/m at first."""
    soft, stiff = (run(mechanics=f"k: {k}", until=30) for k in (8.5e8, 8.9e8))
    assert soft.event_released[0] > 1.0
    assert [str(name) for name in stiff.event_name.values] == ["slip forward"]
    assert stiff.event_released[0] == 0.0
    # The heat is the way times a friction that falls as it warms.
    k, C, p = 8.9e8, 30.0, 2e6
    T, stretch = float(stiff["T"][-1]), p * falling(float(stiff["T"][-1])) / k
    assert stiff.u_t[-1] == pytest.approx(30e-3 - stretch, rel=1e-9)
    heat = C * ((T / 300) ** 5 - 1) * 300 / 5
    assert heat == pytest.approx(0.7 * p * float(stiff.u_t[-1]), rel=1e-9)


def test_sliding_that_becomes_unstable_sticks_and_slips():
    """Pressure rises until friction falls with its heat by more than the spring: 4 F^2 / (C T) = k."""
    loading = "p: {table: {times: [0, 20], values: [0.4e6, 1.2e6]}}, w_t: {ramp: {start: 2.7e-3, rate: 1e-3}}"
    heat = "conductance: {between: [slider, surroundings], h: 1000}"
    data = run(loading=loading, heat=heat, until=20)
    names = [str(name) for name in data.event_name.values]
    assert names[:2] == ["slip forward", "snap"]
    p, T = 0.4e6 + 0.04e6 * float(data.event_time[1]), float(data.T_before[1])
    assert 4 * (0.7 * p * (300 / T) ** 4) ** 2 / (30 * T) == pytest.approx(1e8, rel=1e-5)
    assert set(names[2:]) == {"slip forward", "stop"}
    begun = np.nonzero(np.array(names) == "slip forward")[0][-3:]
    # Each slip begins cold at the limit and ends as its heat lets friction hold the spring.
    for j in begun:
        p, T = 0.4e6 + 0.04e6 * float(data.event_time[j]), float(data.T_before[j])
        stretched = p * falling(T) / 1e8
        left = after_slip(1e8, stretched, lambda energy, p=p, T=T: p * falling(T + energy / 30))
        assert data.u_t_after[j] - data.u_t_before[j] == pytest.approx(stretched - left, rel=1e-6)
