"""Rigid contact of bodies with a mass: rebounds, rest after infinitely many of them, release, and friction."""

import math
from dataclasses import replace

import pytest
from scenes import SITES, bodies, together, varying
from solved import closed, solve

import surfacechem
from surfacechem.contracts.terms import Friction, parameter
from surfacechem.errors import InputError
from surfacechem.laws.cohesive import TensileStrength
from surfacechem.laws.factors import Linear, Proportional
from surfacechem.laws.free_energy import BondEnergy, Penalty, TangentialStiffness
from surfacechem.laws.friction import AnisotropicCoulomb, Coulomb, MohrCoulomb, Stribeck
from surfacechem.laws.heat_transfer import PressureConductance
from surfacechem.laws.kinetics import LinearAffinity
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.scene import Interface, Mounting, Scene

M, F, FELL = 4.0, 40.0, 0.2
PRESSED = {"F_n": Hold(level=-F)}
V_0, T_0 = math.sqrt(2 * F / M * FELL), math.sqrt(2 * FELL * M / F)
"""Speed and time of the first impact of what falls from rest."""


def scene(mount, loading=PRESSED, initial=None, **more):
    return together(loading=loading, initial={"g_n": FELL} | (initial or {}), normal=mount, **more)


# -- rebounds ----------------------------------------------------------------------------------------------------------


def test_a_pull_that_only_reaches_the_pressure_lets_nothing_go():
    load = Harmonic(mean=-10.0, amplitude=10.0, frequency=0.5)
    trajectory = closed(scene(Mounting(m=M), {"F_n": load}, {"g_n": 0.1}), 20.0)
    assert trajectory.events == ["impact", "rest"]


# -- rest and release --------------------------------------------------------------------------------------------------


def test_a_load_that_jumps_lets_go_at_once():
    load = Table(times=[0, 3, 3, 4, 4, 9], values=[-10, -10, 20, 20, -30, -30])
    trajectory = closed(scene(Mounting(m=M), {"F_n": load}), 9.0)
    assert trajectory.events == ["impact", "rest", "open", "impact", "rest"]
    # It rises for 1 s at 5 m/s^2 and falls at 7.5 m/s^2.
    height = 2.5
    speed = math.sqrt(5.0**2 + 2 * 7.5 * height)
    assert [jump.t for jump in trajectory.jumps[2:4]] == pytest.approx([3.0, 4.0 + (5.0 + speed) / 7.5], rel=1e-13)
    assert trajectory.of("impact")[1].released == pytest.approx(M * speed**2 / 2)


@pytest.mark.parametrize(("v", "pull"), [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (-1.0, 1.0)])
def test_starts_at_touch(v, pull):
    trajectory = closed(scene(Mounting(m=1.0, e=0.5), {"F_n": Hold(level=pull)}, {"v_n": v, "g_n": 0.0}), 1.0)
    assert trajectory.events == ["impact"] * (v < 0)
    assert trajectory.end("g_n") == pytest.approx((v if v >= 0 else 0.5) + max(pull, 0.0) / 2, rel=1e-12)


@pytest.mark.parametrize("until", [1e-6, 1e6])
def test_rebounds_far_faster_than_the_run(until):
    """Bodies of a micrometre: the first swing takes 10 ns, whatever the length of the run."""
    mount = Mounting(m=1e-3, k=1e13, e=0.5)
    trajectory = closed(scene(mount, {"w_n": Hold(level=-1e-9)}, {"g_n": 1e-9}), until)
    assert trajectory.events[-1] == "rest"
    impacts = trajectory.of("impact")
    assert len(impacts) == 40
    assert impacts[0].t == pytest.approx(math.pi / 3 * 1e-8, rel=1e-11)


def test_bonds_hold_once_the_bodies_rest():
    """They form in the air as well; a rebound is too brief for a traction that has an end."""
    strength = TensileStrength(t_max=varying(50.0, Proportional(of="phi")), violation="accept")
    bonding = Interface("T", [BondEnergy(K_0=1e-9)], (), [LinearAffinity(c_r=1e26)], sites=SITES, limits=[strength])
    load = Table(times=[0, 1, 9], values=[-20, -20, 140])
    trajectory = closed(scene(Mounting(m=M, e=0.5), {"F_n": load}, {"phi": 0.5}, interface=bonding), 5.0)
    assert trajectory.events[-2:] == ["rest", "debond"]
    debond = trajectory.jumps[-1]
    phi, g, v, _ = debond.before.y
    assert (g, v) == (0.0, 0.0)
    assert -20 + 20 * (debond.t - 1) == pytest.approx(50.0 * phi, rel=1e-9)
    assert debond.t > 2.0
    assert all(jump.before.y[0] > 0.5 for jump in trajectory.of("impact"))


# -- friction ----------------------------------------------------------------------------------------------------------

MU, M_T = 0.3, 5.0
SLIDING = {"u_t": 0.0, "v": 3.0}


def sliding(e, friction=None, tangential=None, **start):
    interface = Interface("T", frictions=[friction or Coulomb(mu=MU)])
    held = tangential or Mounting(m=M_T)
    return scene(Mounting(m=M, e=e), PRESSED, SLIDING | start, interface=interface, tangential=held)


@pytest.mark.parametrize("e", [0.5, 1.0])
def test_friction_answers_impacts_by_impulses(e):
    """What slides loses mu (1 + e) m v / m_t at each impact and nothing between them."""
    trajectory = closed(sliding(e), 4.0)
    rubs, impacts = trajectory.of("rub"), trajectory.of("impact")
    v = SLIDING["v"]
    for impact, rub in zip(impacts, rubs, strict=False):
        assert rub.before.y[3] == pytest.approx(v, rel=1e-9)
        left = max(v + MU * (1 + e) * M * impact.before.y[1] / M_T, 0.0)
        assert rub.after.y[3] == pytest.approx(left, rel=1e-9, abs=1e-14)
        assert rub.released == pytest.approx(M_T * (v**2 - left**2) / 2, rel=1e-4)
        v = left
    assert trajectory.energy_error < 1e-12
    assert all(jump.verdict == "admissible" for jump in trajectory.jumps)
    if e < 1:
        # The impulses of the pressure are those of the load: it stops where it would have under the load at rest.
        assert trajectory.of("stop")[0].t == pytest.approx(SLIDING["v"] * M_T / (MU * F), rel=1e-10)
    else:
        assert trajectory.end("v") == 0.0
        assert len(rubs) == 4


class UnderTraction(Friction):
    """Dry friction that reads the normal traction."""

    mu: float = parameter("1", "coefficient of friction", at_least=0)

    def traction(self, t_n, direction):
        return -self.mu * t_n * direction

    def limit(self, t_n):
        return -self.mu * t_n


def test_friction_by_the_normal_traction_is_that_by_the_pressure():
    one, other = (closed(sliding(0.5, law), 1.0) for law in (Coulomb(mu=MU), UnderTraction(mu=MU)))
    assert [rub.after.y[3] for rub in one.of("rub")] == [rub.after.y[3] for rub in other.of("rub")]


def test_adhesion_and_cohesion_have_no_impulse():
    """Finite tractions act between impacts only; sliding backward is alike."""
    v = -3.0
    friction = MohrCoulomb(mu=MU, t_n_max=5.0, c=2.0)
    trajectory = closed(sliding(0.5, friction, v=v), 0.25)
    (rub,) = trajectory.of("rub")
    assert abs(rub.before.y[3]) - abs(rub.after.y[3]) == pytest.approx(MU * 1.5 * M * V_0 / M_T, rel=1e-12)
    slowed = abs(v) - (MU * 5.0 + 2.0) / M_T * T_0
    assert abs(rub.before.y[3]) == pytest.approx(slowed, rel=1e-12)


def test_in_two_directions_the_direction_stays():
    interface = Interface("T", frictions=[Coulomb(mu=MU)])
    start = {"u_t": 0.0, "u_t2": 0.0, "v": 3.0, "v_2": 4.0}
    given = scene(Mounting(m=M, e=0.5), PRESSED, start, interface=interface, tangential=Mounting(m=M_T))
    trajectory = closed(given, 3.0)
    assert trajectory.events[-1] == "stop"
    stop = trajectory.jumps[-1]
    assert stop.t == pytest.approx(5.0 * M_T / (MU * F), rel=1e-10)
    assert trajectory.end("u_t2") == pytest.approx(4 / 3 * trajectory.end("u_t"), rel=1e-12)


@pytest.mark.parametrize(
    ("friction", "potentials"), [(Coulomb(mu=MU), ()), (Coulomb(mu=MU), [TangentialStiffness(E_t=1e3)])]
)
def test_what_slides_without_a_mass_or_behind_a_spring_sticks_for_an_instant(friction, potentials):
    """No velocity of a mass jumps with the impact, so that friction takes nothing."""
    held = Mounting(k=100.0, m=5.0) if potentials else Mounting(k=100.0)
    interface = Interface("T", potentials, frictions=[friction])
    start = {"u_t": 0.0} | ({"v_t": 1.0} if potentials else {})
    given = scene(Mounting(m=M, e=0.5), PRESSED | {"w_t": Ramp(rate=0.5)}, start, interface=interface, tangential=held)
    trajectory = closed(given, 1.0)
    assert trajectory.of("impact")
    assert not trajectory.of("rub")
    for jump in trajectory.of("impact"):
        assert jump.after.y[2:-1].tolist() == jump.before.y[2:-1].tolist()


def test_the_work_of_a_drive_in_an_impact_is_left_out():
    interface = Interface("T", frictions=[Coulomb(mu=MU)])
    trajectory = closed(scene(Mounting(m=M), PRESSED | {"v": Hold(level=-2.0)}, interface=interface), 3.0)
    assert not trajectory.of("rub")
    assert trajectory.model.system.warnings == (
        "impacts take no time: what coulomb would do at their pressure is left out.",
    )
    assert trajectory.energy_error < 1e-11


# -- what is refused, and what is said ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("friction", "across", "why"),
    [
        (Stribeck(mu_s=0.6, mu_k=0.4, v_s=0.5), {}, "varies with the sliding velocity"),
        (Coulomb(mu=varying(0.3, Linear(of="v", slope=-0.1))), {}, "varies with the sliding velocity"),
        (Coulomb(mu=varying(0.3, Linear(of="p", slope=1e-9))), {}, "varies with the pressure"),
        (AnisotropicCoulomb(mu_1=0.2, mu_2=0.4), {"u_t2": 0.0, "v_2": 1.0}, "differs from direction to direction"),
    ],
)
def test_friction_whose_impulse_is_not_known_is_refused(friction, across, why):
    with pytest.raises(InputError, match=f"{why}.*Let a potential bear the bodies, such as `penalty`"):
        assemble(sliding(0.5, friction, **across))


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (scene(Mounting(m=M, e=0.5), interface=Interface("T", [Penalty(E_n=1e9)])), "the potential of the gap bears"),
        (scene(Mounting(c_g=1.0, e=0.5)), "nothing with a mass hits anything"),
        (scene(Mounting(m=M), tangential=Mounting(m=M_T, e=0.5)), "bodies rebound along the normal"),
    ],
)
def test_a_restitution_that_would_change_nothing_is_refused(given, why):
    with pytest.raises(InputError, match=why):
        assemble(given)


@pytest.mark.parametrize("q", [0.95, 1.0])
def test_a_conductance_that_keeps_up_with_the_pressure_misses_the_instant(q):
    """One that grows less than in proportion conducts nothing in no time."""
    spots = PressureConductance(between=("lower", "upper"), h_c=1e4, H=1e9, q=q)
    given = Scene(
        bodies(), Interface("T_1"), [spots], PRESSED, None, 300.0,
        {"T_1": 300.0, "T_2": 310.0, "g_n": FELL}, normal=Mounting(m=M),
    )  # fmt: skip
    warning = (
        "impacts take no time: what the conductance between lower and upper would do at their pressure is left out."
    )
    assert list(assemble(given).warnings) == ([warning] if q == 1 else [])


# -- the case, other methods, other codes ------------------------------------------------------------------------------


def test_other_methods_see_the_impacts():
    given = scene(Mounting(m=M, e=0.3))
    ours, other = closed(given, 5.0), solve(given, 5.0, solver="cvode", rtol=1e-8)
    assert other.status == "finished"
    assert other.events == (len(other.jumps) - 1) * ["impact"] + ["rest"]
    assert other.jumps[-1].t == pytest.approx(ours.jumps[-1].t, rel=1e-5)
    assert other["g_n"].min() >= 0


def test_a_method_that_passes_an_impact_fails(monkeypatch):
    monkeypatch.setattr("surfacechem.solve.adapters.stepping.first_crossing", lambda step, *_: (step.end, []))
    case = surfacechem.load("bouncing-plate")
    trajectory = case.model.solve(replace(case.case.run, solver="lsoda"))
    assert trajectory.status == "failed"
    assert trajectory.reason.startswith("the method has not seen the gap close; radau does")


@pytest.mark.parametrize("rtol", [1e-2, 3e-2])
def test_rebounds_come_to_rest_at_loose_tolerances(rtol):
    """The drift of an integration is less than what drifts, however loose the tolerance."""
    case = surfacechem.load("bouncing-plate")
    trajectory = case.model.solve(replace(case.case.run, solver="radau", rtol=rtol))
    assert trajectory.status == "finished"
    assert trajectory.result.y[0] == 0.0


def test_rebounds_that_use_up_the_steps_are_named():
    """A damper makes those without loss slower and slower, and there is no end to them."""
    given = scene(Mounting(m=M, c_g=2.0, e=1.0))
    trajectory = solve(given, 1e3, max_steps=5000)
    assert trajectory.status == "failed"
    assert trajectory.reason.startswith("the number of steps allowed was used up by rebounds")


@pytest.mark.parametrize(("speed", "e"), [(1e-20, 0.5), (1e-15, 0.9)])
def test_rebounds_that_are_nothing_from_the_start(speed, e):
    trajectory = closed(scene(Mounting(m=M, e=e), PRESSED, {"g_n": 0.0, "v_n": -speed}), 3.0)
    assert trajectory.events[-1] == "rest"
    assert len(trajectory.jumps) < 200
