"""A manufactured solution with everything coupled: three temperatures, bonds, a moving gap, friction and a direct path.

The sources that make chosen functions of time a solution are derived here from the equations as published, without the
assembler, and compared with the table; then the assembled scene must return the chosen functions.
"""

from collections.abc import Callable

import numpy as np
import pytest
import symengine as se
import tables
from scenes import bodies, path, varying

from surfacechem.contracts.terms import Friction, Load, RateLaw, option, parameter
from surfacechem.expressions import Expression
from surfacechem.laws.factors import Activated, Exponential, Linear, LinearInTemperature, Polynomial
from surfacechem.laws.free_energy import BondEnergy, InterfaceCapacity, NormalStiffness
from surfacechem.laws.kinetics import LinearAffinity
from surfacechem.laws.loading import Hold
from surfacechem.model.assemble import assemble
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Scene, Sites
from surfacechem.solve.run import Model, Run

N_C = 1e18


class Formula(Load):
    """Any expression of time."""

    formula_of: Callable[[Expression], Expression] = option("expression of t")

    def value(self, t):
        return self.formula_of(t)


class Source(RateLaw):
    """Bonds that appear at a prescribed rate."""

    formula_of: Callable[[Expression], Expression] = option("expression of t")

    def rate(self, t, n_c):
        return n_c * self.formula_of(t)


class Film(Friction):
    """A film of constant thickness."""

    eta: float = parameter("Pa s", "viscosity")
    thickness: float = parameter("m", "thickness")

    def traction(self, v):
        return self.eta * v / self.thickness


class Manufactured:
    """Exact functions of time and the sources that they need."""

    def __init__(self, p: dict[str, float]) -> None:
        self.p, self.t = p, se.Symbol("t")
        t, T_0 = self.t, p["T0"]
        self.exact = {
            "T_1": T_0 * (1 + se.sin(2 * t) / 20),
            "T_2": T_0 * (se.Rational(11, 10) - se.exp(-t) / 10),
            "T_c": T_0 * (1 + 2 * se.exp(-t / 3) * se.cos(t) / 25),
            "phi": 2 * se.sin(t + se.Rational(3, 10)) / 5 + se.Rational(1, 2),
            "g_n": p["g_a"] * (1 + se.sin(3 * t) / 2),
        }
        self.sources = self._sources()

    def _psi(self, g, phi, T):
        p = self.p
        T_0, ratio, theta = p["T0"], T / p["T0"], T - p["T0"]
        K = (p["K0"] + p["K1"] * ratio + p["K2"] * ratio**2) * (1 + p["d_K"] * g / p["g_a"])
        elastic = p["E0"] * (1 + p["a_E"] * phi) * (1 - p["b_E"] * theta) * g**2 / 2
        thermal = -p["C0"] * (1 + p["a_C"] * phi) * theta**2 / (2 * T_0)
        return elastic + thermal + K * (phi - p["phi_e0"] - p["phi_e1"] * (ratio - 1)) ** 2 / 2

    def _sources(self):
        p, t, x = self.p, self.t, self.exact
        g, phi, T = se.symbols("g phi T")
        psi = self._psi(g, phi, T)
        at = {g: x["g_n"], phi: x["phi"], T: x["T_c"]}
        h_1, h_2, c_r = (p[name] * p["stiff"] for name in ("h1", "h2", "c_over_n"))
        direct = p["h_d"] * (x["T_2"] - x["T_1"])
        q_1, q_2 = h_1 * (x["T_c"] - x["T_1"]) + direct, h_2 * (x["T_c"] - x["T_2"]) - direct
        D = p["eta"] * se.exp(-p["beta"] * (x["T_c"] - p["T0"])) * p["v"] ** 2 / p["g_film"]
        U = (psi - T * psi.diff(T)).subs(at)
        power = psi.diff(g).subs(at) * x["g_n"].diff(t)
        k = c_r * se.exp(-p["Ea"] / GAS_CONSTANT * (1 / x["T_c"] - 1 / p["T0"]))
        return {
            "Q_1": p["C1"] * x["T_1"] * x["T_1"].diff(t) / p["T0"] - q_1,
            "Q_2": p["C2"] * x["T_2"] * x["T_2"].diff(t) / p["T0"] - q_2,
            "Q_c": U.diff(t) - power - D + q_1 + q_2,
            "r_phi": x["phi"].diff(t) + k * psi.diff(phi).subs(at),
        }

    def function(self, name: str) -> Callable[[Expression], Expression]:
        expression = (self.exact | self.sources)[name]
        return lambda t: expression.subs({self.t: t})

    def values(self, name: str, times: np.ndarray) -> np.ndarray:
        expression = (self.exact | self.sources)[name]
        return np.array([float(expression.subs({self.t: time}).n(200, real=True)) for time in times])

    def scene(self) -> Scene:
        p = self.p
        stiff = p["stiff"]
        potentials = [
            NormalStiffness(
                E_n=varying(p["E0"], Linear(of="phi", slope=p["a_E"]), LinearInTemperature(slope=-p["b_E"]))
            ),
            InterfaceCapacity(C_c=varying(p["C0"], Linear(of="phi", slope=p["a_C"]))),
            BondEnergy(
                K_0=p["K0"],
                K_1=p["K1"],
                K_2=p["K2"],
                K=varying(1.0, Linear(of="g_n", slope=p["d_K"] / p["g_a"])),
                phi_eq=varying(1.0, Polynomial(c_0=p["phi_e0"] - p["phi_e1"], c_1=p["phi_e1"])),
            ),
        ]
        reactions = [
            LinearAffinity(c_r=varying(p["c_over_n"] * stiff * N_C, Activated(E_a=p["Ea"]))),
            Source(formula_of=self.function("r_phi")),
        ]
        film = Film(eta=varying(p["eta"], Exponential(beta=p["beta"])), thickness=p["g_film"])
        heat = [
            path("interface", "lower", p["h1"] * stiff),
            path("interface", "upper", p["h2"] * stiff),
            path("lower", "upper", p["h_d"]),
        ]
        loading = {name: Formula(formula_of=self.function(name)) for name in ("g_n", "Q_1", "Q_2", "Q_c")}
        initial = {name: float(self.values(name, np.zeros(1))[0]) for name in ("T_1", "T_2", "T_c", "phi")}
        interface = Interface("T_c", potentials, [film], reactions, Sites(N_C, N_C))
        pair = bodies(C_1=p["C1"], C_2=p["C2"])
        return Scene(pair, interface, heat, loading | {"v": Hold(level=p["v"])}, None, p["T0"], initial)


@pytest.fixture(params=["l_mms_coupled", "l_mms_coupled_stiff"])
def manufactured(request):
    parameters, columns = tables.read(request.param)
    return Manufactured(parameters), columns


def test_sources_agree_with_the_table(manufactured):
    solution, columns = manufactured
    for name, column in {"Q_1": "Q1", "Q_2": "Q2", "Q_c": "Qc", "r_phi": "r_phi", "T_c": "Tc", "g_n": "g"}.items():
        assert solution.values(name, columns["t"]) == pytest.approx(columns[column], rel=1e-12)


def test_the_scene_returns_the_manufactured_solution(manufactured):
    solution, columns = manufactured
    model = Model(assemble(solution.scene()))
    trajectory = model.solve(Run(times=columns["t"]))
    assert trajectory.status == "finished", trajectory.reason
    tolerance = 1e-6 if solution.p["stiff"] > 1 else 1e-8
    for j, state in enumerate(model.system.states):
        exact = columns[{"T_1": "T1", "T_2": "T2", "T_c": "Tc", "phi": "phi"}[state.name]]
        assert trajectory.result.outputs[:, j] == pytest.approx(exact, rel=tolerance)
    assert audit(trajectory).energy_error < 1e-9
