"""The pressure that laws read: net of attraction, or that of the contact; what is told of laws out of their sense."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import SITES, bodies, together
from solved import solve

from surfacechem.contracts.terms import Friction, UnderPressure, Varying, parameter
from surfacechem.expressions import absolute
from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.factors import Linear
from surfacechem.laws.free_energy import BondEnergy, LatticeGas, NormalStiffness, Penalty
from surfacechem.laws.friction import BondedCoulomb, Coulomb, MohrCoulomb, Stribeck
from surfacechem.laws.heat_transfer import PressureConductance
from surfacechem.laws.kinetics import Bell, LinearAffinity
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.laws.longrange import ElectrostaticFlatFlat, LennardJonesFlatFlat, VanDerWaalsFlatFlat
from surfacechem.model.assemble import assemble
from surfacechem.results.solution import Solution
from surfacechem.runs.check import start_warnings
from surfacechem.scene import Body, Interface, Mounting, Scene, Sites
from surfacechem.solve.run import Model, Run

A_H, D_0, E_N = 6.5e-20, 1e-9, 1e18
ATTRACTION = VanDerWaalsFlatFlat(A_H=A_H, D_0=D_0)
PULL = A_H / (6 * math.pi * D_0**3)
PRESSURES = ("net", "contact")


def in_contact(potentials, pressure="contact", g_n=0.0, w_n=0.0, k=1e14):
    """Two bodies that only attraction holds together, which slide and conduct."""
    friction = [Coulomb(mu=0.3, pressure=pressure)]
    heat = [PressureConductance(between=("lower", "upper"), h_c=1e5, H=1e9, q=1.0, pressure=pressure)]
    loading = {"w_n": Hold(level=w_n), "v": Hold(level=1e-3)}
    initial = {"T_1": 300.0, "T_2": 310.0, "g_n": g_n}
    interface = Interface(None, potentials, friction)
    return Scene(bodies(), interface, heat, loading, T_0=300.0, initial=initial, normal=Mounting(k=k))


def test_repulsion_of_a_lennard_jones_contact():
    """At the gap without traction repulsion and attraction are equal, A g_0 x^3 / 3 with x^6 = 15."""
    flats = LennardJonesFlatFlat(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10)
    rest = 3e-10 * 15 ** (-1 / 6)
    found = solve(in_contact([flats], g_n=rest, w_n=rest), 1.0)
    A = 2 * math.pi * 2e19 * 3e19 * 4e-21
    assert found["p_contact"][-1] == pytest.approx(A * 3e-10 * math.sqrt(15) / 3, rel=1e-8)
    assert abs(found["t_n"][-1]) < 1e-6 * found["p_contact"][-1]


def test_without_attraction_both_pressures_are_one():
    zone = ExponentialCohesiveZone(t_max=1e6, g_0=1e-8, E_n=E_N)
    for potential in (Penalty(E_n=E_N), NormalStiffness(E_n=E_N), zone):
        forces = [solve(in_contact([potential], pressure, w_n=-1e-9), 1.0)["t_coulomb"][-1] for pressure in PRESSURES]
        assert forces[0] == forces[1] > 1e4


def test_a_given_pressure_is_that_of_the_contact():
    loading = {"p": Hold(level=1e5), "v": Hold(level=1e-3)}
    friction = Coulomb(mu=Varying(0.3, (Linear(of="p_contact", about=0.0, slope=1e-5),)), pressure="contact")
    made = Scene(bodies("T", "T"), Interface("T", (), [friction]), loading=loading, T_0=300.0, initial={"T": 300.0})
    assert solve(made, 1.0)["t_coulomb"][-1] == pytest.approx(0.3 * 2 * 1e5, rel=1e-14)


@pytest.mark.parametrize("attraction", [ATTRACTION, ElectrostaticFlatFlat(s_1=1e-3, s_2=-1e-3)], ids=lambda x: x.name())
def test_laws_of_the_net_pressure_beside_attraction_are_told(attraction):
    def told(made):
        return [text for text in assemble(made).warnings if "lowers the net pressure" in text]

    potentials = [Penalty(E_n=E_N), attraction]
    (text,) = told(in_contact(potentials, "net"))
    assert attraction.name() in text
    assert "coulomb and pressure-conductance" in text
    assert not told(in_contact(potentials, "contact"))
    assert not told(in_contact(potentials[:1], "net"))
    derjaguin = in_contact(potentials, "contact")
    law = MohrCoulomb(mu=0.3, t_n_max=PULL)
    assert not told(replace(derjaguin, interface=replace(derjaguin.interface, frictions=[law])))


DAMPED = Mounting(k=1e9, c_b=1e8)


# -- static friction below sliding friction ------------------------------------------------------------------------


def pulled(friction, T=300.0):
    loading = {"p": Hold(level=1e6), "w_t": Ramp(rate=1e-3)}
    bonds = {"potentials": [BondEnergy(K_0=1.0)], "reactions": [LinearAffinity(c_r=1e14)], "sites": SITES}
    return together(frictions=[friction], loading=loading, initial={"T": T, "phi": 1.0}, tangential=DAMPED, **bonds)


LESS = {
    "coulomb": Coulomb(mu=0.3, mu_s=0.2),
    "mohr-coulomb": MohrCoulomb(mu=0.3, mu_s=0.2, c=1e4),
    "stribeck": Stribeck(mu_s=0.2, mu_k=0.3, v_s=1e-3),
    "bonded-coulomb": BondedCoulomb(mu=0.3, mu_b=0.2, mu_ub=0.1),
    "of the temperature": Coulomb(mu=0.3, mu_s=Varying(0.5, (Linear(of="T_c", about=300.0, slope=-0.01),))),
}
MORE = {
    "no static one": Coulomb(mu=0.3),
    "equal": Coulomb(mu=0.3, mu_s=0.3),
    "bonded-coulomb": BondedCoulomb(mu=0.3, mu_b=0.7, mu_ub=0.4),
}


def told_by_check(made):
    model = Model(assemble(made))
    return start_warnings(model, model.problem(Run(np.linspace(0.0, 1.0, 2)), model.values()), None, 1.0)


@pytest.mark.parametrize("name", LESS)
def test_a_static_limit_below_sliding_friction_is_told(name):
    T = 360.0 if name == "of the temperature" else 300.0
    (text,) = told_by_check(pulled(LESS[name], T))
    assert "is below its sliding friction" in text
    assert name != "of the temperature" or text in Solution(solve(pulled(LESS[name], T), 1.0)).warnings


class Rising(UnderPressure, Friction):
    """Friction from that at rest to that of fast sliding, over a velocity of 1 mm/s."""

    rest: float = parameter("1", "friction coefficient at rest", at_least=0)
    swift: float = parameter("1", "friction coefficient of fast sliding", at_least=0)

    def traction(self, p, v, direction):
        """Tangential traction [Pa]."""
        return (self.rest + (self.swift - self.rest) * absolute(v) / (absolute(v) + 1e-3)) * p * direction

    def limit(self, p):
        """Largest tangential traction [Pa] that sticking bears."""
        return self.rest * p

    def fast(self, p):
        """Dry traction of fast sliding [Pa]."""
        return self.swift * p


def test_a_law_of_other_parameters_is_told_by_what_it_states():
    (text,) = told_by_check(pulled(Rising(rest=0.2, swift=0.3)))
    assert text.endswith("is below its sliding friction: it rises as sliding grows faster")
    assert not told_by_check(pulled(Rising(rest=0.3, swift=0.2)))


@pytest.mark.parametrize("name", MORE)
def test_any_other_is_not(name):
    assert not told_by_check(pulled(MORE[name]))


def test_friction_that_rises_from_rest_too_steeply_is_told():
    texts = told_by_check(pulled(Stribeck(mu_s=0.2, mu_k=0.3, v_s=1e-3, delta=0.5)))
    assert [text for text in texts if "rises from rest with an infinite slope" in text]
    assert [text for text in texts if "it rises as sliding grows faster" in text]
    assert not told_by_check(pulled(Stribeck(mu_s=0.3, mu_k=0.2, v_s=1e-3, delta=0.5)))


def test_a_limit_that_falls_as_the_interface_heats_is_told_by_the_run():
    made = pulled(BondedCoulomb(mu=0.3, mu_b=0.31, mu_ub=0.31))
    hot = replace(made, loading=made.loading | {"Q_1": Hold(level=1e5)})
    assert not told_by_check(hot)
    assert "is below its sliding friction" in " ".join(Solution(solve(hot, 1.0)).warnings)


def test_rates_under_a_force_that_they_do_not_feel_are_told():
    law, kept = Bell(k_off=1.0), Hold(level=300.0)
    made = Scene(
        (Body("lower", kept), Body("upper", kept)),
        Interface(kept, [LatticeGas(epsilon=0.0)], reactions=[law], sites=Sites(1e16, 1e16)),
        loading={"f": Hold(level=1e-11)},
        initial={"phi": 0.5},
    )
    (text,) = assemble(made).warnings
    assert text == "bell reads the force on bonds, but does not depend on it: without a value are x_off, k_on, x_on."
    felt = Interface(kept, made.interface.potentials, reactions=[replace(law, x_off=4e-10)], sites=made.interface.sites)
    assert not assemble(replace(made, interface=felt)).warnings


# -- bonds across an open gap --------------------------------------------------------------------------------------


def bonding(c_r=1e14, g_n=1e-6, phi=0.0):
    reactions = [LinearAffinity(c_r=c_r)]
    return together([BondEnergy(K_0=1.0)], (), {"g_n": Hold(level=g_n)}, {"phi": phi}, reactions)


def test_bonds_that_form_across_an_open_gap_are_told():
    far = Varying(1e14, (Linear(of="g_n", about=0.0, slope=-1e5),))
    mounted = replace(bonding(), loading={"w_n": Hold(level=1e-6)}, normal=Mounting(k=1e12))
    for made in (bonding(), mounted):
        (text,) = told_by_check(made)
        assert text.startswith("linear affinity forms bonds across an open gap")
    assert not told_by_check(bonding(g_n=0.0))
    assert not told_by_check(bonding(phi=1.0)), "they break or rest"
    assert not told_by_check(bonding(c_r=far))
