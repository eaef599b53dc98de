"""The exact tables of bonds under load and of cure, each with the scene it solves."""

from collections.abc import Callable

import numpy as np
from scenes import perfect_contact
from tables import Table, read

from surfacechem.laws.free_energy import BondSprings, Constant, LatticeGas, LinearEnthalpy, Quadratic
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.kinetics import Arrhenius, Bell, KamalSourour, ReversibleBell
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.quantities import BOLTZMANN
from surfacechem.scene import Body, Interface, Scene, Sites

SITES = 1e16
RESOLVED = 1e-8
"""Part of its life that a cluster must have left; closer to its end, the last digits of that life decide."""


def isothermal(law, loading, phi=1.0, T=300.0, sites=SITES, potentials=()) -> Scene:
    """Bonds between two reservoirs of one temperature."""
    kept = Hold(level=T)
    interface = Interface(kept, potentials, reactions=[law], sites=Sites(sites, sites))
    return Scene((Body("lower", kept), Body("upper", kept)), interface, loading=loading, initial={"phi": phi})


def bell(p: dict[str, float], **more: float) -> Bell:
    return Bell(k_off=p["k0"], x_off=p["x"], **more)


def constant_force(name: str) -> Table:
    p, columns = read(name)
    return Table(name, isothermal(bell(p), {"f": Hold(level=p["F"])}), columns["t"], {"phi": columns["S"]})


def ramp_survival(name: str) -> Table:
    p, columns = read(name)
    exact = {"phi": columns["S"], "R_bell": -SITES * p["r"] * columns["pdf"]}
    return Table(name, isothermal(bell(p), {"f": Ramp(rate=p["r"])}), columns["F"] / p["r"], exact)


def cluster(per_bond: float, rebinding: float = 0.0, phi: float = 1.0) -> Scene:
    """Bonds that share a constant load of ``per_bond``, in k_B T / x, if all are closed; times are in 1/k_off."""
    x, T = 4e-10, 300.0
    law = Bell(k_off=1.0, x_off=x, k_on=rebinding)
    return isothermal(law, {"t_n": Hold(level=per_bond * SITES * BOLTZMANN * T / x)}, phi, T)


def no_rebinding(name: str, left: float = RESOLVED) -> Table:
    p, columns = read(name)
    rows = columns["one_minus_tau_over_taustar"] >= left
    exact = {"phi": columns["N"][rows] / p["N_t"]}
    return Table(name, cluster(p["f"] / p["N_t"]), columns["tau"][rows], exact, 1e-6)


def kamal(name: str) -> Table:
    p, columns = read(name)
    law = KamalSourour(A_1=p["A1"], E_1=p["E1"], A_2=p["A2"], E_2=p["E2"], m=p["m"], n=p["n"])
    C = 2.0
    start, energy = (p["alpha_i"], p["T_i"]), Constant if name.endswith("const_capacity") else Quadratic
    given = {"C_1": C / 2, "C_2": C / 2, "T_0": p["T_i"], "energy": energy}
    scene = perfect_contact([LinearEnthalpy(H_r=C * p["dT_ad"])], [law], *start, **given)
    return Table(name, scene, columns["t"], {"phi": columns["alpha"], "T": columns["T"]})


def lattice_gas(row: int) -> Table:
    p, columns = read("x_latticegas_equilibrium")
    g, phi, t_n = (columns[key][row] for key in ("g", "phi_eq", "t_n"))
    potentials = [LatticeGas(epsilon=p["eps"]), BondSprings(k_b=p["k_b"])]
    law = ReversibleBell(k_off=1.0, x_off=4e-10)
    scene = isothermal(law, {"g_n": Hold(level=g)}, 0.5, p["T"], p["n_c"], potentials)
    return Table(f"lattice-gas-{row}", scene, np.array([1e3]), {"phi": np.array([phi]), "t_n": np.array([t_n])}, 1e-8)


def ignited(name: str) -> Table:
    p, columns = read(name)
    C, rubbing = p["C_tot"] / 2, {"p": Hold(level=2.0), "v": Hold(level=p["D"])}
    given = {"T_0": p["T_i"], "energy": Constant, "frictions": [Coulomb(mu=0.5)], "loading": rubbing}
    scene = perfect_contact([], [Arrhenius(A=p["k0"], E_a=p["Ea"])], 0.0, p["T_i"], C, C, **given)
    return Table(name, scene, columns["t"], {"phi": columns["phi"], "T": columns["T"]})


def makers() -> dict[str, Callable[[], Table]]:
    """Every table by name, made when asked for."""
    whole = {
        "c_bell_constant_force": constant_force,
        "c_bell_ramp_survival": ramp_survival,
        "d_cluster_no_rebinding": no_rebinding,
        "k_kamal_const_capacity": kamal,
        "k_kamal_quadratic_energy": kamal,
        "x18_friction_ignited_bonding": ignited,
    }
    result: dict[str, Callable[[], Table]] = {
        name: lambda maker=maker, name=name: maker(name) for name, maker in whole.items()
    }
    for row in range(20):
        result[f"x_latticegas_equilibrium-{row}"] = lambda row=row: lattice_gas(row)
    return result
