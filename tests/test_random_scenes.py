"""Random scenes end with a status that is true: finished with closed balances, or a reason in words."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_scenes import random_scene

from surfacechem.assembly import assemble
from surfacechem.audit import audit
from surfacechem.errors import InputError
from surfacechem.integrate import Model, Run, Trajectory
from surfacechem.solvers.contract import REASONS, Status

BUDGETS = (REASONS[Status.MAX_STEPS], REASONS[Status.STOPPED])
KNOWN_ENDS = (REASONS[Status.STEP_UNDERFLOW], REASONS[Status.SINGULAR], REASONS[Status.NO_CONSISTENT_STATE])


def solved(seed: int) -> Trajectory | None:
    """The run of a random scene; None where its input is refused in words."""
    scene, end = random_scene(seed)
    try:
        model = Model(assemble(scene))
        times = np.linspace(0.0, end, 21).tolist()
        return model.solve(Run(times=times, max_steps=5000, max_seconds=10.0))
    except InputError as error:
        assert error.message
        return None


def check(seed: int) -> None:
    trajectory = solved(seed)
    if trajectory is None:
        return
    result = trajectory.result
    assert trajectory.status in ("finished", "stopped", "failed")
    assert np.all(np.isfinite(result.outputs))
    assert np.all(np.isfinite(result.ledger_outputs))
    assert np.all(np.isfinite(trajectory.outputs))
    if trajectory.status == "finished":
        assert result.t == pytest.approx(trajectory.run.times[-1], rel=1e-14)
        assert len(result.times) == len(trajectory.run.times)
    if trajectory.status == "failed":
        assert trajectory.reason.startswith((*BUDGETS, *KNOWN_ENDS, "transitions follow each other"))
        return
    books = audit(trajectory)
    assert [finding for finding in books.findings if "balance" in finding] == []
    # The velocity at which sliding stops is known to the rounding of time, which a pulse magnifies.
    assert all(low >= -1e-6 * abs(books.largest[law]) for law, low in books.least.items())


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 10**6))
def test_random_scenes(seed):
    check(seed)


@pytest.mark.slow
@settings(max_examples=1000, deadline=None, derandomize=True)
@given(st.integers(0, 10**9))
def test_a_thousand_random_scenes(seed):
    check(seed)
