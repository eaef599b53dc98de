"""Bounds of the bonding state: reached, held and left again as the law turns round."""

import math

import numpy as np
import pytest
from scenes import SITES, bodies, varying

import surfacechem
from surfacechem.laws.bonding import BondEnergy, BondSprings, LatticeGas, LinearEnthalpy
from surfacechem.laws.bonds import Bell
from surfacechem.laws.cohesive import ExponentialCohesiveZone, TensileStrength
from surfacechem.laws.contact import BondedContact, BondStiffness
from surfacechem.laws.factors import LinearInTemperature, Proportional
from surfacechem.laws.kinetics import (
    Arrhenius,
    Bimolecular,
    ExponentialAffinity,
    KamalSourour,
    LinearAffinity,
    MassAction,
)
from surfacechem.laws.loading import Hold, Table
from surfacechem.model.assemble import assemble
from surfacechem.quantities import BOLTZMANN
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Mounting, Scene, Sites
from surfacechem.solve.run import Model, Run

T_MAX, G_0 = 1e6, 1e-7
"""Strength and length of a cohesive zone."""

E, K, TOP = 1e12, 0.5, 2e-6
"""Bonds of stiffness E and energy K, torn by a gap that rises to TOP in a second and falls to nothing in another."""
RATE = 40.0
"""Rate of bonding at rest [1/s]."""


def damage(phi=1.0, scale=1.0, until=2.0, gaps=(0.0, TOP, 0.0)) -> Scene:
    pair = bodies("T", "T", C_1=50.0, C_2=50.0)
    interface = Interface(
        "T",
        [BondStiffness(E_b=E, E_n=E), BondEnergy(K_0=K)],
        reactions=[LinearAffinity(c_r=RATE * SITES.density / K * scale)],
        sites=SITES,
    )
    times = np.linspace(0.0, until, len(gaps)).tolist()
    loading = {"g_n": Table(times=times, values=list(gaps))}
    return Scene(pair, interface, loading=loading, T_0=300.0, initial={"phi": phi, "T": 300.0})


def solve(scene, until=2.0, outputs=81, **run):
    return Model(assemble(scene)).solve(Run(times=np.linspace(0.0, until, outputs), **run))


def free(t: float, start: float = 1.0) -> float:
    """The bonding state without a bound: phi' = RATE (1 - phi - a t^2) with a = E TOP^2 / 2 K."""
    a = E * TOP**2 / (2 * K)
    particular = lambda s: 1 - a * (s**2 - 2 * s / RATE + 2 / RATE**2)  # noqa: E731
    return particular(t) + (start - particular(0.0)) * math.exp(-RATE * t)


def test_bonds_are_gone_until_the_law_forms_them_again():
    from scipy.optimize import brentq

    trajectory = solve(damage())
    unbonded, rebond = trajectory.jumps
    assert (unbonded.edge.name, rebond.edge.name) == ("unbonded", "rebond")
    assert unbonded.t == pytest.approx(brentq(free, 0.3, 1.0, xtol=1e-15), rel=1e-10)
    assert rebond.t == pytest.approx(2 - math.sqrt(2 * K / E) / TOP, rel=1e-12)
    assert unbonded.released == rebond.released == 0.0
    phi = trajectory.everywhere["phi"]
    assert phi.min() > -1e-15
    assert phi[-1] > 0.5
    balances = audit(trajectory)
    assert balances.energy_error < 1e-9
    assert balances.violations == ()


def test_no_bond_at_the_start_under_a_load_that_allows_none():
    trajectory = solve(damage(phi=0.0, gaps=(TOP, TOP)), until=1.0)
    assert [jump.edge.name for jump in trajectory.jumps] == ["unbonded"]
    assert trajectory.jumps[0].t == 0.0
    assert trajectory.status == "finished"
    assert np.all(trajectory.everywhere["phi"] == 0.0)


def test_a_limit_frees_complete_bonding():
    """Bonds that were held at their upper bound break at once, and form again."""
    interface = Interface(
        "T",
        [BondedContact(E_n=1e13), LinearEnthalpy(H_r=2.0)],
        reactions=[LinearAffinity(c_r=SITES.density)],
        sites=SITES,
        limits=[TensileStrength(t_max=1e6)],
    )
    loading = {"w_n": Table(times=[0.0, 1.0, 2.0], values=[0.0, 0.0, 1e-6])}
    scene = Scene(
        bodies("T", "T"),
        interface,
        loading=loading,
        T_0=300.0,
        initial={"phi": 0.5, "T": 300.0},
        normal=Mounting(k=1e13),
    )
    trajectory = solve(scene)
    assert [jump.edge.name for jump in trajectory.jumps] == ["complete", "debond", "complete"]
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize(
    "law",
    [
        Arrhenius(A=1.0),
        Bell(k_off=1.0, x_off=1e-10, k_on=3.0),
        KamalSourour(A_1=1.0, A_2=1.0, m=0.5, n=1.5),
        MassAction(k_on=3.0, k_off=1.0),
    ],
)
def test_laws_that_keep_the_range_have_no_modes(law):
    assert assemble(isothermal(law)).modes == ()


def test_fewer_partners_than_sites_bound_what_does_not_read_them():
    few = Sites(2e16, 1e16)
    assert [mode.name for mode in assemble(isothermal(MassAction(k_on=3.0, k_off=1.0), few)).modes] == ["held"]
    assert assemble(isothermal(Bimolecular(k_f=1e-16, k_r=1.0), few)).modes == ()
    trajectory = solve(isothermal(MassAction(k_on=3.0, k_off=0.0), few, phi=0.0), until=1.0)
    (complete,) = trajectory.jumps
    assert complete.t == pytest.approx(math.log(2.0) / 3.0, rel=1e-11)
    assert trajectory.result.y[0] == 0.5


def isothermal(law, sites=SITES, phi=0.5) -> Scene:
    pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
    interface = Interface(Hold(level=300.0), [LinearEnthalpy(H_r=2.0)], (), [law], sites)
    return Scene(pair, interface, loading={"t_n": Hold(level=0.0)}, T_0=300.0, initial={"phi": phi})


@pytest.mark.parametrize("phi_eq", [0.0, 1.0])
def test_an_equilibrium_at_a_bound_is_approached_and_not_hit(phi_eq):
    """Bonds relax towards it for ever: nothing would carry them beyond."""
    pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
    law = LinearAffinity(c_r=RATE * SITES.density / K)
    interface = Interface(Hold(level=300.0), [BondEnergy(K_0=K, phi_eq=phi_eq)], reactions=[law], sites=SITES)
    trajectory = solve(Scene(pair, interface, T_0=300.0, initial={"phi": 0.5}))
    assert trajectory.jumps == ()
    assert trajectory.result.y[0] == pytest.approx(phi_eq, abs=1e-12)


def cohesion_of_bonds() -> Scene:
    """Cohesion in proportion to the bonds pays for more of them than there are sites; gap and temperature are held."""
    strength = varying(T_MAX, Proportional(of="phi"), LinearInTemperature(of="T_c", slope=-1e-3))
    zone = ExponentialCohesiveZone(t_max=strength, g_0=G_0, E_n=1e13)
    reactions = [LinearAffinity(c_r=RATE * SITES.density / K)]
    interface = Interface(Hold(level=300.0), [zone, BondEnergy(K_0=K)], reactions=reactions, sites=SITES)
    loading = {"g_n": Table(times=[0.0, 1.0], values=[G_0, G_0])}
    pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
    return Scene(pair, interface, loading=loading, T_0=300.0, initial={"phi": 0.25})


def test_a_bound_that_only_a_branch_of_the_rate_passes():
    trajectory = solve(cohesion_of_bonds(), until=1.0)
    (complete,) = trajectory.jumps
    driven = 2 * T_MAX * G_0 / K  # e t_max g_0 (1 + g/g_0) exp(-g/g_0) over K at g = g_0
    assert complete.t == pytest.approx(math.log((driven + 0.75) / driven) / RATE, rel=1e-11)
    assert trajectory.status == "finished"
    assert trajectory.result.y[0] == 1.0


@pytest.mark.parametrize("law", [LinearAffinity(c_r=1e19), ExponentialAffinity(C_r=1e34)])
def test_mixing_entropy_yields_to_stretched_springs(law):
    """An equilibrium of exp(-1000) bonds is none: they are gone, and form again as the gap closes."""
    interface = Interface("T", [LatticeGas(epsilon=6e-20), BondSprings(k_b=1e-3)], reactions=[law], sites=SITES)
    loading = {"g_n": Table(times=[0.0, 1.0, 2.0], values=[0.0, 1e-7, 0.0])}
    scene = Scene(bodies("T", "T"), interface, loading=loading, T_0=300.0, initial={"phi": 0.5, "T": 300.0})
    trajectory = solve(scene)
    assert [jump.edge.name for jump in trajectory.jumps] == ["unbonded", "rebond"]
    assert trajectory.status == "finished"
    assert trajectory.everywhere["phi"].min() > -1e-14
    gap = math.sqrt(2 * (6e-20 - BOLTZMANN * 300.0 * math.log(1e-15)) / 1e-3)
    assert trajectory.jumps[1].t == pytest.approx(2 - gap / 1e-7, rel=1e-4)
    assert trajectory.result.y[0] > 1e-6
    assert audit(trajectory).energy_error < 1e-9


PHI_EQ = "interface.potential.bond-energy.phi_eq"


def test_a_sweep_across_the_need_of_a_bound():
    values = [0.5, 1.2, 1.5]
    swept = surfacechem.load("two-way-linear").sweep({PHI_EQ: values})
    data = swept.dataset
    assert list(data["status"].values) == ["finished"] * 3
    for i, phi_eq in enumerate(values):
        free = phi_eq - (phi_eq - 0.05) * np.exp(-1.1 * data["time"].values)
        np.testing.assert_allclose(data["phi"].values[i], np.minimum(free, 1.0), rtol=1e-9)
    assert [len(swept.sweep[i].jumps) for i in range(3)] == [0, 1, 1]
    assert data.attrs["error"] < 1e-9
    assert data.attrs["energy_error"] < 1e-9
