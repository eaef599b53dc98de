"""Thermo that depends on coverages: Cantera's numbers, one potential, both laws of thermodynamics."""

import json
import re

import cantera as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_rates import _quiet, compare  # noqa: F401 - a fixture

import surfacechem
from mechanisms import mechanism_texts, number, states
from surfacechem.errors import InputError
from surfacechem.mechanism import load_mechanism
from surfacechem.studies.mechanism_report import Curves, Span, remarks

TEXT = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
phases:
- name: film
  thermo: coverage-dependent-surface
  kinetics: surface
  species: [free(s), CO(s), O(s)]
  reactions: all
  site-density: 5e-5 mol/m^2
  reference-state-coverage: 0.25
species:
- {name: free(s), composition: {}, thermo: {model: constant-cp, T0: 298.15 K, h0: 0 kJ/mol, s0: 0 J/mol/K}}
- name: CO(s)
  composition: {}
  thermo: {model: constant-cp, T0: 298.15 K, h0: -20 kJ/mol, s0: -40 J/mol/K}
  coverage-dependencies:
    CO(s): {model: piecewise-linear, enthalpy-low: 10 kJ/mol, enthalpy-high: 30 kJ/mol, enthalpy-change: 0.4}
    O(s): {model: linear, enthalpy: 12 kJ/mol, entropy: 5 J/mol/K}
- name: O(s)
  composition: {}
  thermo: {model: constant-cp, T0: 298.15 K, h0: -15 kJ/mol, s0: -30 J/mol/K}
  coverage-dependencies:
    CO(s): {model: linear, enthalpy: 12 kJ/mol, entropy: 5 J/mol/K}
reactions:
- {equation: free(s) <=> CO(s), rate-constant: {A: 20, b: 0, Ea: 0}}
- {equation: free(s) <=> O(s), rate-constant: {A: 7, b: 0, Ea: 0}}
- {equation: CO(s) <=> O(s), rate-constant: {A: 3, b: 0, Ea: 0}}
"""
CASE = """
bodies:
  lower: {temperature: T, C: 20 J/m^2/K, capacity: constant}
  upper: {temperature: T, C: 20 J/m^2/K, capacity: constant}
interface: {temperature: T, mechanism: {file: film.yaml, bonds: [CO(s)]}}
T_0: 300 K
initial: {T: 300 K, coverages: {free(s): 0.8, CO(s): 0.1, O(s): 0.1}}
run: {until: 60 s}
"""


@st.composite
def dependence(draw):
    """What depends on a species' own coverage, which may be of any kind."""
    energy, entropy = 2e7 * draw(number), 1e4 * draw(number)
    knots = [0.0, 0.3, 0.7, 1.0]
    node = {
        "linear": {"enthalpy": energy, "entropy": entropy},
        "polynomial": {
            "enthalpy-coefficients": [energy, -energy / 2, 0.1 * energy, 0.0],
            "entropy-coefficients": [0.0, entropy, 0.0, entropy],
        },
        "piecewise-linear": {
            "enthalpy-low": energy,
            "enthalpy-high": -energy,
            "enthalpy-change": 0.4,
            "entropy-low": entropy,
            "entropy-high": 2 * entropy,
            "entropy-change": 0.2,
        },
        "interpolative": {
            "enthalpy-coverages": knots,
            "enthalpies": [0.0, energy, 0.0, 2 * energy],
            "entropy-coverages": knots,
            "entropies": [0.0, entropy, entropy, 0.0],
        },
    }
    model = draw(st.sampled_from(sorted(node)))
    capacity = {"heat-capacity-a": 1e3 * draw(number), "heat-capacity-b": 1e4 * draw(number)}
    return {"model": model, **node[model], **(capacity if draw(st.booleans()) else {})}


@st.composite
def interacting(draw):
    """A random mechanism with dependences of every kind that derive from a potential."""
    mechanism = json.loads(draw(mechanism_texts()))
    mechanism["phases"][0] |= {"thermo": "coverage-dependent-surface", "reference-state-coverage": 0.3}
    species = mechanism["species"]
    for k, item in enumerate(species):
        own = item.setdefault("coverage-dependencies", {})
        if draw(st.booleans()):
            own[item["name"]] = draw(dependence())
        for other in species[:k]:
            if draw(st.booleans()):
                h, s = 1e7 * draw(number), 1e4 * draw(number)
                pairs = ((item, other), (other, item))
                for one, another in pairs:
                    node = {"model": "linear", "enthalpy": h * one["sites"], "entropy": s * one["sites"]}
                    one["coverage-dependencies"][another["name"]] = node
    return json.dumps(mechanism)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("interaction") / "random.yaml"


@given(text=interacting(), data=st.data())
@settings(max_examples=10)
def test_random_mechanisms_agree_with_cantera(file, text, data):
    file.write_text(text)
    mechanism = load_mechanism(file)
    compare(mechanism, *data.draw(states(len(mechanism.variables))))


@pytest.fixture
def case(tmp_path):
    (tmp_path / "film.yaml").write_text(TEXT)
    path = tmp_path / "case.yaml"
    path.write_text(CASE)
    return path


def test_both_laws_hold_and_it_ends_in_cantera_s_equilibrium(case):
    solution = surfacechem.run(case)
    audit = solution.audit
    assert solution.status == "finished"
    assert audit.energy_error < 1e-9
    assert audit.entropy_error < 1e-9
    assert audit.violations == ()
    end = solution.dataset.isel(time=-1)
    surface = ct.Interface(yaml=TEXT, name="film")
    surface.TP = float(end["T"]), ct.one_atm
    surface.coverages = [float(end[f"theta_{name}_s"]) for name in ("free", "CO", "O")]
    mu = surface.chemical_potentials / (ct.gas_constant * surface.T)
    np.testing.assert_allclose(mu, mu[0], rtol=0, atol=1e-7)


BARE, UNITLESS = TEXT.replace("quantity: mol, ", ""), "enthalpy-low: 10 kJ/mol"
REFUSED = [
    (UNITLESS, "enthalpy-low: 10", "enthalpy-low without a unit counts in kmol"),
    ("    CO(s): {model: linear, enthalpy: 12 kJ/mol, entropy: 5 J/mol/K}\n", "    {}\n", "no free energy"),
    ("CO(s): {model: linear, enthalpy: 12", "CO(s): {model: linear, enthalpy: 11", "give O(s) the same"),
    (
        "O(s): {model: linear, enthalpy: 12 kJ/mol, entropy: 5 J/mol/K}",
        "O(s): {model: polynomial, enthalpy-coefficients: [12 kJ/mol, 1 kJ/mol, 0, 0]}",
        "make both linear",
    ),
    ("O(s): {model: linear", "O(s): {model: liner", "Did you mean 'linear'?"),
    ("O(s): {model: linear, enthalpy", "O(s): {model: linear, entalpy", "Did you mean 'enthalpy'?"),
    ("    O(s): {model", "    o(s): {model", "no species 'o(s)'"),
    (", enthalpy-change: 0.4", "", "enthalpy-low needs `enthalpy-change`"),
    ("entropy: 5 J/mol/K}\n- ", "entropy: 5 J/mol/K, heat-capacity-a: 1}\n- ", "needs `heat-capacity-b`"),
    (
        "{model: piecewise-linear, enthalpy-low: 10 kJ/mol, enthalpy-high: 30 kJ/mol, enthalpy-change: 0.4}",
        "{model: polynomial, enthalpy-coefficients: [1 kJ/mol]}",
        "are 4 numbers",
    ),
    ("enthalpy-low: 10 kJ", "enthalpy-low: 1e305 kJ", "enthalpy-low must be finite"),
    ("enthalpy-low: 10 kJ/mol", "enthalpy-low: 10 m", "Incompatible units"),
]


@pytest.mark.parametrize(("old", "new", "words"), REFUSED, ids=range(len(REFUSED)))
def test_refused_with_its_line(case, old, new, words):
    text = BARE if old == UNITLESS else TEXT
    assert old in text
    (case.parent / "film.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=r"film\.yaml:\d+: .*" + re.escape(words)):
        surfacechem.load(case)


def test_the_sheet_shows_constants_without_interactions(case):
    curves = Curves(load_mechanism(case.parent / "film.yaml"))
    T = np.array([300.0, 340.0])
    without = -(5e3 - 10 * T) / (8.31446261815324 * T)  # dh - T ds from CO(s) to O(s)
    np.testing.assert_allclose(curves.log_equilibrium("R3", T, np.zeros(1)), without, rtol=1e-8)
    assert any("depends on coverages" in remark for remark in remarks(curves, Span(300, 340)))
