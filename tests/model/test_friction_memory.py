"""Friction that remembers, friction with a direction of its own, and debonding along a falling line."""

import numpy as np
import pytest
from scenes import SITES, bodies

import surfacechem
from surfacechem.errors import InputError
from surfacechem.laws.cohesive import CompliantDebonding
from surfacechem.laws.contact import BondStiffness
from surfacechem.laws.friction import AnisotropicCoulomb, AnisotropicViscous, Coulomb, RateAndStateAging
from surfacechem.laws.loading import Hold, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.runs.check import consistent_start, rates
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

PARAMETERS = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6}
ISOTHERMAL = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


def outputs(trajectory, name):
    return trajectory.outputs[:, [item.name for item in trajectory.model.system.outputs].index(name)]


def test_the_age_at_the_start_is_changed_in_seconds():
    """What is solved for is its logarithm, which is nothing that a case gives."""
    simulation = surfacechem.load("rate-and-state-velocity-steps")
    assert "initial.theta" in simulation.system.changeable
    data = simulation.sweep({"initial.theta": ["5 s", 10.0]}).dataset
    np.testing.assert_allclose(data["theta"].values[:, 0], [5.0, 10.0], rtol=1e-14)
    np.testing.assert_array_equal(data["initial_theta"].values, [5.0, 10.0])
    assert data["initial_theta"].attrs["units"] == "s"
    assert data["theta"].values[1].tobytes() == simulation.run().dataset["theta"].values.tobytes()
    assert data.attrs["error"] < 1e-8
    for value, message in ((0.0, "outside its range: > 0"), ("1 m", "needs a time")):
        with pytest.raises(InputError, match=message):
            simulation.run({"initial.theta": value})
    with pytest.raises(InputError, match=r"no parameter 'initial\.ln_theta'"):
        simulation.run({"initial.ln_theta": 1.0})


@pytest.mark.parametrize("ratio", [0.9, 1.0, 1.1])
def test_growth_rates_are_those_of_linear_stability(ratio):
    """About steady sliding B x'' + (k - k_c) x' + k V x / L = 0, B = a p / V + c_b, k_c = [(b - a) p - c_b V] / L."""
    p, V, c_b, L = 5e6, 1e-6, 5e6, 1e-5
    critical = (0.005 * p - c_b * V) / L
    k = ratio * critical
    ramp = {"ramp": {"start": 0.6 * p / k, "rate": V}}
    changes = {"mechanics.tangential.k": k, "initial.theta": L / V, "loading.w_t": ramp}
    simulation = surfacechem.load("rate-and-state-stick-slip", changes)
    start = consistent_start(simulation.model, simulation.model.values())
    expected = np.roots([0.01 * p / V + c_b, k - critical, k * V / L])
    np.testing.assert_allclose(sorted(rates(start), key=np.imag), sorted(expected, key=np.imag), rtol=1e-8)
    assert np.all((rates(start).real > 1e-12) == (ratio < 1))


def test_sticking_needs_no_pressure():
    """What nothing presses yet rests until its load begins, though it could not slide in balance."""
    frictions = [RateAndStateAging(**PARAMETERS), Coulomb(mu=0.2, mu_s=0.8)]
    interface = Interface(Hold(level=300.0), frictions=frictions)
    pull = Table(times=[0.0, 2.0, 4.0], values=[0.0, 0.0, 1e-6])
    loading = {"p": Hold(level=0.0), "w_t": pull}
    mounting = Mounting(k=1e10)
    scene = Scene(ISOTHERMAL, interface, loading=loading, T_0=300.0, initial={"theta": 10.0}, tangential=mounting)
    trajectory = Model(assemble(scene)).solve(Run(times=[0.0, 1.0, 3.0]))
    assert trajectory.status == "stopped", trajectory.reason
    assert trajectory.reason.startswith("no steady sliding velocity: nothing resists it")
    assert trajectory.result.t == pytest.approx(2.0, rel=1e-9)


def two_components(law, **more):
    interface = Interface("T", frictions=[law])
    loading = {"v": Hold(level=3.0), "v_2": Hold(level=4.0), **more}
    scene = Scene(bodies("T", "T"), interface, loading=loading, T_0=300.0, initial={"T": 300.0})
    return Model(assemble(scene)).solve(Run(times=(0.0, 1.0)))


def test_slip_with_two_components_dissipates_both():
    dry = two_components(AnisotropicCoulomb(mu_1=0.3, mu_2=0.6), p=Hold(level=1e2))
    assert outputs(dry, "D_anisotropic_coulomb")[-1] == pytest.approx(1e2 * (0.3 * 9 + 0.6 * 16) / 5, rel=1e-14)
    assert outputs(dry, "t_2_anisotropic_coulomb")[-1] == pytest.approx(48.0, rel=1e-14)
    film = two_components(AnisotropicViscous(eta_1=0.5, eta_2=0.2), g_n=Hold(level=1e-2))
    assert outputs(film, "D_anisotropic_viscous")[-1] == pytest.approx((0.5 * 9 + 0.2 * 16) / 1e-2, rel=1e-14)
    assert max(audit(dry).energy_error, audit(film).energy_error) < 1e-10


def debonding(k, path):
    interface = Interface(
        "T",
        [BondStiffness(E_b=1e14, E_n=1e14)],
        reactions=[CompliantDebonding(t_max=1e6, E_b=1e14, g_f=5e-8)],
        sites=SITES,
    )
    pair = bodies("T", "T", C_1=0.1, C_2=0.1)
    loading = {"w_n": Table(times=[float(i) for i in range(len(path))], values=path)}
    scene = Scene(pair, interface, loading=loading, T_0=300.0, initial={"T": 300.0, "phi": 1.0}, normal=Mounting(k=k))
    return Model(assemble(scene)).solve(Run(times=np.linspace(0.0, len(path) - 1.0, 41)))


def debonded(trajectory):
    """The jumps, without touch and release, which rounding decides at a gap of zero."""
    return [jump for jump in trajectory.jumps if jump.edge.name not in ("touch", "release")]


def names(trajectory):
    return [jump.edge.name for jump in debonded(trajectory)]


def test_a_soft_mounting_tears_the_interface_open():
    trajectory = debonding(1e13, [0.0, 2e-7])
    assert names(trajectory)[-2:] == ["soften", "tear"]
    jump = debonded(trajectory)[-1]
    assert jump.released == pytest.approx(0.5 * 1e6**2 * (1 / 1e13 + 1 / 1e14), rel=1e-9)
    assert jump.verdict == "admissible"
