"""Runs whose edges the compiled loop carries out: each as arc by arc, event by event; the rest is left to that."""

from dataclasses import replace

import case_runs
import numpy as np
import pytest
import zoo
from random_scenes import random_scene
from sampling import every

from surfacechem.model.assemble import assemble
from surfacechem.solve import hybrid
from surfacechem.solve.contract import Status
from surfacechem.solve.radau import solver as radau
from surfacechem.solve.radau.solver import Radau
from surfacechem.solve.run import Model, Run

JUMPING = {
    "area-stretch": 0,
    "bouncing-plate": 79,
    "compliant-debonding": 4,
    "coulomb-stop": 1,
    "debonding": 1,
    "debonding-cooling": 1,
    "pulled-at-an-angle": 1,
    "stick-slip": 12,
    "stick-slip-debonding": 10,
    "stick-slip-rebonding": 8,
}
"""Cases and the number of their jumps."""

CARRIED = {20: 0, 1: 4, 21: 6, 23: 1, 32: 8, 35: 3, 46: 1, 67: 3, 70: 9, 89: 25, 131: 3, 148: 22}
"""Random scenes of one to two hundred segments, and the number of their jumps; a limit stops 23."""

LEFT = 47, 47024
"""One in which a jump leads beyond a limit, and one in which sticking and sliding follow each other at one moment."""


@pytest.fixture
def carried(monkeypatch):
    """Whether the compiled loop has carried each run to its end."""
    ends = []

    def watched(problem, jumper):
        found = yield from hybrid.carried(problem, jumper)
        ends.append(found is not None)
        return found

    monkeypatch.setattr("surfacechem.solve.run.carried", watched)
    return ends


def both(monkeypatch, model, run, changes=None):
    """A run along its edges in the compiled loop, and arc by arc."""
    compiled = model.solve(run, changes)
    monkeypatch.setattr(Radau, "crosses_edges", False)
    by_arcs = model.solve(run, changes)
    monkeypatch.undo()
    return compiled, by_arcs


def told(points):
    return np.column_stack([points.t, points.y, points.ydot, points.ledger])


def assert_same(found, wanted):
    """Two runs are the same to the last bit."""
    a, b = found.result, wanted.result
    assert (found.status, found.reason, a.status, a.t) == (wanted.status, wanted.reason, b.status, b.t)
    assert (a.counters.steps, a.counters.rejected) == (b.counters.steps, b.counters.rejected)
    for name in ("y", "ydot", "ledger", "times", "outputs", "ledger_outputs"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    np.testing.assert_array_equal(told(a.steps), told(b.steps))
    for one, other in zip(a.known or a.states(), b.known or b.states(), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(a.problem.segments, b.problem.segments)
    np.testing.assert_array_equal(a.problem.parameters, b.problem.parameters)
    for which, other in ((a.segment, b.segment), (a.steps.segment, b.steps.segment)):
        assert which is other is None or which.tolist() == other.tolist()
    assert len(found.jumps) == len(wanted.jumps)
    for one, other in zip(found.jumps, wanted.jumps, strict=True):
        assert (one.t, one.edge, one.verdict, one.released) == (other.t, other.edge, other.verdict, other.released)
        assert (one.entropy, one.heat_out, one.entropy_out) == (other.entropy, other.heat_out, other.entropy_out)
        assert one.since == pytest.approx(other.since, rel=1e-15)
        assert dict(one.work) == dict(other.work)
        for side in ("before", "after"):
            np.testing.assert_array_equal(getattr(one, side).inputs(), getattr(other, side).inputs())


@pytest.mark.parametrize("name", JUMPING)
def test_a_case_goes_along_its_edges_as_arc_by_arc(name, monkeypatch):
    simulation = case_runs.load(name)
    model, run = simulation.model, simulation.case.run
    (*_, path) = (path for path in model.system.changeable if path.split(".")[0] != "initial")
    for factor in (1.0, 1.02):
        compiled, by_arcs = both(monkeypatch, model, run, {path: model.values()[path] * factor})
        assert_same(compiled, by_arcs)
        assert factor != 1.0 or len(compiled.jumps) == JUMPING[name]
        a, b = compiled.result.known or compiled.result.states(), by_arcs.result.known or by_arcs.result.states()
        # Where pictures begin anew with each arc, they have somewhat more or fewer states.
        assert len(a.t) == pytest.approx(len(b.t), rel=0.02)
        assert np.all(np.diff(a.t) >= 0)


@pytest.mark.parametrize("seed", [*every(2, CARRIED), *LEFT])
def test_a_random_scene_goes_along_its_edges_as_arc_by_arc_or_is_left_to_that(seed, monkeypatch, carried):
    scene, end = random_scene(seed)
    model = Model(assemble(scene))
    run = Run(np.linspace(0.0, end, 21).tolist(), 1e-11, max_steps=20_000)
    compiled, by_arcs = both(monkeypatch, model, run)
    assert carried == [seed in CARRIED]
    assert_same(compiled, by_arcs)
    assert len(compiled.jumps) == CARRIED.get(seed, len(by_arcs.jumps))


def test_explicit_steps_go_along_edges_too_and_what_has_no_room_is_solved_once_more(monkeypatch):
    model, run = (simulation := case_runs.load("stick-slip")).model, simulation.case.run
    assert_same(*both(monkeypatch, model, replace(run, solver="dop853")))
    whole = model.solve(run)
    monkeypatch.setattr(radau, "ALONE_ROWS", 10)
    assert_same(model.solve(run), whole)


def test_a_run_of_many_jumps_has_room_for_them_at_once(monkeypatch):
    monkeypatch.setattr(radau, "_run_one", lambda problem, *, once=radau._run_one: once(problem))  # none with more room
    assert len(case_runs.load("bouncing-plate").run().trajectory.jumps) == 79


def test_a_run_whose_time_is_up_is_made_again_with_the_steps_that_it_took():
    """Wherever that was, also behind steps that were rejected; its dataset keeps that number."""
    model, run = (simulation := case_runs.load("stick-slip")).model, simulation.case.run
    ended = [model.solve(replace(run, max_steps=count)) for count in range(30, 60)]
    assert any(each.result.counters.rejected > 0 for each in ended)
    assert [each.result.counters.steps for each in ended] == [*range(30, 60)]


def test_runs_end_where_steps_run_out_between_jumps_and_with_an_output_at_a_jump(monkeypatch):
    model, run = (simulation := case_runs.load("bouncing-plate")).model, simulation.case.run
    whole, ended = model.solve(run), model.solve(replace(run, max_steps=50))
    assert ended.result.status is Status.MAX_STEPS
    assert ended.result.counters.steps == 50
    assert ended.jumps[-1].t < ended.result.t < whole.result.t
    for end in [jump.t for jump in whole.jumps if jump.t > 0][::10]:
        for each in both(monkeypatch, model, replace(run, times=(0.0, end))):
            assert each.result.times.tolist() == [0.0, end]


BESIDE_A_CORNER = """
bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}
interface:
  temperature: 300 K
  friction: [stribeck: {mu_s: 0.6, mu_k: 0.3, v_s: 1 um/s, delta: 1, c_v: 1e11}]
mechanics: {tangential: {k: 1e12, c_b: 1e11}}
loading:
  p: {table: {times: [0, 1, 2, 4], values: [0.36 MPa, 0.18 MPa, 0.09 MPa, 0.09 MPa]}}
  w_t: {table: {times: [0, 1, 2, 4], values: [1 um, -1 um, -0.5 um, 0.5 um]}}
run: {until: 1.2 s}
"""
MU_K = "interface.friction.stribeck.mu_k"


def test_what_begins_to_slide_goes_on_where_residuals_are_roundoff():
    """Beside zero the velocity changes with the last digit of the spring's force, by its full size and its sign."""
    model, run = case_runs.load(BESIDE_A_CORNER).model, case_runs.load(BESIDE_A_CORNER).case.run
    for part in range(20):
        assert model.solve(run, {MU_K: 0.3 + part / 2000}).result.status is Status.FINISHED


def test_outputs_beside_a_corner_are_on_their_own_sides_where_the_time_of_an_arc_cannot_tell_them(monkeypatch):
    simulation = case_runs.load(BESIDE_A_CORNER)
    beside = [np.nextafter(1.0, 0.0), 1.0, np.nextafter(1.0, 2.0)]
    run = replace(simulation.case.run, times=(0.0, *beside, 1.2), picture=None, looks=0.0)
    pairs = [both(monkeypatch, simulation.model, run, {MU_K: 0.3 + part / 500}) for part in range(8)]
    for each in (run for pair in pairs for run in pair):
        before, at, after = each.everywhere("v")[1:4]
        assert before == pytest.approx(at, rel=1e-9)
        assert after > 0.5 * at  # the damper leaps with the far field
    starts = [compiled.jumps[2].t for compiled, _ in pairs]
    assert any(beside[0] - start == beside[1] - start for start in starts)


@zoo.each("moving")
def test_guards_are_in_play_by_the_rules_of_the_compiled_loop(member):
    system = member.system
    paths = [parameter.path for parameter in system.parameters]
    for modes in ({}, member.modes):
        values = np.array([parameter.value for parameter in system.parameters], dtype=float)
        for path, value in modes.items():
            values[paths.index(path) if path in paths else 0] = value
        asked = {(k, j) for k, j, _ in system.guard_conditions}
        held = {(k, j) for k, j, value in system.guard_conditions if values[j] == value}
        active = [all(pair in held for pair in asked if pair[0] == k) for k in range(len(system.active_guards(values)))]
        assert tuple(active) == system.active_guards(values)
