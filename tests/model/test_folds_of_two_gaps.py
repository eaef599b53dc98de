"""Folds at which opening and shear are lost together: the gaps end where damped motion from there does.

The oracle is SciPy: the zone of Xu and Needleman by its own derivatives, and dampers of equal size in both directions.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.branches import come_to_rest

CASE = """
T_0: 300
bodies: {{a: {{temperature: {T}, C: 1e6}}, b: {{temperature: {T}, C: 1e6}}}}
interface: {{temperature: {T}, potential: [{potential}], friction: [{friction}]}}
mechanics: {{normal: {{k: {k_n}}}, tangential: {{k: {k_t}}}}}
loading: {{w_n: {w_n}, w_t: {w_t}}}
initial: {{{initial}}}
run: {{until: 10, outputs: 3}}
"""


def tractions(g_n, g_t, Phi=1.0, g_0=1e-6, g_t0=2e-6, q=1.0, r=0.0):
    """Derivatives of Phi e^-u { (1 - r + u) (1 - q) / (r - 1) - [q + (r - q) / (r - 1) u] e^-w^2 }."""
    u, w = g_n / g_0, g_t / g_t0
    shear, decay = np.exp(-(w**2)), np.exp(-u)
    a, b = (1 - q) / (r - 1), (r - q) / (r - 1)
    level = (1 - r + u) * a - (q + b * u) * shear
    return Phi * decay * (a - b * shear - level) / g_0, Phi * decay * (q + b * u) * shear * 2 * w / g_t0


def run(k_n, k_t, w_n, w_t, friction="", extra="", finishes=True, **zone):
    given = ", ".join(f"{name}: {value!r}" for name, value in ({"Phi_n": 1, "g_0": 1e-6, "g_t0": 2e-6} | zone).items())
    potential = f"xu-needleman: {{{given}}}{extra}"
    T, initial = ("T", "T: 300") if friction else ("300", "")
    case = CASE.format(
        potential=potential,
        friction=friction,
        k_n=k_n,
        k_t=k_t,
        w_n=history(w_n),
        w_t=history(w_t),
        T=T,
        initial=initial,
    )
    data = Simulation(load_text(case)).run(error="balances").dataset
    assert (data.attrs["status"] == "finished") == finishes, data.attrs["reason"]
    assert data.attrs["energy_error"] < 1e-9
    return data


def history(w):
    start, rate = w
    return f"{{ramp: {{start: {start!r}, rate: {rate!r}}}}}"


def damped(k, w, begin, forces, scale=1e-6):
    """Where motion with equal dampers ends that begins along the way that costs no traction, on its long side."""

    def push(y):
        return k * (w - y) - np.array(forces(*y))

    nudges = 1e-6 * scale * np.eye(2)
    change = np.column_stack([(push(begin + n) - push(begin - n)) / (2e-6 * scale) for n in nudges])
    growth, ways = np.linalg.eig(change)
    way = ways[:, growth.real.argmax()].real
    ends = []
    for sign in (-1, 1):
        start = begin + sign * 3e-4 * scale * way / np.abs(way).max()
        found = solve_ivp(lambda _, y: push(y), (0, 1e6 / k.min()), start, "LSODA", rtol=1e-10, atol=1e-12 * scale)
        ends.append(found.y[:, -1])
    return max(ends, key=lambda end: np.linalg.norm(end - begin))


SCENES = {
    "closed by a spring": (5e10, 1e11, (-20e-6, 0.0), (0.0, 2e-6), {}),
    "opened": (1e11, 5e10, (0.0, 1e-6), (1e-6, 0.0), {}),
    "opened and sheared": (8e10, 1.5e11, (0.0, 1e-6), (0.0, 2e-6), {}),
    "less work in shear": (6e10, 8e10, (-6e-6, 0.0), (0.0, 2e-6), {"q": 0.7}),
    "more opening after shear": (6e10, 8e10, (-4e-6, 0.0), (0.0, 2e-6), {"q": 0.8, "r": 0.3}),
    "narrow in shear": (3e11, 2e10, (-0.2e-6, 0.0), (0.0, 2e-5), {"g_t0": 0.5e-6}),
    "wide in shear": (2e10, 2e11, (0.0, 2e-6), (2e-6, 0.0), {"g_t0": 5e-6, "q": 1.2}),
}


@pytest.mark.parametrize("scene", SCENES)
def test_gaps_end_where_damped_motion_does(scene):
    k_n, k_t, w_n, w_t, zone = SCENES[scene]
    data = run(k_n, k_t, w_n, w_t, **zone)
    snaps = np.nonzero(data.event_name.values == "snap")[0]
    assert len(snaps) > 0
    for j in snaps:
        t = float(data.event_time[j])
        w = np.array([start + rate * t for start, rate in (w_n, w_t)])
        begin = np.array([float(data.g_n_before[j]), float(data.u_t_before[j])])
        expected = damped(np.array([k_n, k_t]), w, begin, lambda g_n, g_t: tractions(g_n, g_t, **zone))
        found = np.array([float(data.g_n_after[j]), float(data.u_t_after[j])])
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-15)
        energy = np.array([k_n, k_t]) @ ((w - begin) ** 2 - (w - found) ** 2) / 2 + work(begin, found, zone)
        assert data.event_released[j] == pytest.approx(energy, rel=1e-7)


def work(begin, end, zone):
    """Energy that the zone gives back along a straight way."""
    points, weights = np.polynomial.legendre.leggauss(200)
    ways = begin + np.outer((points + 1) / 2, end - begin)
    return -sum(weights[j] / 2 * (np.array(tractions(*way, **zone)) @ (end - begin)) for j, way in enumerate(ways))


def test_contact_that_shear_has_softened_finds_its_equilibrium():
    """Pressed together by 1 MPa, the sheared zone bears nothing until the spring is let go by 17 um."""
    data = run(5e10, 1e11, (-20e-6, 0.0), (0.0, 2e-6))
    assert data.event_time[0] == pytest.approx(1.8885748, rel=1e-7)
    assert data.g_n_after[0] == pytest.approx(-17.45e-6, abs=5e-9)
    assert data.u_t_after[0] == pytest.approx(9.46e-6, abs=5e-9)


def test_a_zone_without_an_equilibrium_still_stops():
    """With more work in shear than in opening the sheared zone pulls the bodies through each other."""
    data = run(5.6e10, 1.5e12, (-20e-6, 0.0), (0.0, 6.6e-6), finishes=False, q=1.38, r=-0.12, g_t0=1.78e-6)
    assert "no gap follows" in data.attrs["reason"]


@pytest.mark.parametrize("rate", [2e-6, -2e-6])
def test_a_symmetric_balance_is_left_as_the_loads_go_on(rate):
    """Shear of a zone that is pressed shut is unstable from the start; nothing pushes it before the drive begins."""
    k_n, k_t = 1e12, 6e10
    data = run(k_n, k_t, (-6e-6, 0.0), (0.0, rate))
    assert [str(name) for name in data.event_name.values[:1]] == ["snap"]
    assert data.event_time[0] == 0.0
    assert data.u_t_before[0] == 0.0
    begin = np.array([float(data.g_n_before[0]), 0.0])
    expected = damped(np.array([k_n, k_t]), np.array([-6e-6, 0.0]), begin, tractions)
    assert data.g_n_after[0] == pytest.approx(expected[0], rel=1e-8)
    assert data.u_t_after[0] == pytest.approx(np.sign(rate) * abs(expected[1]), rel=1e-8)


def test_motion_that_nothing_bears_is_given_up_soon():
    """One gap has a spring, the other is pushed on for ever."""
    seen = 0

    def driving(ways):
        nonlocal seen
        seen += len(ways)
        return np.column_stack([1.0 - 1e10 * ways[:, 0], np.full(len(ways), -1.4)])

    assert come_to_rest(driving, np.full(2, 1e-9), np.zeros(2), np.zeros(2)) is None
    assert 0 < seen < 10_000
