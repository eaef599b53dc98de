"""Cases with surfaces: every gap model against an independent integration, units of a pair of bodies, bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest
import symengine
from sampling import every
from scipy.optimize import brentq, linprog

import surfacechem
from surfacechem.errors import InputError, Place
from surfacechem.expressions import derivative, exp
from surfacechem.laws.free_energy import EquilibriumBonds, Penalty
from surfacechem.laws.longrange import InversePower, LennardJonesSpherePlane
from surfacechem.model.system import DUMMY_STATE
from surfacechem.runs.summaries import run_summary
from surfacechem.surfaces import patches, potential
from surfacechem.surfaces.approach import fitted
from surfacechem.surfaces.forces import density, interaction, level_approaches, over_gap
from surfacechem.surfaces.nearest_places import near_places
from surfacechem.surfaces.potential import CurvedSurfaces
from surfacechem.surfaces.projection import Surface
from surfacechem.surfaces.shapes import Cone, Plane, Sphere, Torus

pytestmark = pytest.mark.around

SCENE = """
T_0: 300 K
bodies:
  ball: {temperature: T, C: 1e-18 J/K}
  plane: {temperature: 300 K}
surface:
  bodies:
    ball: {sphere: {R: 50 nm}}
    plane: plane
  pair:
    - lennard-jones-pair: {n_1: 5e18 1/m^2, n_2: 5e18 1/m^2, psi_0: 4e-21 J, g_0: 0.3 nm}
  approach: {from: 0.4 nm, to: 9 nm}
"""
RUN = "run: {until: 1 us, outputs: 41, rtol: 1e-11}\n"
START = "initial: {T: 300 K}\n"
LAW = LennardJonesSpherePlane(n_1=5e18, n_2=5e18, psi_0=4e-21, g_0=3e-10, R=5e-8, area=1.0)
G = symengine.Symbol("g_n")
FORCE = symengine.Lambdify([G], [derivative(LAW.energy(G), G)])


def force(g):
    return float(FORCE([g])[0])


def written(tmp_path, text, scene=SCENE):
    path = tmp_path / "case.yaml"
    path.write_text(scene + text)
    return path


def data(tmp_path, text, scene=SCENE):
    return surfacechem.run(written(tmp_path, text, scene)).dataset


RAMP = "loading: {F_n: {ramp: {start: -1 nN, rate: 1.5 mN/s}}}\n"
MOVED = "loading: {g_n: {ramp: {start: 5 nm, rate: -4 mm/s}}}\n"
HELD = """
mechanics: {normal: {k: 5 N/m}}
loading: {w_n: {ramp: {start: 6 nm, rate: -4 mm/s}}}
initial: {T: 300 K, g_n: 6 nm}
"""


@pytest.mark.parametrize("evolves", [True, False])
def test_a_prescribed_gap_bears_the_force_in_newtons(tmp_path, evolves):
    """Whether anything evolves beside it or not: a curve of force over distance is a run, too."""
    scene = SCENE if evolves else SCENE.replace("temperature: T, C: 1e-18 J/K", "temperature: 300 K")
    found = data(tmp_path, MOVED + (START if evolves else "") + RUN, scene)
    assert found.t_n.attrs["units"] == "N"
    assert found.W_g_n.attrs["units"] == found.energy_residual.attrs["units"] == "J"
    exact = [force(g) for g in found.g_n.values]
    assert found.t_n.values == pytest.approx(exact, rel=1e-8)
    work = LAW.energy(5e-9) - LAW.energy(1e-9)
    assert found.W_g_n.values[-1] == pytest.approx(-work, rel=1e-8)
    assert DUMMY_STATE not in found


@pytest.mark.parametrize("rtol", every(2, [1e-2, 1e-6]))
def test_the_error_of_a_run_holds_that_of_its_integrals(tmp_path, rtol):
    found = surfacechem.run(written(tmp_path, f"  accuracy: {rtol}\n{HELD}{RUN}"))
    exact = np.array([force(g) for g in found.dataset.g_n.values])
    off, told = np.abs(found.dataset.t_n.values / exact - 1).max(), found.accuracy.variables
    assert off <= told["t_n"] < 10 * rtol
    assert told["g_n"] > found.trajectory.run.rtol
    assert "forces of the surfaces wrong by their error" in found.accuracy.source
    summary = str(run_summary(found, None))
    assert summary.index("surfaces ") < summary.index("compile ")
    assert found.attributes["integrals_seconds"] > 0


WALL = SCENE.replace("from: 0.4 nm", "from: 0.12 nm")


def test_a_dead_load_holds_a_sphere_where_the_force_is_its_own(tmp_path):
    found = data(tmp_path, f"{RAMP}initial: {{T: 300 K, g_n: 0.15 nm}}\n" + RUN, WALL)
    for pull, g in zip(found.F_n.values[::5], found.g_n.values[::5], strict=True):
        exact = brentq(lambda x, pull=pull: pull - force(x), 1.2e-10, 2e-10, xtol=1e-22, rtol=1e-14)
        assert g == pytest.approx(exact, rel=1e-8)


def test_densities_thin_out_as_the_area_grows(tmp_path):
    """What is given is per reference area: of both bodies, so that the force falls with the square of the stretch."""
    table = "J_c: {table: {times: [0 s, 1 us], values: [1, 1.5]}}"
    found = data(tmp_path, f"loading: {{g_n: 1 nm, {table}}}\n" + START + RUN)
    stretch = np.linspace(1, 1.5, 41)
    assert found.t_n.values == pytest.approx(force(1e-9) / stretch**2, rel=1e-8)
    assert found.force.values == pytest.approx(found.t_n.values[::5], rel=1e-8)
    assert found.traction[-1].values * 1.5**2 == pytest.approx(found.traction[0].values, rel=1e-8)
    assert found.energy_residual.values == pytest.approx(0, abs=1e-9 * abs(LAW.energy(1e-9)))


def test_a_stretch_of_the_area_is_refused_where_laws_of_the_gap_have_no_densities_to_thin_out(tmp_path):
    scene = SCENE.replace("  pair:", "  laws: [penalty: {E_n: 1 Pa/m}]\n  pair:")
    with pytest.raises(InputError, match=r"case.yaml:\d+: .*`laws` are those of the area as it is"):
        data(tmp_path, "loading: {g_n: 1 nm, J_c: 1.2}\n" + START + RUN, scene)


def test_what_the_integrals_hold_is_refused_in_a_sweep():
    with pytest.raises(InputError, match=r"surface.bodies.sphere.sphere.R cannot be swept: .* by --set"):
        surfacechem.sweep("sticky-sphere", {"surface.bodies.sphere.sphere.R": [1e-6, 2e-6]})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("from: 0.4 nm", "from: 0 nm", r"case.yaml:\d+: .*the surfaces overlap"),
        ("R: 50 nm", "R: 1e30 m", r"lost in the rounding of bodies of 1e\+30 m"),
        ("from: 0.4 nm", "from: 10 nm", "must be below the largest"),
        ("{sphere: {R: 50 nm}}", "{spere: {R: 50 nm}}", "Did you mean 'sphere'"),
        ("    plane: plane\n", "", "plane has no shape"),
        ("ball: {sphere: {R: 50 nm}}", "ball: plane", "endless: give one of them a length"),
        ("ball: {sphere: {R: 50 nm}}", "ball: {sphere: {R: -1 nm}}", "outside its range"),
        ("to: 9 nm}", "to: 9 nm}\n  acuracy: 1e-3", "Did you mean 'accuracy'"),
        ("surface:", "interface: {sites: 1e16 1/m^2}\nsurface:", "`sites` is of flats.* equilibrium-bonds"),
    ],
)
def test_bad_input_is_one_line_with_its_place(tmp_path, old, new, message):
    assert old in SCENE
    with pytest.raises(InputError, match=message):
        data(tmp_path, "loading: {g_n: 1 nm}\n" + START + RUN, SCENE.replace(old, new))


JUMP = """
from surfacechem.contracts.terms import PairEnergy, parameter
from surfacechem.expressions import where


class Jump(PairEnergy):
    "A step."

    psi_0: float = parameter("J", "energy")
    g_0: float = parameter("m", "length")

    def energy(self, r):
        "Energy."
        return where(r < 1e-9, 0.0 * r, (1e-9 / r) ** 6)
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("T: 300 K}", "T: 300 K, gn: 1 nm}", r"case.yaml:\d+: initial.gn: nothing that evolves"),
        ("T: 300 K}", "T: 300 K, g_n: 10 nm}", r"case.yaml:\d+: initial: g_n = 1e-08 m is not among the approaches"),
        ("start: 5 nm", "start: 10 nm", r"case.yaml:\d+: loading: g_n = 1e-08 m is not among the approaches"),
        ("temperature: T, C: 1e-18 J/K", "temperature: 300 K", "nothing that evolves is called 'T'. Known: none"),
        ("lennard-jones-pair", "jump", r"case.yaml:\d+: .*jump jumps at r = 1e-09 m"),
    ],
)
def test_what_is_wrong_is_told_before_anything_is_integrated(tmp_path, monkeypatch, old, new, message):
    (tmp_path / "jump.py").write_text(JUMP)
    monkeypatch.setattr(potential, "fitted", None)
    text = "laws: [jump.py]" + SCENE + MOVED + START + RUN
    assert old in text
    with pytest.raises(InputError, match=message):
        data(tmp_path, "", text.replace(old, new))


def test_a_ball_pressed_into_a_penalty_has_its_area_of_contact(tmp_path):
    law = "  laws: [penalty: {E_n: 1e15 Pa/m}]\n  approach: {from: -2 nm, to: 9 nm}\n"
    text = law + "loading: {g_n: {ramp: {start: 1 nm, rate: -2 mm/s}}}\n" + START + RUN
    found = data(tmp_path, text, SCENE[: SCENE.index("  pair:")])
    inside = np.maximum(-found.g_n.values, 0.0)
    assert found.t_n.values == pytest.approx(-np.pi * 1e15 * 5e-8 * inside**2, rel=1e-8, abs=1e-18)
    assert found.contact_area.values[-1] == pytest.approx(2 * np.pi * 5e-8 * 1e-9, rel=1e-9)
    assert found.gap.dims == ("surface_time", "u", "v")


def test_bonds_that_fade_are_integrated_where_they_still_count():
    """Over a sphere the force is 2 pi R times the energy between flats; far out that is rounding, and no jump."""
    R, law = 1e-6, EquilibriumBonds(N=1e16, K=50.0, k_b=1e-3, T=300.0)
    pair = CurvedSurfaces(
        shapes=(Sphere(R=R), Plane()), gap_laws=[law], approach=(1e-9, 6e-8), accuracy=1e-3, place=Place(path="surface")
    )
    found = symengine.Lambdify([G], [derivative(pair.energy(G), G)])
    flats = symengine.Lambdify([G], [law.energy(G)])
    gaps = np.geomspace(1e-9, 6e-8, 500)
    exact = 2 * np.pi * R * (flats(gaps + 2 * R) - flats(gaps))
    off = np.abs(found(gaps[:, None])[:, 0] - exact).max() / exact.max()
    assert off < pair.error < 1e-3
    assert pair.strongest == pytest.approx(gaps[np.argmax(exact)], rel=0.01)


def test_the_force_of_a_tilted_plate_bends_where_its_edge_comes_into_contact():
    """Pressed in by u sin t - d along it, a plate bears a force that is a square from its edge on."""
    shapes, law = (Plane(length=4.0, width=3.0, tilt=0.02), Plane(length=6.0, width=5.0)), Penalty(E_n=1.0)
    pair = CurvedSurfaces(
        shapes=shapes, gap_laws=[law], approach=(-0.03, 0.2), accuracy=1e-3, place=Place(path="surface")
    )
    curve = pair.curves[1]
    assert len(curve.pieces) == 2
    rise = 2 * math.sin(0.02)
    for d in (-0.02, 0.0, 0.03, 0.0399, 0.1):
        exact = -3 * max(rise - d, 0.0) ** 2 / (2 * math.sin(0.02))
        assert curve.pieces[d > rise].force(d) == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize(
    ("lower", "upper"),
    [
        (Plane(length=6.0, width=5.0), Plane(length=4.0, width=3.0, tilt=0.02, turn=0.3)),
        (Plane(length=4.0, width=1.0), Plane(length=1.0, width=5.0, tilt=0.1, turn=0.2)),
    ],
)
def test_contact_of_plates_begins_where_a_corner_or_edges_that_cross_come_into_contact(lower, upper):
    """As linear programming has it: the largest height of one plate over the other where their plans overlap."""
    bodies = Surface(lower), Surface(upper, True)
    axes = np.hstack([bodies[0].axes[:, :2], -bodies[1].axes[:, :2]])
    best = linprog(-axes[2], A_eq=axes[:2], b_eq=[0, 0], bounds=[*lower.span, *upper.span])
    assert level_approaches(*bodies, [0.0])[-1] == pytest.approx(-best.fun, rel=1e-9)
    touching = near_places(bodies[0], Surface(upper, True, -best.fun), 6.0, (False, False))
    assert touching.gap[0] == pytest.approx(0, abs=2e-6)


def test_powers_that_change_are_followed_near_the_least_approach():
    """A force over nine decades whose power begins to grow at the second of them."""

    def samples(d):
        x = max(d / 2e-12, 1.0)
        energy = (d / 2e-12) ** -4 * x**-2 * math.exp(2 - 2 / x)
        return energy, (-6 + 2 / x) * energy / d, 0.0

    curve = fitted(samples, 1e-12, 1e-3, 1e-8)
    assert curve.error < 1e-6
    for d in (1.5e-12, 1e-11, 1e-6, 1e-3):
        assert curve.energy(d) == pytest.approx(samples(d)[0], rel=1e-7)


def test_a_force_that_begins_like_a_root_is_held_where_it_is_small():
    """As of lines that come into contact, in a range of approaches that is short as a number."""

    def samples(d):
        depth = max(-d, 0.0) / 1e-10
        return depth**2.5, -2.5e10 * depth**1.5, 0.0

    curve = fitted(samples, -1e-10, 1e-9, 1e-4, [0.0], (1e-3, 2.5e7))
    force = symengine.Lambdify([G], [derivative(curve.energy(G), G)])
    depths = np.geomspace(1e-12, 1e-10, 200)
    exact = np.array([samples(-depth)[1] for depth in depths])
    assert np.abs(force(-depths[:, None]).ravel() / exact - 1).max() <= curve.error <= 1e-4
    assert fitted(samples, 1e-10, 1e-9, 1e-4).energy(5e-10) == 0.0  # out of reach there is none


@pytest.mark.parametrize(
    ("upper", "least"),
    [(Torus(hole=1.0, r=0.5, tilt=0.17), 1.5 * math.sin(0.17) + 0.5 * (1 - math.cos(0.17))), (Sphere(R=1.0), 0.0)],
)
def test_contact_begins_where_the_least_gap_vanishes(upper, least):
    found = level_approaches(Surface(Plane()), Surface(upper, True), [0.0, 0.1])
    assert found == pytest.approx([least, least + 0.1], abs=1e-12)


def test_bodies_that_just_touch_have_no_area_of_contact():
    """Rounding decides which points of a rim overlap, and takes no patches."""
    lower, upper = Surface(Plane()), Surface(Cone(slope=0.3, radius=1.0, tilt=0.4), True)
    touching = replace(upper, approach=level_approaches(lower, upper, [0.0])[0])
    budget = patches.Budget(1e-5)
    found = over_gap(lower, touching, [density(Penalty(E_n=1.0))], rtol=1e-5, floor=(1e-6, 1e-6), budget=budget)
    assert found.area < 1e-12
    assert budget.spent < 1e7


def test_an_accuracy_is_refused_by_what_all_integrals_of_the_approach_take_and_each_is_told(monkeypatch, caplog):
    """By far enough for one of them; the first few say how many times more all will take."""
    law = InversePower(n_1=1.0, n_2=1.0, psi_0=-1.0, r_0=1.0, m=6)
    pair = CurvedSurfaces(shapes=(Sphere(R=1.0), Plane()), pairs=[law], approach=(0.1, 1.0), accuracy=1e-6)
    pair = replace(pair, place=Place(path="surface"))
    with caplog.at_level("INFO", logger="surfacechem"):
        assert pair.integrated([law])[0].error <= 1e-6
    told = [record for record in caplog.records if "integral over the surfaces" in record.message]
    assert [record.done for record in told] == list(range(len(told)))
    assert all(record.done < record.total for record in told)
    budget = patches.Budget(1e-6)
    interaction(*pair.surfaces(0.1), [law], 1e-6 / 64, budget)
    monkeypatch.setattr(patches, "MOST_POINTS", 2 * budget.spent)
    with pytest.raises(InputError, match=r"accuracy 1e-06 of an integral .* out of reach: \d+ of them take"):
        pair.integrated([law])


class FourAndSix(InversePower):
    """A law of one's own, of which nobody knows that it is a sum."""

    decay = 4
    parts = None

    def energy(self, r):
        """Energy of a pair [J]."""
        return self.psi_0 * ((self.r_0 / r) ** 6 - (self.r_0 / r) ** 4)


class Screened(FourAndSix):
    """A law of one's own that falls by decades over the gap."""

    def energy(self, r):
        """Energy of a pair [J]."""
        return self.psi_0 * exp(-r / self.r_0)


@pytest.mark.parametrize("gap", [0.099, 0.13])
def test_a_law_that_falls_by_decades_within_a_table_is_integrated(gap):
    """Over a sphere the force is that between the energies of flats at its near and its far end."""
    law = Screened(n_1=1.0, n_2=1.0, psi_0=-1.0, r_0=1 / 400, m=4)
    found = interaction(Surface(Sphere(R=1.0)), Surface(Plane(), True, gap), [law], 1e-10)
    exact = 4 * math.pi**2 * math.exp(-400 * gap) * (gap / 400 + 1 / 400**2)
    assert found.force_1[0, 2] == pytest.approx(exact, rel=1e-10)


def test_a_law_that_falls_off_as_it_says_beside_a_steeper_part_is_integrated():
    numbers = {"n_1": 1.0, "n_2": 1.0, "r_0": 0.1}
    bodies = Surface(Sphere(R=1.0)), Surface(Plane(), True, 0.2)
    parts = [InversePower(psi_0=sign, m=m, **numbers) for sign, m in ((1.0, 6), (-1.0, 4))]
    (whole,) = interaction(*bodies, [FourAndSix(psi_0=1.0, m=4, **numbers)], 1e-8).force_1
    assert whole == pytest.approx(interaction(*bodies, parts, 1e-8).force_1.sum(axis=0), rel=1e-7, abs=1e-9)


def test_fields_are_sums_to_the_accuracy_and_those_of_the_local_law_where_these_take_too_much(monkeypatch):
    shapes = Sphere(R=1.0), Torus(hole=1.0, r=0.5, tilt=0.1)
    law = InversePower(n_1=2.0, n_2=1.5, psi_0=-1.0, r_0=1.0, m=6)
    pair = CurvedSurfaces(shapes=shapes, pairs=[law], approach=(0.5, 1.0), accuracy=1e-4)
    u, v = np.linspace(0.1, 1.0, 20), np.linspace(0.0, 6.0, 20)
    normals = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1)
    x = normals - np.array([0.0, 0.0, 1.0])
    approaches, stretches = np.array([0.5, 0.7]), np.array([1.0, 1.2])
    gaps = np.array([pair.surfaces(d)[1].nearest(x).gap for d in approaches])
    asked = x, normals, gaps, approaches, stretches
    found, summed = pair.tractions(*asked)
    fine, _ = replace(pair, accuracy=1e-9).tractions(*asked)
    assert summed
    assert 0 < np.abs(found / fine - 1).max() < 1e-4
    flat = -2 * np.pi * 3.0 * gaps * -(gaps**-6) / stretches[:, None] ** 2
    monkeypatch.setattr(patches, "MOST_POINTS", 20_000)
    local, summed = pair.tractions(*asked)
    assert not summed
    assert local == pytest.approx(flat, rel=1e-12)
