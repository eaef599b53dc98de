"""Adhesion and friction in shear: in parallel or in series, held against plain models and closed forms."""

import math

import numpy as np
import pytest
from scenes import bodies
from scipy.integrate import solve_ivp
from zoo import pairwise

from surfacechem.errors import InputError
from surfacechem.laws.cohesive import AdhesionIntensity, AdhesionLoss, ExponentialCohesiveZone, XuNeedleman
from surfacechem.laws.contact import Penalty, TangentialStiffness
from surfacechem.laws.friction import BondedCoulomb, Coulomb, RateAndStateAging
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Mounting, Scene, Sites
from surfacechem.solve.run import Model, Run

MU, C, W, B, E_N = 0.3, 1e12, 1.0, 0.01, 1e15
OVERLAP = 2e-9
P = E_N * OVERLAP
RATE, END = 1e-6, 4.0
ADHESION = AdhesionIntensity(C_N=C, C_T=C, w=W, E_n=E_N)
ZONE = ExponentialCohesiveZone(t_max=1e6, g_0=1e-6, E_n=E_N)
COUPLED = XuNeedleman(Phi_n=math.e, g_0=1e-6, g_t0=1e-6)
SITES = Sites(1e18, 1e18)
DRIVE = {"w_t": Ramp(rate=RATE)}
STIFF = Mounting(k=1e14)
DRY = (Coulomb(mu=MU),)


def scene(potentials, frictions=DRY, loading=DRIVE, mount=STIFF, initial=None, **more):
    loss = [AdhesionLoss(b=B)] if any(isinstance(law, AdhesionIntensity) for law in potentials) else []
    interface = Interface("T", potentials, frictions, loss, SITES)
    start = {"T": 300.0} | ({"phi": 1.0} if loss else {}) | (initial or {})
    start = start if loss else {name: value for name, value in start.items() if name != "phi"}
    loads = {"g_n": Hold(level=-OVERLAP)} | loading
    return Scene(bodies("T", "T"), interface, loading=loads, T_0=300.0, initial=start, tangential=mount, **more)


def solve(made, times=None, rtol=1e-11):
    times = np.linspace(0.0, END, 401) if times is None else times
    trajectory = Model(assemble(made)).solve(Run(times=times, rtol=rtol))
    assert trajectory.status == "finished", trajectory.reason
    books = audit(trajectory)
    assert np.abs(books.energy).max() < 1e4 * rtol * W, "beside the work of adhesion"
    assert not books.violations
    return trajectory


def series(trajectory, name):
    states = [state.name for state in trajectory.model.system.states]
    if name in states:
        return trajectory.result.outputs[:, states.index(name)]
    return trajectory.outputs[:, [item.name for item in trajectory.model.system.outputs].index(name)]


def account(trajectory, name):
    return trajectory.result.ledger[[item.quantity.name for item in trajectory.model.system.ledger].index(name)]


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
    np.testing.assert_allclose(series(found, "phi"), phi, rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(series(found, "t_t"), traction(phi, u), rtol=1e-6, atol=1e-2)
    assert account(found, "heat_coulomb") == pytest.approx(rubbed[-1], rel=1e-6)
    assert series(found, "t_t").max() > 0.99 * math.sqrt(W * C)
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


@pytest.mark.parametrize("stiffness", [1e12, 1e14, 1e16])
def test_elastic_contact_beside_adhesion(stiffness):
    """The unbonded part sticks elastically, then slides; rigid friction is the limit of a stiff contact."""
    made = scene([ADHESION, TangentialStiffness(E_t=stiffness)], loading={"u_t": Ramp(rate=RATE)}, mount=None)
    found = solve(made)

    def rate(t, y):
        g_e = min(RATE * t, MU * P / stiffness)
        return [lost(y[0], RATE * t, g_e, stiffness)]

    phi = solve_ivp(rate, (0, END), [1.0], **ORACLE, t_eval=found.result.times).y[0]
    u = RATE * found.result.times
    np.testing.assert_allclose(series(found, "phi"), phi, rtol=1e-7, atol=1e-8)
    expected = phi**2 * C * u + (1 - phi) * np.minimum(stiffness * u, MU * P)
    np.testing.assert_allclose(series(found, "t_t"), expected, rtol=1e-6, atol=1e-2)
    (slip,) = found.jumps
    assert slip.t == pytest.approx(MU * P / stiffness / RATE, rel=1e-9)
    if stiffness == 1e16:
        rigid = solve(scene([ADHESION], loading={"u_t": Ramp(rate=RATE)}, mount=None))
        # What the contact stores delays the loss, by its part of the energy of adhesion.
        stored = (MU * P) ** 2 / (2 * stiffness * W)
        np.testing.assert_allclose(series(found, "t_t")[1:], series(rigid, "t_t")[1:], rtol=2 * stored)


# -- reversible zones: closed forms --------------------------------------------------------------------------------


def shear_of_zone(u):
    return 1e6 * u / 1e-6 * np.exp(1 - u / 1e-6)


def shear_of_coupled(u):
    """Of a zone that is held closed, so that pressure and shear do not act on each other but through its stiffness."""
    x = OVERLAP / 1e-6
    return 2 * math.e * u / 1e-12 * np.exp(-((u / 1e-6) ** 2)) * math.exp(x) * (1 - x)


@pytest.mark.parametrize(
    "given", [{"loading": {"g_t": Ramp(rate=RATE)}, "mount": None}, {}], ids=["prescribed", "on a stiff spring"]
)
@pytest.mark.parametrize(("zone", "shear"), [(ZONE, shear_of_zone), (COUPLED, shear_of_coupled)])
def test_a_zone_and_friction_add_up(zone, shear, given):
    """The traction is that of the zone at the displacement plus friction; the work both, the heat friction's alone."""
    found = solve(scene([zone], **given))
    u = RATE * found.result.times if "loading" in given else series(found, "u_t")
    p = series(found, "p")[0]
    moves = u > 0
    assert p == pytest.approx(P, rel=0.01) or zone is COUPLED
    np.testing.assert_allclose(series(found, "t_t")[moves], shear(u[moves]) + MU * p_of(found)[moves], rtol=1e-8)
    assert account(found, "heat_coulomb") == pytest.approx(np.trapezoid(MU * p_of(found), u), rel=2e-3)


def p_of(trajectory):
    return np.maximum(series(trajectory, "p"), 0)


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
    assert series(found, "t_t").max() == pytest.approx(MU * P, rel=1e-9)
    normal = ExponentialCohesiveZone(t_max=1e6, g_0=1e-6, E_n=E_N, shear="none")
    np.testing.assert_array_equal(series(solve(scene([normal])), "t_t")[1:], MU * P)


MOVED = {
    "prescribed": ({"g_t": Ramp(rate=RATE)}, None),
    "cycles": ({"u_t": Harmonic(amplitude=3e-6, frequency=0.4)}, None),
    "spring": (DRIVE, STIFF),
    "soft spring": (DRIVE, Mounting(k=2e12)),
    "damper": (DRIVE, Mounting(k=1e13, c_b=1e9)),
    "mass": (DRIVE, Mounting(k=1e13, m=1e3, c_b=2e8)),
    "dead load and damper": ({"F_t": Ramp(rate=1e6)}, Mounting(c_g=1e11)),
}
RESISTING = {
    "coulomb": [Coulomb(mu=MU)],
    "static": [Coulomb(mu=0.2, mu_s=0.6)],
    "little": [Coulomb(mu=1e-6)],
    "remembers": [RateAndStateAging(mu_0=0.3, a=0.01, b=0.005, v_0=1e-6, L=1e-7)],
}
ADHERING = {
    "lost": [ADHESION],
    "lost, elastic contact": [ADHESION, TangentialStiffness(E_t=1e13)],
    "zone": [ZONE],
    "coupled": [COUPLED, Penalty(E_n=E_N)],
    "coupled of its own kind": [XuNeedleman(Phi_n=2.0, g_0=1e-6, g_t0=0.5e-6, q=0.6, r=0.2), Penalty(E_n=E_N)],
    "glue": [TangentialStiffness(E_t=1e12, shear="parallel"), Penalty(E_n=E_N)],
}


@pytest.mark.parametrize(("moved", "adhesion", "frictions"), pairwise([*MOVED], [*ADHERING], [*RESISTING]))
def test_friction_never_lowers_the_peak_of_shear(moved, adhesion, frictions):
    loading, mount = MOVED[moved]
    remembers = frictions == "remembers"
    if remembers and (mount is None or moved.startswith("dead")):
        pytest.skip("the age of a contact needs a velocity that does not jump")
    # At complete adhesion nothing rubs, so that friction of a rate has no velocity.
    start = {"theta": 1.0, "v": 1e-9, "phi": 0.999} if remembers else {}
    peaks = []
    for laws in ((), RESISTING[frictions]):
        alone = [law for law in ADHERING[adhesion] if getattr(law, "shear", "parallel") == "parallel"]
        made = scene(ADHERING[adhesion] if laws else alone, laws, loading, mount, start if laws else {})
        found = solve(made, np.linspace(0, END, 1501))
        peaks.append(np.abs(series(found, "t_t" if laws or mount else "t_e")).max())
    assert peaks[1] >= peaks[0] * (1 - 1e-3), "the peak lies between outputs"


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
    assert account(found, "W_u_t") == pytest.approx(work, rel=1e-8)


# -- in the plane of the interface ---------------------------------------------------------------------------------

ANGLE = 0.6
HEAVY = Mounting(k=1e13, m=1e4, c_b=1e9)


def at_an_angle(potentials, frictions, mount, angle=ANGLE):
    across = {"w_t2": Ramp(rate=RATE * math.sin(angle))}
    return scene(potentials, frictions, {"w_t": Ramp(rate=RATE * math.cos(angle))} | across, mount)


@pytest.mark.parametrize("mount", [HEAVY, Mounting(k=1e13, c_b=1e9)], ids=["mass", "damper"])
@pytest.mark.parametrize("potential", [ADHESION, ZONE, COUPLED], ids=lambda law: law.name())
def test_adhesion_is_the_same_in_all_directions(potential, mount):
    """Pulled at an angle the interface moves along the pull, as it does along an axis."""
    straight = solve(scene([potential], mount=mount))
    turned = solve(at_an_angle([potential], (Coulomb(mu=MU),), mount))
    for axis, part in (("t", math.cos(ANGLE)), ("t2", math.sin(ANGLE))):
        np.testing.assert_allclose(series(turned, f"u_{axis}"), part * series(straight, "u_t"), rtol=1e-6, atol=1e-15)
        np.testing.assert_allclose(series(turned, f"t_{axis}"), part * series(straight, "t_t"), rtol=1e-6, atol=1e-1)


def test_what_two_directions_do_not_know_is_refused():
    with pytest.raises(InputError, match="dry friction in two directions does not say how fast"):
        assemble(at_an_angle([ZONE], (Coulomb(mu=MU),), STIFF))
    with pytest.raises(InputError, match="elastic gap g_t of its potential has one"):
        assemble(at_an_angle([Penalty(E_n=E_N), TangentialStiffness(E_t=1e12)], (Coulomb(mu=MU),), HEAVY))


def test_two_adhesions_of_the_same_bonds_are_one_of_their_sums():
    """What the bonds leave is left once, however many energies the bonds have."""
    parts = [AdhesionIntensity(C_N=x * C, C_T=x * C, w=x * W, E_n=x * E_N) for x in (0.25, 0.75)]
    one, two = solve(scene([ADHESION])), solve(scene(parts))
    for name in ("phi", "t_t", "D_coulomb", "T"):
        np.testing.assert_allclose(series(two, name), series(one, name), rtol=1e-9, atol=1e-12)
