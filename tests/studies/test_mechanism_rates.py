"""Cycles of reactions whose rates no thermo allows are found and named."""

import numpy as np
import pytest

from surfacechem.mechanism import load_mechanism
from surfacechem.studies.mechanism_rates import Curves, cycle_verdict, cycles
from surfacechem.studies.mechanism_report import Span, mechanism_sheet

HEAD = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
phases:
- {name: film, thermo: ideal-surface, kinetics: surface, species: all, reactions: all, site-density: 1e-6 mol/m^2}
species:
- {name: a(s), composition: {}, thermo: {model: constant-cp, h0: 0 kJ/mol, s0: 0 J/mol/K}}
- {name: b(s), composition: {}, thermo: {model: constant-cp, h0: -5 kJ/mol, s0: -20 J/mol/K}}
- {name: c(s), composition: {}, thermo: {model: constant-cp, h0: -10 kJ/mol, s0: -20 J/mol/K}}
- {name: d(s), composition: {}, sites: 2, thermo: {model: constant-cp, h0: -10 kJ/mol, s0: -20 J/mol/K}}
reactions:
"""
PAIRS = """
- {equation: a(s) => b(s), rate-constant: {A: 1.0, b: 0, Ea: 0}}
- {equation: b(s) => a(s), rate-constant: {A: 2.0, b: 0, Ea: 0}}
- {equation: b(s) => c(s), rate-constant: {A: 3.0, b: 0, Ea: 5}}
- {equation: c(s) => b(s), rate-constant: {A: 1.0, b: 0, Ea: 0}}
- {equation: a(s) => c(s), rate-constant: {A: LAST, b: 0, Ea: 5}}
- {equation: c(s) => a(s), rate-constant: {A: 2.0, b: 0, Ea: 0}}
"""
T = np.array([280.0, 300.0, 360.0])
NONE = np.zeros(1)


@pytest.fixture
def curves(tmp_path):
    def read(reactions):
        (tmp_path / "cycle.yaml").write_text(HEAD + reactions)
        return Curves(load_mechanism(tmp_path / "cycle.yaml"))

    return read


def one_way(*steps):
    return "".join(f"- {{equation: {step}, rate-constant: {{A: 1.0, b: 0, Ea: 0}}}}\n" for step in steps)


def test_rates_that_some_thermo_allows(curves):
    """Every pair departs from the thermo of the file, but 1/2 times 3 is 3/2: another thermo would do."""
    found = curves(PAIRS.replace("LAST", "3.0"))
    (cycle,) = cycles(found)
    assert cycle.labels == ("R1", "R2", "R3", "R4", "R5", "R6")
    np.testing.assert_allclose(cycle.departure(found, T, NONE), 0.0, atol=1e-12)
    assert "is 1 to within" in cycle_verdict(cycle, found, T, NONE)
    assert all(np.max(np.abs(found.departure(pair, T, NONE))) > 0.1 for pair in found.pairs)


def test_rates_that_no_thermo_allows(curves):
    found = curves(PAIRS.replace("LAST", "12.0"))
    (cycle,) = cycles(found)
    np.testing.assert_allclose(np.abs(cycle.departure(found, T, NONE)), np.log(4), rtol=1e-12)
    text = mechanism_sheet(found, Span(280.0, 360.0), Span(0.0, 0.0))
    assert "R1 R2 R3 R4 R5 R6  INCONSISTENT: the product of k_f/k_r is not 1 but exp(1.39)" in text


def test_reversible_reactions_agree_by_construction(curves):
    assert cycles(curves(PAIRS.split("- {equation: a(s) => c(s)")[0])) == []
    assert cycles(curves(one_way("a(s) <=> b(s)", "b(s) <=> c(s)", "a(s) <=> c(s)"))) == []


def test_a_force_opens_a_cycle(curves):
    """Bell factors around a cycle have to add up to nothing."""
    loaded = PAIRS.replace("LAST", "3.0").replace("a(s) => b(s),", "a(s) => b(s), type: Bell, x-beta: 0.3 nm,")
    found = curves(loaded)
    (cycle,) = cycles(found)
    force = np.array([0.0, 20e-12])
    expected = force * 0.3e-9 / (1.380649e-23 * 300.0)
    np.testing.assert_allclose(np.abs(cycle.departure(found, np.array(300.0), force)), expected, atol=1e-12)


def test_what_cannot_run_back_never_stops(curves):
    found = curves(one_way("a(s) => b(s)", "b(s) => c(s)", "c(s) => a(s)"))
    (cycle,) = cycles(found)
    assert cycle.labels == ("R1", "R2", "R3")
    assert "no way back from R1, R2, R3" in cycle_verdict(cycle, found, T, NONE)


def test_reactions_of_second_order_close_cycles_too(curves):
    """From 2 a to d directly, and over a + b."""
    second = one_way("2 a(s) <=> d(s)", "a(s) + b(s) => d(s)").replace("A: 1.0", "A: 1e6 m^2/mol/s")
    found = curves(second + one_way("d(s) => a(s) + b(s)", "a(s) <=> b(s)"))
    (cycle,) = cycles(found)
    assert set(cycle.labels) == {"R1", "R2", "R3", "R4"}
    assert "INCONSISTENT" in cycle_verdict(cycle, found, T, NONE)
