"""The work of a prescribed force belongs to the affinity of pairs of rates, as their distances define it."""

import math

import numpy as np
import pytest

import surfacechem
from surfacechem.mechanism import load_mechanism
from surfacechem.quantities import BOLTZMANN
from surfacechem.ratecurves import Curves

KT = BOLTZMANN * 298.15
LENGTH = 3.8e-9  # 0.4 nm + 3.4 nm

MECHANISM = """
units: {{length: m, quantity: mol, activation-energy: kJ/mol}}
phases:
- {{name: clutch, thermo: ideal-surface, kinetics: surface, species: [free, a, b, c], reactions: all,
   site-density: 1e-10 mol/m^2}}
species:
- {{name: free, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
- {{name: a, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
- {{name: b, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
- {{name: c, composition: {{}}, thermo: {{model: constant-cp, h0: 0, s0: 0, cp0: 0}}}}
reactions:
{reactions}
"""
STEP = "- {{equation: {0} => {1}, type: Bell, rate-constant: {{A: {2}, b: 0, Ea: 0}}, x-beta: {3} nm}}\n"
CASE = """
bodies:
  lower: {{temperature: 298.15 K}}
  upper: {{temperature: 298.15 K}}
interface: {{temperature: 298.15 K, mechanism: {{file: bonds.yaml, bonds: [a, b, c]}}}}
loading: {{f: {force}}}
initial: {{coverages: {{a: 1}}}}
run: {{until: 1 s}}
"""


def pairs(folder, *steps, force="10 pN", reversible="", duplicate=False):
    """A case of pairs of rates: species, species, rates at no force, distances [nm]."""
    mark = ", duplicate: true}" if duplicate else "}"
    lines = [STEP.format(a, b, f"{k} 1/s", x).replace(" nm}", " nm" + mark) for a, b, k, x in steps]
    (folder / "bonds.yaml").write_text(MECHANISM.format(reactions="".join(lines) + reversible))
    path = folder / "case.yaml"
    path.write_text(CASE.format(force=force))
    return surfacechem.load(path)


def both(a, b, x_f, x_r, k_f=1.0, k_r=1.0):
    return (a, b, k_f, x_f), (b, a, k_r, x_r)


@pytest.mark.parametrize("force", ["0 pN", "8 pN", "30 pN"])
def test_vinculin_keeps_detailed_balance_under_any_force(force):
    solution = surfacechem.load("vinculin-catch-bond", {"loading.f": force}).run()
    data = solution.dataset
    np.testing.assert_allclose(data["departure_R3_R4"], math.log(6.1 / 43) + 16.24 / 8.314462618, atol=1e-10)
    assert solution.audit.violations == ()
    assert all(verdict.consistent for verdict in solution.verdicts)


def test_the_force_works_along_the_distances():
    data = surfacechem.load("vinculin-catch-bond", {"run.outputs": 4001}).run().dataset.isel(time=slice(1, None))
    rate = data["R_R3"] - data["R_R4"]
    f, T = 8e-12, 298.15
    entropy = -16.24 / 6.02214076e23
    affinity = f * LENGTH - (-T * entropy + KT * np.log(data["theta_strong_s"] / data["theta_weak_s"]))
    np.testing.assert_allclose(data["sigma_R3_R4"], rate * affinity / T, rtol=1e-9)
    work = np.trapezoid(f * LENGTH * rate, data["time"])
    assert float(data["W_f"][-1] - data["W_f"][0]) == pytest.approx(float(work), rel=1e-4)


def test_a_ramp_that_jumps_needs_no_work_of_its_own(tmp_path):
    force = "{table: {times: [0 s, 0.5 s, 0.5 s, 1 s], values: [0 pN, 5 pN, 20 pN, 20 pN]}}"
    solution = pairs(tmp_path, *both("a", "b", 0.3, -0.7), force=force).run()
    assert solution.audit.energy_error < 1e-10
    assert solution.audit.violations == ()
    assert float(np.abs(solution.dataset["departure_R1_R2"]).max()) < 1e-12


def test_an_inconsistent_pair_is_found_with_the_size_of_its_error(tmp_path):
    solution = pairs(tmp_path, *both("a", "b", 0.3, -0.7, k_f=10.0)).run()
    (verdict,) = solution.verdicts
    assert verdict.low == pytest.approx(math.log(10.0), abs=1e-12)
    assert verdict.high == pytest.approx(math.log(10.0), abs=1e-12)
    assert "by a factor exp(2.3) at most" in str(verdict)


def test_around_a_cycle_distances_have_to_close(tmp_path):
    """Three pairs of 1, 1 and -2 nm close; of 1, 1 and 1 nm they do not, by 3 nm that the three share."""
    closed = [*both("a", "b", 0.4, -0.6), *both("b", "c", 0.5, -0.5), *both("c", "a", -1.0, 1.0)]
    open_ones = [*closed[:4], *both("c", "a", 0.5, -0.5)]
    for steps, expected in ((closed, 0.0), (open_ones, 1e-9 * 10e-12 / KT)):
        data = pairs(tmp_path, *steps).run().dataset
        for label in ("R1_R2", "R3_R4", "R5_R6"):
            np.testing.assert_allclose(data[f"departure_{label}"], expected, atol=1e-10)


def test_a_reaction_whose_reverse_knows_no_force_keeps_its_equilibrium(tmp_path):
    """Between a and b one reversible reaction says that no length changes, so a pair that says otherwise departs."""
    reversible = "- {equation: a <=> b, duplicate: true, rate-constant: {A: 2 1/s, b: 0, Ea: 0}}\n"
    data = pairs(tmp_path, *both("a", "b", 0.4, -0.6), reversible=reversible, duplicate=True).run().dataset
    np.testing.assert_allclose(data["departure_R1_R2"], 1e-9 * 10e-12 / KT, atol=1e-10)


def test_ruptures_that_nothing_undoes_take_no_work(tmp_path):
    data = pairs(tmp_path, ("a", "free", 1.0, 0.5)).run().dataset
    assert "W_f" not in data


def test_the_sheet_of_a_mechanism_says_the_same():
    curves = Curves(load_mechanism("vinculin.yaml"))
    (pair,) = curves.pairs
    values = curves.departure(pair, np.array(298.15), np.linspace(0, 40e-12, 9))
    np.testing.assert_allclose(values, math.log(6.1 / 43) + 16.24 / 8.314462618, atol=1e-9)
    K = curves.log_equilibrium("R3", np.array(298.15), np.array([0.0, 1e-11]))
    assert K[1] - K[0] == pytest.approx(1e-11 * LENGTH / KT, rel=1e-9)
    free = curves.log_equilibrium("R2", np.array(298.15), np.array([0.0, 1e-11]))
    assert free[1] == free[0]
