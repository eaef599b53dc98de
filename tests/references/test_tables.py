"""Exact tables of scenes that no shipped case has, met by their runs at default tolerances.

The other tables belong to an exact solution, which has to be theirs (test_references.py) and which cases and regimes of
the stability matrix have to meet.
"""

import numpy as np
import pytest
from scenes import SITES, bodies, path, perfect_contact, together, varying
from solved import Solved, closed, solve
from tables import columns, parameters, read, rows

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.expressions import exp
from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.factors import Exponential, Power
from surfacechem.laws.free_energy import (
    BondEnergy,
    BondStiffness,
    Constant,
    ConstantInterfaceCapacity,
    InterfaceCapacity,
    LinearEnthalpy,
    Quadratic,
)
from surfacechem.laws.friction import Coulomb, Viscous
from surfacechem.laws.kinetics import Arrhenius, KamalSourour, LinearAffinity
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.laws.longrange import LennardJonesDerjaguin, LennardJonesFlatFlat, LennardJonesSpherePlane
from surfacechem.model.assemble import assemble
from surfacechem.runs.check import consistent_start, rates
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model

COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
CONSTANT = {"pair": bodies("T", "T", Constant, 1.0, 1.0)}
ZONE = {"t_max": 1e6, "g_0": 1e-8, "E_n": 1e16}
EVENTS = 1e-6
"""Relative error of what depends on the time of an event."""


def assert_met(solved: Solved, names: dict[str, str], exact) -> None:
    """Columns of a table by names of a run, relative to the largest."""
    for name, column in names.items():
        known = exact[column]
        assert solved[name][-len(known) :] == pytest.approx(known, rel=0, abs=1e-8 * np.max(np.abs(known))), name


# -- without events ---------------------------------------------------------------------------------------------------


def cured(name: str, law, T_i: float, phi=0.0, energy=Constant) -> Scene:
    """Two bodies with 2 J/(m^2 K) that a reaction heats."""
    heat = LinearEnthalpy(H_r=2.0 * parameters(name)["dT_ad"])
    return perfect_contact([heat], [law], phi, T_i, T_0=T_i, energy=energy)


def test_a_rate_proportional_to_temperature():
    name = "k_coupled_explicit"
    p, exact = read(name)
    assert_met(closed(cured(name, Arrhenius(A=p["k0"], b=1.0), p["T_i"]), exact["t"]), {"T": "T", "phi": "phi"}, exact)


def test_a_cure_of_bodies_of_quadratic_energy():
    name = "k_kamal_quadratic_energy"
    p, exact = read(name)
    law = KamalSourour(A_1=p["A1"], E_1=p["E1"], A_2=p["A2"], E_2=p["E2"], m=p["m"], n=p["n"])
    solved = closed(cured(name, law, p["T_i"], p["alpha_i"], Quadratic), exact["t"])
    assert_met(solved, {"phi": "alpha", "T": "T"}, exact)


@pytest.mark.parametrize("film", [False, True])
def test_weakening_friction_between_bodies_of_constant_capacity(film):
    p, exact = read("f_dry_friction_mu_T0_over_T")
    thinning = varying(p["mu0"] * p["p"] / p["v"] * 1e-6, Exponential(beta=p["beta"]))
    law = Viscous(eta=thinning) if film else Coulomb(mu=varying(p["mu0"], Power(exponent=-1.0)))
    loading = {"v": Hold(level=p["v"]), **({"g_n": Hold(level=1e-6)} if film else {"p": Hold(level=p["p"])})}
    C, given = p["C_tot"] / 2, {"T": p["T0"], "T_0": p["T0"], "energy": Constant}
    scene = perfect_contact([], C_1=C, C_2=C, frictions=[law], loading=loading, **given)
    assert_met(closed(scene, exact["t"]), {"T": "T_visc_exp_constC" if film else "T_constC"}, exact)


class Decay(Hold):
    r"""A source that decays exponentially about a constant.

    >>> Decay(level=1.0, amplitude=2.0, gamma=3.0).value(0.0)
    3.0
    """

    amplitude: float = parameter("[x]", "decaying part", varies=False)
    gamma: float = parameter("1/s", "decay rate", varies=False)

    def value(self, t):
        return self.level + self.amplitude * exp(-self.gamma * t)


def test_a_source_that_decays_between_three_temperatures():
    p, exact = read("e_three_temperatures_source")
    heat = [path("interface", "lower", p["h1"]), path("interface", "upper", p["h2"])]
    source = Decay(level=p["D0"], amplitude=p["D1"], gamma=p["gamma"])
    pair = bodies(energy=Constant, C_1=p["C1"], C_2=p["C2"])
    initial = {"T_1": p["T1"], "T_2": p["T2"], "T_c": p["Tc"]}
    interface = Interface("T_c", [ConstantInterfaceCapacity(C_c=p["Cc"])])
    scene = Scene(pair, interface, heat, {"Q_c": source}, T_0=300.0, initial=initial)
    assert_met(closed(scene, exact["t"]), {"T_1": "T1", "T_2": "T2", "T_c": "Tc"}, exact)


def test_a_gap_snaps_open_and_rings_down():
    p, exact = read("h_pulloff_dynamic")
    mount, C = Mounting(k=p["k_eff"], m=p["m"], c_b=p["c_b"]), p["C_tot"] / 2
    given = {"loading": {"w_n": Hold(level=p["w"])}, "initial": {"g_n": 0.0}, "normal": mount}
    scene = perfect_contact([ExponentialCohesiveZone(**ZONE)], C_1=C, C_2=C, **given)
    names = {"g_n": "g", "v_n": "gdot", "t_n": "t_n", "heat_bulk_damper_n": "heat", "T": "T"}
    assert_met(closed(scene, exact["t"]), names, exact)


def test_bonds_in_equilibrium_until_none_is_left():
    """Bonds that carry tension follow their equilibrium: they relax in 1e-10 of the time in which the gap opens."""
    p, exact = read("h_damage_equilibrium")
    potentials = [BondStiffness(E_b=p["E"], E_n=p["E"]), BondEnergy(K_0=p["K"])]
    relaxes = LinearAffinity(c_r=1e10 * SITES.density / p["K"])
    interface, last = Interface(Hold(level=300.0), potentials, (), [relaxes], SITES), exact["g"][-1]
    scene = Scene(COLD, interface, (), {"g_n": Ramp(rate=last)}, None, 300.0, {"phi": 1.0})
    solved = closed(scene, exact["g"] / last)
    assert_met(solved, {"phi": "phi", "t_n": "t_n"}, exact)
    (unbonded,) = solved.of("unbonded")
    assert unbonded.t * last == pytest.approx(np.sqrt(2 * p["K"] / p["E"]), rel=1e-8)


# -- long range -------------------------------------------------------------------------------------------------------


def lennard_jones(law, **size):
    p = parameters("i_lj_flat_flat")
    return law(n_1=p["n1"], n_2=p["n2"], psi_0=p["psi0"], g_0=p["g0"], **size)


def opened(law, gaps) -> Solved:
    """The gap takes the given values, one in a second, from contact to far away."""
    gap = Table(times=np.arange(float(len(gaps))).tolist(), values=gaps.tolist())
    return solve(together([law], loading={"g_n": gap}, **CONSTANT), gap.times)


def test_flats():
    exact = columns("i_lj_flat_flat")
    solved = opened(lennard_jones(LennardJonesFlatFlat), exact["g"])
    assert solved["t_n"] == pytest.approx(exact["t_n"], rel=1e-12)
    assert solved["U_c"] == pytest.approx(exact["W"], rel=1e-12)
    assert solved["W_g_n"] == pytest.approx(exact["W"] - exact["W"][0], rel=0, abs=1e-7 * np.abs(exact["W"]).max())


@pytest.mark.parametrize(
    ("law", "column"), [(LennardJonesSpherePlane, "F_exact"), (LennardJonesDerjaguin, "F_derjaguin")]
)
def test_sphere_and_plane(law, column):
    exact, size = columns("i_lj_sphere_plane"), {"R": parameters("i_lj_flat_flat")["R"], "area": 1e-16}
    assert opened(lennard_jones(law, **size), exact["g"])["t_n"] * 1e-16 == pytest.approx(exact[column], rel=1e-12)


def snaps(law, row, history: Table, start: float, pair) -> tuple[Solved, list[float]]:
    """A quasi-static run along a history of w, and where that is at the snaps."""
    given = {"loading": {"w_n": history}, "initial": {"g_n": start}, "normal": Mounting(k=row["k_eff"])}
    solved = closed(together([law], **given, pair=pair), history.times[-1], outputs=31)
    return solved, [float(np.interp(jump.t, history.times, history.values)) for jump in solved.of("snap")]


def found(solved: Solved, side: str) -> list[float]:
    return [solved.state(jump, "g_n", side) for jump in solved.of("snap")]


@pytest.mark.parametrize("row", rows("i_lj_snap"), ids=lambda row: f"{row['k_over_kmax']}")
def test_flats_snap_in_and_pull_off(row):
    far, near = 1.2 * row["w_snap_in"], 0.8 * row["w_snap_in"]
    history = Table(times=[0.0, 1.0, 2.0], values=[far, near, 1.2 * max(row["w_pull_off"], row["w_snap_in"])])
    solved, w = snaps(lennard_jones(LennardJonesFlatFlat), row, history, far, CONSTANT["pair"])
    assert found(solved, "before") == pytest.approx([row["g_snap_in"], row["g_pull_off"]], rel=EVENTS)
    assert w == pytest.approx([row["w_snap_in"], row["w_pull_off"]], rel=EVENTS)


@pytest.mark.parametrize("row", rows("h_pulloff_vs_stiffness"), ids=lambda row: f"{row['k_g0_over_tmax']:g}")
def test_a_zone_pulls_off_and_comes_back_at_any_stiffness(row):
    """Between reservoirs, which take what the snaps release."""
    top, low = 1.05 * row["w_off"], 0.5 * min(row["w_on"], row["w_off"])
    history = Table(times=[0.0, 1.0, 2.0, 3.0], values=[0.0, top, min(2.0 * row["w_on"], top), low])
    interface = Interface(None, [ExponentialCohesiveZone(**ZONE)])
    given = {"loading": {"w_n": history}, "initial": {"g_n": 0.0}, "normal": Mounting(k=row["k_eff"])}
    solved = closed(Scene(COLD, interface, **given), 3.0, outputs=31)
    snapped = solved.of("snap")
    assert [np.interp(jump.t, history.times, history.values) for jump in snapped] == pytest.approx(
        [row["w_off"], row["w_on"]], rel=EVENTS
    )
    assert found(solved, "after") == pytest.approx([row["g_after"], row["g_after_on"]], rel=EVENTS)
    assert [jump.released for jump in snapped] == pytest.approx([row["release_off"], row["release_on"]], rel=EVENTS)
    for jump in snapped:
        assert jump.heat_out == pytest.approx(jump.released, rel=1e-14)
        assert jump.entropy_out == pytest.approx(jump.released / 300.0, rel=1e-14)
    assert solved["H_events"][-1] == pytest.approx(-sum(jump.released for jump in snapped), rel=1e-12)


# -- capacities -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "row", [row for row in rows("x13_negative_capacity_growth") if row["Cc"]], ids=lambda row: f"{row['Cc']}"
)
def test_interface_without_capacity_left(row):
    """Disturbances grow the faster the less is missing; what has no capacity is refused, what has some decays."""
    p = parameters("x13_negative_capacity_growth")
    interface = Interface("T_c", [BondEnergy(K_2=p["K2"]), InterfaceCapacity(C_c=row["Cc"])])
    heat = [path("interface", "lower", p["h1"]), path("interface", "upper", p["h2"])]
    given = {"loading": {"phi": Hold(level=p["phi"])}, "T_0": p["T0"], "initial": {"T_c": p["T"]}}
    model = Model(assemble(Scene(COLD, interface, heat, **given)))
    assert rates(consistent_start(model, model.values())).real == pytest.approx([row["growth_rate"]], rel=1e-12)
    if row["C_eff"] > 0:
        closed(model, 1e-3)
    else:
        with pytest.raises(InputError, match="heat capacity at T_c was lost"):
            solve(model, 1e-3)
