"""Adhesion and friction in shear: in parallel or in series, held against plain models and closed forms."""

import math

import numpy as np
import pytest
from scenes import SITES, together
from scipy.integrate import solve_ivp
from solved import closed
from zoo import pairwise

import surfacechem
from surfacechem.laws.cohesive import AdhesionIntensity, AdhesionLoss, ExponentialCohesiveZone, XuNeedleman
from surfacechem.laws.free_energy import Penalty, TangentialStiffness
from surfacechem.laws.friction import BondedCoulomb, Coulomb, Stribeck
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.radau.solver import consistent

MU, C, W, B, E_N = 0.3, 1e12, 1.0, 0.01, 1e15
OVERLAP = 2e-9
P = E_N * OVERLAP
RATE, END = 1e-6, 4.0
ADHESION = AdhesionIntensity(C_N=C, C_T=C, w=W, E_n=E_N)
ZONE = ExponentialCohesiveZone(t_max=1e6, g_0=1e-6, E_n=E_N)
COUPLED = XuNeedleman(Phi_n=math.e, g_0=1e-6, g_t0=1e-6)
DRIVE = {"w_t": Ramp(rate=RATE)}
STIFF = Mounting(k=1e14)
DRY = (Coulomb(mu=MU),)


def scene(potentials, frictions=DRY, loading=DRIVE, mount=STIFF):
    loss = [AdhesionLoss(b=B)] if any(isinstance(law, AdhesionIntensity) for law in potentials) else []
    loads, start = {"g_n": Hold(level=-OVERLAP)} | loading, {"phi": 1.0} if loss else {}
    return together(potentials, frictions, loads, start, loss, sites=SITES, tangential=mount)


def solve(made, times=END):
    return closed(made, times, exact=1e-7, outputs=401)


# -- Raous, Cangemi & Cocu with friction on the unbonded part: plain models -----------------------------------------

K = 1e12
ORACLE = {"method": "LSODA", "rtol": 1e-11, "atol": 1e-13}


def lost(phi, u, g_e=0.0, stiffness=0.0):
    """Rate at which adhesion is lost [1/s]."""
    return -max(phi * C * u**2 - W - stiffness * g_e**2 / 2, 0.0) / B


def traction(phi, u):
    return phi**2 * C * u + (1 - phi) * MU * P


def by_prescribed_gap(t, y):
    phi = y[0]
    return [lost(phi, RATE * t)]


def by_spring(t, y):
    phi = y[0]
    return [lost(phi, at_rest(phi, t))]


def at_rest(phi, t):
    return (K * RATE * t - (1 - phi) * MU * P) / (K + phi**2 * C)


def by_damper(t, y, c=1e9):
    phi, u = y
    return [lost(phi, u), max(K * (RATE * t - u) - traction(phi, u), 0.0) / c]


def by_mass(t, y, c=1e9, m=1e4):
    phi, u, v = y
    return [lost(phi, u), v, (K * (RATE * t - u) - traction(phi, u) - c * v) / m]


MODELS = {
    "prescribed gap": (by_prescribed_gap, [1.0], {"loading": {"g_t": Ramp(rate=RATE)}, "mount": None}),
    "prescribed displacement": (by_prescribed_gap, [1.0], {"loading": {"u_t": Ramp(rate=RATE)}, "mount": None}),
    "spring": (by_spring, [1.0], {"mount": Mounting(k=K)}),
    "damper": (by_damper, [1.0, 0.0], {"mount": Mounting(k=K, c_g=1e9)}),
    "mass": (by_mass, [1.0, 0.0, 0.0], {"mount": Mounting(k=K, c_g=1e9, m=1e4)}),
}


@pytest.mark.parametrize("name", MODELS)
def test_adhesion_that_is_lost_beside_friction(name):
    """Bonds, displacement, traction and the heat of both against SciPy, however the gap is moved."""
    model, start, given = MODELS[name]
    found = solve(scene([ADHESION], **given))
    times = found.result.times
    oracle = solve_ivp(
        lambda t, y: [*model(t, y[:-1]), heat(model, t, y)], (0, END), [*start, 0.0], **ORACLE, t_eval=times
    )
    phi, rubbed = oracle.y[0], oracle.y[-1]
    u = oracle.y[1] if len(start) > 1 else at_rest(phi, times) if name == "spring" else RATE * times
    assert np.all(np.diff(u) > 0), "the plain models slide forward only"
    np.testing.assert_allclose(found["phi"], phi, rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(found["t_t"], traction(phi, u), rtol=1e-6, atol=1e-2)
    assert found.booked("heat_coulomb") == pytest.approx(rubbed[-1], rel=1e-6)
    assert found["t_t"].max() > 0.99 * math.sqrt(W * C)
    assert phi[-1] < 0.1


def heat(model, t, y):
    """Power of friction [W/m^2]."""
    phi = y[0]
    if model is by_prescribed_gap:
        v = RATE
    elif model is by_spring:
        (change,) = model(t, y[:1])
        v = (K * RATE + change * MU * P - 2 * phi * change * C * at_rest(phi, t)) / (K + phi**2 * C)
    else:
        v = model(t, y[:-1])[1] if model is by_damper else y[2]
    return (1 - phi) * MU * P * v


@pytest.mark.parametrize("stiffness", [1e12, 1e16])
def test_elastic_contact_beside_adhesion(stiffness):
    """The unbonded part sticks elastically, then slides; rigid friction is the limit of a stiff contact."""
    made = scene([ADHESION, TangentialStiffness(E_t=stiffness)], loading={"u_t": Ramp(rate=RATE)}, mount=None)
    found = solve(made)

    def rate(t, y):
        g_e = min(RATE * t, MU * P / stiffness)
        return [lost(y[0], RATE * t, g_e, stiffness)]

    phi = solve_ivp(rate, (0, END), [1.0], **ORACLE, t_eval=found.result.times).y[0]
    u = RATE * found.result.times
    np.testing.assert_allclose(found["phi"], phi, rtol=1e-7, atol=1e-8)
    expected = phi**2 * C * u + (1 - phi) * np.minimum(stiffness * u, MU * P)
    np.testing.assert_allclose(found["t_t"], expected, rtol=1e-6, atol=1e-2)
    (slip,) = found.jumps
    assert slip.t == pytest.approx(MU * P / stiffness / RATE, rel=1e-9)
    if stiffness == 1e16:
        rigid = solve(scene([ADHESION], loading={"u_t": Ramp(rate=RATE)}, mount=None))
        # What the contact stores delays the loss, by its part of the energy of adhesion.
        stored = (MU * P) ** 2 / (2 * stiffness * W)
        np.testing.assert_allclose(found["t_t"][1:], rigid["t_t"][1:], rtol=2 * stored)


# -- reversible zones: closed forms --------------------------------------------------------------------------------


def shear_of_zone(u):
    return 1e6 * u / 1e-6 * np.exp(1 - u / 1e-6)


def shear_of_coupled(u):
    """Of a zone that is held closed, so that pressure and shear do not act on each other but through its stiffness."""
    x = OVERLAP / 1e-6
    return 2 * math.e * u / 1e-12 * np.exp(-((u / 1e-6) ** 2)) * math.exp(x) * (1 - x)


@pytest.mark.parametrize(
    ("zone", "shear", "given"),
    [(ZONE, shear_of_zone, {"loading": {"g_t": Ramp(rate=RATE)}, "mount": None}), (COUPLED, shear_of_coupled, {})],
    ids=["prescribed", "on a stiff spring"],
)
def test_a_zone_and_friction_add_up(zone, shear, given):
    """The traction is that of the zone at the displacement plus friction; the work both, the heat friction's alone."""
    found = solve(scene([zone], **given))
    u = RATE * found.result.times if "loading" in given else found["u_t"]
    p = found["p"][0]
    moves = u > 0
    assert p == pytest.approx(P, rel=0.01) or zone is COUPLED
    np.testing.assert_allclose(found["t_t"][moves], shear(u[moves]) + MU * p_of(found)[moves], rtol=1e-8)
    assert found.booked("heat_coulomb") == pytest.approx(np.trapezoid(MU * p_of(found), u), rel=2e-3)


def p_of(trajectory):
    return np.maximum(trajectory["p"], 0)


# -- the arrangement and its name ----------------------------------------------------------------------------------


def role(made, name):
    return next(item.by for item in assemble(made).roles if item.variable == name)


def test_both_arrangements_have_a_name():
    """In series friction bears what the zone would: the weaker of the two."""
    assert role(scene([ZONE]), "t_a") == "exponential-cohesive-zone in parallel with friction"
    in_series = ExponentialCohesiveZone(t_max=1e6, g_0=1e-6, E_n=E_N, shear="series")
    assert role(scene([in_series]), "g_t") == "exponential-cohesive-zone in series with friction"
    bearing = Penalty(E_n=E_N)
    elastic = scene([bearing, TangentialStiffness(E_t=1e12)])
    assert role(elastic, "g_t") == "tangential-stiffness in series with friction"
    beside = scene([bearing, TangentialStiffness(E_t=1e12, shear="parallel")])
    assert role(beside, "t_a") == "tangential-stiffness in parallel with friction"
    assert role(scene([ZONE], frictions=()), "g_t") == "exponential-cohesive-zone"
    found = solve(scene([in_series]))
    assert found["t_t"].max() == pytest.approx(MU * P, rel=1e-9)
    normal = ExponentialCohesiveZone(t_max=1e6, g_0=1e-6, E_n=E_N, shear="none")
    np.testing.assert_array_equal(solve(scene([normal]))["t_t"][1:], MU * P)


def test_bonds_that_break_as_sliding_starts_take_the_adhesion_with_them():
    law = BondedCoulomb(mu=0.3, mu_b=0.7, mu_ub=0.4)
    (warning,) = [text for text in assemble(scene([ADHESION], [law])).warnings if "breaks all bonds" in text]
    assert warning.startswith("bonded-coulomb")
    assert "adhesion-intensity" in warning
    assert not [text for text in assemble(scene([ADHESION])).warnings if "breaks all bonds" in text]


def test_steps_end_where_the_stiffness_of_a_pressed_zone_has_its_peak():
    """Work on a zone that swings through zero shear, held against its energy."""
    made = scene([ZONE], loading={"u_t": Harmonic(amplitude=3e-6, frequency=0.4)}, mount=None)
    found = solve(made, times=np.linspace(0, 3.1, 11))
    end = 3e-6 * math.sin(2 * math.pi * 0.4 * 3.1)
    work = ZONE.energy(g_n=-OVERLAP, g_t=end) - ZONE.energy(g_n=-OVERLAP, g_t=0.0)
    assert found.booked("W_u_t") == pytest.approx(work, rel=1e-8)


# -- in the plane of the interface ---------------------------------------------------------------------------------

ANGLE = 0.6
HEAVY = Mounting(k=1e13, m=1e4, c_b=1e9)


def at_an_angle(potentials, frictions, mount, angle=ANGLE):
    across = {"w_t2": Ramp(rate=RATE * math.sin(angle))}
    return scene(potentials, frictions, {"w_t": Ramp(rate=RATE * math.cos(angle))} | across, mount)


@pytest.mark.parametrize(("potential", "mount"), [(ADHESION, HEAVY), (COUPLED, Mounting(k=1e13, c_b=1e9))])
def test_adhesion_is_the_same_in_all_directions(potential, mount):
    """Pulled at an angle the interface moves along the pull, as it does along an axis."""
    straight = solve(scene([potential], mount=mount))
    turned = solve(at_an_angle([potential], (Coulomb(mu=MU),), mount))
    for axis, part in (("t", math.cos(ANGLE)), ("t2", math.sin(ANGLE))):
        np.testing.assert_allclose(turned[f"u_{axis}"], part * straight["u_t"], rtol=1e-6, atol=1e-15)
        np.testing.assert_allclose(turned[f"t_{axis}"], part * straight["t_t"], rtol=1e-6, atol=1e-1)


def on_an_elastic_gap(loading, friction="coulomb: {mu: 0.5}", more=()):
    """Friction in series with 1 GPa/mm, as is loaded, without anything else that moves along."""
    case = f"""
    T_0: 300 K
    bodies: {{lower: {{temperature: 300 K}}, upper: {{temperature: 300 K}}}}
    interface:
      temperature: 300 K
      potential: [{{tangential-stiffness: {{E_t: 1 GPa/mm}}}}]
      friction: [{{{friction}}}]
    loading: {loading}
    run: {{until: 2 s}}
    """
    return surfacechem.run(case, more)


RAMP = "{p: 2 MPa, F_t: {ramp: {start: 0 MPa, rate: 1 MPa/s}}}"


def test_without_a_load_nothing_has_to_be_borne():
    loading = "{p: {ramp: {start: 0 MPa, rate: 2 MPa/s}}, F_t: {ramp: {start: 0 MPa, rate: 0.9 MPa/s}}}"
    assert on_an_elastic_gap(loading).status == "finished"


@pytest.mark.parametrize(
    ("mu_b", "mu_ub", "end", "breaks"), [(0.5, 0.2, 0.7, []), (0.2, 0.5, 1.0, [0.7])], ids=["weaker", "stronger"]
)
def test_a_dead_load_is_held_once_more_where_friction_is_larger_without_bonds(mu_b, mu_ub, end, breaks):
    """Half of all bonds help to stick."""
    bonds = ["interface.sites=1e18 1/m^2", "interface.bonding=[{mass-action: {k_on: 0 1/s, k_off: 1e-9 1/s}}]"]
    friction = f"bonded-coulomb: {{mu: 0.1, mu_b: {mu_b}, mu_ub: {mu_ub}}}"
    found = on_an_elastic_gap(RAMP, friction, [*bonds, "initial={phi: 0.5}"])
    assert "the dead load exceeds what sticking bears" in found.reason
    assert found.trajectory.result.t == pytest.approx(end, rel=1e-9)
    assert [jump.t for jump in found.trajectory.jumps] == pytest.approx(breaks, rel=1e-9)
    assert found.trajectory.result.y[0] == pytest.approx(0.0 if breaks else 0.5, abs=1e-9)


STRIBECK = """
T_0: 300 K
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface:
  temperature: 300 K
  friction: [{stribeck: {mu_s: MU_S, mu_k: 0.5, v_s: 1 mm/s, delta: DELTA}}]
mechanics: {tangential: {k: 1 MPa/mm, c_b: 1e3 Pa s/m}}
loading: {p: 1 MPa, w_t: {ramp: {start: 0 mm, rate: 1 mm/s}}}
run: {until: 2 s}
"""


@pytest.mark.parametrize("delta", [0.3, 1.0])
def test_friction_that_falls_as_soon_as_sliding_begins_has_no_velocity(delta):
    """As steeply as at once, or more: without a mass nothing says how fast it slides."""
    found = surfacechem.run(STRIBECK.replace("DELTA", str(delta)).replace("MU_S", "0.7"))
    assert found.status == "stopped"
    assert "no steady sliding velocity" in found.reason
    assert "more viscous resistance would give one, so would a mass at" in found.reason
    assert found.trajectory.result.t == pytest.approx(0.7, rel=1e-5)


@pytest.mark.parametrize("v", [1e-15, 0.0, -1e-15])
def test_a_velocity_that_rounding_has_against_the_sliding_is_as_unstable_as_rest(v):
    model = surfacechem.load(STRIBECK.replace("DELTA", "0.5").replace("MU_S", "0.7")).model
    values = model.values()
    parameters = [values[p.path] if p.path != "mode.slip" else 1.0 for p in model.system.parameters]
    (stable,) = [j for j, margin in enumerate(model.margins) if margin.name == "stable v"]
    assert model.program.margins(np.array([0.0, 0.0, v, 0.0, 0.0, *parameters]))[stable] < 0


@pytest.mark.parametrize("across", ["", "w_t2: {harmonic: {amplitude: 0.3 mm, frequency: 0.7 Hz}}, "])
@pytest.mark.parametrize(("delta", "damper"), [(0.5, "2e8 Pa s/m"), (2, "1e8 Pa s/m")])
def test_sliding_that_slows_down_to_a_fold_of_the_velocity_does_not_stop_there(delta, damper, across):
    case = STRIBECK.replace("DELTA", str(delta)).replace("MU_S", "0.7").replace("1e3 Pa s/m", damper)
    case = case.replace("p: 1 MPa, ", f"p: 1 MPa, {across}")
    found = surfacechem.run(case, "loading.w_t={harmonic: {amplitude: 3 mm, frequency: 1 Hz}}")
    assert "no steady sliding velocity" in found.reason
    assert [jump.edge.name.split()[0] for jump in found.trajectory.jumps] == ["slip"]
    assert found.dataset["v"][-1] > 1e-4  # m/s


def test_a_run_that_ends_at_its_start_has_the_state_there(tmp_path):
    text = STRIBECK.replace("DELTA", "0.7").replace("MU_S", "0.7").replace(", c_b: 1e3 Pa s/m", "")
    found = surfacechem.run(text, "loading.w_t=-1 mm")
    assert "no steady sliding velocity" in found.reason
    assert found.dataset["time"].values.tolist() == [0.0]
    last = [float(found.dataset[name][-1]) for name in ("u_t", "v", "E_spring_t", "T_1")]
    assert last == pytest.approx([0.0, 0.0, 500.0, 300.0])
    assert found.accuracy.source == "unknown: the run ended at its start"
    assert found.write(tmp_path / "start.nc").exists()


def test_a_mass_beside_an_elastic_gap_is_not_asked_for():
    """It is given: elastic sticking takes it from the velocity of sliding."""
    friction = "stribeck: {mu_s: 0.7, mu_k: 0.5, v_s: 1 mm/s, delta: 0.3}"
    drive = "{p: 1 MPa, w_t: {ramp: {start: 0 mm, rate: 20 mm/s}}}"
    found = on_an_elastic_gap(drive, friction, ["mechanics={tangential: {m: 5e3 kg/m^2, k: 1 MPa/mm}}"])
    assert found.status == "stopped"
    assert "so would a mass if sticking were exact, without an elastic gap g_t at" in found.reason


@pytest.mark.parametrize("more", [[], ["interface.potential=[{tangential-stiffness: {E_t: 1 MPa/um}}]"]])
@pytest.mark.parametrize("damper", ["1e3 Pa s/m", "0 Pa s/m"])
def test_friction_that_grows_with_velocity_from_rest_on_slides_as_fast_as_is_pulled(damper, more):
    case = STRIBECK.replace("DELTA", "1").replace("MU_S", "0.4").replace("1e3 Pa s/m", damper)
    found = surfacechem.run(case, more)
    assert found.status == "finished"
    assert found.accuracy.error < 1e-8
    # In the end as fast as the far field, by friction of mu_k less a part e^-1 of what it has grown by.
    assert found["v"][-1] == pytest.approx(1e-3, rel=1e-6)
    assert found["t_stribeck"][-1] == pytest.approx(1e6 * (0.5 - 0.1 / np.e), rel=1e-6)


@pytest.mark.parametrize("friction", ["coulomb", "mohr-coulomb"])
def test_a_contact_that_lands_while_it_is_pulled_the_other_way_slides_on(friction):
    """It slid backward as it was let go; a bond still pulls, so that the net pressure is below that of the contact."""
    found = surfacechem.run(f"""
bodies: {{a: {{temperature: 300 K}}, b: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  potential: [exponential-cohesive-zone: {{t_max: 0.1 MPa, g_0: 1 um, E_n: 1 MPa/um, shear: none}}]
  friction: [{friction}: {{mu: 0.3, pressure: contact}}]
mechanics: {{normal: {{k: 1 MPa/um, c_g: 1 kPa s/um}}, tangential: {{k: 1 MPa/um}}}}
loading:
  w_n: {{table: {{times: [0, 10 ms, 20 ms], values: [-2 um, 2 um, -2 um]}}}}
  w_t: {{table: {{times: [0, 7 ms, 20 ms], values: [0, -2 um, 3 um]}}}}
initial: {{g_n: -1 um}}
run: {{until: 20 ms}}
""")
    assert found.status == "finished"
    assert found["slip"][-1] == 1.0
    assert found["t_t"][-1] == pytest.approx(0.3 * float(found["p_contact"][-1]), rel=1e-10)
    assert found.accuracy.error < 1e-10


PRESSED = {
    "pressure": ({"p": [0.0, 1e6, 1e6, 0.0, 0.0, 0.0, 5e6]}, {}),
    "given gap": ({"g_n": [0.0, -1e-6, -1e-6, 0.0, 1e-6, 0.0, -5e-6]}, {"penalty": {"E_n": 1e12}}),
    "spring": ({"w_n": [0.0, -2e-6, -2e-6, 0.0, 1e-6, 0.0, -10e-6]}, {"penalty": {"E_n": 1e12}}),
    "rigid": ({"w_n": [0.0, -1e-6, -1e-6, 0.0, 1e-6, 0.0, -5e-6]}, {}),
}
"""Loads by which the pressure falls to zero at 2 s, and grows by 1 MPa/s from 4 s on; the potential that bears them."""


DRIVES, STIFFNESSES = [(1e-4, 1), (4.2e-4, -1), (7e-4, 1)], [{}, {"tangential-stiffness": {"E_t": 3e9}}]


@pytest.mark.parametrize(("by", "drive", "stiffness"), pairwise([*PRESSED], DRIVES, STIFFNESSES))
def test_a_contact_closes_on_a_drive_that_has_reversed_in_the_air(by, drive, stiffness):
    """It slides on with the drive, by sliding friction, if that grows slower than the pull; else it sticks.

    The pull grows slower than what sticking bears, but for the fastest drive.
    """
    (load,), potentials = PRESSED[by][0].items(), PRESSED[by][1] | stiffness
    k = 1e9 if not stiffness else 1 / (1 / 1e9 + 1 / 3e9)
    rate, side = drive[0] * 1e9 / k, drive[1]
    drive = {"times": [0.0, 3.0, 9.0], "values": [0.0, side * 3e-3, side * (3e-3 - 6 * rate)]}
    loads = {load[0]: {"table": {"times": [0.0, 0.1, 1.0, 2.0, 3.0, 4.0, 9.0], "values": load[1]}}}
    case = {
        "bodies": {"slider": {"temperature": 300}, "base": {"temperature": 300}},
        "interface": {
            "potential": [{name: values} for name, values in potentials.items()],
            "friction": [{"coulomb": {"mu": 0.3, "mu_s": 0.5}}],
        },
        "mechanics": {"tangential": {"k": 1e9}} | ({"normal": {"k": 1e12}} if load[0] == "w_n" else {}),
        "loading": {"w_t": {"table": drive}} | loads,
        "run": {"until": 9.0},
    }
    found = surfacechem.load(case).run(error="balances")
    assert found.status == "finished"
    pull = min(k * rate, 0.3e6)
    late = np.asarray(found.dataset.time) > 4.01
    np.testing.assert_allclose(found["t_t"][late], -side * pull * (found.dataset.time[late] - 4.0), rtol=1e-8)


@pytest.mark.parametrize(("depth", "rtol"), [("2 um", 1e-11), ("3 um", 1e-12), ("2 um", 1e-13)])
def test_a_contact_that_closes_at_rest_sticks_whatever_roundoff_says(depth, rtol):
    """Adhesion beside friction is stiffest at touch, so that the interface rests there for a moment."""
    found = surfacechem.run(f"""
bodies: {{a: {{temperature: 300 K}}, b: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  potential: [exponential-cohesive-zone: {{t_max: 1.6 MPa, g_0: 1 um, E_n: 5 MPa/um}}]
  friction: [coulomb: {{mu: 0.4, mu_s: 0.6}}]
mechanics: {{normal: {{k: 7 MPa/um, m: 3.6e10 kg/m^2, c_g: 3e11 Pa s/m}}, tangential: {{k: 0.5 MPa/um}}}}
loading:
  w_n: {{table: {{times: [0 s, 1 s, 4 s], values: [2 um, 2 um, -{depth}]}}}}
  w_t: {{table: {{times: [0 s, 1 s], values: [0 um, 3 um]}}}}
initial: {{g_n: 1.8 um}}
run: {{until: 4 s, rtol: {rtol}}}
""")
    assert sorted(jump.edge.name for jump in found.trajectory.jumps) == ["slip forward", "stop", "touch"]


def test_an_elastic_slip_is_at_rest_where_the_bodies_have_come_apart():
    """The bond pulls harder as the gap opens, and no pressure falls with it."""
    found = surfacechem.run("""
bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}
interface:
  temperature: 300 K
  potential:
    - exponential-cohesive-zone: {t_max: 0.1 MPa, g_0: 1 um, E_n: 1 MPa/um, shear: none}
    - tangential-stiffness: {E_t: 1 MPa/um}
  friction: [coulomb: {mu: 0.3}]
mechanics: {normal: {k: 1 MPa/um}, tangential: {k: 1 MPa/um, m: 1e3 kg/m^2}}
loading: {w_n: {table: {times: [0, 10 ms], values: [-2 um, 2 um]}}, w_t: {ramp: {rate: 0.3 mm/s}}}
run: {until: 6 ms}
""").trajectory
    model, (*_, release) = found.model, found.jumps
    assert release.edge.name == "release"
    after, column = release.after, model.system.state_columns["g_t"]
    rates = consistent(model.program, np.array([after.t]), after.y[None], 0.0, after.parameters[None]).ydot[0]
    assert rates[column] == 0


TURNING = """
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface:
  temperature: T_c
  friction: [{stribeck: {mu_s: 0.7, mu_k: 0.5, v_s: 1 mm/s}}]
heat: [{conductance: {between: [lower, interface], h: 100 kW/m^2/K}}]
mechanics: {tangential: {k: 1 MPa/mm, c_b: 3e8 Pa s/m}}
loading: {p: 1 MPa, w_t: {harmonic: {amplitude: 2 mm, frequency: FREQUENCY}}}
run: {until: END}
"""


@pytest.mark.parametrize("frequency", [5e-4, 1.0913e-3, 1.42174e-3])
def test_rounding_of_a_velocity_from_balances_neither_ends_sliding_as_it_begins_nor_hides_how_fast_it_is(frequency):
    """A damper that resists more than friction falls: as sliding begins the velocity is the rounding of tractions."""
    found = surfacechem.run(TURNING.replace("FREQUENCY", f"{frequency} Hz").replace("END", f"{1.2 / frequency} s"))
    assert found.status == "finished"
    assert found.accuracy.error < 1e-7
    events = [jump.edge.name for jump in found.trajectory.jumps]
    assert events == ["slip forward", "stop", "slip backward", "stop", "slip forward"]


HELD = {"times": [0.0, 3.0, 6.0, 9.0], "values": [0.0, 1e-3, 1e-3, 2e-3]}
DROP = {
    "p": {"table": {"times": [0.0, 4.0, 4.0, 9.0], "values": [1e6, 1e6, 5e5, 5e5]}},
    "w_t": {"table": HELD | {"values": [0.0, 4e-4, 4e-4, 1.4e-3]}},
}
"""A load that drops lets it slip, and it rests at once."""


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"p": 1e6}, {"slip forward": [1.5, 6.6], "stop": [3.0]}),
        ({"p": 1e6, "E_t": 3e9}, {"slip forward": [2.0, 6.8], "stop": [3.0]}),
        ({"w_n": -1e-6, "E_n": 9e12}, {"slip forward": [1.35, 6.54], "stop": [3.0]}),
        (DROP, {"slip forward": [4.0, 6.3], "stop": [4.0]}),
    ],
)
def test_what_a_drive_that_rests_has_left_sticks(changes, expected):
    """Slide, hold, slide: each slide begins at the static limit."""
    laws = {name: changes[name] for name in ("E_t", "E_n") if name in changes}
    kinds = {"E_t": "tangential-stiffness", "E_n": "penalty"}
    case = {
        "bodies": {"slider": {"temperature": 300}, "base": {"temperature": 300}},
        "interface": {
            "potential": [{kinds[name]: {name: value}} for name, value in laws.items()],
            "friction": [{"coulomb": {"mu": 0.3, "mu_s": 0.5}}],
        },
        "mechanics": {"tangential": {"k": 1e9}} | ({"normal": {"k": 1e12}} if "E_n" in laws else {}),
        "loading": {"w_t": {"table": HELD}} | {name: load for name, load in changes.items() if name not in laws},
        "run": {"until": 9.0},
    }
    run = surfacechem.run(case)
    names, times = run.dataset.event_name.values, run.dataset.event_time.values
    assert {name: times[names == name].tolist() for name in np.unique(names) if name != "load"} == {
        name: pytest.approx(each, rel=1e-12) for name, each in expected.items()
    }
    assert run.accuracy.error < 1e-12


@pytest.mark.parametrize("rtol", [1e-9, 1e-11])
def test_slip_begins_from_the_roundoff_of_loads_that_cancel(rtol):
    """Drive and friction are equal there: the velocity is their roundoff over the damping, and grows from it."""
    k, c_b, c_v, mu, mean, swing, omega, phase = 1e11, 1e10, 2e10, 0.5, 6e4, 4e4, 0.5 * np.pi, -np.pi
    pressure = Harmonic(mean=mean, amplitude=swing, frequency=0.25, phase=phase)
    loading = {"p": pressure, "w_t": Table(times=[0.0, 2.0], values=[0.0, 2e-6])}
    friction = Stribeck(mu_s=mu, mu_k=mu, v_s=1e-6, c_v=c_v)
    warm, mount = Hold(level=300.0), Mounting(k=k, c_b=c_b)
    pair, interface = (Body("lower", warm), Body("upper", warm)), Interface(warm, (), [friction])
    found = closed(Scene(pair, interface, loading=loading, T_0=300.0, tangential=mount), 1.0, rtol=rtol)
    (begins,) = (jump.t for jump in found.of("slip"))

    def forced(t):
        wave = np.exp(1j * (omega * t + phase)) / (k + 1j * omega * (c_b + c_v))
        return 1e-6 * (t - c_v / k) - mu * (mean / k + swing * wave.imag)

    times = found.result.times
    left = forced(begins) * np.exp(-k * (times - begins) / (c_b + c_v))
    exact = np.where(times > begins, forced(times) - left, 0.0)
    np.testing.assert_allclose(found["u_t"], exact, rtol=0, atol=10 * rtol * exact.max())
