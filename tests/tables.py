"""The exact tables: each file of tests/references with the scene it solves."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scenes
from scenes import bodies, path, perfect_contact, varying
from tables_mechanics import FOLDER, columns, parameters

from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.factors import Exponential, Power
from surfacechem.laws.free_energy import (
    BondEnergy,
    Constant,
    ConstantInterfaceCapacity,
    InterfaceCapacity,
    LinearEnthalpy,
    Quadratic,
)
from surfacechem.laws.friction import Coulomb, Viscous
from surfacechem.laws.kinetics import Arrhenius, ExponentialAffinity, LinearAffinity, Relaxation
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.quantities import BOLTZMANN
from surfacechem.scene import Body, Interface, Scene, Sites
from surfacechem.solve.run import Trajectory


@dataclass(frozen=True)
class Table:
    """A scene, the times at which it is known, and the exact values by name of our variable."""

    name: str
    scene: Scene
    times: np.ndarray
    exact: dict[str, np.ndarray]
    tolerance: float = 1e-8
    floors: dict[str, float] = field(default_factory=dict)
    """Errors are relative to the exact value, or to this part of its largest; for variables that pass through zero."""


def read(name: str) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Parameters and columns of a table."""
    return parameters(name), columns(name)


def nonzero(**values: float) -> dict[str, float]:
    return {key: value for key, value in values.items() if value}


def sliding(name: str) -> Table:
    p, columns = read(name)
    if "mu" in p:
        law, loading = Coulomb(mu=p["mu"]), {"p": Hold(level=p["p"]), "v": Hold(level=p["v"])}
    else:
        law, loading = Viscous(eta=p["eta"]), {"g_n": Hold(level=p["g_n"]), "v": Hold(level=p["v"])}
    given = {"C_1": p["C1"], "C_2": p["C2"], "T_0": p["T0"], "T": p["T0"], "loading": loading}
    scene = perfect_contact([InterfaceCapacity(C_c=p["Cc"])], frictions=[law], **given)
    names = {"T": "T", "q1": "q_1", "q2": "q_2", "S_total": "S_total"}
    exact = {names[key]: columns[key] for key in columns if key in names}
    return Table(name, scene, columns["t"], exact, floors={"S_total": 1e-2})


def bonding(name: str, tolerance: float = 1e-8) -> Table:
    p, columns = read(name)
    potentials = [BondEnergy(**nonzero(K_0=p["K0"], K_1=p["K1"], K_2=p["K2"]))]
    potentials += [InterfaceCapacity(C_c=p["Cc"])] if p["Cc"] else []
    frictions, loading = [], {}
    if "D" in p:
        frictions, loading = [Coulomb(mu=0.5)], {"p": Hold(level=2.0), "v": Hold(level=p["D"])}
    start, sizes = (p["phi_i"], p["T_i"]), (p["C1"], p["C2"])
    given = {"T_0": p["T0"], "frictions": frictions, "loading": loading}
    scene = perfect_contact(potentials, [Relaxation(tau=p["tau"])], *start, *sizes, **given)
    names = {"q1": "q_1", "q2": "q_2", "sigma_chem": "sigma_relaxation"}
    names |= {name: name for name in ("phi", "T", "q_m", "U_c", "S_total")}
    exact = {names[key]: columns[key] for key in columns if key in names}
    floors = dict.fromkeys(("U_c", "S_total", "q_1", "q_2", "q_m", "sigma_relaxation"), 1e-2)
    return Table(name, scene, columns["t"], exact, tolerance, floors)


def isothermal(potential, reaction, phi: float, T: float, sites: Sites) -> Scene:
    pair = Body("lower", Hold(level=T)), Body("upper", Hold(level=T))
    return Scene(pair, Interface(Hold(level=T), [potential], (), [reaction], sites), initial={"phi": phi}, T_0=T)


def linear_equilibrium(name: str) -> Table:
    p, columns = read(name)
    K = p["Kf"] + p["Kb"]
    potential = BondEnergy(K_0=K, phi_eq=p["Kf"] / K)
    scene = isothermal(potential, LinearAffinity(c_r=p["c_r"]), p["phi_i"], 300.0, Sites(p["n_c"], p["n_c"]))
    exact = {"phi": columns["phi"], "R_linear_affinity": columns["R_c"]}
    return Table(name, scene, columns["t"], exact, floors={"R_linear_affinity": 1e-2})


def exponential(name: str) -> Table:
    p, columns = read(name)
    potential = BondEnergy(K_0=p["K"], phi_eq=p["phi_eq"])
    reaction = ExponentialAffinity(C_r=p["C_r"])
    scene = isothermal(potential, reaction, p["phi_i"], p["T"], Sites(p["n_c"], p["n_c"]))
    exact = {"phi": columns["phi"], "formed_phi": columns["phi"] - p["phi_i"]}
    return Table(name, scene, columns["t"], exact, floors={"formed_phi": 1e-2})


def exponential_overflow(row: int) -> Table:
    p, columns = read("x03_exponential_overflow")
    a, phi_i, phi_eq, t, phi = (columns[key][row] for key in ("a", "phi_i", "phi_eq", "t", "phi"))
    K = a * p["n_c"] * BOLTZMANN * p["T"]
    reaction = ExponentialAffinity(C_r=p["C_r"])
    scene = isothermal(BondEnergy(K_0=K, phi_eq=phi_eq), reaction, phi_i, p["T"], Sites(p["n_c"], p["n_c"]))
    return Table(f"x03_exponential_overflow-{row}", scene, np.array([t]), {"phi": np.array([phi])}, 1e-6)


def pair_exchange(name: str) -> Table:
    p, columns = read(name)
    heat = [path("lower", "upper", p["h"])]
    pair = bodies(C_1=p["C1"], C_2=p["C2"])
    scene = Scene(pair, Interface(), heat, T_0=p["T0"], initial={"T_1": p["T1"], "T_2": p["T2"]})
    return Table(name, scene, columns["t"], {"T_1": columns["T1"], "T_2": columns["T2"]})


def reservoir(start: str) -> Table:
    p, columns = read("e_reservoir_quadratic")
    pair = Body("lower", "T_1", Quadratic(C=p["C"])), Body("upper", Hold(level=p["T_inf"]))
    T_i = columns[start][0]
    scene = Scene(pair, Interface(), [path("lower", "upper", p["h"])], T_0=p["T0"], initial={"T_1": T_i})
    return Table(f"e_reservoir_quadratic-{start}", scene, columns["t"], {"T_1": columns[start]})


class Decay(scenes.Hold):
    r"""A source that decays exponentially about a constant.

    >>> Decay(level=1.0, amplitude=2.0, gamma=3.0).value(0.0)
    3.0
    """

    amplitude: float = scenes.parameter("[x]", "decaying part", varies=False)
    gamma: float = scenes.parameter("1/s", "decay rate", varies=False)

    def value(self, t):
        from surfacechem.expressions import exp

        return self.level + self.amplitude * exp(-self.gamma * t)


def three_temperatures(name: str) -> Table:
    p, columns = read(name)
    source = {"Q_c": Decay(level=p["D0"], amplitude=p["D1"], gamma=p.get("gamma", 0.0))} if p["D0"] else {}
    exact = {"T_1": columns["T1"], "T_2": columns["T2"], "T_c": columns["Tc"]}
    return Table(name, medium(p, source), columns["t"], exact)


def medium(p: dict[str, float], loading) -> Scene:
    potentials = [ConstantInterfaceCapacity(C_c=p["Cc"])] if p["Cc"] else []
    heat = [path("interface", "lower", p["h1"]), path("interface", "upper", p["h2"])]
    initial = {"T_1": p["T1"], "T_2": p["T2"]} | ({"T_c": p["Tc"]} if p["Cc"] else {})
    pair = bodies(energy=Constant, C_1=p["C1"], C_2=p["C2"])
    return Scene(pair, Interface("T_c", potentials), heat, loading, T_0=300.0, initial=initial)


def stiff_exchange(row: int) -> Table:
    p, columns = read("x06_stiff_exchange")
    values = p | {key: columns[key][row] for key in ("Cc", "h1", "h2")}
    exact = {"T_1": columns["T1"][[row]], "T_2": columns["T2"][[row]], "T_c": columns["Tc"][[row]]}
    scene = medium(values, {"Q_c": Hold(level=p["D"])})
    return Table(f"x06_stiff_exchange-{row}", scene, np.array([p["t"]]), exact, 1e-6)


def weakening_friction(column: str) -> Table:
    p, columns = read("f_dry_friction_mu_T0_over_T")
    energy = Constant if column.endswith("constC") else Quadratic
    loading = {"p": Hold(level=p["p"]), "v": Hold(level=p["v"])}
    law = Coulomb(mu=varying(p["mu0"], Power(exponent=-1.0)))
    if "visc" in column:
        gap = 1e-6
        eta = p["mu0"] * p["p"] / p["v"] * gap
        law, loading = Viscous(eta=varying(eta, Exponential(beta=p["beta"]))), loading | {"g_n": Hold(level=gap)}
        del loading["p"]
    C = p["C_tot"] / 2
    scene = perfect_contact([], T=p["T0"], T_0=p["T0"], C_1=C, C_2=C, energy=energy, frictions=[law], loading=loading)
    return Table(f"f_dry_friction-{column}", scene, columns["t"], {"T": columns[column]})


def friction_with_loss(name: str) -> Table:
    p, columns = read(name)
    loading = {"p": Hold(level=p["p"]), "v": Hold(level=p["v"])}
    law = Coulomb(mu=varying(p["mu0"], Power(exponent=-1.0)))
    C = p["C_tot"] / 2
    outside = {"heat": [path("lower", "surroundings", p["H"])], "surroundings": Hold(level=p["T_a"])}
    given = {"T": p["T0"], "T_0": p["T0"], "C_1": C, "C_2": C, "loading": loading}
    scene = perfect_contact([], frictions=[law], **given, **outside)
    return Table(name, scene, columns["t"], {"T": columns["T"]})


def adiabatic(name: str, reaction: Arrhenius) -> Table:
    p, columns = read(name)
    C = 2.0
    given = {"T": p["T_i"], "T_0": p["T_i"], "C_1": C / 2, "C_2": C / 2, "energy": Constant}
    scene = perfect_contact([LinearEnthalpy(H_r=C * p["dT_ad"])], [reaction], **given)
    return Table(name, scene, columns["t"], {"T": columns["T"], "phi": columns["phi"]})


def adiabatic_arrhenius(name: str) -> Table:
    p, _ = read(name)
    return adiabatic(name, Arrhenius(A=p["k0"], E_a=p["Ea"]))


def rate_proportional_to_temperature(name: str) -> Table:
    p, _ = read(name)
    return adiabatic(name, Arrhenius(A=p["k0"], b=1.0))


def isentropic_cooling(name: str) -> Table:
    p, columns = read(name)
    zone = ExponentialCohesiveZone(t_max=varying(p["t0"], Power(exponent=-1.0)), g_0=p["g0"], E_n=0.0)
    loading = {"g_n": Ramp(start=p["g_i"], rate=p["g0"])}
    C = p["C_tot"] / 2
    scene = perfect_contact([zone], T=p["T_i"], T_0=p["T0"], C_1=C, C_2=C, loading=loading)
    exact = {"T": columns["T"], "t_n": columns["t_n"]}
    return Table(name, scene, columns["g"] / p["g0"], exact, floors={"t_n": 1e-6})


def closing_film(name: str) -> Table:
    """Up to 1e-10 of the closing time before its end; beyond, rounding of t moves the gap."""
    p, columns = read(name)
    rows = columns["one_minus_t_over_tc"] > 0.9e-10
    loading = {"v": Hold(level=p["v"]), "g_n": Ramp(start=p["g_i"], rate=-p["a"])}
    C = p["C_tot"] / 2
    frictions = [Viscous(eta=p["eta"])]
    scene = perfect_contact([], T=p["T0"], T_0=p["T0"], C_1=C, C_2=C, frictions=frictions, loading=loading)
    return Table(name, scene, columns["t"][rows], {"T": columns["T"][rows]}, 1e-6)


def makers() -> dict[str, Callable[[], Table]]:
    """Every table by name, made when asked for."""
    by_file = {
        "S61": sliding,
        "S621": bonding,
        "S622": bonding,
        "S62x": bonding,
        "x01": lambda n: bonding(n, 1e-6),
        "x12": lambda n: bonding(n, 1e-6),
        "a_linear": linear_equilibrium,
        "b_exponential": exponential,
        "e_exchange": pair_exchange,
        "e_three": three_temperatures,
        "f_dry_friction_with": friction_with_loss,
        "k_adiabatic": adiabatic_arrhenius,
        "k_coupled": rate_proportional_to_temperature,
        "h_isentropic": isentropic_cooling,
        "x05": closing_film,
    }
    result: dict[str, Callable[[], Table]] = {}
    for file in sorted(FOLDER.glob("*.json")):
        for prefix, maker in by_file.items():
            if file.stem.startswith(f"{prefix}_") or (file.stem.startswith(prefix) and "_" in prefix):
                result[file.stem] = lambda maker=maker, stem=file.stem: maker(stem)
    for column in ("T_cooling", "T_heating_from_20K"):
        result[f"e_reservoir-{column}"] = lambda column=column: reservoir(column)
    for column in ("T_quadratic", "T_constC", "T_visc_exp_constC", "T_visc_exp_quadratic"):
        result[f"f_dry_friction-{column}"] = lambda column=column: weakening_friction(column)
    for row in range(36):
        result[f"x03_exponential-{row}"] = lambda row=row: exponential_overflow(row)
    for row in range(20):
        result[f"x06_stiff_exchange-{row}"] = lambda row=row: stiff_exchange(row)
    return result


def errors(table: Table, trajectory: Trajectory) -> dict[str, float]:
    """Largest relative error of each tabulated variable."""
    result, system = trajectory.result, trajectory.model.system
    rows = slice(-len(table.times), None)
    values = {state.name: result.outputs[rows, j] for j, state in enumerate(system.states)}
    values |= {item.name: trajectory.outputs[rows, j] for j, item in enumerate(system.outputs)}
    values |= {account.quantity.name: result.ledger_outputs[rows, j] for j, account in enumerate(system.ledger)}
    return {name: worst(values[name], exact, table.floors.get(name, 0.0)) for name, exact in table.exact.items()}


def worst(values, exact, floor: float) -> float:
    scale = np.maximum(np.abs(exact), floor * np.max(np.abs(exact)))
    error = np.abs(values - exact)
    return float(np.max(np.divide(error, scale, out=error, where=scale > 0)))
