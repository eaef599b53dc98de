"""Every exact table is met: 1e-8 where the solution is smooth, 1e-6 at the extremes, at default tolerances."""

from functools import cache

import numpy as np
import pytest
import tables
from tables import errors

from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.solve.run import Model, Run, Trajectory

MAKERS = tables.makers()


@cache
def made(name: str) -> tables.Table:
    return MAKERS[name]()


@cache
def at_default_tolerance(name: str) -> Trajectory:
    return solved(made(name))


SMOOTH = [name for name in MAKERS if not name.startswith("x")]
smooth_tables = pytest.mark.parametrize("name", SMOOTH)
each_table = pytest.mark.parametrize("name", MAKERS)


def solved(table: tables.Table, model: Model | None = None, **settings) -> Trajectory:
    times = table.times if table.times[0] == 0 else np.concatenate([[0.0], table.times])
    return (model or Model(assemble(table.scene))).solve(Run(times=times, **settings))


@each_table
def test_exact_values_are_met(name):
    table, trajectory = made(name), at_default_tolerance(name)
    assert trajectory.status == "finished", trajectory.reason
    assert max(errors(table, trajectory).values()) < table.tolerance


@each_table
def test_energy_closes_and_no_law_destroys_entropy(name):
    books = audit(at_default_tolerance(name))
    assert books.energy_error < 1e-9
    assert books.violations == ()


@smooth_tables
def test_entropy_closes(name):
    """At the extremes a temperature may rise by ten decades within a step, which its reciprocal does not forgive."""
    assert audit(at_default_tolerance(name)).entropy_error < 1e-9
