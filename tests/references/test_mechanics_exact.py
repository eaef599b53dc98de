"""Moving gaps against the exact solutions of mechanics: 1e-8 where nothing happens, 1e-6 through events."""

import numpy as np
import pytest

from surfacechem.laws.bulk import Quadratic
from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.contact import Penalty
from surfacechem.laws.loading import Ramp
from surfacechem.model.assemble import assemble
from surfacechem.references import get
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run, Trajectory

ZONE = {"t_max": 1e6, "g_0": 1e-8}


def scene(potential, loading, initial=None, C=1e3, T=300.0, k=1e12) -> Scene:
    """Both bodies and the interface at one temperature, on a spring."""
    pair = Body("lower", "T", Quadratic(C=C / 2)), Body("upper", "T", Quadratic(C=C / 2))
    start = {"T": T, **(initial or {})}
    return Scene(pair, Interface("T", [potential]), (), loading, None, 300.0, start, normal=Mounting(k=k))


def run(given: Scene, times) -> Trajectory:
    trajectory = Model(assemble(given)).solve(Run(times=np.asarray(times)))
    assert trajectory.status == "finished", trajectory.reason
    return trajectory


def state(trajectory: Trajectory, name: str):
    names = [item.name for item in trajectory.model.system.states]
    return trajectory.result.outputs[:, names.index(name)]


@pytest.mark.parametrize("k", [1e12, 1e13, 3.6e13, 1e14])
def test_cohesive_pull_off_with_heating(k):
    exact = get("cohesive-pull-off-heating")(**ZONE, k=k, w_dot=1e-8, C=2e-3, T_0=300.0, T_i=310.0)
    end = 20.0 if exact.stable else 1.5 * exact.opening.w / 1e-8
    zone = ExponentialCohesiveZone(**ZONE, E_n=1e15)
    trajectory = run(scene(zone, {"w_n": Ramp(rate=1e-8)}, None, 2e-3, 310.0, k), np.linspace(0.0, end, 41))
    for name in ("g_n", "T"):
        values = exact.solution(trajectory.result.times)[name]
        np.testing.assert_allclose(state(trajectory, name), values, rtol=0, atol=1e-8 * np.max(np.abs(values)))
    assert len(trajectory.jumps) == (0 if exact.stable else 1)
    if not exact.stable:
        (jump,) = trajectory.jumps
        assert jump.t == pytest.approx(exact.opening.w / 1e-8, rel=1e-8)
        assert jump.released == pytest.approx(exact.opening.release, rel=1e-5)


@pytest.mark.parametrize("E_n", [1e6, 1e12, 1e20])
def test_touch(E_n):
    """From apart into contact: free before, elastic after."""
    exact = get("elastic-contact")(k=1e12, E_n=E_n, w_i=0.0, w_dot=-1e-8)
    given = scene(Penalty(E_n=E_n), {"w_n": Ramp(start=1e-8, rate=-1e-8)}, {"g_n": 1e-8})
    trajectory = run(given, np.linspace(0.0, 2.0, 21))
    t, g = trajectory.result.times, state(trajectory, "g_n")
    np.testing.assert_allclose(g[t <= 1.0], 1e-8 * (1.0 - t[t <= 1.0]), rtol=0, atol=1e-16)
    after = exact.solution(t[t > 1.0] - 1.0)["g_n"]
    np.testing.assert_allclose(g[t > 1.0], after, rtol=0, atol=1e-6 * np.max(np.abs(after)))
