"""Every tolerance on every problem: the run ends, the error follows the tolerance, the steps stay few."""

import numpy as np
import pytest
import tables
from sampling import every
from solver_problems import problem, robertson, robertson_dae, robertson_sums
from test_tables import MAKERS, SMOOTH, errors

from surfacechem.model.assemble import assemble
from surfacechem.solve.contract import Status
from surfacechem.solve.radau.newton import COARSE_RTOL
from surfacechem.solve.radau.solver import Radau
from surfacechem.solve.run import Model, Run

TOLERANCES = [10.0**-digits for digits in range(3, 14)]
ROBERTSON = [2.083340149701255e-08, 8.333360770334713e-14]
"""Hairer & Wanner II, IV.10, at t = 1e11."""
CONDITION = 200
"""Differences of two states (heat released, entropy made) lose two digits; their floor in the tables is 1e-2."""

radau = Radau()
ROUNDING = {"x05_closing_film": 3e-8}
"""Floors of what can be known: one ulp of the time is 1e-7 of the film left 1e-8 s before it closes, and a film thinner
by a tenth is hotter by 0.3 K."""

each_tolerance = pytest.mark.parametrize("rtol", TOLERANCES)


@each_tolerance
@pytest.mark.parametrize(
    ("make", "digits"),
    # Cancelling rates of 1e-9, known to 1e-25, integrated over 1e11 s: no method finds more digits of the first two.
    [(robertson, 1e-7), (robertson_dae, 1e-7), (robertson_sums, 1e-13)],
)
def test_robertson(make, digits: float, rtol: float) -> None:
    result = radau.solve(problem(make(), [1.0, 0.0, 0.0], [0.0, 1e11], rtol, atol=rtol * 1e-10))
    assert result.status == Status.FINISHED
    assert np.max(np.abs(result.y[:2] / ROBERTSON - 1)) < 10 * rtol + digits
    assert result.counters.steps < 400
    assert result.counters.rejected < 0.15 * result.counters.steps


@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_tables(name: str) -> None:
    table = MAKERS[name]()
    model = Model(assemble(table.scene))
    for rtol in TOLERANCES[::2]:
        trajectory = model.solve(Run(times=with_start(table), rtol=rtol))
        assert trajectory.status == "finished", trajectory.reason
        assert max(errors(table, trajectory).values()) < CONDITION * rtol
        assert trajectory.result.counters.steps < 200


@pytest.mark.parametrize("name", every(3, [name for name in MAKERS if name not in SMOOTH]))
def test_extreme_tables(name: str) -> None:
    """Layers of 1e-300 s and slopes beyond 1e200: solved, or where the tolerance does not resolve them, given up."""
    table = MAKERS[name]()
    model = Model(assemble(table.scene))
    for rtol in TOLERANCES[::2]:
        trajectory = model.solve(Run(times=with_start(table), rtol=rtol))
        if rtol > COARSE_RTOL and not trajectory.result.status.success:
            continue
        assert trajectory.status == "finished", trajectory.reason
        assert max(errors(table, trajectory).values()) < CONDITION * rtol + ROUNDING.get(name, 0.0)
        assert trajectory.result.counters.steps < 2000 or rtol > COARSE_RTOL


def with_start(table: tables.Table) -> np.ndarray:
    return np.asarray(table.times if table.times[0] == 0 else np.concatenate([[0.0], table.times]))
