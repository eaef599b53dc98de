"""Folds in shear and in mixed mode: where they are, what they release, and where the gaps come to rest."""

import math
from dataclasses import replace

import numpy as np
import pytest
import solved
from mpmath import mp, mpf
from scenes import perfect_contact, together, varying
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import lambertw
from solved import closed

import surfacechem
from surfacechem.format import load_text
from surfacechem.laws.cohesive import ExponentialCohesiveZone, XuNeedleman
from surfacechem.laws.factors import Power
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.laws.longrange import LennardJonesFlatFlat
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import Mounting
from surfacechem.solve.equilibria import come_to_rest

PHI, G_N, G_T = 0.1, 1e-8, 2e-8
ZONE = XuNeedleman(Phi_n=PHI, g_0=G_N, g_t0=G_T)
STIFF = 2 * PHI / G_T**2
"""Stiffness of the zone in shear where it is closed [Pa/m]."""
NORMAL = 1e14


def solve(loading, until=40.0, potentials=(ZONE,), exact=1e-9, **more):
    return closed(together(potentials, loading=loading, **more), until, exact=exact, outputs=41)


def shear(x):
    """Traction of the closed zone at g_t = x g_t0."""
    return STIFF * G_T * x * math.exp(-(x**2))


@pytest.mark.parametrize("ratio", [1e-3, 0.3])
def test_a_soft_spring_on_a_zone_in_shear_snaps_where_the_tangent_is_lost(ratio):
    """(2 x^2 - 1) exp(-x^2) = k / stiffness, with Lambert's function."""
    k, rate = ratio * STIFF, 1e-8
    x = math.sqrt(0.5 - lambertw(-ratio * math.sqrt(math.e) / 2).real)
    w = x * G_T + shear(x) / k
    top = brentq(lambda y: k * (w - y * G_T) - shear(y), 1.01 * x, w / G_T)
    trajectory = solve({"g_n": Hold(level=0.0), "w_t": Ramp(rate=rate)}, 1.2 * w / rate, tangential=Mounting(k=k))
    (snap,) = trajectory.of("snap")
    assert snap.t == pytest.approx(w / rate, rel=1e-10)
    assert snap.verdict == "admissible"
    gaps = [trajectory.state(snap, name) for name in ("g_t", "u_t")]
    assert gaps[0] == pytest.approx(gaps[1], rel=np.finfo(float).eps)  # two states, each rounded
    energy = [0.5 * k * (w - y * G_T) ** 2 - PHI * math.exp(-(y**2)) for y in (x, top)]
    assert trajectory.state(snap, "g_t") == pytest.approx(top * G_T, rel=1e-8)
    assert snap.released == pytest.approx(energy[0] - energy[1], rel=1e-7)


@pytest.mark.parametrize("phase", [0.0, -0.9, -2.4])
def test_a_zone_below_its_strength_follows_an_alternating_dead_load_through_touch(phase):
    """Where it touches neither its gap nor its traction gives a stiffness to which that of a fold could be related."""
    t_max, g_0, E_n, F = 3e3, 7e-9, 1.8e13, 2e3
    zone = ExponentialCohesiveZone(t_max=t_max, g_0=g_0, E_n=E_n)
    load = Harmonic(amplitude=F, frequency=1.0, phase=phase)
    trajectory = closed(together([zone], loading={"F_n": load}, initial={"g_n": 1e-10}), 3.0, outputs=61)
    assert set(trajectory.events) == {"touch", "release"}
    force = F * np.sin(2 * np.pi * trajectory.result.times + phase)
    apart = -g_0 * lambertw(-np.maximum(force, 0.0) / (math.e * t_max)).real
    exact = apart + np.minimum(force, 0.0) / E_n
    assert trajectory["g_n"] == pytest.approx(exact, abs=1e-9 * g_0)


def opened(k, C):
    """Fold of a zone of strength T_0/T that a spring opens without heat: load, gap, temperature; and the rest after
    it: gap, temperature. The entropy C T/T_0 - a/T^2 stays at the fold, the energy after it."""
    t_0, T_0, g_0 = mpf(10) ** 6 * mp.e, mpf(300), mpf(10) ** -7

    def zone(x):
        return t_0 * T_0 * g_0 * (1 + x) * mp.exp(-x) / C

    start = T_0 - zone(0) / T_0

    def warm(x):
        return mp.findroot(lambda u: (u - start / T_0) * u**2 - zone(x) / T_0**2, 1) * T_0

    def force(x, T):
        return t_0 * T_0 / T * x * mp.exp(-x)

    def load(x):
        return x * g_0 + force(x, warm(x)) / k

    x = mp.findroot(lambda x: mp.diff(load, x, h=mpf(10) ** -12), (1.2, 1.3), tol=1e-25)
    w = load(x)

    def energy(x, T):
        return C * T**2 / (2 * T_0) - 2 * C * zone(x) / T + k * (w - x * g_0) ** 2 / 2

    def unbalanced(y, u):
        return (force(y, u * T_0) / k / w + y * g_0 / w - 1, energy(y, u * T_0) / energy(x, warm(x)) - 1)

    y, u = mp.findroot(unbalanced, (w / g_0, 1))
    return [float(value) for value in (w, x * g_0, warm(x), y * g_0, u * T_0)]


@pytest.mark.parametrize(("k", "C"), [(1e12, 2.0), (2.5e12, 0.01)])
def test_moment_and_state_of_a_fold_are_those_of_the_fold_itself(k, C):
    """The zone cools as it opens; a run ends a little before the fold, by the root of what time resolves."""
    with mp.workdps(40):
        w, g, T, apart, hot = opened(mpf(k), mpf(C))
    zone = ExponentialCohesiveZone(t_max=varying(1e6, Power(exponent=-1.0)), g_0=1e-7, E_n=1e16)
    scene = perfect_contact([zone], C_1=C / 2, C_2=C / 2, loading={"w_n": Ramp(rate=1e-6)}, normal=Mounting(k=k))
    trajectory = solved.solve(scene, [0.0, 1.5 * w / 1e-6], rtol=1e-13)
    (snap,) = trajectory.of("snap")
    assert snap.t == pytest.approx(w / 1e-6, rel=5e-15)
    assert snap.before.y == pytest.approx([g, T], rel=5e-15)
    assert snap.after.y == pytest.approx([apart, hot], rel=1e-13)


def test_the_time_of_a_fold_is_known_better_than_the_gap_that_leads_to_it():
    """Zones snap on where the run ends before the fold, by more than its tolerance where that is the tightest."""
    simulation = surfacechem.load("cohesive-cycles")
    runs = [simulation.model.solve(replace(simulation.case.run, rtol=rtol)) for rtol in (1e-8, 1e-10, 1e-12)]
    for late in range(1, 6, 2):
        assert [run.jumps[late].t for run in runs] == pytest.approx([runs[-1].jumps[late].t] * 3, rel=1e-15)


def gradient(z, w_n, w_t, k_t):
    """Driving tractions of both gaps, in units of the gaps, and the determinant of their stiffness."""
    u, x = z
    e = math.exp(-u - x**2)
    r = (NORMAL * (w_n - u * G_N) - PHI / G_N * u * e, k_t * (w_t - x * G_T) - 2 * PHI / G_T * x * (1 + u) * e)
    nn = NORMAL + PHI / G_N**2 * (1 - u) * e
    tt = k_t + 2 * PHI / G_T**2 * (1 + u) * (1 - 2 * x**2) * e
    nt = -2 * PHI / (G_N * G_T) * u * x * e
    return r, nn * tt - nt**2


def test_a_fold_of_both_gaps_is_where_the_determinant_vanishes():
    """Each tangent by itself would be lost later."""
    k, v_n, v_t = 0.3 * STIFF, 3e-9, 1e-8

    def system(q):
        r, det = gradient(q[:2], v_n * q[2], v_t * q[2], k)
        return r[0] * G_N / PHI, r[1] * G_T / PHI, det / NORMAL / STIFF

    loading = {"w_n": Ramp(rate=v_n), "w_t": Ramp(rate=v_t)}
    trajectory = solve(loading, normal=Mounting(k=NORMAL), tangential=Mounting(k=k))
    snap = trajectory.of("snap")[0]
    start = (trajectory.state(snap, "g_n", "before") / G_N, trajectory.state(snap, "g_t", "before") / G_T, snap.t)
    u, x, t = fsolve(system, start, xtol=1e-13)
    assert snap.t == pytest.approx(t, rel=1e-9)
    e = math.exp(-u - x**2)
    assert k + 2 * PHI / G_T**2 * (1 + u) * (1 - 2 * x**2) * e > 1e-3 * k
    r, det = gradient((trajectory.state(snap, "g_n") / G_N, trajectory.state(snap, "g_t") / G_T), v_n * t, v_t * t, k)
    assert det > 0
    assert np.all(np.abs(r) < 1e-6 * k * G_T)


def test_a_dead_load_in_shear_beyond_the_strength_has_no_equilibrium():
    strength = PHI * math.sqrt(2 / math.e) / G_T
    trajectory = solved.solve(together([ZONE], (), {"g_n": Hold(level=0.0), "F_t": Ramp(rate=strength / 10)}), 40.0)
    assert trajectory.status == "stopped"
    assert trajectory.result.t == pytest.approx(10.0, rel=1e-9)


def test_a_dead_load_beside_a_repulsive_wall_opens_the_gap_up_to_the_strength():
    flats, g_0 = {"n_1": 2e19, "n_2": 2e19, "psi_0": 4e-21}, 3e-10
    strength = 2 * math.sqrt(5) / 9 * 2 * math.pi * math.prod(flats.values()) * g_0
    law = LennardJonesFlatFlat(**flats, g_0=g_0)
    load = Ramp(start=-strength / 10, rate=strength / 10)
    trajectory = solved.solve(together([law], (), {"F_n": load}, initial={"g_n": 2e-10}), 40.0)
    assert trajectory.status == "stopped"
    assert trajectory.result.t == pytest.approx(11.0, rel=1e-9)


# -- folds at which opening and shear are lost together: the gaps end where damped motion from there does -------------

CASE = """
T_0: 300
bodies: {{a: {{temperature: 300}}, b: {{temperature: 300}}}}
interface: {{temperature: 300, potential: [xu-needleman: {{{given}}}]}}
mechanics: {{normal: {{k: {k_n}}}, tangential: {{k: {k_t}}}}}
loading: {{w_n: {w_n}, w_t: {w_t}}}
run: {{until: 10, outputs: 3}}
"""


def tractions(g_n, g_t, Phi=1.0, g_0=1e-6, g_t0=2e-6, q=1.0, r=0.0):
    """Derivatives of Phi e^-u { (1 - r + u) (1 - q) / (r - 1) - [q + (r - q) / (r - 1) u] e^-w^2 }."""
    u, w = g_n / g_0, g_t / g_t0
    shear, decay = np.exp(-(w**2)), np.exp(-u)
    a, b = (1 - q) / (r - 1), (r - q) / (r - 1)
    level = (1 - r + u) * a - (q + b * u) * shear
    return Phi * decay * (a - b * shear - level) / g_0, Phi * decay * (q + b * u) * shear * 2 * w / g_t0


def run(k_n, k_t, w_n, w_t, **zone):
    given = ", ".join(f"{name}: {value!r}" for name, value in ({"Phi_n": 1, "g_0": 1e-6, "g_t0": 2e-6} | zone).items())
    case = CASE.format(given=given, k_n=k_n, k_t=k_t, w_n=history(w_n), w_t=history(w_t))
    data = Simulation(load_text(case)).run(error="balances").dataset
    assert data.attrs["status"] == "finished", data.attrs["reason"]
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
    "more opening after shear": (6e10, 8e10, (-4e-6, 0.0), (0.0, 2e-6), {"q": 0.8, "r": 0.3}),
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


def test_a_symmetric_balance_is_left_as_the_loads_go_on():
    """Shear of a zone that is pressed shut is unstable from the start; nothing pushes it before the drive begins."""
    k_n, k_t = 1e12, 6e10
    data = run(k_n, k_t, (-6e-6, 0.0), (0.0, -2e-6))
    assert [str(name) for name in data.event_name.values[:1]] == ["snap"]
    assert data.event_time[0] == 0.0
    assert data.u_t_before[0] == 0.0
    begin = np.array([float(data.g_n_before[0]), 0.0])
    expected = damped(np.array([k_n, k_t]), np.array([-6e-6, 0.0]), begin, tractions)
    assert data.g_n_after[0] == pytest.approx(expected[0], rel=1e-8)
    assert data.u_t_after[0] == pytest.approx(-abs(expected[1]), rel=1e-8)


def test_motion_that_nothing_bears_is_given_up_soon():
    """One gap has a spring, the other is pushed on for ever."""
    seen = 0

    def driving(ways):
        nonlocal seen
        seen += len(ways)
        return np.column_stack([1.0 - 1e10 * ways[:, 0], np.full(len(ways), -1.4)])

    assert come_to_rest(driving, np.full(2, 1e-9), np.zeros(2), np.zeros(2)) is None
    assert 0 < seen < 10_000
