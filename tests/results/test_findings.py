"""Dangerous regimes end as theory says they do: refused, stopped with the true reason, or solved."""

import json
import math

import numpy as np
import pytest
import scenes
import tables
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


def capacity_scene(regime: str, C_c: float, K_2: float, phi: float) -> Scene:
    potentials = ([BondEnergy(K_2=K_2)] if K_2 else []) + ([InterfaceCapacity(C_c=C_c)] if C_c else [])
    reactions = [Relaxation(tau=1.0)] if K_2 else []
    if regime == "perfect":
        return scenes.perfect_contact(potentials, reactions, phi)
    heat = [path("interface", "lower", 100.0), path("interface", "upper", 100.0)]
    initial = (
        {"T_1": 300.0, "T_2": 300.0} | ({"T_c": 300.0} if potentials else {}) | ({"phi": phi} if reactions else {})
    )
    return Scene(
        bodies(C_1=1.0, C_2=1.0), Interface("T_c", potentials, (), reactions, SITES), heat, {}, None, 300.0, initial
    )


def capacity_rows():
    data = json.loads((tables.FOLDER / "x02_capacity_validity.json").read_text())
    return [pytest.param(*row[1:2], *map(float, row[2:5]), row[6], id=row[0]) for row in data["rows"]]


@pytest.mark.parametrize(("regime", "C_c", "K_2", "phi", "verdict"), capacity_rows())
def test_a_capacity_must_be_positive(regime, C_c, K_2, phi, verdict):
    scene = capacity_scene(regime, C_c, K_2, phi)
    if verdict.startswith("accept"):
        trajectory = run(scene, 1.0)
        assert trajectory.status == "finished"
        assert any(state.algebraic for state in trajectory.model.system.states) == ("algebraic" in verdict)
    else:
        with pytest.raises(InputError, match=r"at the start the heat capacity at T(_c)? was lost"):
            run(scene, 1.0)


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


def test_bonding_ends_at_the_sites_of_the_poorer_side():
    sites = Sites(1e18, 4e17, 1)
    pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
    interface = Interface(Hold(level=300.0), [BondEnergy(K_0=1.0)], (), [Relaxation(tau=1.0)], sites)
    trajectory = run(Scene(pair, interface, initial={"phi": 0.0}, T_0=300.0), 10.0)
    (complete,) = trajectory.jumps
    assert complete.edge.name == "complete"
    assert complete.t == pytest.approx(-math.log(0.6), rel=1e-9)
    assert trajectory.status == "finished"
    assert trajectory.result.y[0] == 0.4


def test_the_choice_of_the_reference_side_changes_phi_but_not_the_bonds():
    def bonds(reference: int) -> float:
        sites = Sites(1e18, 2e18, reference)
        pair = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
        scale = sites.density / 1e18  # the same energy as a function of the number of bonds
        potential = BondEnergy(K_0=2.0 * scale**2, phi_eq=0.3 / scale)
        interface = Interface(Hold(level=300.0), [potential], (), [LinearAffinity(c_r=1e17 / scale)], sites)
        return run(Scene(pair, interface, initial={"phi": 0.0}, T_0=300.0), 1.0).result.y[0] * sites.density

    assert bonds(2) == pytest.approx(bonds(1), rel=1e-9)


@pytest.mark.parametrize("phi", [-0.1, 1.1])
def test_phi_outside_its_range_is_refused(phi):
    with pytest.raises(InputError, match=r"initial phi = .* is outside its range: 0 to 1"):
        run(scenes.perfect_contact([BondEnergy(K_0=1.0)], [Relaxation(tau=1.0)], phi), 1.0)


@pytest.mark.parametrize("T", [0.0, -1.0])
def test_temperature_must_be_absolute(T):
    with pytest.raises(InputError, match="is not an absolute temperature above zero"):
        run(scenes.perfect_contact([], T=T), 1.0)


def test_tension_has_no_coulomb_friction():
    def scene(p):
        return scenes.perfect_contact([], frictions=[Coulomb(mu=0.3)], loading={"v": Hold(level=0.1), "p": p})

    with pytest.raises(InputError, match="p fell below zero, where the law coulomb ends"):
        run(scene(Hold(level=-1e3)), 0.1)
    trajectory = run(scene(Ramp(start=1e3, rate=-1e4)), 1.0)
    assert "p fell below zero" in trajectory.reason
    assert trajectory.result.t == pytest.approx(0.1, rel=1e-9)
    assert run(scene(Table(times=[0.0, 0.5], values=[1e3, 0.0])), 1.0).status == "finished"


ISOTHERMAL = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


def cooled_reservoir() -> Scene:
    pair = Body("lower", Ramp(start=300.0, rate=-100.0)), bodies()[1]
    return Scene(pair, Interface(), [path("lower", "upper", 1.0)], T_0=300.0, initial={"T_2": 300.0})


def shrinking_surface() -> Scene:
    loading = {"J_c": Ramp(start=1.0, rate=-0.5), "p": Hold(level=1.0), "v": Hold(level=1.0)}
    return scenes.perfect_contact([], loading=loading, frictions=[Coulomb(mu=0.1)])


def too_many_bonds() -> Scene:
    return scenes.perfect_contact([BondEnergy(K_0=1.0)], loading={"phi": Ramp(rate=0.4)})


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


@pytest.mark.parametrize("name", ["g_n", "phi", "T_1"])
def test_what_stores_energy_cannot_jump(name):
    jump = Table(times=[0.0, 1.0, 1.0, 2.0], values=[0.5, 0.5, 0.6, 0.6] if name != "T_1" else [300, 300, 310, 310])
    scene = {
        "g_n": scenes.perfect_contact([NormalStiffness(E_n=1e9)], loading={"g_n": jump}),
        "phi": scenes.perfect_contact([BondEnergy(K_0=1.0)], loading={"phi": jump}),
        "T_1": Scene((Body("lower", jump, Quadratic(C=1.0)), bodies()[1]), Interface(), [path("lower", "upper", 1.0)],
                     T_0=300.0, initial={"T_2": 300.0}),
    }[name]  # fmt: skip
    with pytest.raises(InputError, match=f"{name} stores energy, so it cannot jump"):
        assemble(scene)


FOREIGN = {
    "p": (BondEnergy(K_0=varying(1.0, Linear(of="p", slope=1e-6))), {"p": Ramp(rate=1.0)}),
    "T_1": (InterfaceCapacity(C_c=varying(1.0, LinearInTemperature(of="T_1", slope=1e-3))), {}),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_an_energy_varies_only_with_what_its_balance_knows(name):
    potential, loading = FOREIGN[name]
    interface = Interface("T_c", [potential], (), [Relaxation(tau=1.0)] if "K" in str(potential) else (), SITES)
    heat = [path("interface", "lower", 1.0)]
    initial = {"T_1": 300.0, "T_2": 300.0, "T_c": 300.0} | ({"phi": 0.1} if interface.reactions else {})
    with pytest.raises(InputError, match=f"varies with {name}, which its balance does not know"):
        assemble(Scene(bodies(), interface, heat, loading, None, 300.0, initial))


def test_a_body_stores_energy_by_its_own_temperature():
    pair = Body("lower", "T_1", Quadratic(C=varying(1.0, LinearInTemperature(slope=1e-3)))), bodies()[1]
    interface = Interface("T_c", [InterfaceCapacity(C_c=1.0)])
    initial = dict.fromkeys(("T_1", "T_2", "T_c"), 300.0)
    scene = Scene(pair, interface, [path("interface", "lower", 1.0)], T_0=300.0, initial=initial)
    with pytest.raises(InputError, match=r"the energy of quadratic varies with T_c.*It may vary with T_1"):
        assemble(scene)


def test_a_factor_of_temperature_is_given_a_temperature():
    potential = NormalStiffness(E_n=varying(1e9, Power(of="g_n", exponent=2.0)))
    with pytest.raises(InputError, match="the factor power is one of temperature; of: g_n is none"):
        assemble(scenes.perfect_contact([potential], loading={"g_n": Hold(level=1e-6)}))


def test_a_scene_with_nothing_to_solve_is_refused():
    with pytest.raises(InputError, match="there is nothing to solve: everything is prescribed"):
        Model(assemble(Scene(ISOTHERMAL, Interface(), T_0=300.0)))


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


@pytest.mark.parametrize("ramp", [True, False])
def test_heat_that_is_drawn_out_is_not_called_ignition(ramp):
    """A path that conducts less as it cools down brings at most h / (e beta); more than that is drawn."""
    beta, h = 0.05, 50.0
    most = h / (math.e * beta)
    drawn = {"Q_c": Ramp(rate=-2 * most) if ramp else Hold(level=-1.01 * most)}
    heat = [path("interface", "lower", varying(h, Exponential(beta=-beta)))]
    trajectory = run(Scene(ISOTHERMAL, Interface("T_c"), heat, drawn, T_0=300.0, initial={"T_c": 300.0}), 1.0, 21)
    assert trajectory.status == "stopped"
    assert trajectory.reason.startswith(
        "runaway cooling: no temperature T_c balances the heat that the interface takes up"
    )
    assert trajectory.result.t == pytest.approx(0.5 if ramp else 0.0, rel=1e-6)
