"""Moving gaps against the exact solutions of mechanics: 1e-8 where nothing happens, 1e-6 through events."""

import numpy as np
import pytest
from oracles import get
from scenes import varying

from surfacechem.laws.bonding import BondEnergy
from surfacechem.laws.bulk import Quadratic
from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.contact import Penalty
from surfacechem.laws.factors import Proportional
from surfacechem.laws.friction import BondedCoulomb, Coulomb
from surfacechem.laws.kinetics import LinearAffinity
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.laws.longrange import LennardJonesFlatFlat
from surfacechem.model.assemble import assemble
from surfacechem.references import Reference
from surfacechem.scene import Body, Interface, Mounting, Scene, Sites
from surfacechem.solve.run import Model, Run, Trajectory

SLIDER = Mounting(m=10.0, k=1e8)
ZONE = {"t_max": 1e6, "g_0": 1e-8}


def scene(potentials=(), frictions=(), loading=None, initial=None, C=1e3, T=300.0, **more) -> Scene:
    """Both bodies and the interface at one temperature."""
    pair = Body("lower", "T", Quadratic(C=C / 2)), Body("upper", "T", Quadratic(C=C / 2))
    return Scene(
        pair, Interface("T", potentials, frictions), (), loading, None, 300.0, {"T": T, **(initial or {})}, **more
    )


def run(given: Scene, times) -> Trajectory:
    trajectory = Model(assemble(given)).solve(Run(times=np.asarray(times)))
    assert trajectory.status == "finished", trajectory.reason
    return trajectory


def state(trajectory: Trajectory, name: str):
    names = [item.name for item in trajectory.model.system.states]
    return trajectory.result.outputs[:, names.index(name)]


def assert_follows(trajectory: Trajectory, reference: Reference, names, relative: float) -> None:
    """Errors relative to the largest exact value."""
    exact = reference.solution(trajectory.result.times)
    for name in names:
        scale = np.max(np.abs(exact[name]))
        np.testing.assert_allclose(state(trajectory, name), exact[name], rtol=0, atol=relative * scale, err_msg=name)


def counts(trajectory: Trajectory) -> dict[str, int]:
    names = [jump.transition.name for jump in trajectory.jumps]
    return {name: names.count(name) for name in names}


def test_coulomb_stop():
    given = scene((), [Coulomb(mu=0.25)], {"p": Hold(level=3e4)}, {"v": 2.0}, 100.0, tangential=Mounting(m=5.0))
    exact = get("coulomb-stop")(m=5.0, mu=0.25, p=3e4, v_i=2.0, C=100.0, T_0=300.0, T_i=300.0)
    trajectory = run(given, np.linspace(0.0, 2e-3, 41))
    assert_follows(trajectory, exact, ("v", "u_t", "T"), 1e-12)
    assert np.all(state(trajectory, "v")[trajectory.result.times > exact.stop_time] == 0.0)


@pytest.mark.parametrize("V", [10.0**e for e in range(-15, 3, 2)] + [0.3, 1e3])
def test_stick_slip_over_decades_of_speed(V):
    """Five cycles: as many slips as sticks, no flip between them, and the displacement of the exact solution."""
    exact = get("stick-slip")(m=10.0, k=1e8, V=V, t_s=6e4, t_k=4e4)
    loading = {"p": Hold(level=1e5), "w_t": Ramp(rate=V)}
    given = scene((), [Coulomb(mu=0.4, mu_s=0.6)], loading, {"v": 0.0}, tangential=SLIDER)
    ends = exact.onset_time + (np.arange(5) + 1.0) * exact.period
    trajectory = run(given, [0.0, exact.onset_time, *(ends - 0.5 * exact.stick_time), ends[-1] - 1e-6 * exact.period])
    assert_follows(trajectory, exact, ("u_t",), 1e-8)
    assert counts(trajectory) == {"slip forward": 5, "stop": 5}


def test_stick_slip_while_it_slips():
    exact = get("stick-slip")(m=10.0, k=1e8, V=0.3, t_s=6e4, t_k=4e4)
    loading = {"p": Hold(level=1e5), "w_t": Ramp(rate=0.3)}
    given = scene((), [Coulomb(mu=0.4, mu_s=0.6)], loading, {"v": 0.0}, tangential=SLIDER)
    trajectory = run(given, np.linspace(0.0, 5 * exact.period, 401))
    assert_follows(trajectory, exact, ("u_t", "v"), 1e-8)


def test_stick_slip_with_bonds_that_form_again():
    sites, K, tau = Sites(1e18, 1e18), 1e-12, 2.0
    bonding = LinearAffinity(c_r=varying(1e18 / (tau * K), Proportional(of="sticking")))
    friction = BondedCoulomb(mu=0.4, mu_b=0.7, mu_ub=0.4)
    pair = Body("lower", "T", Quadratic(C=1e15)), Body("upper", "T", Quadratic(C=1e15))
    interface = Interface("T", [BondEnergy(K_0=K)], [friction], [bonding], sites)
    loading = {"p": Hold(level=1e5), "w_t": Ramp(rate=7.5e-5)}
    given = Scene(pair, interface, (), loading, None, 300.0, {"T": 300.0, "v": 0.0, "phi": 0.0}, tangential=SLIDER)
    given_law = {"p": 1e5, "mu_b": 0.7, "mu_ub": 0.4, "mu_k": 0.4, "tau": tau}
    exact = get("stick-slip-rebonding")(m=10.0, k=1e8, V=7.5e-5, **given_law)
    assert_follows(run(given, np.linspace(0.0, 40.0, 401)), exact, ("u_t", "phi"), 1e-8)


@pytest.mark.parametrize("k", [1e12, 1e13, 3.6e13, 1e14])
def test_cohesive_pull_off_with_heating(k):
    exact = get("cohesive-pull-off-heating")(**ZONE, k=k, w_dot=1e-8, C=2e-3, T_0=300.0, T_i=310.0)
    end = 20.0 if exact.stable else 1.5 * exact.opening.w / 1e-8
    zone = ExponentialCohesiveZone(**ZONE, E_n=1e15)
    given = scene([zone], (), {"w_n": Ramp(rate=1e-8)}, None, 2e-3, 310.0, normal=Mounting(k=k))
    trajectory = run(given, np.linspace(0.0, end, 41))
    assert_follows(trajectory, exact, ("g_n", "T"), 1e-8)
    assert len(trajectory.jumps) == (0 if exact.stable else 1)
    if not exact.stable:
        (jump,) = trajectory.jumps
        assert jump.t == pytest.approx(exact.opening.w / 1e-8, rel=1e-8)
        assert jump.released == pytest.approx(exact.opening.release, rel=1e-5)


@pytest.mark.parametrize("delta_w", [1e-7, 1e-10, 1e-12])
def test_overdamped_passage(delta_w):
    """Close to the fold a rounding of w moves the passage by its part of delta_w."""
    exact = get("overdamped-pull-off")(**ZONE, k=1e13, c=2e5, delta_w=delta_w)
    zone = ExponentialCohesiveZone(**ZONE, E_n=1e15)
    damped = Mounting(k=1e13, c_b=2e5)
    given = scene([zone], (), {"w_n": Hold(level=exact.w)}, {"g_n": 0.0}, normal=damped)
    trajectory = run(given, np.linspace(0.0, 0.999 * exact.end_time, 41))
    assert_follows(trajectory, exact, ("g_n",), 1e-8 if delta_w > 1e-9 else 1e-6)


@pytest.mark.parametrize("E_n", [1e6, 1e12, 1e20, 1e38])
def test_penalty_limit(E_n):
    exact = get("elastic-contact")(k=1e12, E_n=E_n, w_i=-1e-9, w_dot=-1e-8)
    start = {"g_n": float(exact.solution(0.0)["g_n"])}
    given = scene([Penalty(E_n=E_n)], (), {"w_n": Ramp(start=-1e-9, rate=-1e-8)}, start, normal=Mounting(k=1e12))
    assert_follows(run(given, np.linspace(0.0, 1.0, 11)), exact, ("g_n",), 1e-8)


@pytest.mark.parametrize("E_n", [1e6, 1e12, 1e20])
def test_touch(E_n):
    """From apart into contact: free before, elastic after."""
    exact = get("elastic-contact")(k=1e12, E_n=E_n, w_i=0.0, w_dot=-1e-8)
    loading = {"w_n": Ramp(start=1e-8, rate=-1e-8)}
    given = scene([Penalty(E_n=E_n)], (), loading, {"g_n": 1e-8}, normal=Mounting(k=1e12))
    trajectory = run(given, np.linspace(0.0, 2.0, 21))
    t, g = trajectory.result.times, state(trajectory, "g_n")
    np.testing.assert_allclose(g[t <= 1.0], 1e-8 * (1.0 - t[t <= 1.0]), rtol=0, atol=1e-16)
    after = exact.solution(t[t > 1.0] - 1.0)["g_n"]
    np.testing.assert_allclose(g[t > 1.0], after, rtol=0, atol=1e-6 * np.max(np.abs(after)))


@pytest.mark.parametrize("part", [0.1, 0.5, 0.95])
def test_snap_in_and_pull_off_at_long_range(part):
    """Approach and retreat on a spring: both jumps where the exact folds are."""
    sites = {"n_1": 2e19, "n_2": 3e19, "psi_0": 4e-21, "g_0": 3e-10}
    flats = get("lennard-jones-flats")(**sites, g_i=1e-9)
    k = part * flats.largest_softening
    for fold, start, rate in ((flats.snap_in(k), 3e-9, -1e-9), (flats.pull_off(k), flats.equilibrium_gap, 1e-9)):
        w = start + float(flats.traction(np.array(start))) / k
        end = 1.2 * (fold.w - w) / rate
        loading = {"w_n": Ramp(start=w, rate=rate)}
        given = scene([LennardJonesFlatFlat(**sites)], (), loading, {"g_n": start}, normal=Mounting(k=k))
        (jump,) = run(given, np.linspace(0.0, end, 5)).jumps
        assert w + rate * jump.t == pytest.approx(fold.w, rel=1e-8)
        assert jump.released > 0
