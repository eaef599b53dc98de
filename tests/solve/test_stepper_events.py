"""Events at exactly known times: dense sequences, double roots, coincidences, starts at zero, brief dips."""

import numpy as np
import pytest
import symengine as se
from solver_problems import BROKEN, RUPTURE, problem, rupture_problem, slider, slider_events

from surfacechem.compile.program import compile_program
from surfacechem.solve.contract import Margin, Status
from surfacechem.solve.radau.solver import Radau

radau = Radau()
STOP = (Margin.stop(),)
T, X, V, DX, DV = se.symbols("t x v dx dv")


def oscillator(*margins):
    """x = cos t from (1, 0)."""
    return compile_program(T, [X, V], [DX, DV], [], [DX - V, DV + X], margins=list(margins))


def clock(*margins):
    """x = t: margins of time alone, and steps as long as the run allows."""
    return compile_program(T, [X], [DX], [], [DX - 1], margins=list(margins))


def run(program, y0, end, rtol=1e-10, kinds=STOP, start=0.0):
    return radau.solve(problem(program, y0, [start, end], rtol, margins=kinds))


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_every_crossing_of_a_fast_margin_is_found_in_order(rtol):
    """22 zeros of sin(22 pi t), many of them within one step of x = t."""
    result = run(clock(se.sin(22 * se.pi * X + 0.5)), [0.0], 1.0, rtol, (Margin.restart(),))
    exact = (np.arange(1, 23) - 0.5 / np.pi) / 22
    assert result.status == Status.FINISHED
    np.testing.assert_allclose(result.events.t, exact, rtol=1e-14)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_events_are_located_to_rounding(rtol):
    result = run(clock(0.3 - X**3), [0.0], 10.0, rtol)
    assert result.t == pytest.approx(0.3 ** (1 / 3), rel=4e-16)


@pytest.mark.parametrize("width", [1.0, 0.3, 0.1])
@pytest.mark.parametrize("centre", [3.01, 4.97, 6.5])
def test_a_dip_between_samples_is_found(width, centre):
    """A double crossing of depth 1e-6 at the bottom of a parabola."""
    dip = (X - centre) ** 2 / width**2 - 1e-6
    result = run(clock(dip), [0.0], 10.0)
    assert result.status == Status.EVENT
    assert result.t == pytest.approx(centre - 1e-3 * width, rel=1e-13)


@pytest.mark.parametrize("centre", [0.77, 3.01, 9.99])
def test_a_limit_that_is_touched_is_reached(centre):
    result = run(clock((X - centre) ** 2), [0.0], 10.0)
    assert result.status == Status.EVENT
    assert result.t == pytest.approx(centre, rel=1e-6)
    assert result.margins[0] < 1e-12


def test_a_kink_that_is_touched_is_none():
    assert run(clock((X - 3.01) ** 2), [0.0], 10.0, kinds=(Margin.restart(),)).status == Status.FINISHED


def test_a_dip_that_stays_above_zero_is_none():
    assert run(clock((X - 3.01) ** 2 + 1e-9), [0.0], 10.0).status == Status.FINISHED


@pytest.mark.parametrize("width", [0.3, 0.1, 0.03])
def test_a_pulse_shorter_than_the_step_is_found(width):
    """A Gaussian pulse of the margin; steps of x = t would take the run in a few."""
    result = run(clock(0.5 - se.exp(-(((X - 0.33) / width) ** 2))), [0.0], 1.0)
    assert result.t == pytest.approx(0.33 - width * np.sqrt(np.log(2)), rel=1e-13)


def test_the_earlier_of_a_dip_and_a_crossing_comes_first():
    dip, crossing = (X - 3.01) ** 2 - 1e-8, 3.0102 - X
    result = run(clock(crossing, dip), [0.0], 10.0, kinds=(Margin.stop(), Margin.stop()))
    assert list(result.events.index) == [1]
    assert result.t == pytest.approx(3.01 - 1e-4, rel=1e-13)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_coincident_events_have_one_time(rtol):
    program = oscillator(X, 3 * X, X * V**2 - 0.0 * T, X - 0.1)
    result = run(program, [1.0, 0.0], 10.0, rtol, (Margin.restart(), Margin.stop(), Margin.restart(), Margin.restart()))
    assert list(result.events.index) == [3, 0, 1, 2]
    assert len(set(result.events.t)) == 2


def test_a_margin_at_zero_that_rises_does_not_fire():
    result = run(clock(X), [0.0], 1.0)
    assert result.status == Status.FINISHED


@pytest.mark.parametrize("start", [0.0, 1e-18, -1e-18])
def test_a_limit_at_zero_that_falls_fires_at_once(start):
    result = run(clock(1.0 - (1.0 + X)), [start], 1.0)
    assert result.status == Status.EVENT
    assert result.t == 0.0
    assert list(result.events.t) == [0.0]


def test_a_limit_passed_at_the_start_fires_at_once_where_it_falls():
    result = run(clock(-0.5 - X), [0.0], 1.0)
    assert result.status == Status.EVENT
    assert result.t == 0.0


def test_a_limit_passed_at_the_start_may_recover():
    """-0.5 + t rises through zero, and 0.5 - (t - 1)^2 falls again through zero later."""
    result = run(clock(X * (3 - X) - 0.5), [0.0], 4.0)
    assert result.status == Status.EVENT
    assert result.t == pytest.approx((3 + np.sqrt(7)) / 2, rel=1e-14)


def test_a_limit_that_stays_at_zero_for_a_while():
    """max(0, t - 1) is zero, then falls: the limit is reached where it falls."""
    margin = se.Piecewise((0.0, X < 1.0), (1.0 - X, True))
    result = run(clock(margin), [0.0], 2.0)
    assert result.status == Status.EVENT
    assert result.t <= 1.0 + 1e-12


def test_restart_at_zero_by_repeated_runs():
    """A bouncing ball, restarted by hand: velocities halve, times are exact, no bounce is missed or repeated."""
    program = compile_program(T, [X, V], [DX, DV], [], [DX - V, DV + 1], margins=[X])
    t, v, exact = 0.0, 1.0, 0.0
    for _bounce in range(25):
        result = run(program, [0.0, v], t + 10.0, start=t)
        exact += 2 * v
        assert result.status == Status.EVENT
        assert result.t == pytest.approx(exact, rel=1e-13)
        t, v = result.t, -result.y[1] / 2
    assert v == pytest.approx(2.0**-25, rel=1e-8)


def test_stick_slip_by_repeated_runs():
    """Bonds re-form in stick and break in slip: 24 events at exact times, the mode and the jump made by hand."""
    program, state, mode, times = slider(), np.zeros(3), 0.0, [0.0]
    for _event in range(24):
        case = problem(program, state, [times[-1], 1000.0], 1e-12, parameters=[mode], margins=STOP)
        result = radau.solve(case)
        assert result.status == Status.EVENT
        times.append(result.t)
        state, mode = result.y * [1.0, 0.0, 0.0], 1.0 - mode
    np.testing.assert_allclose(times[1:], slider_events(24), rtol=1e-11)


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-12])
def test_rupture_of_a_cluster_under_a_growing_force(rtol):
    """Finite-time rupture with an interface a thousand million times lighter than the bodies; energy is conserved."""
    result = radau.solve(rupture_problem(rtol))
    assert result.status == Status.EVENT
    assert result.y[0] == pytest.approx(BROKEN, rel=1e-12)
    assert result.t == pytest.approx(2.318145972772154, rel=rtol)
    heat = result.y[1] + result.y[2] - 600.0 + RUPTURE[3] * (result.y[3] - 300.0)
    assert heat == pytest.approx(20.0 * (BROKEN - 0.9), rel=1e-12 + rtol)
