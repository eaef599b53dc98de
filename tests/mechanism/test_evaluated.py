"""Mechanisms that are not lowered: Cantera gives the rates while a scene runs, and energy is conserved."""

import dataclasses
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import surfacechem
from surfacechem.errors import InputError

pytestmark = pytest.mark.around

MECHANISM = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
extensions: [{type: python, name: foreign_rates}]
phases:
- name: film
  thermo: ideal-surface
  kinetics: surface
  species: [free(s), bond(s)]
  reactions: all
  site-density: 5e-5 mol/m^2
species:
- {name: free(s), composition: {H: 1}, thermo: {model: constant-cp, h0: 0 kJ/mol, s0: 0 J/mol/K, cp0: 30 J/mol/K}}
- {name: bond(s), composition: {H: 1}, thermo: {model: constant-cp, h0: -40 kJ/mol, s0: -110 J/mol/K, cp0: 25 J/mol/K}}
reactions:
"""
FOREIGN = "- {equation: free(s) <=> bond(s), type: foreign-exponential, A: 3.0e4, Ta: 2500}\n"
LOWERED = "- {equation: free(s) <=> bond(s), rate-constant: {A: 3.0e4, b: 0, Ea: 2500 K}}\n"
BLOWERS_MASEL = LOWERED.replace("rate", "type: Blowers-Masel, rate").replace("Ea: 2500 K", "Ea0: 20, w: 400")
CASE = """
bodies:
  lower: {temperature: T_1, C: 2 kJ/m^2/K, capacity: constant}
  upper: {temperature: T_2, C: 1 kJ/m^2/K, capacity: constant}
interface:
  temperature: T_c
  potential: [constant-interface-capacity: {C_c: 42 J/m^2/K}]
  mechanism: {file: film.yaml, bonds: [bond(s)]}
heat:
  - conductance: {between: [lower, interface], h: 2100 W/m^2/K}
  - conductance: {between: [upper, interface], h: 4200 W/m^2/K}
T_0: 298.15 K
initial: {T_1: 298.15 K, T_2: 345 K, T_c: 298.15 K, coverages: {free(s): 1}}
run: {until: 30 ms, outputs: 11, solver: cantera, rtol: 1e-8}
"""
EXTENSION = """
import math
import cantera as ct


class Data(ct.ExtensibleRateData):
    def update(self, surface):
        self.T = surface.T
        return True


@ct.extension(name="foreign-exponential", data=Data)
class ForeignExponential(ct.ExtensibleRate):
    def set_parameters(self, node, units):
        self.A, self.Ta = node["A"], node["Ta"]

    def get_parameters(self, node):
        node["A"], node["Ta"] = self.A, self.Ta

    def eval(self, data):
        return self.A * math.exp(-self.Ta / data.T)
"""


@pytest.fixture
def case(tmp_path, monkeypatch):
    """Writes a case with a mechanism beside it; another's extension can be imported."""
    (tmp_path / "foreign_rates.py").write_text(EXTENSION)
    monkeypatch.syspath_prepend(tmp_path)

    def write(reaction, text=CASE):
        (tmp_path / "film.yaml").write_text(MECHANISM + reaction)
        path = tmp_path / "case.yaml"
        path.write_text(text)
        return path

    return write


def outputs(solution):
    return solution.trajectory.result.outputs


def test_as_if_it_were_lowered(case):
    lowered = surfacechem.run(case(LOWERED), {"run.solver": "radau"})
    evaluated = surfacechem.run(case(FOREIGN))
    assert evaluated.status == "finished"
    scale = np.abs(outputs(lowered)).max(axis=0)
    assert np.all(np.abs(outputs(evaluated) - outputs(lowered)) < 1e-6 * scale)
    ours, theirs = evaluated.dataset, lowered.dataset
    assert set(ours.variables) == set(theirs.variables)
    rate = theirs["R_R1"].values
    np.testing.assert_allclose(ours["R_R1"].values, rate, atol=1e-6 * abs(rate).max(), rtol=0)
    assert evaluated.audit.energy_error < 1e-10
    assert evaluated.audit.site_error < 100 * 1e-8  # its tolerance
    assert evaluated.audit.violations == ()


def test_a_run_without_an_output_asks_for_nothing(case):
    program = surfacechem.load(case(FOREIGN)).model.program
    assert program.filled(np.empty((0, program.n_inputs))).shape == (0, program.n_inputs)


def test_a_compiled_solver_cannot_ask(case):
    with pytest.raises(InputError, match=r"film\.yaml:15: .*'Blowers-Masel' is not lowered.*solver: cantera"):
        surfacechem.load(case(BLOWERS_MASEL), {"run.solver": "radau"})
    simulation = surfacechem.load(case(FOREIGN))
    with pytest.raises(InputError, match="come from Cantera itself, which the solver radau cannot ask"):
        simulation.run(run=dataclasses.replace(simulation.case.run, solver="radau"))


def test_an_evaluated_rate_is_no_parameter(case):
    with pytest.raises(InputError, match=r"no parameter 'mechanism\.R1\.value' to change"):
        surfacechem.load(case(FOREIGN)).run({"mechanism.R1.value": 1.0})
    with pytest.raises(InputError, match=r"no parameter 'x' to sweep\. Known: [^:]*$") as refused:
        surfacechem.load(case(FOREIGN)).sweep({"x": [1.0]})
    assert "mechanism.R1" not in str(refused.value)


def test_an_evaluated_mechanism_is_swept_run_by_run(case):
    simulation = surfacechem.load(case(FOREIGN), {"run.until": "3 ms"})
    data = simulation.sweep({"initial.T_2": [330.0, 345.0]}).dataset
    assert data["T_2"].values[1].tobytes() == simulation.run().dataset["T_2"].values.tobytes()


def test_the_threads_of_a_sweep_ask_a_surface_in_turn(case):
    simulation = surfacechem.load(case(FOREIGN), {"run.until": "3 ms"})
    temperatures, interval = np.linspace(330.0, 360.0, 9), sys.getswitchinterval()

    def end(T):
        return simulation.run({"initial.T_2": T}, error="balances").trajectory.result.y.tolist()

    alone = [end(T) for T in temperatures]
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(3) as pool:
            assert list(pool.map(end, temperatures)) == alone
    finally:
        sys.setswitchinterval(interval)


def test_an_interface_without_capacity(case):
    path = case(FOREIGN, CASE.replace("  potential: [constant-interface-capacity: {C_c: 42 J/m^2/K}]\n", ""))
    film = path.parent / "film.yaml"
    film.write_text(film.read_text().replace(", cp0: 30 J/mol/K", "").replace(", cp0: 25 J/mol/K", ""))
    with pytest.raises(InputError, match="T_c has no heat capacity, so it would have to be found together"):
        assert surfacechem.load(path).system


def test_the_precision_of_a_case_that_only_cantera_can_run(case):
    study = surfacechem.precision(case(BLOWERS_MASEL), ["radau", "cantera"], [1e-4, 1e-7], repeat=1)
    data = study.dataset.isel(case=0)
    assert data["status"].values.tolist() == [["omitted", "omitted"], ["finished", "finished"]]
    assert str(data["reference"].values) == "cantera alone, which no second method confirms"
    loose, tight = data["error_max"].values[1]
    assert float(data["uncertainty_max"]) < tight < loose
    assert any("radau: rates of the mechanism come from Cantera itself" in line for line in study.page.omissions)
