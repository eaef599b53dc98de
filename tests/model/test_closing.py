"""What ends where bodies meet: gaps that nothing bears, laws at the end of their domain, limits, softening laws."""

import math

import numpy as np
import pytest
from scenes import SITES, together, varying
from solved import solve

from surfacechem.contracts.terms import Potential, parameter
from surfacechem.errors import InputError
from surfacechem.laws.cohesive import CompliantDebonding, TensileStrength
from surfacechem.laws.factors import Proportional
from surfacechem.laws.free_energy import (
    BondedContact,
    BondEnergy,
    BondStiffness,
    LinearEnthalpy,
    NormalStiffness,
    Penalty,
)
from surfacechem.laws.friction import Viscous
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.laws.longrange import (
    LennardJonesDerjaguin,
    LennardJonesFlatFlat,
    LennardJonesSpherePlane,
    VanDerWaalsFlatFlat,
    VanDerWaalsSpherePlane,
)
from surfacechem.model.assemble import assemble
from surfacechem.scene import Mounting
from surfacechem.solve.equilibria import next_root, steps_ahead
from surfacechem.solve.run import Model, Run

CLOSED = "the gap closed, and no potential bears the bodies in contact"
ATTRACTIVE = [
    (VanDerWaalsFlatFlat(A_H=1e-19), 1e14, 1e-7),
    (VanDerWaalsSpherePlane(A_H=1e-19, R=1e-6, area=1e-12), 1e11, 5e-7),
]
SITES_OF = {"n_1": 2e19, "n_2": 3e19, "psi_0": 4e-21, "g_0": 3e-10}
REPULSIVE = [
    (LennardJonesFlatFlat(**SITES_OF), 1e14, 6e-8),
    (LennardJonesSpherePlane(**SITES_OF, R=1e-6, area=1e-12), 1e11, 6e-7),
    (LennardJonesDerjaguin(**SITES_OF, R=1e-6, area=1e-12), 1e11, 6e-7),
]


def scene(potentials=(), loading=None, mount=None, initial=None, **more):
    return together(potentials, loading=loading, initial=initial, normal=mount, **more)


def approach(law, k, far):
    loading = {"w_n": Table(times=[0.0, 5.0], values=[far, 1e-9])}
    return solve(scene([law], loading, Mounting(k=k), {"g_n": far}), 5.0)


# -- snaps into what has no end ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("law", "k", "far"), ATTRACTIVE)
def test_attraction_that_nothing_bears_snaps_to_no_equilibrium(law, k, far):
    """Without repulsion the gap would pass touch, and the bodies each other."""
    trajectory = approach(law, k, far)
    (snap,) = trajectory.jumps
    assert (trajectory.status, snap.verdict, snap.released) == ("stopped", "impossible", 0.0)
    assert (
        f"which is impossible: no gap follows at which the tractions are in equilibrium and the laws hold: {CLOSED}"
        in (trajectory.reason)
    )
    assert 0 < trajectory.end("g_n") < far
    assert trajectory.energy_error < 1e-8


@pytest.mark.parametrize(("law", "k", "far"), REPULSIVE)
def test_repulsion_ends_the_snap_before_the_pole(law, k, far):
    trajectory = approach(law, k, far)
    assert (trajectory.status, [jump.verdict for jump in trajectory.jumps]) == ("finished", ["admissible"])
    assert 0.01 * law.g_0 < trajectory.end("g_n") < law.g_0
    assert assemble(scene([law], {"w_n": Hold(level=far)}, Mounting(k=k), {"g_n": far})).warnings == ()


class OddPole(Potential):
    """Attraction without a guard; beyond its pole it changes its sign. Source: a test. g_n > -D."""

    A: float = parameter("J", "strength", above=0)
    D = 1e-9

    @property
    def limits(self):
        return {"g_n": (-self.D, math.inf)}

    def energy(self, g_n):
        return -self.A / (2 * (g_n + self.D) ** 2)


def test_a_law_states_where_it_ends():
    """The search meets a pole at which the traction changes its sign, and what it lands on lies beyond."""
    trajectory = approach(OddPole(A=1e-20), 1e14, 1e-7)
    assert trajectory.status == "stopped"
    assert "is impossible: no gap follows" in trajectory.reason
    assert trajectory.end("g_n") > 0


@pytest.mark.parametrize("power", [1, 3])
def test_a_pole_is_no_zero(power):
    def pole(gaps):
        return 1.0 / (np.asarray(gaps) + 1.0) ** power

    assert next_root(pole, 1.0, -1.0, 1.0) is None
    assert next_root(lambda g: np.asarray(g) ** power, 1.0, -1.0, 1.0) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("rounding", [1e-9, -1e-9])
@pytest.mark.parametrize("beside", [1e-12, -1e-12])
def test_a_zero_is_found_where_a_value_alone_rounds_otherwise_than_among_others(beside, rounding, sign):
    """As compiled code may do for one gap and for many; the zero is closer to a trial than its rounding tells."""
    zero = float(steps_ahead(1.0, -1.0)[800]) + beside

    def curve(gaps):
        return sign * (np.asarray(gaps) - zero + (rounding if len(gaps) == 1 else 0.0))

    assert next_root(curve, 1.0, -1.0, sign) == pytest.approx(zero, abs=2e-9)


def test_a_change_that_leaves_nothing_to_bear_the_bodies_is_refused():
    given = scene([Penalty(E_n=1e13)], {"w_n": Hold(level=1e-8)}, Mounting(k=1e12), {"g_n": 1e-8})
    with pytest.raises(InputError, match=r"no potential bears the bodies in contact \(.*`penalty`"):
        Model(assemble(given)).solve(Run(times=(0.0, 1.0)), {"interface.potential.penalty.E_n": 0.0})


# -- masses and dampers that meet ------------------------------------------------------------------------------


@pytest.mark.parametrize("mount", [Mounting(m=4.0), Mounting(c_g=1e4)])
def test_a_law_of_an_open_gap_ends_the_run(mount):
    given = scene(
        (), {"F_n": Hold(level=-39.0), "v": Hold(level=0.1)}, mount, {"g_n": 1e-3}, frictions=[Viscous(eta=1e-6)]
    )
    assert assemble(given).modes == ()
    trajectory = solve(given, 30.0)
    assert trajectory.status == "stopped"
    assert "g_n reached zero, where the law viscous ends" in trajectory.reason


def test_a_gap_given_closed_is_refused_with_the_remedy():
    given = scene((), {"F_n": Hold(level=8.0)}, Mounting(m=4.0), {"g_n": -1e-6})
    with pytest.raises(
        InputError, match=r"at the start the bodies overlap.*Give a potential that lets them, such as `penalty`,"
    ):
        solve(given, 2.0)


# -- bonds, and what limits them ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("start", "carried"), [(1e-6, 0.0), (0.0, 1.0)])
def test_a_prescribed_gap_is_bonded_where_it_starts_closed(start, carried):
    trajectory = solve(scene([BondedContact(E_n=1e12)], {"g_n": Ramp(start=start, rate=1e-6)}), 2.0)
    assert trajectory["t_n"] == pytest.approx(
        carried * 1e12 * (start + 1e-6 * trajectory.result.problem.times), rel=1e-12
    )


def test_a_limit_of_a_tension_that_bonds_do_not_carry_is_refused():
    loading, rest = {"w_n": Ramp(rate=1e-6)}, {"mount": Mounting(k=3e13)}
    extra = {"limits": [TensileStrength(t_max=9e7)], "sites": SITES, "initial": {"phi": 1.0}}
    potentials = [NormalStiffness(E_n=2e14), BondEnergy(K_0=8.0)]
    with pytest.raises(InputError, match="would change nothing: the tension of normal-stiffness does not depend"):
        assemble(scene(potentials, loading, **rest, **extra))
    for carries in (
        BondedContact(E_n=2e14),
        BondStiffness(E_b=2e14, E_n=2e14),
        NormalStiffness(E_n=varying(2e14, Proportional(of="phi"))),
    ):
        trajectory = solve(scene([carries, potentials[1]], loading, **rest, **extra), 5.0)
        (debond,) = trajectory.of("debond")
        assert debond.released > 0


# -- bonds that break one by one ---------------------------------------------------------------------------------------


def softened(**changes):
    law = CompliantDebonding(**{"t_max": 5e7, "E_b": 4e13, "g_f": 6e-6} | changes)
    potentials = [BondStiffness(E_b=4e13, E_n=4e13), LinearEnthalpy(H_r=3.0)]
    loading, initial = {"w_n": Ramp(rate=1e-6)}, {"phi": 1.0}
    return scene(potentials, loading, Mounting(k=5e13), initial, reactions=[law], sites=SITES)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"g_f": 1.1e-6}, r"t_max / E_b = 1.25e-06 m, .*, is not below g_f = 1.1e-06 m: .* snap back"),
        ({"g_f": 1.25e-6}, r"t_max / E_b = 1.25e-06 m, .*, is not below g_f = 1.25e-06 m"),
        ({"t_max": 1e-30}, r"t_max / E_b = 2.5e-44 m, .*, is less than 1e-09 g_f, too little to be resolved"),
        ({"E_b": 1e30}, r"t_max / E_b = 5e-23 m, .*, is less than 1e-09 g_f, too little to be resolved"),
    ],
)
def test_an_envelope_that_does_not_fall_after_it_rose_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        assemble(softened(**changes))


@pytest.mark.parametrize(("changes", "borne"), [({"E_b": 5e13}, "4e.07"), ({"E_b": 2e13}, "1e.08")])
def test_two_stiffnesses_of_the_same_bonds_are_refused(changes, borne):
    """They bear E_b g_n where the law says t_max."""
    with pytest.raises(InputError, match=f"the bonds of the potential bear {borne} Pa, not the t_max of 5e.07 Pa"):
        assemble(softened(**changes))


@pytest.mark.parametrize(
    ("change", "message"),
    [({"g_f": 1.1e-6}, "bonds begin to break beyond g_f"), ({"E_b": 5e13}, "another traction than t_max")],
)
def test_a_sweep_cannot_leave_what_holds(change, message):
    model = Model(assemble(softened()))
    ((name, value),) = change.items()
    path = f"interface.bonding.compliant-debonding.{name}"
    with pytest.raises(InputError, match=f"at the start .*{message}"):
        model.solve(Run([0.0, 1.0]), {path: value})
