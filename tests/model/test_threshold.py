"""Loads that are easy to miss, and limits in which two models must agree."""

import dataclasses
import math

import numpy as np
import pytest
import scenes
from scenes import SITES, bodies, path

from surfacechem.errors import InputError
from surfacechem.laws.bonding import BondEnergy
from surfacechem.laws.bulk import Constant
from surfacechem.laws.contact import ConstantInterfaceCapacity, InterfaceCapacity, NormalStiffness
from surfacechem.laws.friction import Coulomb, Stribeck
from surfacechem.laws.kinetics import ExponentialAffinity, LinearAffinity, Relaxation
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.results.solution import Solution
from surfacechem.scene import Body, Interface, Scene
from surfacechem.solve.run import Model, Run


def solve(scene, end, outputs=11, **settings):
    trajectory = Model(assemble(scene)).solve(Run(times=np.linspace(0.0, end, outputs), **settings))
    assert trajectory.status == "finished", trajectory.reason
    return trajectory


def final(trajectory, name):
    system = trajectory.model.system
    states = [state.name for state in system.states]
    if name in states:
        return trajectory.result.outputs[-1, states.index(name)]
    if name in (booked := [account.quantity.name for account in system.ledger]):
        return trajectory.result.ledger_outputs[-1, booked.index(name)]
    return trajectory.outputs[-1, [item.name for item in system.outputs].index(name)]


def heated(load):
    return scenes.perfect_contact([], energy=Constant, C_1=2.0, C_2=3.0, loading={"Q_1": load})


def test_a_brief_pulse_is_not_stepped_over():
    end, heat = 3.0 + 1e-9, 50.0
    width = end - 3.0  # as doubles have it
    pulse = Table(times=[0.0, 3.0, 3.0, end, end, 9.0], values=[0, 0, heat / width, heat / width, 0, 0])
    trajectory = solve(heated(pulse), 10.0)
    assert final(trajectory, "T") == pytest.approx(300 + heat / 5.0, rel=1e-9)
    assert final(trajectory, "H_1") == pytest.approx(heat, rel=1e-12)


def test_a_table_is_its_straight_lines():
    trajectory = solve(heated(Table(times=[0.0, 1.0, 4.0], values=[0.0, 6.0, 0.0])), 10.0)
    assert final(trajectory, "H_1") == pytest.approx(6.0 * 4.0 / 2, rel=1e-12)


def test_a_harmonic_load_is_integrated_over_its_periods():
    trajectory = solve(heated(Harmonic(mean=2.0, amplitude=5.0, frequency=3.0)), 10.0)
    assert final(trajectory, "H_1") == pytest.approx(20.0, rel=1e-10)


def test_friction_heats_in_both_directions_of_sliding():
    amplitude, frequency = 0.02, 2.0
    loading = {"v": Harmonic(amplitude=amplitude, frequency=frequency), "p": Hold(level=1e5)}
    scene = scenes.perfect_contact([], C_1=2000.0, C_2=2000.0, frictions=[Coulomb(mu=0.3)], loading=loading)
    trajectory = solve(scene, 5.0)
    assert final(trajectory, "heat_coulomb") == pytest.approx(0.3 * 1e5 * amplitude * 2 / np.pi * 5.0, rel=1e-9)
    assert len(trajectory.result.events.t) == 19  # every reversal but that at the start and at the end


def exchange(h, temperatures=("T_1", "T_c", "T_2"), C_c=4.0):
    first, middle, second = temperatures
    potentials = [BondEnergy(K_0=300.0)] + ([ConstantInterfaceCapacity(C_c=C_c)] if C_c else [])
    heat = [path("interface", body, h) for body, node in (("lower", first), ("upper", second)) if node != middle]
    initial = dict.fromkeys((first, second), 300.0) | ({middle: 300.0} if C_c or middle in (first, second) else {})
    interface = Interface(middle, potentials, (), [Relaxation(tau=0.5)], SITES)
    return Scene(bodies(first, second, Constant, 10.0, 30.0), interface, heat, {}, None, 300.0, initial | {"phi": 0.0})


@pytest.mark.parametrize("h", [1e10, 1e15, 1e20])
def test_infinite_conductance_is_one_temperature(h):
    stiff, shared = solve(exchange(h), 2.0), solve(exchange(1.0, ("T", "T", "T")), 2.0)
    for name in ("T_1", "T_2", "T_c"):
        assert final(stiff, name) == pytest.approx(final(shared, "T"), rel=1e-9)
    assert final(stiff, "heat_into_2") == pytest.approx(final(shared, "heat_into_2"), rel=1e-8)
    assert audit(stiff).energy_error < 1e-9


@pytest.mark.parametrize("h", [1e10, 1e15, 1e20, 1e25])
def test_infinite_direct_conductance_is_one_temperature(h):
    scene = Scene(
        bodies(energy=Constant), Interface(), [path("lower", "upper", h)], {}, None, 300.0, {"T_1": 290.0, "T_2": 355.0}
    )
    trajectory = solve(scene, 2.0)
    for name in ("T_1", "T_2"):
        assert final(trajectory, name) == pytest.approx((40 * 290 + 25 * 355) / 65, rel=1e-12)
    assert audit(trajectory).energy_error < 1e-9


def test_an_interface_temperature_that_nothing_determines_is_refused():
    with pytest.raises(InputError, match="nothing determines the interface temperature T_c"):
        assemble(Scene(bodies(), Interface("T_c"), (), {}, None, 300.0, {"T_1": 300.0, "T_2": 300.0}))


@pytest.mark.parametrize(("h", "lost"), [(1e3, False), (1e9, False), (1e20, True)])
def test_fluxes_that_are_rounding_are_called_out(h, lost):
    """The states and the heat received stay right at any conductance; h times a difference of rounding does not."""
    trajectory = solve(exchange(h), 2.0)
    warnings = [text for text in Solution(trajectory).warnings if "lost to rounding" in text]
    assert bool(warnings) is lost


def test_one_sided_contact_is_the_limit_of_one_large_conductance():
    scene = exchange(50.0)
    scene = dataclasses.replace(scene, heat=[path("interface", "lower", 1e15), path("interface", "upper", 50.0)])
    one_sided = solve(exchange(50.0, ("T_1", "T_1", "T_2")), 2.0)
    assert final(solve(scene, 2.0), "T_2") == pytest.approx(final(one_sided, "T_2"), rel=1e-9)


@pytest.mark.parametrize("C_c", [1e-9, 1e-15])
def test_a_vanishing_capacity_is_an_algebraic_temperature(C_c):
    assert final(solve(exchange(50.0, C_c=C_c), 2.0), "T_c") == pytest.approx(
        final(solve(exchange(50.0, C_c=0.0), 2.0), "T_c"), rel=1e-8
    )


def test_the_order_of_the_bodies_does_not_matter():
    scene = exchange(50.0)
    swapped = dataclasses.replace(scene, bodies=scene.bodies[::-1])
    assert final(solve(swapped, 2.0), "T_c") == pytest.approx(final(solve(scene, 2.0), "T_c"), rel=1e-10)


def stretch(reaction, J):
    pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
    interface = Interface(Hold(level=300.0), [BondEnergy(K_0=1e-3)], (), [reaction], SITES)
    loading = {} if J is None else {"J_c": Hold(level=J)}
    return Scene(pair, interface, (), loading, None, 300.0, {"phi": 0.0})


def test_stretch_leaves_the_linear_law_and_speeds_up_the_exponential_one():
    """C_r counts per current area, c_r per site: N_c dphi/dt = J_c R_c."""
    linear = [final(solve(stretch(LinearAffinity(c_r=1e21), J), 1.0), "phi") for J in (None, 2.0)]
    assert linear[1] == pytest.approx(linear[0], rel=1e-10)
    doubled = final(solve(stretch(ExponentialAffinity(C_r=2e39), None), 1.0), "phi")
    assert final(solve(stretch(ExponentialAffinity(C_r=1e39), 2.0), 1.0), "phi") == pytest.approx(doubled, rel=1e-10)


def test_nominal_quantities_are_current_ones_times_the_stretch():
    interface = Interface("T_c", [NormalStiffness(E_n=1e9), InterfaceCapacity(C_c=2.0)], [Coulomb(mu=0.3)])
    heat = [path("interface", "lower", 100.0), path("interface", "upper", 70.0)]
    loading = {"J_c": Ramp(start=1.0, rate=0.5), "g_n": Hold(level=-1e-6), "v": Hold(level=0.1)}
    scene = Scene(bodies(), interface, heat, loading, None, 300.0, {"T_1": 300.0, "T_2": 310.0, "T_c": 305.0})
    trajectory = solve(scene, 2.0)
    J = 2.0
    assert final(trajectory, "t_n_nominal") == pytest.approx(-1e3)
    assert final(trajectory, "p") == pytest.approx(1e3 / J)
    assert final(trajectory, "t_coulomb") == pytest.approx(0.3 * 1e3 / J)
    assert final(trajectory, "D_coulomb") == pytest.approx(0.3 * 1e3 * 0.1)
    for k in ("1", "2"):
        assert final(trajectory, f"q_{k}_nominal") == pytest.approx(J * final(trajectory, f"q_{k}"), rel=1e-12)


def test_a_pressure_from_a_potential_and_from_loading_is_two_roles():
    interface = Interface("T", [NormalStiffness(E_n=1e9)], [Coulomb(mu=0.3)])
    loading = {name: Hold(level=1.0) for name in ("g_n", "v", "p")}
    with pytest.raises(InputError, match="p has two roles"):
        assemble(Scene(bodies("T", "T"), interface, (), loading, None, 300.0, {"T": 300.0}))


def test_fluxes_between_unequal_bodies_follow_the_exact_identity():
    """q_t = h (T_2 - T_1) + (h_1 - h_2) / (h_1 + h_2) q_m with 1/h = 1/h_1 + 1/h_2."""
    h_1, h_2 = 900.0, 300.0
    scene = dataclasses.replace(exchange(0.0), heat=[path("interface", "lower", h_1), path("interface", "upper", h_2)])
    trajectory = solve(dataclasses.replace(scene, initial=scene.initial | {"T_2": 350.0}), 1.0)
    T_1, T_2, q_m, q_t = (final(trajectory, name) for name in ("T_1", "T_2", "q_m", "q_t"))
    h = 1 / (1 / h_1 + 1 / h_2)
    assert q_t == pytest.approx(h * (T_2 - T_1) + (h_1 - h_2) / (h_1 + h_2) * q_m, rel=1e-9)


def test_a_pressure_may_grow_from_nothing():
    """C (T^2 - T_0^2) / 2 T_0 = mu_k p t v / 2, for a law that ends below p = 0."""
    friction = Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3)
    loading = {"p": Ramp(start=0.0, rate=1e4), "v": Hold(level=1.0)}
    pair = bodies("T", "T", C_1=50.0, C_2=50.0)
    scene = Scene(pair, Interface("T", frictions=[friction]), loading=loading, T_0=300.0, initial={"T": 300.0})
    trajectory = Model(assemble(scene)).solve(Run(times=[0.0, 1.0]))
    assert trajectory.status == "finished"
    assert trajectory.result.y[0] == pytest.approx(math.sqrt(300.0**2 + 2 * 300.0 * 2000.0 / 100.0), rel=1e-10)
