"""Mechanisms under force: pairs of reactions that keep detailed balance, and one that runs one way only."""

import math

import numpy as np
import pytest

import surfacechem
from surfacechem.mechanism import load_mechanism
from surfacechem.studies.mechanism_report import Curves, Span, figure, mechanism_sheet, verdict

T, K_0 = 300.0, 10.0
FORCES = np.linspace(0.0, 60e-12, 7)
TEMPERATURE = np.array([T])

HEAD = """\
units: {length: m, quantity: mol}
phases:
- name: contact
  thermo: ideal-surface
  kinetics: surface
  species: [free(s), bond(s)]
  reactions: all
  site-density: 1e-10 mol/m^2
species:
- {name: free(s), composition: {}, thermo: {model: constant-cp}}
- name: bond(s)
  composition: {}
  thermo: {model: constant-cp, s0: 19.14475... J/mol/K}
  bond: {stiffness: 5 pN/nm, rest-length: 10 nm}
reactions:
""".replace("19.14475...", repr(8.31446261815324 * math.log(K_0)))
OFF, ON = "bond(s) => free(s)", "free(s) => bond(s)"
CASE = """\
title: Bonds pulled apart
bodies:
  lower: {temperature: 300 K}
  upper: {temperature: 300 K}
interface: {temperature: 300 K, mechanism: {file: pulled.yaml, bonds: [bond(s)]}}
initial: {coverages: {free(s): 0.1, bond(s): 0.9}}
loading: {g_n: {ramp: {start: 10 nm, rate: 2 nm/s}}}
run: {until: 4 s, accuracy: 1e-8}
"""


def reaction(equation, A, kind="", **own):
    lines = [f"- equation: {equation}", f"  rate-constant: {{A: {A}, b: 0, Ea: 0}}"]
    lines += [f"  type: {kind}"] if kind else []
    return "\n".join([*lines, *(f"  {key.replace('_', '-')}: {value}" for key, value in own.items())]) + "\n"


PAIRS = {
    "Bell": (reaction(OFF, 1.0, "Bell", x_beta="0.4 nm"), reaction(ON, K_0, "Bell", x_beta="-0.2 nm")),
    "Dembo": (
        reaction(OFF, 1.0, "Dembo", stiffness="5 pN/nm", transition_stiffness="2 pN/nm"),
        reaction(ON, K_0, "Dembo-formation", stiffness="5 pN/nm", transition_stiffness="2 pN/nm"),
    ),
    "attachment": (reaction(OFF, 1.0), reaction(ON, K_0, "gap-attachment", stiffness="5 pN/nm", rest_length="10 nm")),
}


@pytest.fixture
def file(tmp_path):
    def write(name):
        (tmp_path / "pulled.yaml").write_text(HEAD + "".join(PAIRS[name]), encoding="utf-8")
        (tmp_path / "case.yaml").write_text(CASE, encoding="utf-8")
        return tmp_path / "pulled.yaml"

    return write


@pytest.mark.parametrize("name", ["Dembo", "attachment"])
def test_springs_know_their_energy(name, file):
    curves = Curves(load_mechanism(file(name)))
    (pair,) = curves.pairs
    assert np.max(np.abs(curves.departure(pair, TEMPERATURE, FORCES))) < 1e-12
    assert "k_f/k_r is K(g, T) to within" in verdict(curves, "R1", Span(280.0, 360.0), Span(0.0, 60e-12))
    solution = surfacechem.load(file(name).with_name("case.yaml")).run()
    assert np.max(np.abs(solution.dataset.departure_R1_R2)) < 1e-11
    assert solution.warnings == ()


def test_a_direction_that_is_switched_off_is_shown(file):
    path = file("Bell")
    path.write_text(path.read_text().replace("A: 10.0", "A: 0.0"), encoding="utf-8")
    curves = Curves(load_mechanism(path))
    text = mechanism_sheet(curves, Span(T, T), Span(0.0, 4e-11))
    assert "one of the two never runs" in text
    assert figure(curves, Span(T, T), Span(0.0, 4e-11)).axes
