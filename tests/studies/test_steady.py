"""Steady states against Cantera alone: coverages, degrees of rate control, apparent barriers."""

from contextlib import suppress

import cantera as ct
import numpy as np
import pytest

from surfacechem.errors import InputError
from surfacechem.studies.steady import _Rest, steady

pytestmark = pytest.mark.around

CASE = """
title: Oxidation of carbon monoxide on platinum
bodies: {lower: {temperature: 650 K}, upper: {temperature: 650 K}}
interface:
  temperature: 650 K
  mechanism:
    file: ptcombust.yaml
    phase: Pt_surf
    neighbours: {gas: {pressure: 1 atm, composition: {CO: 0.02, O2: 0.21}, rest: N2}}
initial: {coverages: {PT(S): 0.5, O(S): 0.5}}
run: {until: 1 ms, solver: cantera, rtol: 1e-8}
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    path = tmp_path_factory.mktemp("steady") / "case.yaml"
    path.write_text(CASE)
    return steady(path)


def alone(T=650.0, reaction=0, factor=1.0):
    """Coverages, and the rate at which CO2 is made, of Cantera alone [1/(m^2 s)]."""
    surface = ct.Interface("ptcombust.yaml", "Pt_surf")
    gas = surface.adjacent["gas"]
    gas.TPX, surface.TP = (T, ct.one_atm, "CO:0.02, O2:0.21, N2:0.77"), (T, None)
    surface.set_multiplier(factor, reaction)
    for free in (0.5, 0.6, 0.4, 0.7, 0.3, 0.8):
        surface.coverages = {"PT(S)": free, "O(S)": 1 - free}
        # Rounding decides whether CVODES comes through at such a tolerance; where it began is forgotten.
        with suppress(ct.CanteraError):
            surface.advance_coverages(1.0, rtol=1e-12, atol=1e-22, max_steps=100000)
            break
    else:
        pytest.fail("Cantera finds no steady state")
    return surface.coverages, surface.get_net_production_rates(gas)[gas.species_index("CO2")] * 6.02214076e26


def test_coverages_and_rates(found):
    coverages, rate = alone()
    np.testing.assert_allclose([*found.coverages.values()], coverages, rtol=1e-8, atol=1e-14)
    assert found.rates["production_CO2"] == pytest.approx(rate, rel=1e-8)
    assert set(found.rates) == {"production_CO2", "production_CO", "production_O2"}
    assert set(found.units.values()) == {"1/(m^2 s)"}
    assert "CH2(S)s" in found.coverages


def test_an_apparent_barrier_is_the_change_with_temperature(found):
    (_, more), (_, less) = alone(T=650.1), alone(T=649.9)
    exact = 8.31446261815324 * 650.0**2 * np.log(more / less) / 0.2
    assert found.barriers["production_CO2"] == pytest.approx(exact, rel=1e-5)
    assert f"apparent barrier {exact / 1e3:.4g} kJ/mol" in str(found)


CYCLE = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
phases:
- {name: s, thermo: ideal-surface, kinetics: surface, species: [a(s), b(s), x(s)], site-density: 2e-5 mol/m^2}
species:
- {name: a(s), composition: {}, thermo: {model: constant-cp}}
- {name: b(s), composition: {}, thermo: {model: constant-cp}}
- {name: x(s), composition: {}, thermo: {model: constant-cp}}
reactions:
- {equation: a(s) => b(s), rate-constant: {A: 1e5 1/s, b: 0, Ea: 20}}
- {equation: b(s) + x(s) => a(s) + x(s), rate-constant: {A: 1e11 m^2/mol/s, b: 0, Ea: 40}}
"""
TURNING = """
bodies: {lower: {temperature: 500 K}, upper: {temperature: 500 K}}
interface: {temperature: 500 K, mechanism: cycle.yaml}
initial: {coverages: {a(s): 0.7, x(s): 0.3}}
run: {until: 1 s}
"""


def test_a_spectator_keeps_its_coverage(tmp_path):
    """Two steps in turn: each controls as much as the other's part of the resistance to both, 1/k over the sum."""
    (tmp_path / "cycle.yaml").write_text(CYCLE)
    (tmp_path / "case.yaml").write_text(TURNING)
    found = steady(tmp_path / "case.yaml", of=["R_R1"])
    RT = 8.31446261815324 * 500.0
    k = np.array([1e5 * np.exp(-20e3 / RT), 1e11 * 2e-5 * 0.3 * np.exp(-40e3 / RT)])
    exact = k[::-1] / k.sum()
    assert [*found.control["R_R1"].values()] == pytest.approx(exact, rel=1e-7)
    assert found.barriers["R_R1"] == pytest.approx(exact @ [20e3, 40e3], rel=1e-7)
    assert found.coverages["x(s)"] == pytest.approx(0.3, rel=1e-12)


def one_way(tmp_path, case, heats, reactions, **changes):
    """Steady state with one mol/m^2 of sites: heats [kJ/mol] by species; A and Ea [kJ/mol] of one-way reactions."""
    found = [
        f"{{name: {name}(s), composition: {{}}, thermo: {{model: constant-cp, h0: {h} kJ/mol}}}}"
        for name, h in heats.items()
    ]
    rates = [f"{{equation: {r}, rate-constant: {{A: {k}, b: 0, Ea: {Ea}}}}}" for r, (k, Ea) in reactions.items()]
    surface = f"{{name: s, thermo: ideal-surface, kinetics: surface, species: [{', '.join(f'{x}(s)' for x in heats)}]"
    lists = {"phases": [f"{surface}, site-density: 1 mol/m^2}}"], "species": found, "reactions": rates}
    text = "\n".join(f"{key}:\n- " + "\n- ".join(each) for key, each in lists.items())
    (tmp_path / "m.yaml").write_text(f"units: {{quantity: mol, activation-energy: kJ/mol}}\n{text}\n")
    (tmp_path / "case.yaml").write_text(case)
    return steady(tmp_path / "case.yaml", **changes)


HELD = """
bodies: {lower: {temperature: 500 K}, upper: {temperature: 500 K}}
interface: {temperature: 500 K, mechanism: m.yaml}
initial: {coverages: {a(s): 1}}
run: {until: 1 ms}
"""
CLOSED = """
T_0: 500 K
bodies: {lower: {temperature: T_1, C: 4 kJ/m^2/K, capacity: constant}, upper: {temperature: T_2, C: 1 J/m^2/K}}
interface: {temperature: T_1, mechanism: m.yaml}
initial: {T_1: 500 K, T_2: 300 K, coverages: {a(s): 1}}
run: {until: 1 s}
"""


def test_a_state_that_a_trace_leaves_is_not_the_steady_state(tmp_path):
    reactions = {"a(s) + b(s) => 2 b(s)": (1, 0), "b(s) => a(s)": (0.1, 0), "a(s) => b(s)": (1e-14, 0)}
    found = one_way(tmp_path, HELD, {"a": 0, "b": 0}, reactions, of=["R_R3"])
    assert found.coverages == pytest.approx({"a(s)": 0.1, "b(s)": 0.9})


def test_a_search_that_leaves_the_range_of_numbers_begins_again_later(tmp_path, monkeypatch):
    """Where rates hardly change with the coverage, Newton's method goes to where those of Cantera are not numbers."""
    rates = _Rest.rates
    monkeypatch.setattr(_Rest, "rates", lambda rest, x: rates(rest, x) if np.abs(x).max() < 100 else x * np.nan)
    strength, k = 5.0, np.exp(5.0) / 4
    barrier = f"0}}, coverage-dependencies: {{a(s): {{a: 0, m: 0, E: {strength * 8.31446261815324 * 0.5}}}"
    reactions = {"b(s) => a(s)": (1, 0), "a(s) => b(s)": (k, barrier)}
    a = one_way(tmp_path, HELD, {"a": 0, "b": 0}, reactions, of=["R_R1"]).coverages["a(s)"]
    assert k * a * np.exp(-strength * a) == pytest.approx(1 - a, rel=1e-9)


def test_a_case_that_loses_no_heat_keeps_its_energy(tmp_path):
    """More of b is warmer by its heat, which speeds up both ways; a body apart takes none of it."""
    cycle = {"a(s) => b(s)": (1e5, 20), "b(s) => a(s)": (1e7, 40)}
    found = one_way(tmp_path, CLOSED, {"a": 0, "b": -80}, cycle, of=["R_R1"])
    T, theta, R = found.states["T_1"], found.coverages["b(s)"], 8.31446261815324
    assert pytest.approx(500 + 20 * theta) == T
    # ln(theta / (1 - theta)) = ln(k_1 / k_2), and T follows theta.
    up, down = np.array([20e3, 40e3]) / (R * T**2) * 20
    moved = 1 / (1 / (theta * (1 - theta)) - up + down)
    assert found.control["R_R1"]["R1"] == pytest.approx(1 + (up - 1 / (1 - theta)) * moved, rel=1e-6)
    assert sum(found.control["R_R1"].values()) == pytest.approx(1, rel=1e-6)


def test_what_used_up_reactions_have_left_is_not_asked_of_the_state_at_rest(tmp_path):
    """How much of a became b, which goes on, and how much c, is not in the state at rest."""
    reactions = {"a(s) => b(s)": (1, 0), "a(s) => c(s)": (3, 0), "b(s) => d(s)": (1, 0), "d(s) => b(s)": (2, 0)}
    with pytest.raises(InputError, match="R1, R2 used up what they take, and the state at rest depends on what they"):
        one_way(tmp_path, HELD, dict.fromkeys("abcd", 0), reactions, of=["R_R3"])


@pytest.mark.parametrize(
    ("case", "of", "message"),
    [
        ("diamond-growth", (), "x_gas_H changes in time, so there is no steady state"),
        ("dna-adhesive", (), "nothing is made in a neighbour: name the rates that matter"),
        ("dna-adhesive", ("R_R2",), "the case has no quantity 'R_R2'. Did you mean 'R_R1'"),
        ("dna-adhesive", ("R_R1",), "R_R1 is zero at rest, so nothing controls it"),
        ("bond-constant-force", ("mu",), "mu is zero at rest, so nothing controls it"),
        ("stick-slip", ("p",), r"stick-slip.yaml:\d+: .* changes in time"),
        ("slow-passage", (), r"slow-passage.yaml:\d+: .* has jumps \(touch, release\), so that"),
        ("catch-bond", (), r"catch-bond.yaml:1: nothing is made .* `--of R_two_pathway`"),
    ],
)
def test_what_has_no_steady_state(case, of, message):
    with pytest.raises(InputError, match=message):
        steady(case, of)
