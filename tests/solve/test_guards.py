"""Limits that are touched and not passed, and sliding that begins, stops and lies at rest: each once, and no more."""

from dataclasses import replace

import numpy as np
import pytest
import symengine as se
from scenes import together
from solved import Solved, closed, solve
from solver_problems import problem
from zoo import pairwise

from surfacechem.compile.program import compile_program
from surfacechem.format import load_text
from surfacechem.laws.free_energy import Penalty, TangentialStiffness
from surfacechem.laws.friction import Coulomb, Stribeck
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import Mounting
from surfacechem.solve import solver
from surfacechem.solve.contract import Guard, Status
from surfacechem.solve.radau.solver import Radau

RTOLS, TIGHT = [1e-6, 1e-13], [1e-11, 1e-13]


@pytest.mark.parametrize(
    ("amplitude", "mean", "frequency", "rtol"), [(30.0, 0.0, 3.0, RTOLS[0]), (15.0, 15.0, 7.0, RTOLS[1])]
)
def test_a_traction_that_touches_the_limit_moves_nothing(amplitude, mean, frequency, rtol):
    """A mass that rubs, with a limit of 30 Pa, under a traction that swings."""
    loading = {"p": Hold(level=100.0), "F_t": Harmonic(amplitude=amplitude, frequency=frequency, mean=mean)}
    trajectory = solve(together([], [Coulomb(mu=0.3)], loading, tangential=Mounting(m=5.0)), 3.0, rtol=rtol)
    assert (trajectory.status, trajectory.events) == ("finished", [])
    assert np.all(trajectory.everywhere("v") == 0)
    assert np.all(trajectory.everywhere("u_t") == 0)


@pytest.mark.parametrize("name", ["lsoda", "ida"])
def test_what_nothing_holds_slides_at_once(name):
    """The limit is zero at the start, and every traction beyond it."""
    loading = {"p": Hold(level=0.0), "F_t": Ramp(rate=2.0)}
    trajectory = solve(together([], [Coulomb(mu=0.3)], loading, tangential=Mounting(m=5.0)), 3.0, solver=name)
    assert trajectory.events == ["slip forward"]
    np.testing.assert_allclose(trajectory["v"], 2.0 / 5.0 * trajectory.result.times**2 / 2, rtol=1e-6)


def elastic(amplitude, rtol):
    """Elastic sticking in series with a spring as stiff: the elastic gap is half of what is imposed."""
    loading = {"p": Hold(level=100.0), "w_t": Harmonic(amplitude=amplitude, frequency=3.0)}
    mount, sticking = Mounting(k=1e6), [TangentialStiffness(E_t=1e6)]
    return solve(together(sticking, [Coulomb(mu=0.3)], loading, tangential=mount), 3.0, outputs=101, rtol=rtol)


@pytest.mark.parametrize(("amplitude", "rtol"), [(60e-6, RTOLS[1]), (59.999999999999e-6, RTOLS[0])])
def test_elastic_sticking_that_touches_its_limit_sticks(amplitude, rtol):
    trajectory = elastic(amplitude, rtol)
    assert (trajectory.status, trajectory.events) == ("finished", [])
    gap = 0.5 * amplitude * np.sin(6 * np.pi * trajectory.result.times)
    np.testing.assert_allclose(trajectory["g_t"], gap, rtol=0, atol=max(10 * rtol, 1e-10) * amplitude)


@pytest.mark.parametrize(("rtol", "amplitude"), [(1e-9, 60.001e-6), (1e-13, 66e-6)])
def test_a_limit_that_is_just_passed_slides_from_there_to_the_peak(amplitude, rtol):
    """From a peak the gap has to swing by twice the limit: it slides in each half of a period, for a moment."""
    trajectory = elastic(amplitude, rtol)
    first = np.arcsin(60e-6 / amplitude)
    again = np.arcsin((120e-6 - amplitude) / amplitude)
    half = np.arange(18)
    begins = np.where(half == 0, first, half * np.pi + again) / (6 * np.pi)
    ends = (half + 0.5) / 3.0 / 2.0
    assert trajectory.events == [x for j in half for x in (("slip forward", "slip backward")[j % 2], "stop")]
    found = np.array([jump.t for jump in trajectory.jumps])
    np.testing.assert_allclose(found[::2], begins, rtol=0, atol=max(10 * rtol, 1e-9))
    np.testing.assert_allclose(found[1::2], ends, rtol=0, atol=max(10 * rtol, 1e-9))


@pytest.mark.parametrize("rtol", [1e-9, 1e-13])
def test_a_damper_of_the_bodies_does_not_delay_the_slip(rtol):
    """Before the first slip the bodies push with k w + c_b w': at rest that has to be what the static limit bears."""
    k, m, c, V, p_0, rise = 3e7, 25.0, 900.0, 3e-3, 1e5, 5e3
    friction = Stribeck(mu_s=0.7, mu_k=0.3, v_s=4e-3, delta=1.3, c_v=300.0)
    loading = {"p": Ramp(start=p_0, rate=rise), "w_t": Ramp(rate=V)}
    mount = Mounting(k=k, m=m, c_b=c)
    trajectory = solve(together([], [friction], loading, tangential=mount), 6.0, rtol=rtol)
    assert trajectory.events == ["slip forward", "stop"] * (len(trajectory.jumps) // 2)
    for jump in trajectory.jumps[::2]:
        u = jump.before.y[0]
        onset = (0.7 * p_0 + k * u - c * V) / (k * V - 0.7 * rise)
        assert jump.t == pytest.approx(onset, rel=1e-13)


def test_friction_that_rises_steeply_lets_slip_begin_in_its_own_direction():
    """Without a direction the speed has a slope without bound at rest, and drives on rounding of either sign."""
    loading = {"p": Hold(level=0.05), "w_t": Ramp(rate=-1.5e-10)}
    friction = Stribeck(mu_s=0.14, mu_k=0.74, v_s=5.7e-8, delta=0.4)
    trajectory = solve(together((), [friction], loading, tangential=Mounting(k=7.8e7, m=7.9e7)), 6.4, rtol=1e-6)
    assert trajectory.events == ["slip backward"]


@pytest.mark.parametrize("touch", [0.7, 1.1])
def test_what_friction_stretches_follows_a_gap_that_closes_and_opens(touch):
    """The pressure, and the rate at which friction stretches the springs of its asperities, begin and end at once."""
    gap = Table(times=[0.0, 2 * touch, 2 * touch + 1.3], values=[1e-8, -1e-8, 0.7e-8])
    springs, mount = [Penalty(E_n=1.6e15), TangentialStiffness(E_t=2.2e14)], Mounting(k=1e13, m=1e12)
    made = together(springs, [Coulomb(mu=0.5)], {"g_n": gap, "w_t": Ramp(rate=1e-10)}, tangential=mount)
    opens = 2 * touch + 1.3 / 1.7
    trajectory = closed(made, (0.0, opens, opens + 0.05), rtol=1e-8)
    assert trajectory.events == ["slip forward", "stop", "slip forward"]
    assert trajectory.jumps[1].t == pytest.approx(touch, rel=1e-14)
    u, v, rate, wave = trajectory["u_t"], trajectory["v_t"], 1e-10, np.sqrt(10.0)
    # Open it swings about what pulls it.
    swung = (u[1] - rate * opens) * np.cos(0.05 * wave) + (v[1] - rate) / wave * np.sin(0.05 * wave)
    assert u[2] == pytest.approx(rate * (opens + 0.05) + swung, rel=1e-7)


def test_what_lies_in_the_air_moves_with_the_least_push():
    """A traction that begins while nothing presses begins to move it at once, and to and fro."""
    push = Table(times=[0.0, 1e-3, 1e-3, 2e-2], values=[0.0, 0.0, 50.0, 50.0])
    loading, start = {"F_n": Hold(level=-3000.0), "F_t": push}, {"g_n": 1e-4, "v_n": -0.5}
    mounts = {"normal": Mounting(m=3.0), "tangential": Mounting(m=3.0)}
    trajectory = solve(together([Penalty(E_n=8e9)], [Coulomb(mu=0.05)], loading, start, **mounts), 1.5e-3)
    assert trajectory.events == ["touch", "release", "slip forward"]
    assert trajectory.jumps[-1].t == pytest.approx(1e-3, rel=1e-12)
    assert trajectory.end("v") == pytest.approx(50.0 / 3.0 * 0.5e-3, rel=1e-9)


@pytest.mark.parametrize("rtol", RTOLS)
def test_what_slides_as_a_rigid_contact_closes_stops_where_friction_grows_faster(rtol):
    """A rigid contact closes at 1/3 s under what is dragged along by a spring."""
    wall = Table(times=[0.0, 1.0, 3.0, 4.0], values=[5e-6, -10e-6, -10e-6, 5e-6])
    mounts = {"normal": Mounting(k=1e10), "tangential": Mounting(k=1e10)}
    loading = {"w_n": wall, "w_t": Ramp(rate=1e-5)}
    trajectory = solve(together([], [Coulomb(mu=0.8)], loading, **mounts), 5.0, outputs=101, rtol=rtol)
    assert trajectory.events == ["slip forward", "touch", "stop", "slip forward", "open"]
    found, times = [jump.t for jump in trajectory.jumps], trajectory.result.times
    np.testing.assert_allclose(found, [0.0, 1 / 3, 1 / 3, 1 / 3 + 0.8, 11 / 3], rtol=0, atol=1e-14)
    pressing = np.maximum(-np.interp(times, wall.times, wall.values), 0.0)
    held = (times > 1 / 3) & (times < 1 / 3 + 0.8)
    u = np.where(held, 1e-5 / 3, 1e-5 * times - 0.8 * pressing)
    np.testing.assert_allclose(trajectory["u_t"], u, rtol=0, atol=1e-18)


def test_what_has_turned_in_the_air_slides_on_as_a_rigid_contact_closes():
    """A direction has no meaning in the air; as the contact closes it is that in which the spring pulls, at once."""
    wall = Table(times=[0.0, 1.0, 3.0], values=[5e-6, -10e-6, -10e-6])
    drive = Table(times=[0.0, 0.2, 3.0], values=[0.0, 4e-6, -52e-6])
    mounts = {"normal": Mounting(k=1e10), "tangential": Mounting(k=1e10)}
    trajectory = solve(together([], [Coulomb(mu=0.8)], {"w_n": wall, "w_t": drive}, **mounts), 3.0, outputs=61)
    assert trajectory.events == ["slip forward", "touch", "stop"]
    times = trajectory.result.times
    pressing = np.maximum(-np.interp(times, wall.times, wall.values), 0.0)
    exact = np.interp(times, drive.times, drive.values) + 0.8 * pressing
    np.testing.assert_allclose(trajectory["u_t"], exact, rtol=0, atol=1e-18)


# -- a limit of zero, at which sticking and sliding are the same ------------------------------------------------------


OWN = {}, {"c_b": 1e11}, {"m": 1e10}
NORMAL = {}, {"c_b": 1e11}, {"m": 1e10, "e": 0.3}
DRIVEN = (1e-6, None), (-0.3e-6, 0.7), (1e-6, 0.7)
"""Rate [m/s], and static friction."""


@pytest.mark.parametrize(("normal", "own", "driven"), pairwise(NORMAL, OWN, DRIVEN))
def test_sliding_asperities_that_are_pulled_apart_let_go_once(normal, own, driven):
    """From there on nothing holds the slider, which follows its drive."""
    rate, mu_s = driven
    rigid = "e" in normal
    springs = [TangentialStiffness(E_t=2e12), *([] if rigid else [Penalty(E_n=1e13)])]
    loading = {"w_n": Ramp(start=-4e-7, rate=5e-7), "w_t": Ramp(rate=rate)}
    mounts = {"normal": Mounting(k=1e13, **normal), "tangential": Mounting(k=1e12, **own)}
    start = {"g_n": 0.0 if rigid else -2e-7}
    trajectory = closed(together(springs, [Coulomb(mu=0.5, mu_s=mu_s)], loading, start, **mounts), 2.0)
    way = "forward" if rate > 0 else "backward"
    assert trajectory.events == [f"slip {way}", "open" if rigid else "release"]
    apart = trajectory.jumps[-1]
    if "c_b" not in normal:
        assert apart.t == pytest.approx(0.8, rel=1e-13)
    left, ahead = 2.0 - apart.t, trajectory.state(apart, "u_t") - rate * apart.t
    if "m" in own:
        after = ahead * np.cos(10 * left) + (trajectory.state(apart, "v_t") - rate) / 10 * np.sin(10 * left)
    else:
        after = ahead * np.exp(-10 * left) if own else 0.0
    assert trajectory.end("u_t") == pytest.approx(2 * rate + after, rel=1e-9)


@pytest.mark.parametrize("phase", [0.0, 0.2, 1.0, 2.0])
@pytest.mark.parametrize(
    ("mu", "load", "mounts"),
    [
        (0.5, {"p": Hold(level=0.0)}, {}),
        (0.0, {"p": Hold(level=1e6)}, {}),
        (0.5, {"w_n": Hold(level=1e-6)}, {"normal": Mounting(k=1e12)}),
    ],
    ids=["no pressure", "no friction", "open"],
)
def test_what_nothing_rubs_follows_a_spring_to_and_fro(mu, load, mounts, phase):
    """It begins to move once, and where its drive turns nothing happens."""
    drive = Harmonic(amplitude=5e-7, frequency=0.5, phase=phase)
    made = together([], [Coulomb(mu=mu)], load | {"w_t": drive}, tangential=Mounting(k=1e12), **mounts)
    for rtol in TIGHT:
        trajectory = closed(made, 4.0, outputs=41, rtol=rtol)
        assert trajectory.events == ["slip forward"]
        exact = 5e-7 * np.sin(np.pi * trajectory.result.times + phase)
        np.testing.assert_allclose(trajectory["u_t"][1:], exact[1:], rtol=0, atol=rtol * 5e-7 + 1e-20)


def test_a_stage_that_ends_without_pressure_slips_once():
    """All that is left of the pressure is rounding, and so is what friction bears."""
    case = """
    T_0: 300 K
    bodies: {a: {temperature: T, C: 500 J/m^2/K}, b: {temperature: T, C: 700 J/m^2/K}}
    interface: {temperature: T, potential: [penalty: {E_n: 1 GPa/m}], friction: [coulomb: {mu: 0.5}]}
    mechanics: {normal: {k: 1 GPa/m}, tangential: {k: 1 GPa/m}}
    programme:
      - press: {w_n: -1 mm/s, until: {p: 0 MPa}}
      - shear: {w_t: 1 mm/s, until: slip forward}
      - both: {w_t: 1 mm/s, w_n: 1 mm/s, until: release}
      - back: {w_t: -1 mm/s, for: 1 s}
    initial: {w_n: 1 mm, g_n: 1 mm, w_t: 0, T: 300 K}
    run: {until: 20 s}
    """
    simulation = Simulation(load_text(case))
    for rtol in TIGHT:
        trajectory = Solved(simulation.model.solve(replace(simulation.case.run, rtol=rtol)))
        assert trajectory.status == "finished"
        assert trajectory.events == ["touch", "end of press", "slip forward", "release", "end of back"]
        assert [jump.t for jump in trajectory.jumps] == pytest.approx([1.0, 1.0, 1.0, 1.0, 2.0], rel=1e-13)
        assert trajectory.end("u_t") == pytest.approx(-1e-3, rel=1e-12)


# -- events at exactly known times: dense sequences, double roots, coincidences, starts at zero, brief dips -----------

radau = Radau()
STOP = (Guard.stop(),)
T, X, V, DX, DV = se.symbols("t x v dx dv")


def oscillator(*margins):
    """x = cos t from (1, 0)."""
    return compile_program(T, [X, V], [DX, DV], [], [DX - V, DV + X], margins=list(margins))


def clock(*margins):
    """x = t: margins of time alone, and steps as long as the run allows."""
    return compile_program(T, [X], [DX], [], [DX - 1], margins=list(margins))


def run(program, y0, end, rtol=1e-10, kinds=STOP, start=0.0):
    return radau.solve(problem(program, y0, [start, end], rtol, margins=kinds))


@pytest.mark.parametrize("rtol", [1e-3, 1e-12])
def test_every_crossing_of_a_fast_margin_is_found_in_order(rtol):
    """22 zeros of sin(22 pi t), many of them within one step of x = t."""
    result = run(clock(se.sin(22 * se.pi * X + 0.5)), [0.0], 1.0, rtol, (Guard.restart(),))
    exact = (np.arange(1, 23) - 0.5 / np.pi) / 22
    assert result.status == Status.FINISHED
    np.testing.assert_allclose(result.events.t, exact, rtol=1e-14)


def dip(centre, width):
    """A double crossing of depth 1e-6 at the bottom of a parabola."""
    return (X - centre) ** 2 / width**2 - 1e-6


FIRST = [
    (0.3 - X**3, 0.3 ** (1 / 3), 4e-16),
    *((dip(centre, width), centre - 1e-3 * width, 1e-13) for centre, width in ((3.01, 1.0), (6.5, 0.1))),
    *(((X - centre) ** 2, centre, 1e-6) for centre in (0.77, 9.99)),  # a limit that is touched is reached
    # A pulse of the margin shorter than the step: steps of x = t would take the run in a few.
    *((0.5 - se.exp(-(((X - 0.33) / w) ** 2)), 0.33 - w * np.sqrt(np.log(2)), 1e-13) for w in (0.3, 0.03)),
    (X * (3 - X) - 0.5, (3 + np.sqrt(7)) / 2, 1e-14),  # passed at the start it recovers, and is passed again later
]


@pytest.mark.parametrize(("margin", "t", "exact"), FIRST)
def test_the_first_passage_of_a_limit_is_located(margin, t, exact):
    program = clock(margin)
    for rtol in (1e-6, 1e-12):
        result = run(program, [0.0], 10.0, rtol)
        assert result.status == Status.EVENT
        assert result.t == pytest.approx(t, rel=exact)


def test_a_kink_that_is_touched_is_none():
    assert run(clock((X - 3.01) ** 2), [0.0], 10.0, kinds=(Guard.restart(),)).status == Status.FINISHED


def test_the_earlier_of_a_dip_and_a_crossing_comes_first():
    dip, crossing = (X - 3.01) ** 2 - 1e-8, 3.0102 - X
    result = run(clock(crossing, dip), [0.0], 10.0, kinds=(Guard.stop(), Guard.stop()))
    assert list(result.events.index) == [1]
    assert result.t == pytest.approx(3.01 - 1e-4, rel=1e-13)


def test_coincident_events_have_one_time():
    program = oscillator(X, 3 * X, X * V**2 - 0.0 * T, X - 0.1)
    result = run(program, [1.0, 0.0], 10.0, 1e-10, (Guard.restart(), Guard.stop(), Guard.restart(), Guard.restart()))
    assert list(result.events.index) == [3, 0, 1, 2]
    assert len(set(result.events.t)) == 2


@pytest.mark.parametrize("name", ["radau", "lsoda"])
def test_what_is_not_in_play_is_not_looked_at(name):
    """A limit that is crossed, one that starts at zero and falls, one that is no number there: none ends the run."""
    program = clock(0.3 - X, -X, se.log(X - 2.0), 0.7 - X)
    case = problem(program, [0.0], [0.0, 1.0], 1e-8, margins=STOP * 4, active=(False, False, False, True))
    result = solver(name).solve(case)
    assert (result.status, result.t) == (Status.EVENT, pytest.approx(0.7))
    assert list(result.events.index) == [3]


@pytest.mark.parametrize("start", [0.0, -1e-18])
def test_a_limit_at_zero_that_falls_fires_at_once(start):
    result = run(clock(1.0 - (1.0 + X)), [start], 1.0)
    assert result.status == Status.EVENT
    assert result.t == 0.0
    assert list(result.events.t) == [0.0]


def test_an_event_at_a_singular_state_leaves_finite_numbers():
    """A gap that closes at a steady rate under a traction that grows as its inverse root: the work is finite."""
    program = replace(compile_program(T, [X], [DX], [], [DX + 1], ledger=[X**-0.5], margins=[X]), groups=(0,))
    result = radau.solve(problem(program, [1.0], [0.0, 2.0], 1e-8, margins=STOP, times=[0.5, 1.0]))
    assert result.status == Status.EVENT
    assert result.t == pytest.approx(1.0, rel=1e-12)
    assert np.isfinite(result.ledger).all()
    assert np.isfinite(result.ledger_outputs).all()
    assert result.ledger[0] == pytest.approx(2.0, rel=3e-5)  # the inverse root of what is too brief
