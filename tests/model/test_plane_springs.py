"""Dry friction in the plane without a mass: exact paths, one component rotated, consistency, small masses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plane import BODIES, circling, close, events, moments, run, scene
from scenes import varying
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tables_mechanics import Solved, solve

from surfacechem.errors import InputError
from surfacechem.laws.contact import Penalty
from surfacechem.laws.factors import Linear
from surfacechem.laws.friction import AnisotropicCoulomb, BondedCoulomb, Coulomb, MohrCoulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.run import Model

K, P, MU = 1e8, 1e5, 0.4
SPRING, REACH = Mounting(k=K), MU * P / K
"""A spring, and by how much it is stretched while the block slides."""

ROUGH, STIFFER = AnisotropicCoulomb(mu_1=0.2, mu_2=0.5), Mounting(k=3 * K)
PULL = {"w_t": Harmonic(amplitude=2e-3, frequency=1.0), "w_t2": Harmonic(amplitude=1.5e-3, frequency=1.3)}


def resists(solved: Solved) -> None:
    """Friction dissipates at every time, and so does every jump."""
    laws = [item.name for item in solved.system.outputs if item.name.startswith("D_")]
    assert laws
    assert all(np.all(solved[name] >= 0) for name in laws)
    assert all(jump.released >= -1e-12 and jump.entropy >= -1e-12 for jump in solved.jumps)


# -- exact paths ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("psi", [1e-3, 0.3, 1.5])
def test_a_block_on_a_string_draws_a_tractrix(psi):
    """Dragged along a line, the string turns by tan(psi / 2) ~ exp(-V t / e), and the path is -e ln sin psi long."""
    V, times = 1e-3, np.linspace(0, 2, 21)
    start = {"u_t": -REACH * math.cos(psi), "u_t2": -REACH * math.sin(psi)}
    solved = run(scene([Coulomb(mu=MU)], SPRING, start, p=P, w_t=Ramp(rate=V), w_t2=0.0), times)
    angle = 2 * np.arctan(math.tan(psi / 2) * np.exp(-V * times / REACH))
    close(solved["u_t"], V * times - REACH * np.cos(angle))
    close(solved["u_t2"], -REACH * np.sin(angle))
    close(solved["turn"], angle - psi)
    slid = REACH * np.log(math.sin(psi) / np.sin(angle))
    close(solved["l_t"], slid)
    close(solved["heat_coulomb"], MU * P * slid)
    assert solved.jumps[0].t < 1e-9


def test_a_string_that_is_pushed_first_slackens():
    """It sticks until the spring is as long again on the other side."""
    V, psi, times = 1e-3, 2.0, np.linspace(0, 2, 21)
    start = {"u_t": -REACH * math.cos(psi), "u_t2": -REACH * math.sin(psi)}
    solved = run(scene([Coulomb(mu=MU)], SPRING, start, p=P, w_t=Ramp(rate=V), w_t2=0.0), times)
    onset = -2 * REACH * math.cos(psi) / V
    assert events(solved) == ["slip"]
    assert solved.jumps[0].t == pytest.approx(onset, rel=1e-13)
    angle = 2 * np.arctan(math.tan((math.pi - psi) / 2) * np.exp(-V * (times - onset) / REACH))
    sliding = times > onset
    close(solved["u_t"][sliding], (V * times - REACH * np.cos(angle))[sliding])
    close(solved["u_t2"][sliding], -REACH * np.sin(angle)[sliding])


def test_dragged_in_a_circle_it_lags_by_a_tangent():
    R, times = 2e-3, np.linspace(0, 3, 31)
    r, lag = math.sqrt(R**2 - REACH**2), math.asin(REACH / R)
    drive = {
        "w_t": Harmonic(amplitude=R, frequency=1.0, phase=math.pi / 2),
        "w_t2": Harmonic(amplitude=R, frequency=1.0),
    }
    start = {"u_t": r * math.cos(lag), "u_t2": -r * math.sin(lag)}
    solved = run(scene([Coulomb(mu=MU)], SPRING, start, p=P, **drive), times)
    angle = 2 * math.pi * times
    close(solved["u_t"], r * np.cos(angle - lag))
    close(solved["u_t2"], r * np.sin(angle - lag))
    close(solved["turn"], angle)
    close(solved["heat_coulomb"], MU * P * r * angle)


@pytest.mark.parametrize("law", [Coulomb(mu=0.2), ROUGH], ids=["round", "elliptic"])
def test_a_reversal_stops_at_once_and_slides_on_when_the_ellipse_is_crossed(law):
    along, across = (Table(times=[0.0, 1.0, 3.0], values=[0.0, x, -x]) for x in (1e-3, 2e-3))
    times = [0.0, 1.0, 1.05, 3.0]
    solved = run(scene([law], SPRING, p=P, w_t=along, w_t2=across), times)
    assert events(solved) == ["slip", "stop", "slip"]
    begun, stopped, again = (jump.t for jump in solved.jumps)
    axes = np.array([0.2, getattr(law, "mu_2", 0.2)]) * P
    back = K * np.array([1e-3, 2e-3]) / axes
    assert begun == pytest.approx(1 / np.linalg.norm(back), rel=1e-13)
    assert stopped == 1.0
    held = np.array([solved["t_t"][1], solved["t_t2"][1]]) / axes
    assert np.linalg.norm(held) == pytest.approx(1, rel=1e-11)
    assert again == pytest.approx(1 + 2 * held @ back / (back @ back), rel=1e-10)
    for u in ("u_t", "u_t2"):
        assert solved[u][2] == pytest.approx(solved[u][1], rel=1e-14)
    resists(solved)


# -- one component, rotated -----------------------------------------------------------------------------------------

ALONG = Harmonic(amplitude=2e-3, frequency=1.0)
JUMPING = Table(times=[0.0, 0.5, 0.5, 1.0, 1.0, 2.0], values=[0.0, 1e-3, 2e-3, 3e-3, 2e-4, -1e-3])
PULSING = Harmonic(mean=P, amplitude=0.9 * P, frequency=0.7)
LIFTED = Table(times=[0.0, 0.5, 1.2, 2.0], values=[P, 0.0, 0.0, P])
WEAKER = varying(0.4, Linear(of="T_c", slope=-1e-2, about=300.0))
LINES = {
    "dry": ([Coulomb(mu=MU)], ALONG, P),
    "static limit": ([Coulomb(mu=MU, mu_s=0.6)], ALONG, P),
    "two laws": ([Coulomb(mu=0.2, mu_s=0.5), Coulomb(mu=0.1)], ALONG, P),
    "cohesion": ([MohrCoulomb(mu=0.3, t_n_max=2e4, c=5e3, mu_s=0.5)], ALONG, PULSING),
    "weakened by heat": ([Coulomb(mu=WEAKER)], ALONG, P),
    "lifted off": ([Coulomb(mu=MU)], ALONG, LIFTED),
    "drive jumps": ([Coulomb(mu=MU)], JUMPING, P),
    "drive jumps, static limit": ([Coulomb(mu=MU, mu_s=0.6)], JUMPING, P),
    "pressure jumps": (
        [Coulomb(mu=MU)],
        Ramp(rate=2e-3),
        Table(times=[0, 0.7, 0.7, 1.2, 1.2, 2], values=[P, P, 2 * P, 2 * P, P, P]),
    ),
}


@pytest.mark.parametrize(("frictions", "pull", "p"), LINES.values(), ids=LINES)
def test_along_a_line_it_is_that_of_one_component(frictions, pull, p):
    times = np.linspace(0, 1.99, 41)
    one = run(scene(frictions, SPRING, p=p, w_t=pull), times)
    assert len(one.jumps) > 1
    for c, s in ((1.0, 0.0), (0.6, 0.8), (-0.8, 0.6)):
        both = run(scene(frictions, SPRING, p=p, w_t=scaled(pull, c), w_t2=scaled(pull, s)), times)
        close(both["u_t"] * c + both["u_t2"] * s, one["u_t"], 1e-9)
        assert np.max(np.abs(both["u_t"] * s - both["u_t2"] * c)) < 1e-12 * np.max(np.abs(one["u_t"]))
        close(both["T"] - 300, one["T"] - 300, 1e-9)
        assert moments(both) == pytest.approx(moments(one), rel=1e-9)
        assert sum(jump.released for jump in both.jumps) == pytest.approx(sum(j.released for j in one.jumps), abs=1e-9)
        resists(both)


def scaled(load, factor):
    """A history times a number."""
    if isinstance(load, Harmonic):
        return replace(load, amplitude=factor * load.amplitude)
    if isinstance(load, Ramp):
        return replace(load, rate=factor * load.rate)
    return replace(load, values=[factor * value for value in load.values])


def test_bonds_break_and_the_spring_jumps_along_the_pull():
    law = BondedCoulomb(mu=0.3, mu_b=0.7, mu_ub=0.3)
    drive = {"w_t": Ramp(rate=1.2e-3), "w_t2": Ramp(rate=1.6e-3)}
    solved = run(scene([law], SPRING, p=P, phi=1.0, **drive), [0.0, 0.5, 1.0])
    (slip,) = solved.jumps
    assert slip.t == pytest.approx(0.7 * P / K / 2e-3, rel=1e-12)
    assert slip.released == pytest.approx((0.7**2 - 0.3**2) / 2 * P**2 / K, rel=1e-9)
    close(solved["l_t"][1:], 2e-3 * np.array([0.5, 1.0]) - 0.3 * P / K)


def test_contact_that_opens_lets_go_of_the_block():
    """A spring presses a penalty, and lifts off now and then: there the block follows the drive."""
    gap = Harmonic(mean=-1e-4, amplitude=1.9e-4, frequency=0.7)
    times = np.linspace(0, 2, 41)

    def pressed(law, **drive) -> Solved:
        interface = Interface("T", [Penalty(E_n=1e9)], [law])
        mounts = {"normal": Mounting(k=1e9), "tangential": SPRING}
        return run(Scene(BODIES, interface, (), {"w_n": gap, **drive}, None, 300.0, {"T": 300.0}, **mounts), times)

    one = pressed(Coulomb(mu=MU), w_t=ALONG)
    both = pressed(Coulomb(mu=MU), w_t=scaled(ALONG, 0.6), w_t2=scaled(ALONG, 0.8))
    close(0.6 * both["u_t"] + 0.8 * both["u_t2"], one["u_t"], 1e-9)
    for law in (Coulomb(mu=MU), ROUGH):
        solved = pressed(law, **PULL)
        apart = solved["g_n"] > 1e-12
        assert np.any(apart)
        for u, w in (("u_t", "w_t"), ("u_t2", "w_t2")):
            assert np.max(np.abs(solved[u] - solved[w])[apart]) < 1e-13
        resists(solved)


# -- the plane itself -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("p", [P, PULSING, LIFTED, Ramp(rate=P)], ids=["held", "pulsing", "lifted", "pressed on"])
def test_isotropic_sliding_on_springs_does_not_know_the_axes(p):
    c, s = math.cos(0.4), math.sin(0.4)
    times = np.linspace(0, 2, 41)

    def pulled(along, across) -> Solved:
        """Each component of the far field is a sum of two harmonics: the second comes as a traction."""
        loads = {}
        for axis, (x, y) in (("t", along), ("t2", across)):
            loads[f"w_{axis}"] = Harmonic(amplitude=2e-3 * x, frequency=1.0)
            loads[f"F_{axis}"] = Harmonic(amplitude=1.5e5 * y, frequency=1.3)
        return run(scene([Coulomb(mu=MU, mu_s=0.5 if p is P else None)], SPRING, p=p, **loads), times)

    straight, turned = pulled((1, 0), (0, 1)), pulled((c, -s), (s, c))
    size = np.hypot(straight["u_t"], straight["u_t2"]).max()
    for found, exact in (
        (c * turned["u_t"] + s * turned["u_t2"], straight["u_t"]),
        (c * turned["u_t2"] - s * turned["u_t"], straight["u_t2"]),
    ):
        assert np.max(np.abs(found - exact)) <= 1e-9 * size
    assert moments(straight) == pytest.approx(moments(turned), rel=1e-8, abs=1e-12)


PRESSURE = (lambda t: P * (1 + 0.5 * np.sin(3 * t)), lambda t: 1.5 * P * np.cos(3 * t))


def consistency(mu, k, weakening):
    """The rate that keeps springs and friction in balance: n is the pull in units of friction, its size stays one."""

    def rates(t, state):
        u, T = state[:2], state[2]
        (w, w_dot), f = circling(t), 1 + weakening * (T - 300)
        L = mu * PRESSURE[0](t) * f
        n = k * (w - u) / L
        n /= np.linalg.norm(n)
        stays = mu * PRESSURE[1](t) * f
        warms = (L @ n**2) / (100.0 * T / 300)  # with the length of the path
        heats = mu * PRESSURE[0](t) * weakening * warms
        s = (n / L) @ (k * w_dot - stays * n) / ((n**2 / L) @ (k + heats))
        return [*(s * n), s * warms]

    return rates


@pytest.mark.parametrize("weakening", [0.0, -2e-2])
@pytest.mark.parametrize(("mu", "k_2"), [((0.4, 0.4), 3e8), ((0.2, 0.5), 1e8), ((0.5, 0.2), 4e8)])
def test_it_obeys_the_consistency_condition(mu, k_2, weakening):
    m_1, m_2 = (varying(x, Linear(of="T_c", slope=weakening, about=300.0)) if weakening else x for x in mu)
    law = AnisotropicCoulomb(mu_1=m_1, mu_2=m_2)
    k, n = np.array([K, k_2]), np.array([0.9, 0.4]) / math.hypot(0.9, 0.4)
    u = circling(0.0)[0] - np.array(mu) * P * n / k * (1 + 1e-13)
    w = {"w_t": Harmonic(amplitude=2e-3, frequency=1.0), "w_t2": Harmonic(amplitude=1.5e-3, frequency=1.0, phase=1.0)}
    p = Harmonic(mean=P, amplitude=P / 2, frequency=1.5 / math.pi)
    times = np.linspace(0, 0.2, 21)
    start = {"u_t": u[0], "u_t2": u[1]}
    solved = run(scene([law], SPRING, start, Mounting(k=k_2), p=p, **w), times)
    assert events(solved) == ["slip"]
    rates = consistency(np.array(mu), k, weakening)
    found = solve_ivp(rates, (0, 0.2), [*u, 300.0], "DOP853", t_eval=times, rtol=1e-13, atol=1e-16).y
    close(solved["u_t"], found[0], 1e-9)
    close(solved["u_t2"], found[1], 1e-9)
    close(solved["T"] - 300, found[2] - 300, 1e-9)
    resists(solved)


def test_friction_stays_on_the_ellipse():
    times = np.linspace(0, 20, 201)
    solved = run(scene([ROUGH], SPRING, None, STIFFER, p=P, **PULL), times)
    x, y = solved["t_t"] / (0.2 * P), solved["t_t2"] / (0.5 * P)
    sliding = solved["slip"] > 0
    k_x, k_y = solved["w_t"] - solved["u_t"], 3 * (solved["w_t2"] - solved["u_t2"])
    close(K * k_x[sliding], solved["t_t"][sliding], 1e-9)
    close(K * k_y[sliding], solved["t_t2"][sliding], 1e-9)
    assert np.max(np.hypot(x, y)) < 1 + 1e-12
    resists(solved)


@pytest.mark.parametrize("law", [Coulomb(mu=MU), ROUGH], ids=["round", "elliptic"])
def test_small_dampers_and_masses_slide_like_none(law):
    times = np.linspace(0, 0.24, 13)
    exact = run(scene([law], SPRING, None, STIFFER, p=P, **PULL), times)

    def error(mass, damping) -> float:
        mounts = Mounting(k=K, m=mass, c_g=damping), Mounting(k=3 * K, c_g=damping)
        solved = run(scene([law], mounts[0], None, mounts[1], p=P, **PULL), times)
        return max(np.max(np.abs(solved[u] - exact[u])) for u in ("u_t", "u_t2"))

    damped = [error(0.0, c) for c in (1e4, 1e3)]
    assert damped[1] == pytest.approx(damped[0] / 10, rel=0.02)
    heavy = [error(m, math.sqrt(K * m)) for m in (1e-2, 1e-4)]
    assert heavy[1] == pytest.approx(heavy[0] / 10, rel=0.05)
    assert max(damped[1], heavy[1]) < 1e-4 * np.max(np.abs(exact["u_t"]))


@pytest.mark.parametrize(("c", "c_2"), [(1e6, 1e6), (1e5, 1e6), (3e3, 1e3)])
def test_dampers_beside_friction_that_knows_directions(c, c_2):
    """What pulls is resisted by friction and damper, (L + c s) n, which leaves one speed."""
    k, L, damping = np.array([K, 3 * K]), np.array([0.2, 0.5]) * P, np.array([c, c_2])
    times = np.linspace(0, 1, 21)
    mounts = Mounting(k=K, c_g=c), Mounting(k=3 * K, c_g=c_2)
    w = {"w_t": Harmonic(amplitude=2e-3, frequency=1.0), "w_t2": Harmonic(amplitude=1.5e-3, frequency=1.0, phase=1.0)}
    u = circling(0.0)[0] - 0.999 * L * np.array([0.6, 0.8]) / k
    solved = run(scene([ROUGH], mounts[0], {"u_t": u[0], "u_t2": u[1]}, mounts[1], p=P, **w), times)

    def rates(t, state):
        pull = k * (circling(t)[0] - state)
        if np.linalg.norm(pull / L) <= 1:
            return [0.0, 0.0]

        def beyond(s):
            return np.linalg.norm(pull / (L + damping * s)) - 1

        s = brentq(beyond, 0, np.linalg.norm(pull) / damping.min(), xtol=1e-300, rtol=1e-15)
        return pull / (L + damping * s) * s

    begun = solved.jumps[0].t
    assert events(solved)[0] == "slip"
    sliding = times > begun
    found = solve_ivp(rates, (begun, 1), u, "Radau", t_eval=times[sliding], rtol=1e-10, atol=1e-16).y
    close(solved["u_t"][sliding], found[0], 1e-7)
    close(solved["u_t2"][sliding], found[1], 1e-7)
    resists(solved)


# -- what has no answer ---------------------------------------------------------------------------------------------

ON = {"w_t": Ramp(rate=1e-3), "w_t2": Ramp(rate=1e-3)}


def test_a_jump_is_refused_where_its_way_is_open():
    steps = {"w_t": JUMPING, "w_t2": 0.0}
    solved = solve(Model(assemble(scene([ROUGH], SPRING, p=P, **steps))), np.linspace(0, 2, 5))
    assert solved.status == "stopped"
    assert "beyond what sticking bears, as after a jump" in solved.reason
    assert solved.reason.endswith("at t = 0.5 s")
    small = {"w_t": Table(times=[0.0, 0.5, 0.5, 1.0], values=[0.0, 0.0, 1e-4, 1e-4]), "w_t2": 0.0}
    assert events(run(scene([ROUGH], SPRING, p=P, **small), [0.0, 1.0])) == ["load"]  # it sticks


def test_a_start_beyond_the_ellipse_is_refused_where_its_way_is_open():
    start = {"u_t": -1e-3, "u_t2": -1e-3}
    outside = solve(Model(assemble(scene([ROUGH], SPRING, start, p=P, **ON))), [0.0, 1.0])
    assert outside.status == "stopped"
    assert outside.reason.endswith("only a mass or a damper says which way it slips at t = 0 s")
    solved = run(scene([Coulomb(mu=MU)], SPRING, {"u_t": -1e-3}, p=P, **ON), [0.0, 1.0])
    assert solved.jumps[0].released == pytest.approx(K / 2 * (1e-3 - REACH) ** 2 + MU * P * (1e-3 - REACH), rel=1e-8)


@pytest.mark.parametrize("mount", [SPRING, Mounting(k=K, c_b=1e5)], ids=["springs", "dampers"])
def test_rails_need_a_mass(mount):
    model = Model(assemble(scene([AnisotropicCoulomb(mu_1=0.2, mu_2=0.0)], mount, p=Hold(level=P), **ON)))
    with pytest.raises(InputError, match="nothing rubs along one of two directions; with a mass"):
        solve(model, [0.0, 1.0])
