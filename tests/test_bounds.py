"""Bounds of the bonding state: reached, held and left again as the law turns round."""

import math

import numpy as np
import pytest
from scenes import SITES, bodies

from surfacechem.assembly import assemble
from surfacechem.assembly.enclosure import enclosure
from surfacechem.audit import audit
from surfacechem.integrate import Model, Run
from surfacechem.laws.bonding import BondEnergy, LatticeGas, LinearEnthalpy
from surfacechem.laws.contact import BondedContact, BondStiffness
from surfacechem.laws.kinetics import Arrhenius, ExponentialAffinity, KamalSourour, LinearAffinity, MassAction
from surfacechem.laws.limits import TensileStrength
from surfacechem.laws.loading import Hold, Table
from surfacechem.scene import Body, Interface, Mounting, Scene

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
    assert (unbonded.transition.name, rebond.transition.name) == ("unbonded", "rebond")
    assert unbonded.t == pytest.approx(brentq(free, 0.3, 1.0, xtol=1e-15), rel=1e-10)
    assert rebond.t == pytest.approx(2 - math.sqrt(2 * K / E) / TOP, rel=1e-12)
    assert unbonded.released == rebond.released == 0.0
    phi = trajectory.everywhere["phi"]
    assert phi.min() > -1e-15
    assert phi[-1] > 0.5
    balances = audit(trajectory)
    assert balances.energy_error < 1e-9
    assert balances.violations == ()


def test_held_bonds_are_said_in_the_dataset_and_dissipate_nothing():
    trajectory = solve(damage())
    values = trajectory.everywhere
    held = values["held"] != 0
    assert held.any()
    assert np.all(values["phi"][held] == 0.0)
    assert np.all(values["R_linear_affinity"][held] == 0.0)
    assert np.all(values["sigma_linear_affinity"][held] == 0.0)


def test_no_bond_at_the_start_under_a_load_that_allows_none():
    trajectory = solve(damage(phi=0.0, gaps=(TOP, TOP)), until=1.0)
    assert [jump.transition.name for jump in trajectory.jumps] == ["unbonded"]
    assert trajectory.jumps[0].t == 0.0
    assert trajectory.status == "finished"
    assert np.all(trajectory.everywhere["phi"] == 0.0)


def test_a_bound_is_touched_again_and_again():
    gaps = (0.0, *(TOP, 0.0) * 20)
    trajectory = solve(damage(gaps=gaps, until=40.0), until=40.0, outputs=11)
    names = [jump.transition.name for jump in trajectory.jumps]
    assert names == ["unbonded", "rebond"] * 20
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-13])
def test_bounds_at_any_tolerance(rtol):
    trajectory = solve(damage(), rtol=rtol)
    assert [jump.transition.name for jump in trajectory.jumps] == ["unbonded", "rebond"]


def test_constant_affinity_bonds_all_sites():
    interface = Interface("T", [LinearEnthalpy(H_r=2.0)], reactions=[LinearAffinity(c_r=SITES.density)], sites=SITES)
    scene = Scene(bodies("T", "T"), interface, T_0=300.0, initial={"phi": 0.25, "T": 300.0})
    trajectory = solve(scene, until=1.0)
    (complete,) = trajectory.jumps
    assert complete.t == pytest.approx(0.375, rel=1e-12)
    heat = trajectory.outputs[-1, [o.name for o in trajectory.model.system.outputs].index("U_c")]
    assert heat == pytest.approx(0.0, abs=1e-12)
    assert trajectory.result.y[0] == 1.0


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
    assert [jump.transition.name for jump in trajectory.jumps] == ["complete", "debond", "complete"]
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize(
    ("potential", "law"),
    [
        (BondEnergy(K_0=300.0), LinearAffinity(c_r=1e16)),
        (BondEnergy(K_0=300.0, phi_eq=0.7), LinearAffinity(c_r=1e16)),
        (BondEnergy(K_0=300.0), ExponentialAffinity(C_r=1e34)),
        (LatticeGas(epsilon=6e-20), LinearAffinity(c_r=1e16)),
        (LatticeGas(epsilon=6e-20), MassAction(k_on=3.0, k_off=1.0)),
        (LinearEnthalpy(H_r=2.0), Arrhenius(A=1.0)),
        (LinearEnthalpy(H_r=2.0), KamalSourour(A_1=1.0, A_2=1.0, m=0.5, n=1.5)),
    ],
)
def test_laws_that_stay_within_the_bounds_have_no_modes(potential, law):
    pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
    interface = Interface(Hold(level=300.0), [potential], (), [law], SITES)
    system = assemble(Scene(pair, interface, T_0=300.0, initial={"phi": 0.5}))
    assert system.modes == ()


def test_intervals_enclose_values():
    import symengine

    x, y = symengine.symbols("x y")
    known = {x: (-1.5, 2.0), y: (0.25, 3.0)}
    expressions = [
        x**2 - y,
        x**3 * y,
        symengine.exp(-x) / y,
        y**-2.5 + symengine.log(y),
        symengine.sinh(x) * symengine.sin(x),
        1 / x,
        symengine.Piecewise((x, x < 0), (-x, True)),
        symengine.Piecewise((y, y > 5), (2 * y, True)),
        symengine.pi * y,
    ]
    for expression in expressions:
        low, high = enclosure(expression, known)
        for a in np.linspace(-1.5, 2.0, 20):
            for b in np.linspace(0.25, 3.0, 20):
                value = float(expression.subs({x: a, y: b}))
                assert low - 1e-12 <= value <= high + 1e-12, expression
