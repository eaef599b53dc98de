"""Bounds of the bonding state: reached, held and left again as the law turns round."""

import math
from functools import partial

import numpy as np
import pytest
from scenes import SITES, bodies, together, varying
from scipy.optimize import brentq
from scipy.special import expit, logit
from solved import closed
from zoo import pairwise

from surfacechem.errors import InputError
from surfacechem.laws.cohesive import ExponentialCohesiveZone, TensileStrength
from surfacechem.laws.factors import LinearInTemperature, Proportional
from surfacechem.laws.free_energy import (
    BondedContact,
    BondEnergy,
    BondStiffness,
    LatticeGas,
    LinearEnthalpy,
    PartnerMixing,
)
from surfacechem.laws.kinetics import (
    Arrhenius,
    Bell,
    Bimolecular,
    DudkoHummerSzabo,
    KamalSourour,
    LinearAffinity,
    MassAction,
    Relaxation,
    ReversibleBell,
)
from surfacechem.laws.loading import Hold, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.solution import Solution
from surfacechem.scene import Body, Interface, Mounting, Scene, Sites
from surfacechem.solve.run import Model, Run

E, K, TOP = 1e12, 0.5, 2e-6
"""Bonds of stiffness E and energy K, torn by a gap that rises to TOP in a second and falls to nothing in another."""
RATE = 40.0
"""Rate of bonding at rest [1/s]."""
FORMS = LinearAffinity(c_r=RATE * SITES.density / K)


def damage(phi=1.0, gaps=(0.0, TOP, 0.0)) -> Scene:
    gap = Table(times=np.arange(float(len(gaps))).tolist(), values=list(gaps))
    potentials, pair = [BondStiffness(E_b=E, E_n=E), BondEnergy(K_0=K)], bodies("T", "T", C_1=50.0, C_2=50.0)
    return together(potentials, loading={"g_n": gap}, initial={"phi": phi}, reactions=[FORMS], pair=pair)


def isothermal(law, sites=SITES, phi=0.5, potentials=None, loading=None) -> Scene:
    kept = Hold(level=300.0)
    interface = Interface(kept, potentials or [LinearEnthalpy(H_r=2.0)], (), [law], sites)
    loading = loading or {"t_n": Hold(level=0.0)}
    return Scene((Body("lower", kept), Body("upper", kept)), interface, (), loading, None, 300.0, {"phi": phi})


def test_bonds_are_gone_until_the_law_forms_them_again():
    """Without a bound phi' = RATE (1 - phi - a t^2) with a = E TOP^2 / 2 K."""

    def particular(s):
        return 1 - E * TOP**2 / (2 * K) * (s**2 - 2 * s / RATE + 2 / RATE**2)

    def free(t):
        return particular(t) + (1 - particular(0.0)) * math.exp(-RATE * t)

    trajectory = closed(damage(), 2.0, outputs=81)
    unbonded, rebond = trajectory.jumps
    assert trajectory.events == ["unbonded", "rebond"]
    (held,) = assemble(damage()).modes
    assert held.words[-1.0] == "held at zero"
    assert unbonded.t == pytest.approx(brentq(free, 0.3, 1.0, xtol=1e-15), rel=1e-10)
    assert rebond.t == pytest.approx(2 - math.sqrt(2 * K / E) / TOP, rel=1e-12)
    assert unbonded.released == rebond.released == 0.0
    phi = trajectory.everywhere("phi")
    assert phi.min() > -1e-15
    assert phi[-1] > 0.5


def test_a_limit_frees_complete_bonding():
    """Bonds that were held at their upper bound break at once, and form again."""
    potentials, laws = [BondedContact(E_n=1e13), LinearEnthalpy(H_r=2.0)], [LinearAffinity(c_r=SITES.density)]
    loading = {"w_n": Table(times=[0.0, 1.0, 2.0], values=[0.0, 0.0, 1e-6])}
    limits, mount = [TensileStrength(t_max=1e6)], Mounting(k=1e13)
    given = together(potentials, (), loading, {"phi": 0.5}, laws, limits, normal=mount)
    assert closed(given, 2.0).events == ["complete", "debond", "complete"]


KEEPING = [Arrhenius(A=1.0), Bell(k_off=1.0, x_off=1e-10, k_on=3.0), KamalSourour(A_1=1.0, A_2=1.0, m=0.5, n=1.5)]


@pytest.mark.parametrize("law", [*KEEPING, MassAction(k_on=3.0, k_off=1.0)])
def test_laws_that_keep_the_range_have_no_modes(law):
    assert assemble(isothermal(law)).modes == ()


def test_fewer_partners_than_sites_bound_what_does_not_read_them():
    few = Sites(2e16, 1e16)
    assert [mode.name for mode in assemble(isothermal(MassAction(k_on=3.0, k_off=1.0), few)).modes] == ["held"]
    assert assemble(isothermal(Bimolecular(k_f=1e-16, k_r=1.0), few)).modes == ()
    trajectory = closed(isothermal(MassAction(k_on=3.0, k_off=0.0), few, phi=0.0), 1.0)
    (complete,) = trajectory.jumps
    assert complete.t == pytest.approx(math.log(2.0) / 3.0, rel=1e-11)
    assert trajectory.end("phi") == 0.5


@pytest.mark.parametrize("law", [MassAction(k_on=3.0, k_off=0.0), Bimolecular(k_f=1e-16, k_r=0.0)])
@pytest.mark.parametrize(("path", "number"), [("interface.sites.upper", 5e15), ("interface.sites.lower", 8e16)])
def test_the_bound_of_bonds_follows_densities_of_sites_that_a_run_changes(law, path, number):
    """More partners than sites in the scene, fewer in the run, and the other way round."""
    given, changed = Sites(2e16, 4e16), {"interface.sites.upper": 4e16, "interface.sites.lower": 2e16, path: number}
    sites = Sites(changed["interface.sites.lower"], changed["interface.sites.upper"])
    for one, other in ((given, sites), (sites, given)):
        changes = {"interface.sites.lower": other.density_1, "interface.sites.upper": other.density_2}
        found = closed(isothermal(law, one, phi=0.1), 60.0, changes).end("phi")
        assert found == pytest.approx(other.phi_max, rel=1e-6)


@pytest.mark.parametrize(
    ("sites", "named"), [(SITES, set()), (Sites(2e16, 1e16), {"N_2"}), (Sites(2e16, 1e16, 2), {"N_1"})]
)
def test_only_a_body_with_sites_of_its_own_has_a_density_beside_that_of_reference(sites, named):
    roles = {role.variable for role in assemble(isothermal(MassAction(k_on=3.0, k_off=1.0), sites)).roles}
    assert roles & {"N_1", "N_2"} == named


MIXING = (LatticeGas, SITES, 1.0), (partial(PartnerMixing, a=1e-16), Sites(1e16, 5e15), 0.5)


@pytest.mark.parametrize(("epsilon", "mixed", "solver"), pairwise([2e-19, 1e-18], MIXING, ["radau", "lsoda"]))
def test_bonds_too_strong_for_an_equilibrium_below_the_bound_are_complete(epsilon, mixed, solver):
    """Fifty k_B T and more: what is left unbonded is less than the last digit of the bonding state."""
    mixing, sites, bound = mixed
    law = ReversibleBell(k_off=0.1)
    scene = isothermal(law, sites, 0.01, [mixing(epsilon=epsilon)], {"f": Hold(level=0.0)})
    trajectory = Model(assemble(scene)).solve(Run([0.0, 1.0, 4.0], 1e-8, solver=solver))
    assert [jump.edge.name for jump in trajectory.jumps] == ["complete"]
    assert trajectory.result.outputs[1:, 0].tolist() == [bound, bound]
    assert Solution(trajectory).audit.findings == ()
    assert all(jump.verdict == "admissible" for jump in trajectory.jumps)


@pytest.mark.parametrize(
    ("phi", "rest"), [(0.0, 1.0), (1e-280, 1.0), (1e-290, 1.0), (1.0, 1.0), (0.5, -483.0), (0.5, 483.0)]
)
def test_relaxation_to_ideal_mixing_is_that_of_its_logarithm(phi, rest):
    """From any number of bonds to any other; none at all, or all of them, are at rest, which is said."""
    mixing = LatticeGas(epsilon=rest * 1.380649e-23 * 300.0)
    run = closed(isothermal(Relaxation(tau=1.0), phi=phi, potentials=[mixing]), 6.5)
    assert run.end("phi") == pytest.approx(expit(rest + (logit(phi) - rest) * math.exp(-6.5)), rel=1e-9, abs=1e-16)
    assert (phi in (0, 1)) == any("does not leave a bound" in text for text in Solution(run.trajectory).warnings)


def test_relaxation_starts_from_less_than_rational_numbers_hold():
    run = closed(isothermal(Relaxation(tau=1.0), phi=1e-299, potentials=[LatticeGas(epsilon=0.0)]), 1e-3)
    assert run.end("phi") == pytest.approx(expit(logit(1e-299) * math.exp(-1e-3)), rel=1e-3)


def test_a_bound_that_only_a_branch_of_the_rate_passes():
    """Cohesion in proportion to the bonds pays for more of them than there are sites; gap and temperature are held."""
    strength = varying(1e6, Proportional(of="phi"), LinearInTemperature(of="T_c", slope=-1e-3))
    potentials = [ExponentialCohesiveZone(t_max=strength, g_0=1e-7, E_n=1e13), BondEnergy(K_0=K)]
    loading = {"g_n": Table(times=[0.0, 1.0], values=[1e-7, 1e-7])}
    trajectory = closed(isothermal(FORMS, phi=0.25, potentials=potentials, loading=loading), 1.0)
    (complete,) = trajectory.jumps
    driven = 2 * 1e6 * 1e-7 / K  # e t_max g_0 (1 + g/g_0) exp(-g/g_0) over K at g = g_0
    assert complete.t == pytest.approx(math.log((driven + 0.75) / driven) / RATE, rel=1e-11)
    assert trajectory.end("phi") == 1.0


def test_a_law_that_is_undefined_at_a_bound_leaves_the_range_there():
    """The barrier is zero without bonds, and there is no rate by it."""
    barrier = varying(2e-19, Proportional(of="phi", about=1.0))
    law = DudkoHummerSzabo(k_off=0.5, x_off=1e-9, barrier=barrier, nu=0.5)
    kept, bonded = Hold(level=300.0), BondEnergy(K_0=K)
    interface = Interface(kept, [bonded], (), [FORMS, law], SITES)
    loading = {"f": Hold(level=1e-12)}
    scene = Scene((Body("lower", kept), Body("upper", kept)), interface, (), loading, None, 300.0, {"phi": 0.0})
    with pytest.raises(InputError, match="barrier left its range"):
        Model(assemble(scene)).solve(Run([0.0, 1.0], 1e-9))
