"""What random scenes brought to light: each cause by itself, in the smallest scene that shows it."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import SITES, bodies, path, perfect_contact, varying
from solved import solve

import surfacechem
from surfacechem.errors import InputError
from surfacechem.laws.cohesive import AdhesionIntensity
from surfacechem.laws.factors import Linear
from surfacechem.laws.films import FilmCapacity
from surfacechem.laws.free_energy import Constant, LatticeGas, LinearEnthalpy
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.heat_transfer import GasGap, PressureConductance
from surfacechem.laws.kinetics import DudkoHummerSzabo, LinearAffinity, Relaxation
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.results.solution import Solution
from surfacechem.scene import Interface, Medium, Scene
from surfacechem.solve.contract import Status
from surfacechem.solve.diagnose import beyond_numbers, closest_margin

APART = {"T_1": 300.0, "T_2": 310.0}


def run(scene, end):
    return solve(scene, end, max_steps=20_000)


def test_a_parameter_called_M_is_not_the_chemical_potential():
    interface = Interface(None, [LinearEnthalpy(H_r=0.3)], (), [LinearAffinity(c_r=1e10)], SITES)
    gas = GasGap(between=("lower", "upper"), k=0.026, M=3.7e-7)
    loading = {"g_n": Hold(level=1e-6)}
    scene = Scene(bodies(energy=Constant), interface, [gas], loading, None, 300.0, APART | {"phi": 0.1})
    trajectory = run(scene, 1e-3)
    assert trajectory["q_12"][0] == pytest.approx(0.026 / 1.37e-6 * -10, rel=1e-12)


def test_a_parameter_called_C_T_is_not_the_capacity_of_a_node_T():
    adhesion = AdhesionIntensity(C_N=1e12, C_T=varying(1e12, Linear(of="T_c", slope=0.0, about=0.0)), w=1.0, E_n=1e14)
    loading = {"g_t": Hold(level=1e-6), "g_n": Hold(level=0.0), "phi": Hold(level=0.5)}
    scene = perfect_contact([adhesion], loading=loading)
    trajectory = run(scene, 1.0)
    assert trajectory["t_e"][0] == pytest.approx(0.25 * 1e12 * 1e-6, rel=1e-12)


def test_relaxation_needs_a_potential_that_curves():
    with pytest.raises(InputError, match=r"relaxation holds for dmu_dphi > 0 only; .* always 0"):
        assemble(perfect_contact([LinearEnthalpy(H_r=1.0)], [Relaxation(tau=1.0)]))


def test_the_range_of_a_law_of_bonds_is_a_number():
    law = DudkoHummerSzabo(k_off=0.1, x_off=1e-10, barrier=2e-20)
    loading = {"f": Ramp(start=0.0, rate=1e-9)}
    solution = Solution(run(perfect_contact([LatticeGas(epsilon=1e-20)], [law], phi=0.5, loading=loading), 1.0))
    assert any("dudko hummer szabo is an extrapolation" in warning for warning in solution.warnings)


def test_a_film_that_stores_heat_needs_a_temperature_of_its_own():
    medium = Medium(None, {"rho_m": 1e3, "cp_m": 2e3}, 1e-6)
    interface = Interface(None, [FilmCapacity()], medium=medium)
    with pytest.raises(InputError, match="depends on temperature, but the interface has none"):
        assemble(Scene(bodies(), interface, [path("lower", "upper", 1.0)], {}, None, 300.0, APART))


def test_a_parameter_that_varies_and_is_zero_is_in_its_range():
    law = PressureConductance(between=("lower", "upper"), h_c=varying(0.0, Linear(of="phi", slope=-1.5)), H=1e9)
    loading = {"phi": Ramp(start=0.1, rate=0.5), "p": Hold(level=1e6)}
    assert run(Scene(bodies(), Interface(None), [law], loading, None, 300.0, APART), 1.5).status == "finished"


def test_a_parameter_that_varies_out_of_its_range_stops_the_run(monkeypatch: pytest.MonkeyPatch):
    law = PressureConductance(between=("lower", "upper"), h_c=1e3, H=varying(1e9, Linear(of="phi", slope=-1.5)))
    loading = {"phi": Ramp(start=0.1, rate=0.5), "p": Hold(level=1e6)}
    scene = Scene(bodies(), Interface(None), [law], loading, None, 300.0, APART)
    trajectory = run(scene, 1.5)
    assert trajectory.status == "stopped"
    assert trajectory.reason.startswith("pressure conductance: H left its range (> 0) as it varies near t = 1.13333")
    # An event at a margin that is open, which has jumped at the pole of another one, is not the reason.
    index = [margin.name for margin in trajectory.model.margins].index("T_1 > 0")
    jumped = trajectory.result._replace(status=Status.EVENT, events=SimpleNamespace(index=np.array([index])))
    assert "H left its range" in trajectory.model.verdict(trajectory.run, jumped, trajectory.values)[1]
    monkeypatch.setattr(Linear, "limits", {"x": (0.0, 0.5)})
    assert run(scene, 1.5).reason.startswith("phi left the range of the law linear, 0 to 0.5 at t = 0.8")


def test_what_is_no_number_a_little_later_is_named():
    result = SimpleNamespace(status=Status.NOT_FINITE, steps=SimpleNamespace(t=np.array([0.0, 1.0])))
    result.y, result.ydot = np.array([1.0]), np.array([1.0])
    system = SimpleNamespace(output_columns={"even": 0, "late": 1, "soon": 2, "never": 3})

    def named(rows):
        y = rows[:, 1]
        return np.column_stack([y, np.log(5.0 - y), 1.0 / (2.0 - y), np.full(len(y), np.nan)])

    inputs = np.array([1.0, 1.0, 1.0])
    assert beyond_numbers(system, result, inputs, named) == "soon leaves the range of numbers"
    assert beyond_numbers(system, result, inputs, lambda rows: named(rows)[:, [0, 0, 0, 3]]) is None
    result.status = Status.SINGULAR
    assert beyond_numbers(system, result, inputs, named) is None


def test_a_bound_that_a_loose_tolerance_passes_is_not_told_to_be_passed_by_roundoff():
    run = surfacechem.load("adiabatic-arrhenius", ["run.solver=dop853", "run.rtol=1e-2"]).run()
    assert run.status == "failed"
    assert re.search(
        r"rose above its bound 1 at .*: the rates lead back from it; at this `rtol` steps may err", run.reason
    )


def test_a_run_that_takes_too_many_steps_says_how_many_and_what_for():
    loading = {"p": Hold(level=5e6), "v": Harmonic(amplitude=1e-2, frequency=50.0)}
    friction = Interface(None, frictions=[Coulomb(mu=0.3)])
    run = solve(Scene(bodies(), friction, [], loading, None, 300.0, APART), 10.0, max_steps=1000)
    assert "`run.max-steps` is 1000, and " in run.reason
    assert " of them ended at events, or where loads turn" in run.reason
    # No margin is told to close where all of them and the states stand still.
    still = run.result._replace(status=Status.STEP_UNDERFLOW, ydot=np.zeros(2))
    assert closest_margin(run.system, run.model.program, run.model.margins, still) is None


def test_an_interface_whose_balance_is_roundoff_is_named():
    """A damper is torn open within nanoseconds: its heat is 1e16 times what passes through the interface."""
    found = surfacechem.run("""
T_0: 300 K
bodies: {lower: {temperature: T_1, C: 10 kJ/m^2/K}, upper: {temperature: T_2, C: 100 kJ/m^2/K}}
interface: {temperature: T_c, potential: [normal-stiffness: {E_n: 1e14 Pa/m}]}
heat: [conductance: {between: [lower, interface], h: 1e3}, conductance: {between: [interface, upper], h: 1e3}]
mechanics: {normal: {k: 2e16 Pa/m, m: 3e15 kg/m^2, c_b: 4e18 Pa s/m, beta_1: 0}}
loading: {w_n: {table: {times: [0 s, 1 s, 1.00000001 s], values: [0 nm, 0 nm, 100 nm]}}}
initial: {T_1: 360 K, T_2: 300 K, g_n: 0 m}
run: {until: 2 s}
""")
    assert found.status == "stopped"
    assert found.reason.startswith("roundoff hides T_c = 329 K: ")
