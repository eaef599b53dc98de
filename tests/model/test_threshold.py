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
from surfacechem.laws.contact import ConstantInterfaceCapacity, NormalStiffness
from surfacechem.laws.friction import Coulomb, Stribeck
from surfacechem.laws.kinetics import Relaxation
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.results.solution import Solution
from surfacechem.scene import Interface, Scene
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


def test_an_interface_temperature_that_nothing_determines_is_refused():
    with pytest.raises(InputError, match="nothing determines the interface temperature T_c"):
        assemble(Scene(bodies(), Interface("T_c"), (), {}, None, 300.0, {"T_1": 300.0, "T_2": 300.0}))


@pytest.mark.parametrize(("h", "lost"), [(1e3, False), (1e9, False), (1e20, True)])
def test_fluxes_that_are_rounding_are_called_out(h, lost):
    """The states and the heat received stay right at any conductance; h times a difference of rounding does not."""
    trajectory = solve(exchange(h), 2.0)
    warnings = [text for text in Solution(trajectory).warnings if "lost to rounding" in text]
    assert bool(warnings) is lost


def test_the_order_of_the_bodies_does_not_matter():
    scene = exchange(50.0)
    swapped = dataclasses.replace(scene, bodies=scene.bodies[::-1])
    assert final(solve(swapped, 2.0), "T_c") == pytest.approx(final(solve(scene, 2.0), "T_c"), rel=1e-10)


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
