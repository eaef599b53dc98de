"""Sliding with two components that moves: exact solutions, rotated axes, and independent integrations of the plane."""

import math

import numpy as np
import pytest
from scenes import bodies, together, varying
from solved import closed, solve

from surfacechem.contracts.terms import Load
from surfacechem.errors import InputError
from surfacechem.laws.factors import Linear
from surfacechem.laws.free_energy import TangentialStiffness
from surfacechem.laws.friction import AnisotropicCoulomb, AnisotropicViscous, Coulomb, RateAndStateAging, Viscous
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.scene import Mounting, Scene, Stage
from surfacechem.solve.run import Model

FREE, SPRING = Mounting(m=5.0), Mounting(k=1e8, m=10.0)


def scene(frictions, mount=FREE, initial=None, transverse=None, potentials=(), programme=(), **loading) -> Scene:
    """A slider on one plate; numbers under ``loading`` are held."""
    histories = {x: load if isinstance(load, Load) else Hold(level=float(load)) for x, load in loading.items()}
    mounts = {"tangential": mount, "transverse": transverse}
    pair = bodies("T", "T", C_1=50.0, C_2=50.0)
    return together(potentials, frictions, histories, initial, pair=pair, programme=programme, **mounts)


def close(found, exact, tolerance=1e-10):
    assert np.max(np.abs(found - exact)) <= tolerance * np.max(np.abs(exact))


# -- stops of a free mass -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kappa", "v"), [(1.1, 2.0), (8.0, 2.0), (8.0, 2e-8)])
def test_a_slide_across_a_dead_load_curves_into_it(kappa, v):
    """Across a load F, with kappa = mu p / F, v_2 tan(alpha/2)^-kappa is constant; it is the block on an incline."""
    m, F, p, mu = 5.0, 3e3, 3e4, kappa / 10
    stop = m * v / F * kappa / (kappa**2 - 1)
    times = np.linspace(0, 1.2 * stop, 25)
    solved = closed(scene([Coulomb(mu=mu)], initial={"v_2": v}, p=p, F_t=F), times)
    sliding = times < 0.95 * stop
    alpha = np.arctan2(solved["v_2"], solved["v"])[sliding]
    close(solved["v_2"][sliding], v * np.tan(alpha / 2) ** kappa, 1e-10)
    assert solved.jumps[0].t == pytest.approx(stop, rel=1e-9, abs=0)
    assert np.all(solved["v"][~sliding][2:] == 0)
    heat = 0.5 * m * v**2 + F * solved["u_t"][-1]
    assert solved["heat_coulomb"][-1] == pytest.approx(heat, rel=1e-10)


# -- beginning on the ellipse, and independent integrations ---------------------------------------------------------


def test_sticking_gives_way_on_the_ellipse():
    law, (k, x, y) = AnisotropicCoulomb(mu_1=0.2, mu_2=0.5), (1e8, 1e-3, 2e-3)
    onset = 1e5 / (k * math.hypot(x / 0.2, y / 0.5))
    times = [0.0, onset * (1 - 1e-6), onset * (1 + 1e-4)]
    solved = closed(scene([law], SPRING, p=1e5, w_t=Ramp(rate=x), w_t2=Ramp(rate=y)), times)
    assert solved.events == ["slip"]
    assert solved.jumps[0].t == pytest.approx(onset, rel=1e-13)
    assert solved["v"][1] == solved["v_2"][1] == solved["u_t2"][1] == 0
    assert solved["t_t"][1] == pytest.approx(k * x * times[1], rel=1e-13)
    assert solved["t_t2"][1] == pytest.approx(k * y * times[1], rel=1e-13)
    assert solved["v_2"][2] / solved["v"][2] == pytest.approx(y / 0.5 / (x / 0.2), rel=1e-2)


def test_what_bears_nothing_across_slides_there():
    """A block on rails: friction along, none across, where the spring swings it for good."""
    law = AnisotropicCoulomb(mu_1=0.3, mu_2=0.0)
    times, omega = np.linspace(0, 0.01, 51), math.sqrt(1e8 / 10)
    solved = closed(scene([law], SPRING, {"v_2": 0.1}, p=1e5, w_t=1e-4, w_t2=0.0), times)
    assert solved["u_t"][-1] > 0  # what slides across is not held along
    free = closed(scene([law], SPRING, {"v_2": 0.1}, p=1e5, w_t=0.0, w_t2=0.0), times)
    close(free["u_t2"], 0.1 / omega * np.sin(omega * times), 1e-8)
    assert np.all(free["u_t"] == 0)


# -- programmes, values, prescribed velocities ----------------------------------------------------------------------


def test_a_programme_turns_the_pull():
    stages = (Stage("along", {"w_t": 1e-3}, duration=0.3), Stage("across", {"w_t2": 1e-3}, event="slip"))
    stages += (Stage("rest", {}),)
    solved = closed(scene([Coulomb(mu=0.4, mu_s=0.6)], SPRING, p=1e5, programme=stages), [0.0, 0.4, 2.0])
    onset = 0.3 + math.sqrt(0.6**2 - 0.3**2)
    assert solved.events == ["end of along", "slip", "stop"]
    assert solved.jumps[1].t == pytest.approx(onset, rel=1e-12)
    # It springs along the pull, at 60 degrees to the first stage, until the spring pulls as much less as it did more.
    assert (solved["t_t"][2], solved["t_t2"][2]) == pytest.approx((1e4, math.sqrt(3) * 1e4), rel=1e-9)
    assert np.all(solved["v_2"][:2] == 0)


def test_initial_velocities_can_be_changed():
    one = assemble(scene([Coulomb(mu=0.25)], initial={"v": 1.0}, p=3e4))
    assert "initial.v_2" not in one.changeable  # one direction only
    model = Model(assemble(scene([Coulomb(mu=0.25)], initial={"v": 1.0, "v_2": 1.0}, p=3e4)))
    solved = solve(model, [0.0, 1e-4, 2e-3], {"initial.v": -1.2, "initial.v_2": 1.6})
    assert (solved["v"][0], solved["v_2"][0]) == pytest.approx((-1.2, 1.6), rel=1e-15)
    assert solved.jumps[0].t == pytest.approx(5.0 * 2.0 / 7500, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "along", "across"),
    [
        (AnisotropicCoulomb(mu_1=0.3, mu_2=0.6), 0.3 * 1e2 * 0.6, 0.6 * 1e2 * 0.8),
        (AnisotropicViscous(eta_1=0.5, eta_2=0.2), 50 * 3.0, 20 * 4.0),
    ],
)
def test_friction_opposes_a_prescribed_velocity(law, along, across):
    given = {"g_n": 1e-2} if "viscous" in law.name() else {"p": 1e2}
    found, name = closed(scene([law], None, v=3.0, v_2=-4.0, **given), [0.0, 1.0]), law.name().replace("-", "_")
    assert (found[f"t_{name}"][0], found[f"t_2_{name}"][0]) == pytest.approx((along, -across), rel=1e-14)
    assert found[f"D_{name}"][-1] == pytest.approx(3.0 * along + 4.0 * across, rel=1e-14)


def test_dampers_relax_each_on_its_own_where_nothing_presses():
    times, k, c = np.linspace(0, 1, 5), (K, 3 * K), (1e7, 1e8)
    mounts = [Mounting(k=stiff, c_g=damped) for stiff, damped in zip(k, c, strict=True)]
    solved = closed(scene([Coulomb(mu=0.3)], mounts[0], None, mounts[1], p=0.0, w_t=1e-3, w_t2=-2e-3), times)
    close(solved["u_t"], 1e-3 * (1 - np.exp(-k[0] / c[0] * times)))
    close(solved["u_t2"], -2e-3 * (1 - np.exp(-k[1] / c[1] * times)))


def test_rails_need_a_mass():
    mount, pull = Mounting(k=K, c_b=1e5), {"w_t": Ramp(rate=1e-3), "w_t2": Ramp(rate=1e-3)}
    model = Model(assemble(scene([AnisotropicCoulomb(mu_1=0.2, mu_2=0.0)], mount, p=P, **pull)))
    with pytest.raises(InputError, match=r"dry friction acts along one of two directions.*Give the mounting a mass"):
        solve(model, [0.0, 1.0])


K, P = 1e8, 1e5
SPEEDLESS = "Give the mounting a mass `m`, or a damper `c_b` along both directions"
REFUSED = [
    (scene([Coulomb(mu=0.3)], None, p=1, F_t=1, F_t2=1), SPEEDLESS),
    (scene([Coulomb(mu=0.3)], Mounting(k=1e6), p=1, w_t=0, w_t2=0), SPEEDLESS),
    (scene([Coulomb(mu=0.3)], Mounting(k=1e6, c_b=1.0), None, Mounting(k=1e6), p=1, w_t=0, w_t2=0), SPEEDLESS),
    (scene([Coulomb(mu=0.3)], SPRING, p=1, w_t=0, v_2=1), "v_2 is prescribed, but a mounting moves the interface"),
    (scene([Coulomb(mu=0.3)], SPRING, transverse=Mounting(k=1.0, m=1.0), p=1), "a mass is the same in every direction"),
    (scene([Coulomb(mu=0.3)], None, transverse=Mounting(k=1.0), p=1, v=1), "stands beside one along"),
    (scene([AnisotropicCoulomb(mu_1=0.3, mu_2=0.6)], SPRING, p=1, w_t=0), "Prescribe `w_t2` under `loading`"),
    (
        scene([Coulomb(mu=0.3)], SPRING, potentials=[TangentialStiffness(E_t=1e9)], p=1, w_t=0, w_t2=0),
        "but the elastic gap g_t of its potential has one",
    ),
    (
        scene(
            [RateAndStateAging(mu_0=0.6, a=0.01, b=0.02, L=1e-5, v_0=1e-6)], SPRING, {"theta": 1.0}, p=1, w_t=0, w_t2=0
        ),
        "remembers sliding along one direction",
    ),
    (scene([Coulomb(mu=varying(0.3, Linear(of="v", slope=1.0)))], SPRING, p=1, w_t=0, w_t2=0), "mu varies with one co"),
    (scene([AnisotropicViscous(eta_1=1.0, eta_2=1.0)], None, g_n=1e-6, v=1), "nothing evolves or prescribes it"),
]


@pytest.mark.parametrize(("refused", "reason"), REFUSED, ids=[reason[:30] for _, reason in REFUSED])
def test_what_is_refused_in_two_directions(refused, reason):
    with pytest.raises(InputError) as error:
        assemble(refused)
    assert reason in str(error.value)


def test_films_relax_at_their_own_rates():
    k, g, times = 1e6, 1e-6, np.linspace(0, 1, 21)
    for law, (along, across) in (
        (AnisotropicViscous(eta_1=0.5, eta_2=0.2), (0.5, 0.2)),
        (Viscous(eta=0.4), (0.4, 0.4)),
    ):
        solved = closed(scene([law], Mounting(k=k), g_n=g, w_t=1e-3, w_t2=-2e-3), times)
        close(solved["u_t"], 1e-3 * (1 - np.exp(-k * g / along * times)))
        close(solved["u_t2"], -2e-3 * (1 - np.exp(-k * g / across * times)))
        close(solved["t_t2"], k * (-2e-3 - solved["u_t2"]), 1e-9)


DRIVEN = {"w_t": (2e-6, 0.0), "w_t2": (1.5e-6, 1.0)}


@pytest.mark.parametrize("length", [1e-9, 1e-3, 1e3, 1e9])
@pytest.mark.parametrize("drive", ["spring", "push"])
def test_a_path_is_the_same_in_any_unit_of_length(drive, length):
    """From rest at the start on, where neither time nor friction has made a speed."""

    def path(unit):
        waves = {x: Harmonic(amplitude=a * unit, frequency=1.0, phase=b) for x, (a, b) in DRIVEN.items()}
        pushes = {"F_t": Ramp(rate=10.0), "F_t2": Hold(level=7.0)}
        mount = Mounting(k=1e8 / unit if drive == "spring" else 0.0, m=1e6 / unit)
        loads = {"p": 100.0, **waves} if drive == "spring" else {"p": 20.0, **pushes}
        found = closed(scene([Coulomb(mu=0.3)], mount, **loads), 2.0, outputs=41, atol=1e-23 * unit)
        return np.array([found[x] for x in ("u_t", "u_t2", "v", "v_2")]) / unit

    close(path(length), path(1.0), 1e-10)
