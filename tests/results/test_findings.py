"""Dangerous regimes end as theory says they do: refused, stopped with the true reason, or solved."""

import math

import numpy as np
import pytest
import scenes
from scenes import SITES, bodies, path, varying
from scipy.special import lambertw

from surfacechem.errors import InputError
from surfacechem.laws.factors import Exponential, Linear, LinearInTemperature, Power
from surfacechem.laws.free_energy import (
    BondEnergy,
    Constant,
    InterfaceCapacity,
    LinearEnthalpy,
    NormalStiffness,
    Quadratic,
)
from surfacechem.laws.friction import Coulomb, Viscous
from surfacechem.laws.kinetics import Arrhenius, LinearAffinity, Relaxation
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.scene import Body, Interface, Mounting, Scene, Sites
from surfacechem.solve.run import Model, Run, Trajectory


def run(scene: Scene, end: float, outputs: int = 11, **settings) -> Trajectory:
    return Model(assemble(scene)).solve(Run(times=np.linspace(0.0, end, outputs), **settings))


BETA, H, ETA, FILM = 0.05, 50.0, 0.1, 1e-6
CRITICAL = H / (math.e * BETA)
"""Heat at which a film that thins as it warms under a dead shear load has no steady temperature any more [W/m^2]."""


def sheared_film(heat: float, guess: float = 300.0, *, ramp: bool = False) -> Scene:
    """A film without capacity whose sliding velocity the load and its viscosity set: F^2 g / eta(T) = H (T - T_0)."""
    F = math.sqrt(heat * ETA / FILM)
    interface = Interface("T_c", [], [Viscous(eta=varying(ETA, Exponential(beta=BETA)))])
    loading = {"F_t": Ramp(rate=F) if ramp else Hold(level=F), "g_n": Hold(level=FILM)}
    heats = [path("interface", "lower", 30.0), path("interface", "upper", 20.0)]
    return Scene(ISOTHERMAL, interface, heats, loading, T_0=300.0, initial={"T_c": guess}, tangential=Mounting())


@pytest.mark.parametrize("guess", [300.0, 353.6, 400.0])
def test_temperature_and_velocity_find_their_stable_state_from_any_guess(guess):
    trajectory = run(sheared_film(0.5 * CRITICAL, guess), 1.0)
    names = [state.name for state in trajectory.model.system.states]
    exact = 300.0 - lambertw(-0.5 / math.e).real / BETA
    assert trajectory.result.y[names.index("T_c")] == pytest.approx(exact, rel=1e-12)


def test_a_film_ignites_where_its_load_passes_the_fold():
    assert "ignition" in run(sheared_film(1.0001 * CRITICAL), 1.0).reason
    trajectory = run(sheared_film(4 * CRITICAL, ramp=True), 1.0, 21)
    assert "ignition: no temperature T_c balances the heat" in trajectory.reason
    assert trajectory.result.t == pytest.approx(0.5, rel=1e-6)


def test_a_capacity_that_vanishes_on_the_way_ends_the_run():
    """Bonds that break, pushed by a prescribed phi, take more capacity than the bodies have: K_2 (1 - phi)^2 / T_0."""
    scene = scenes.perfect_contact([BondEnergy(K_2=1200.0)], loading={"phi": Ramp(start=0.9, rate=-0.1)})
    trajectory = run(scene, 9.0)
    lost = 1 - math.sqrt(0.5)
    assert trajectory.status == "stopped"
    assert "the heat capacity at T was lost" in trajectory.reason
    assert trajectory.result.t == pytest.approx((0.9 - lost) / 0.1, rel=1e-3)


def test_the_choice_of_the_reference_side_changes_phi_but_not_the_bonds():
    def bonds(reference: int) -> float:
        sites = Sites(1e18, 2e18, reference)
        pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
        scale = sites.density / 1e18  # the same energy as a function of the number of bonds
        potential = BondEnergy(K_0=2.0 * scale**2, phi_eq=0.3 / scale)
        interface = Interface(Hold(level=300.0), [potential], (), [LinearAffinity(c_r=1e17 / scale)], sites)
        return run(Scene(pair, interface, initial={"phi": 0.0}, T_0=300.0), 1.0).result.y[0] * sites.density

    assert bonds(2) == pytest.approx(bonds(1), rel=1e-9)


ISOTHERMAL = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


def cooled_reservoir() -> Scene:
    pair = Body("lower", Ramp(start=300.0, rate=-100.0)), bodies()[1]
    return Scene(pair, Interface(), [path("lower", "upper", 1.0)], T_0=300.0, initial={"T_2": 300.0})


def shrinking_surface() -> Scene:
    loading = {"J_c": Ramp(start=1.0, rate=-0.5), "p": Hold(level=1.0), "v": Hold(level=1.0)}
    return scenes.perfect_contact([], loading=loading, frictions=[Coulomb(mu=0.1)])


def too_many_bonds() -> Scene:
    return scenes.perfect_contact([BondEnergy(K_0=1.0)], loading={"phi": Ramp(rate=0.4)})


def jump(*values):
    return Table(times=[0.0, 1.0, 1.0, 2.0], values=values)


def with_capacity(potential, pair=None, **more) -> Scene:
    """A medium that stores heat, whose potential has a parameter that varies."""
    interface = Interface("T_c", [potential], **more)
    initial = {"T_1": 300.0, "T_2": 300.0, "T_c": 300.0} | ({"phi": 0.1} if interface.reactions else {})
    heat = [path("interface", "lower", 1.0)]
    return Scene(pair or bodies(), interface, heat, {"p": Ramp(rate=1.0)}, None, 300.0, initial)


BONDS = {"reactions": [Relaxation(tau=1.0)], "sites": SITES}
OF_MEDIUM = Body("lower", "T_1", Quadratic(C=varying(1.0, LinearInTemperature(slope=1e-3)))), bodies()[1]
JUMPING = Body("lower", jump(300, 300, 310, 310), Quadratic(C=1.0)), bodies()[1]
perfect, STEP = scenes.perfect_contact, jump(0.5, 0.5, 0.6, 0.6)
REFUSED = [
    (perfect([BondEnergy(K_0=1.0)], [Relaxation(tau=1.0)], -0.1), r"initial phi = .* is outside its range: 0 to 1"),
    (perfect([BondEnergy(K_0=1.0)], [Relaxation(tau=1.0)], 1.1), r"initial phi = .* is outside its range: 0 to 1"),
    (perfect([], T=0.0), "is not an absolute temperature above zero"),
    (perfect([], T=-1.0), "is not an absolute temperature above zero"),
    (perfect([NormalStiffness(E_n=1e9)], loading={"g_n": STEP}), "g_n stores energy, so it cannot jump"),
    (perfect([BondEnergy(K_0=1.0)], loading={"phi": STEP}), "phi stores energy, so it cannot jump"),
    (Scene(JUMPING, Interface(), [path("lower", "upper", 1.0)], T_0=300.0, initial={"T_2": 300.0}), "T_1 stores energ"),
    (with_capacity(BondEnergy(K_0=varying(1.0, Linear(of="p", slope=1e-6))), **BONDS), "with p, which its balance doe"),
    (with_capacity(InterfaceCapacity(C_c=varying(1.0, LinearInTemperature(of="T_1", slope=1e-3)))), "varies with T_1"),
    (with_capacity(InterfaceCapacity(C_c=1.0), OF_MEDIUM), r"quadratic varies with T_c.*It may vary with T_1"),
    (perfect([NormalStiffness(E_n=varying(1e9, Power(of="g_n", exponent=2.0)))], loading={"g_n": Hold(level=1e-6)}),
     "the factor power is one of temperature; of: g_n is none"),
    (Scene(ISOTHERMAL, Interface(), T_0=300.0), "there is nothing to solve: everything is prescribed"),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_makes_no_sense_is_refused(scene, message):
    with pytest.raises(InputError, match=message):
        run(scene, 1.0)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (cooled_reservoir, "the temperature T_1 reached zero"),
        (shrinking_surface, "the area stretch J_c reached zero"),
        (too_many_bonds, "phi rose above its bound 1"),
    ],
)
def test_prescribed_variables_stay_in_their_range(scene, reason):
    trajectory = run(scene(), 10.0)
    assert trajectory.status == "stopped"
    assert reason in trajectory.reason
    assert np.isfinite(trajectory.outputs).all()


def test_bonds_that_pass_their_bound_leave_finite_numbers():
    """A fractional order would make a number of what rounding has carried beyond complete bonding."""
    reaction = Arrhenius(A=1.0, n=0.5)
    trajectory = run(scenes.perfect_contact([LinearEnthalpy(H_r=1.0)], [reaction], energy=Constant), 10.0)
    assert np.isfinite(trajectory.outputs).all()
    assert np.isfinite(trajectory.result.ledger_outputs).all()


def test_fluxes_where_a_shared_temperature_is_prescribed():
    """What the interface gives off is what the bodies receive: q_1 + q_2 = D - dU_c/dt."""
    loading = {"v": Hold(level=0.1), "p": Hold(level=1e6)}
    interface = Interface("T_1", [InterfaceCapacity(C_c=3.0)], [Coulomb(mu=0.3)])
    heat = [path("interface", "upper", 100.0)]
    pair = Body("lower", "T_1", Quadratic(C=1000.0)), Body("upper", "T_2", Quadratic(C=50.0))
    scene = Scene(pair, interface, heat, loading | {"T_1": Ramp(start=300.0, rate=1.0)}, None, 300.0, {"T_2": 290.0})
    trajectory = run(scene, 2.0)
    values = trajectory.everywhere
    stored = 3.0 / 300.0 * values("T_1") * 1.0
    assert values("q_1") + values("q_2") == pytest.approx(values("D_coulomb") - stored, rel=1e-12)
