"""Runs with jumps as arrays: each as the run by itself, event by event, in any company; the rest is left to that."""

from dataclasses import replace

import case_runs
import numpy as np
import pytest
import zoo
from random_scenes import random_scene

from surfacechem.model.assemble import assemble
from surfacechem.solve import stretches
from surfacechem.solve.choice import EXPLICIT
from surfacechem.solve.radau.stepper import END, EVENTS, OUTPUTS
from surfacechem.solve.run import Model, Run
from surfacechem.solve.stretches import Stretches

JUMPING = {
    "area-stretch": 0,
    "bouncing-plate": 79,
    "compliant-debonding": 4,
    "coulomb-stop": 1,
    "debonding": 1,
    "debonding-cooling": 1,
    "stick-slip": 12,
    "stick-slip-debonding": 10,
    "stick-slip-rebonding": 8,
}
"""Cases and the number of their jumps."""


def together(model, run, rows):
    """Runs with other values through arrays, and the same ones one by one."""
    values = [model.values(changes) for changes in rows]
    run = model.chosen(run, values[0])
    explicit = run.solver == EXPLICIT
    problems = [replace(model.problem(run, row), picture=0.0, explicit=explicit) for row in values]
    columns = [np.array([getattr(each, name) for each in problems]) for name in ("y0", "parameters", "segments")]
    y0, parameters, segments = columns
    carried = Stretches(model.system, model.jumper, problems[0])
    spacing = np.array([each.spacing for each in problems])
    times = np.array([each.times for each in problems])
    course = carried.run(y0, parameters, segments, times, spacing)
    return course, [model.solve_values(run, row) for row in values]


def assert_same(model, course, i, alone):
    """A run of a course is the run by itself, to the last bit."""
    n, result = model.program.n, alone.result
    assert course.counts[i, END] == result.status
    assert course.ends[i, 0] == result.t
    np.testing.assert_array_equal(course.ends[i, 1 : 1 + n], result.y)
    assert course.counts[i, OUTPUTS] == len(result.times)
    reached = course.outputs[i, : len(result.times)]
    np.testing.assert_array_equal(reached[:, :n], result.outputs)
    np.testing.assert_array_equal(reached[:, n:], result.ledger_outputs)
    happened = course.events[i, : course.counts[i, EVENTS]]
    edges = happened[happened[:, 0] >= len(model.margins)]
    assert edges[:, 1].tolist() == [jump.t for jump in alone.jumps]
    names = [model.system.edges[int(index) - len(model.margins)].name for index in edges[:, 0]]
    assert names == [jump.edge.name for jump in alone.jumps]
    for row, jump in zip(edges, alone.jumps, strict=True):
        np.testing.assert_array_equal(row[2 : 2 + n], jump.before.y)
    kept = course.records[i][: len(result.steps.t)]
    np.testing.assert_array_equal(kept[:, 0], result.steps.t)
    np.testing.assert_array_equal(kept[:, 1 : 1 + n], result.steps.y)


@pytest.mark.parametrize("name", JUMPING)
def test_a_case_with_jumps_is_that_of_the_run_by_itself(name):
    simulation = case_runs.load(name)
    model, run = simulation.model, replace(simulation.case.run, picture=None)
    (*_, path) = (path for path in model.system.changeable if path.split(".")[0] != "initial")
    usual = model.values()[path]
    rows = [{}, *({path: usual * factor} for factor in (0.999, 1.001, 1.02))]
    course, alone = together(model, run, rows)
    assert course.told.all()
    assert len(alone[0].jumps) == JUMPING[name]
    for i, each in enumerate(alone):
        assert_same(model, course, i, each)


TOLD = {1: 4, 20: 0, 21: 6, 23: 1, 32: 8, 35: 3, 46: 1, 67: 3, 70: 9, 89: 25, 131: 3, 148: 22}
"""Random scenes of one to two hundred segments, and the number of their jumps; a limit stops 23."""

LEFT = 47
"""One in which a jump leads beyond a limit."""


@pytest.mark.parametrize("seed", [*TOLD, LEFT])
def test_a_random_scene_with_jumps_is_the_run_by_itself_or_left_to_that(seed):
    scene, end = random_scene(seed)
    model = Model(assemble(scene))
    course, (alone,) = together(model, Run(np.linspace(0.0, end, 21).tolist(), 1e-11, max_steps=20_000), [{}])
    assert bool(course.told[0]) == (seed in TOLD)
    if seed in TOLD:
        assert len(alone.jumps) == TOLD[seed]
        assert_same(model, course, 0, alone)


@zoo.each("moving")
def test_guards_in_play_of_many_are_those_of_each(member):
    system = member.system
    paths = [parameter.path for parameter in system.parameters]
    table = np.tile([parameter.value for parameter in system.parameters], (3, 1))
    for path, value in member.modes.items():
        table[1, paths.index(path) if path in paths else 0] = value
    many = system.playing(table)
    assert [tuple(row) for row in many.tolist()] == [system.in_play(row) for row in table]


def test_what_has_no_room_is_solved_once_more(monkeypatch):
    simulation = case_runs.load("stick-slip")
    run = replace(simulation.case.run, picture=None)
    whole, _ = together(simulation.model, run, [{}, {"loading.w_t.ramp.rate": 2e-3}])
    monkeypatch.setattr(stretches, "ROOM", (10, 1, 0))
    narrow, _ = together(simulation.model, run, [{}, {"loading.w_t.ramp.rate": 2e-3}])
    assert narrow.told.all()
    for name in ("ends", "outputs", "events", "records", "table"):
        np.testing.assert_array_equal(getattr(narrow, name), getattr(whole, name))
