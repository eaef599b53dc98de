"""What happens at one instant counts once, and nothing happens where nothing could."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SITES, bodies, perfect_contact, together, varying
from solved import Solved, solve

import surfacechem
from surfacechem.contracts.terms import Friction, parameter
from surfacechem.errors import InputError
from surfacechem.laws.cohesive import ExponentialCohesiveZone, TensileStrength, XuNeedleman
from surfacechem.laws.factors import Proportional
from surfacechem.laws.films import Film
from surfacechem.laws.free_energy import BondEnergy, BondStiffness, Constant, Penalty
from surfacechem.laws.kinetics import LinearAffinity, Relaxation
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.laws.longrange import VanDerWaalsFlatFlat
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Medium, Mounting, Scene
from surfacechem.solve.equilibria import Point
from surfacechem.solve.jumps import ADMISSIBLE, IMPOSSIBLE, VIOLATES, EdgeUncertainty
from surfacechem.solve.run import Model

TOLERANCES = [1e-5, 1e-9, 1e-13]
COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


def test_bodies_touch_and_come_apart_once_at_any_tolerance():
    press = surfacechem.load("thermal-press")
    for rtol in TOLERANCES:
        trajectory = Solved(press.model.solve(replace(press.case.run, rtol=rtol)))
        assert trajectory.events == ["touch", "end of press", "end of hold", "release", "end of leave"], rtol


@pytest.mark.parametrize("rtol", TOLERANCES)
def test_a_contact_under_a_swinging_load_touches_once_in_each_period(rtol):
    loading = {"w_n": Harmonic(amplitude=1e-7, frequency=1.0, phase=0.3)}
    scene = Scene(COLD, Interface(None, [Penalty(E_n=1e14)]), (), loading, T_0=300.0, normal=Mounting(k=1e13))
    trajectory = solve(scene, 5.0, rtol=rtol)
    assert trajectory.events == ["touch", "release"] * 5
    exact = (np.arange(1, 11) / 2) - 0.3 / (2 * np.pi)
    assert [jump.t for jump in trajectory.jumps] == pytest.approx(exact, rel=1e-12)


def test_what_a_start_settles_to_has_to_be_admissible():
    interface = Interface("T", [Penalty(E_n=1e14)], medium=Medium(None, {"k_m": 0.026}))
    film = Film(between=("lower", "upper"))
    pair = Body("lower", "T", Constant(C=1.0)), Body("upper", "T_2", Constant(C=1.0))
    loading, initial = {"w_n": Hold(level=-1e-8)}, {"T": 300.0, "T_2": 310.0, "g_n": 1e-8}
    scene = Scene(pair, interface, [film], loading, None, 300.0, initial, normal=Mounting(k=1e13))
    with pytest.raises(InputError, match="at the start d_m reached zero, where the law film ends"):
        solve(scene, 1.0)


def test_a_start_is_judged_in_the_modes_that_hold_there():
    """In contact the energy is not convex in phi, while its continuation from beyond touch is."""
    adhesion = VanDerWaalsFlatFlat(A_H=varying(1e-19, Proportional(of="phi", about=1.0)), D_0=1e-9)
    interface = Interface("T", [adhesion, Penalty(E_n=1e12)], reactions=[Relaxation(tau=1.0)], sites=SITES)
    initial = {"T": 300.0, "phi": 0.5, "g_n": -5e-10}
    mount, loading = Mounting(k=1e12, c_b=1e10), {"w_n": Hold(level=0.0)}
    with pytest.raises(InputError, match="relaxation"):
        solve(together(interface=interface, loading=loading, initial=initial, normal=mount), 1.0)


def test_a_jump_to_where_a_law_has_no_energy_is_impossible():
    zone = ExponentialCohesiveZone(t_max=1e6, g_0=varying(1e-7, Proportional(of="phi", about=1.0)), E_n=1e14)
    interface = Interface("T", [zone], sites=SITES, limits=[TensileStrength(t_max=1e5)])
    loading, initial = {"w_n": Ramp(rate=1e-8)}, {"T": 300.0, "phi": 1.0}
    scene = together(interface=interface, loading=loading, initial=initial, normal=Mounting(k=1e13))
    trajectory = solve(scene, 10.0)
    assert trajectory.jumps[-1].verdict == IMPOSSIBLE
    assert "which is impossible: the energy of the interface is not finite after it" in trajectory.reason


class Reluctant(Friction):
    r"""Friction that drives what is slower than v_1.

    .. math:: t_t = c (v - v_1)

    Source: none; it breaks the second law. Any v.

    >>> Reluctant(c=1.0, v_1=1.0).traction(v=0.5)
    -0.5
    """

    abstract = True

    c: float = parameter("Pa s/m", "resistance", at_least=0)
    v_1: float = parameter("m/s", "velocity below which it drives")

    def traction(self, v):
        return self.c * (v - self.v_1)


@pytest.mark.parametrize(("v_1", "rtol"), [(0.5, 1e-4), (0.01, 1e-12)])
def test_a_law_that_destroys_entropy_is_named_at_any_tolerance(v_1, rtol):
    """Accelerated from rest to 1 m/s it destroys v_1^3 / 6 of what it produces, 1/3 - v_1 / 2 but for that."""
    loading = {"v": Ramp(rate=1.0)}
    scene = perfect_contact([], frictions=[Reluctant(c=1e3, v_1=v_1)], loading=loading)
    books = audit(solve(scene, 1.0, rtol=rtol, outputs=201))
    assert books.violations == ("reluctant",)
    whole = 1 / 3 - v_1 / 2 + v_1**3 / 3
    assert books.destroyed["reluctant"] == pytest.approx(v_1**3 / 6 / whole, rel=0.5)


@pytest.mark.parametrize(("phi", "verdict"), [(1e-14, ADMISSIBLE), (-1e-14, ADMISSIBLE), (1e-3, VIOLATES)])
def test_the_rounding_of_a_bound_destroys_no_entropy(phi, verdict):
    """Bodies and bonds cancel to a total of none, so that the last bonds are all there is to compare with."""
    K_1, C = 0.5, 1e3
    interface = Interface(
        "T", [BondStiffness(E_b=1e12, E_n=1e12), BondEnergy(K_1=K_1)], (), [LinearAffinity(c_r=1e19)], SITES
    )
    pair, loading = bodies("T", "T", C_1=C / 2, C_2=C / 2), {"g_n": Ramp(rate=1e-6)}
    scene = Scene(pair, interface, loading=loading, T_0=300.0, initial={"T": 300.0 + K_1 / (2 * C), "phi": 0.5})
    model = Model(assemble(scene))
    index = [item.name for item in model.system.edges].index("unbonded")
    states = [{"phi": phi, "T": 300.0 + K_1 / (2 * C)}[state.name] for state in model.system.states]
    values = np.array([parameter.value for parameter in model.system.parameters], dtype=float)
    point = Point(0.0, np.array(states), np.zeros(len(states)), values)
    assert model.jumper.make(index, point, 0.0, EdgeUncertainty(noise=1e-13)).verdict == verdict


def test_a_gap_on_an_unstable_equilibrium_that_nothing_pushes_from_says_so():
    """Pressed together, opposite surfaces are held where they are least at rest: on top of the shear potential."""
    zone = XuNeedleman(Phi_n=1.0, g_0=1e-7, g_t0=1e-7, q=1.0, r=0.0)
    loading, mount = {"w_t": Hold(level=0.0), "g_n": Hold(level=-3e-7)}, Mounting(k=1e10)
    scene = together([zone], (), loading, tangential=mount)
    trajectory = solve(scene, 1.0)
    assert trajectory.status == "stopped"
    assert trajectory.reason.startswith(
        "the quasi-static equilibrium of the gap was lost (mechanical fold), but nothing"
    )
    assert trajectory.events == ["snap"]
