"""Scenes of the exact tables of mechanics. Each is compiled once; its rows are runs with changed parameters."""

import json
from functools import cache
from pathlib import Path

import numpy as np
from scenes import SITES, bodies, path, perfect_contact, together, varying
from solved import Solved, solve

from surfacechem.laws.cohesive import ExponentialCohesiveZone, TensileStrength
from surfacechem.laws.factors import Linear, Power
from surfacechem.laws.free_energy import (
    BondedContact,
    BondEnergy,
    BondStiffness,
    Constant,
    InterfaceCapacity,
    NormalStiffness,
    Quadratic,
)
from surfacechem.laws.friction import BondedCoulomb, Coulomb, Viscous
from surfacechem.laws.kinetics import Arrhenius, LinearAffinity
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.laws.longrange import LennardJonesDerjaguin, LennardJonesFlatFlat, LennardJonesSpherePlane
from surfacechem.model.assemble import assemble
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model

FOLDER = Path(__file__).parent / "references"
COLD_BODIES = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


@cache
def table(name: str) -> dict:
    return json.loads((FOLDER / f"{name}.json").read_text())


def parameters(name: str) -> dict[str, float]:
    return {key: float(value) for key, value in table(name)["parameters"].items()}


def rows(name: str) -> list[dict]:
    """Rows by column; words stay words."""
    return [dict(zip(table(name)["columns"], map(_entry, row), strict=True)) for row in table(name)["rows"]]


def columns(name: str) -> dict[str, np.ndarray]:
    return {key: np.array([row[key] for row in rows(name)]) for key in table(name)["columns"]}


def expected(name: str) -> dict[str, float]:
    return {key: float(value) for key, value in table(name)["expect"].items()}


def _entry(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


# -- the normal gap -------------------------------------------------------------------------------------------------


@cache
def debonding(elastic: bool, violation: str = "warn") -> Model:
    """A far field that reaches the strength at t = 1 s."""
    potentials = [BondEnergy(K_0=1.0), *([BondedContact(E_n=1e12)] if elastic else [])]
    limits = [TensileStrength(t_max=1.0, violation=violation)]
    given = {"loading": {"w_n": Ramp(rate=1.0)}, "initial": {"phi": 1.0}, "limits": limits}
    scene = together(potentials, **given, pair=bodies("T", "T", C_1=1.0, C_2=1.0), normal=Mounting(k=1.0))
    return Model(assemble(scene))


def debonded(q: dict, violation: str = "warn") -> Solved:
    elastic = np.isfinite(q["E_n"])
    opening = q["t_n"] / q["k_eff"] + (q["t_n"] / q["E_n"] if elastic else 0.0)
    changes = {
        "T_0": q["T0"],
        "initial.T": q["T_i"],
        "bodies.lower.C": q["C_tot"] / 2,
        "bodies.upper.C": q["C_tot"] / 2,
        "interface.potential.bond-energy.K_0": q["K0"],
        "initial.phi": q["phi_i"],
        "interface.limits.tensile-strength.t_max": q["t_n"],
        "mechanics.normal.k": q["k_eff"],
        "loading.w_n.rate": opening,
    }
    if elastic:
        changes["interface.potential.bonded-contact.E_n"] = q["E_n"]
    return solve(debonding(bool(elastic), violation), np.linspace(0.0, 1.5, 7), changes)


ZONE = {"t_max": 1e6, "g_0": 1e-8, "E_n": 1e16}


def zone(mounting: Mounting, w_n, energy=Quadratic, C: float = 1e-4, T: float = 300.0, programme=(), **more) -> Model:
    more |= {"loading": {"w_n": w_n}, "initial": {"g_n": 0.0}, "normal": mounting, "programme": programme}
    return Model(assemble(perfect_contact([ExponentialCohesiveZone(**ZONE)], energy=energy, C_1=C, C_2=C, T=T, **more)))


def cycles(top: float, count: int) -> Table:
    """Up to ``top`` and back, each way in a second."""
    return Table(times=[float(t) for t in range(2 * count + 1)], values=[top * (t % 2) for t in range(2 * count + 1)])


def pull_off(q: dict) -> tuple[Solved, list[float]]:
    """Opening and closing, quasi-static, between reservoirs; a ramp for each fold. Returns w at the jumps."""
    top, low = 1.05 * q["w_off"], 0.5 * min(q["w_on"], q["w_off"])
    history = Table(times=[0.0, 1.0, 2.0, 3.0], values=[0.0, top, min(2.0 * q["w_on"], top), low])
    interface, mount = Interface(None, [ExponentialCohesiveZone(**ZONE)]), Mounting(k=q["k_eff"])
    scene = Scene(COLD_BODIES, interface, loading={"w_n": history}, initial={"g_n": 0.0}, normal=mount)
    solved = solve(Model(assemble(scene)), np.linspace(0.0, 3.0, 31))
    return solved, [float(np.interp(jump.t, history.times, history.values)) for jump in solved.of("snap")]


def heating(energy) -> Solved:
    p = parameters("h_pulloff_heating")
    model = zone(Mounting(k=p["k_eff"]), cycles(1.5e-7, 19), energy, p["C_tot"] / 2, p["T_i"])
    return solve(model, (0.0, 38.0))


def dynamic() -> Solved:
    p = parameters("h_pulloff_dynamic")
    model = zone(Mounting(k=p["k_eff"], m=p["m"], c_b=p["c_b"]), Hold(level=p["w"]), C=p["C_tot"] / 2)
    return solve(model, columns("h_pulloff_dynamic")["t"])


def isentropic() -> Solved:
    """Cohesion whose strength falls with temperature is opened in a second, without heat."""
    p, exact = parameters("h_isentropic_cohesive_cooling"), columns("h_isentropic_cohesive_cooling")
    potential = ExponentialCohesiveZone(t_max=varying(p["t0"], Power(exponent=-1.0)), g_0=p["g0"], E_n=1e16)
    C, loading = p["C_tot"] / 2, {"g_n": Ramp(rate=exact["g"][-1])}
    scene = perfect_contact([potential], T=p["T_i"], T_0=p["T0"], C_1=C, C_2=C, loading=loading)
    return solve(Model(assemble(scene)), exact["g"] / exact["g"][-1])


def damage() -> Solved:
    """Bonds that carry tension follow their equilibrium: they relax in 1e-10 of the time in which the gap opens."""
    p, exact = parameters("h_damage_equilibrium"), columns("h_damage_equilibrium")
    potentials = [BondStiffness(E_b=p["E"], E_n=p["E"]), BondEnergy(K_0=p["K"])]
    relaxes = LinearAffinity(c_r=1e10 * SITES.density / p["K"])
    interface = Interface(Hold(level=300.0), potentials, (), [relaxes], SITES)
    scene = Scene(COLD_BODIES, interface, (), {"g_n": Ramp(rate=exact["g"][-1])}, None, 300.0, {"phi": 1.0})
    return solve(Model(assemble(scene)), exact["g"] / exact["g"][-1])


CONSTANT = {"pair": bodies("T", "T", Constant, 1.0, 1.0)}
LONG_RANGE = {"flat": LennardJonesFlatFlat, "sphere": LennardJonesSpherePlane, "derjaguin": LennardJonesDerjaguin}


def long_range(kind: str, gaps: np.ndarray) -> Solved:
    """The gap opens through the given values, one in a second, from contact to far away."""
    p = parameters("i_lj_flat_flat")
    sites = {"n_1": p["n1"], "n_2": p["n2"], "psi_0": p["psi0"], "g_0": p["g0"]}
    size = {} if kind == "flat" else {"R": p["R"], "area": 1e-16}
    times = [float(t) for t in range(len(gaps))]
    gap = Table(times=times, values=[float(g) for g in gaps])
    scene = together([LONG_RANGE[kind](**sites, **size)], loading={"g_n": gap}, **CONSTANT)
    return solve(Model(assemble(scene)), times)


def snap(q: dict) -> tuple[Solved, list[float]]:
    """Flats approach until they snap in and are drawn apart until they pull off; w at the two jumps."""
    p = parameters("i_lj_flat_flat")
    sites = {"n_1": p["n1"], "n_2": p["n2"], "psi_0": p["psi0"], "g_0": p["g0"]}
    far, near = 1.2 * q["w_snap_in"], 0.8 * q["w_snap_in"]
    apart = 1.2 * max(q["w_pull_off"], q["w_snap_in"])
    history = Table(times=[0.0, 1.0, 2.0], values=[far, near, apart])
    given = {"loading": {"w_n": history}, "initial": {"g_n": far}, "normal": Mounting(k=q["k_eff"])}
    scene = together([LennardJonesFlatFlat(**sites)], **given, **CONSTANT)
    solved = solve(Model(assemble(scene)), np.linspace(0.0, 2.0, 21))
    return solved, [float(np.interp(jump.t, history.times, history.values)) for jump in solved.of("snap")]


@cache
def penalty() -> Model:
    p = parameters("x09_penalty_limit")
    given = {"loading": {"w_n": Ramp(rate=p["w"])}, "normal": Mounting(k=p["k_eff"])}
    return Model(assemble(together([NormalStiffness(E_n=1.0)], **given, **CONSTANT)))


def light_interface(C_c: float) -> Scene:
    """An interface between reservoirs whose bonds take capacity away; nothing but its temperature moves."""
    p = parameters("x13_negative_capacity_growth")
    return Scene(
        COLD_BODIES,
        Interface("T_c", [BondEnergy(K_2=p["K2"]), InterfaceCapacity(C_c=C_c)]),
        [path("interface", "lower", p["h1"]), path("interface", "upper", p["h2"])],
        {"phi": Hold(level=p["phi"])},
        T_0=p["T0"],
        initial={"T_c": p["T"]},
    )


@cache
def film() -> Model:
    p = parameters("x05_closing_film")
    C, loading = p["C_tot"] / 2, {"v": Hold(level=p["v"]), "g_n": Ramp(start=p["g_i"], rate=-p["a"])}
    scene = perfect_contact([], frictions=[Viscous(eta=p["eta"])], C_1=C, C_2=C, T=p["T0"], loading=loading)
    return Model(assemble(scene))


# -- sliding --------------------------------------------------------------------------------------------------------


def coulomb_stop() -> Solved:
    p = parameters("g_coulomb_stop")
    C, given = p["C_tot"] / 2, {"loading": {"p": Hold(level=p["p"])}, "initial": {"v": p["v0"]}}
    frictions, mount = [Coulomb(mu=p["mu"])], Mounting(m=p["m"])
    scene = perfect_contact([], frictions=frictions, C_1=C, C_2=C, T=p["T0"], tangential=mount, **given)
    return solve(Model(assemble(scene)), columns("g_coulomb_stop")["t"])


def _dragged(p) -> dict:
    """Pressure and drive of a mass on a spring."""
    loading = {"p": Hold(level=p["p"]), "w_t": Ramp(rate=p["V"])}
    return {"loading": loading, "tangential": Mounting(m=p["m"], k=p["k"])}


@cache
def slider() -> Model:
    p = parameters("g_stickslip_motion")
    friction = Coulomb(mu=p["mu_k"], mu_s=p["mu_s"])
    return Model(assemble(perfect_contact([], frictions=[friction], C_1=500.0, C_2=500.0, **_dragged(p))))


@cache
def rebonding_slider() -> Model:
    """Bonds form while the interface sticks, without heat, and break as it slides."""
    p = parameters("g_stickslip_rebonding_transient")
    forms = Arrhenius(A=varying(1 / p["tau"], Linear(of="sticking", about=1.0, slope=1.0)), E_a=0.0)
    friction = BondedCoulomb(mu=p["mu_k"], mu_b=p["mu_b"], mu_ub=p["mu_ub"])
    interface = Interface(Hold(level=300.0), (), [friction], [forms], SITES)
    return Model(assemble(Scene(COLD_BODIES, interface, T_0=300.0, initial={"phi": 0.0}, **_dragged(p))))
