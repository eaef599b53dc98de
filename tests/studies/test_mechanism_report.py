"""The mechanism command: Cantera's own numbers, verdicts in words, cycles that no thermo allows, a figure."""

import math
import re
from pathlib import Path

import cantera as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from mechanisms import KMOL, cantera_of, load, mechanism_texts
from surfacechem.cli.main import app
from surfacechem.errors import InputError
from surfacechem.mechanism import load_mechanism
from surfacechem.studies import mechanism_report
from surfacechem.studies.mechanism_report import (
    Curves,
    Span,
    cycle_verdict,
    cycles,
    mechanism_sheet,
    power_of_ten,
    remarks,
    span,
    verdict,
)

pytestmark = pytest.mark.around

NONE = np.zeros(1)
T, F = Span(280.0, 360.0), Span(0.0, 1e-10)


@pytest.fixture
def call(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, ["mechanism", *map(str, arguments)])


def full(surface, law):
    """Amounts [1/m^2] of the species of a reaction at coverages of one."""
    sizes = {s.name: s.size for s in surface.species()}
    return {item.variable: surface.site_density / sizes[item.name] * KMOL for item in law.species}


def compare(mechanism, temperature):
    surface, curves = cantera_of(mechanism), Curves(mechanism)
    surface.TP = temperature, ct.one_atm
    surface.coverages = np.ones(surface.n_species)
    thermo = curves.thermo(temperature)
    size = ct.gas_constant * temperature
    for j, name in enumerate(surface.species_names):
        h, s = (float(column[j]) for column in (surface.standard_enthalpies_RT, surface.standard_entropies_R))
        assert thermo[name].h == pytest.approx(h * size / 1e3, rel=1e-10, abs=1e-7)
        assert thermo[name].s == pytest.approx(s * ct.gas_constant / 1e3, rel=1e-10, abs=1e-9)
        assert thermo[name].g == pytest.approx((h - s) * size / 1e3, rel=1e-10, abs=1e-7)
    for i, (label, law) in enumerate(curves.laws.items()):
        amounts = full(surface, law)
        log_K = sum(nu * math.log(KMOL / amounts[x]) for x, nu in law.change.items())
        log_K += math.log(surface.equilibrium_constants[i])
        (got,) = curves.log_equilibrium(label, np.array([temperature]), NONE)
        assert got == pytest.approx(log_K, rel=1e-9, abs=1e-9)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("mechanisms") / "random.yaml"


@given(text=mechanism_texts(), temperature=st.floats(300.0, 1200.0))
@settings(max_examples=5)
def test_numbers_of_random_mechanisms_are_cantera_s(file, text, temperature):
    ct.suppress_thermo_warnings(True)
    file.write_text(text, encoding="utf-8")
    mechanism = load_mechanism(file)
    compare(mechanism, temperature)
    printed = mechanism_sheet(Curves(mechanism), Span(300.0, 1200.0), F)
    assert not re.search(r"\b(nan|inf)\b", printed)


@pytest.mark.parametrize(
    ("arguments", "file", "phase"),
    [
        (("diamond.yaml", "-T", "1200 K"), "diamond.yaml", "diamond_100"),
        (("SiF4_NH3_mec", "-T", "1600 K"), "SiF4_NH3_mec.yaml", "SI3N4"),
        (("sofc", "--phase", "oxide_surface"), "sofc.yaml", "oxide_surface"),
        (("lithium_ion_battery", "--phase", "edge_anode_electrolyte"), "lithium_ion_battery.yaml", None),
    ],
)
def test_surfaces_of_cantera_are_found_by_name_with_every_reaction(call, arguments, file, phase):
    """Where only one phase is a surface it need not be named; what stands beside it needs no state."""
    done = call(*arguments)
    assert done.exit_code == 0, done.stderr
    surface = ct.Interface(file, phase or arguments[-1])
    assert done.stdout.startswith(f"phase {surface.name}, ")
    for number, equation in enumerate(surface.reaction_equations(), start=1):
        assert re.search(rf"^  R{number} +{re.escape(equation)}  ", done.stdout, re.MULTILINE)


def test_the_figure_shows_every_reaction_once(call, tmp_path):
    rates, constants = mechanism_report.figure(Curves(load("dna-film.yaml")), T, F).axes
    assert [line.get_label() for line in rates.lines] == ["R1: A(s) + B(s) <=> AB(s)", "R1, reverse"]
    assert len(constants.lines) == 1
    assert rates.get_ylabel() == "log$_{10}$ Rate per bond [1/s]"
    done = call("dna-film", "-o", "rates.svg")
    assert done.exit_code == 0, done.stderr
    assert done.stdout.endswith("written to rates.svg\n")
    assert (tmp_path / "rates.svg").read_bytes().startswith(b"<?xml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("selectins",), "no mechanism file selectins.yaml. Did you mean 'selectin.yaml'?"),
        (("ptcombus",), "no mechanism file ptcombus.yaml. Did you mean 'ptcombust.yaml'?"),
        (("covdepsurf",), "Did you mean 'example_data/covdepsurf.yaml'?"),
        (
            ("KOH",),
            "no phase that is a surface (ideal-surface or coverage-dependent-surface), only KOH_plasma, K_solid",
        ),
        (("sofc",), "name one: `phase` in a case, `--phase` of the command. Known: metal_surface, oxide_surface."),
        (("selectin", "--phase", "contatc"), "has no phase 'contatc'. Did you mean 'contact'?"),
        (("selectin", "-T", "360..280 K"), "--temperature: '360..280 K' is no range upwards"),
        (
            ("selectin", "-T", "280-360 K"),
            "--temperature: '280-360 K' is not a number with a unit; --temperature needs a",
        ),
        (("selectin", "-T", "0 K"), "--temperature: '0 K' is no range upwards"),
        (("selectin", "-T", "3 m"), "--temperature"),
        (("selectin", "--force", "3 K"), "--force"),
        (("selectin", "-o", "x.jpg"), "no format 'jpg'"),
    ],
)
def test_bad_input_is_refused(call, arguments, words):
    done = call(*arguments)
    assert done.exit_code == 2
    assert words in done.stderr
    assert not done.stdout


def test_ranges_have_units_at_either_end():
    assert span("280 K..360 K", "K", "-T") == span("280..360 K", "K", "-T") == Span(280.0, 360.0)
    assert span("0..100 pN", "N", "--force").high == pytest.approx(1e-10)
    assert span("20 degC", "K", "-T").values().tolist() == pytest.approx([293.15])
    with pytest.raises(InputError, match="-T"):
        span("..300 K", "K", "-T")


@pytest.mark.parametrize(
    ("exponent", "text"), [(1e6, "e+434294"), (-1e6, "e-434295"), (math.inf, "inf"), (1.0, "2.718")]
)
def test_numbers_of_any_size_are_shown(exponent, text):
    assert power_of_ten(exponent).endswith(text)


@pytest.mark.parametrize(("temperatures", "told"), [((299, 400), True), ((300, 3000), False), ((400, 3001), True)])
def test_temperatures_beyond_the_thermo_are_remarked(temperatures, told):
    curves = Curves(load_mechanism(Path("co-platinum.yaml"), evaluate=True))
    found = any("holds from 300 to 3000 K" in text for text in remarks(curves, Span(*temperatures)))
    assert found is told


def test_what_is_odd_is_remarked(tmp_path):
    text = load("dna-film.yaml").text.replace("A(s) + B(s) <=> AB(s)", "2 A(s) => AB(s)")
    (tmp_path / "odd.yaml").write_text(
        text.replace("  rate-constant: {A: 5.13e8 m^2/mol/s", "  orders: {A(s): 0}\n  rate-constant: {A: 1 mol/m^2/s")
    )
    curves = Curves(load_mechanism(tmp_path / "odd.yaml"))
    first, second = remarks(curves, Span(280, 360))
    assert "goes on where nothing is left to react" in first
    assert second == "B(s) takes part in no reaction: its coverage stays as it is."
    assert verdict(curves, "R1", T, F).startswith("runs one way only")


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
WARM = np.array([280.0, 300.0, 360.0])


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
    np.testing.assert_allclose(cycle.departure(found, WARM, NONE), 0.0, atol=1e-12)
    assert "is 1 to within" in cycle_verdict(cycle, found, WARM, NONE)
    assert all(np.max(np.abs(found.departure(pair, WARM, NONE))) > 0.1 for pair in found.pairs)


def test_rates_that_no_thermo_allows(curves):
    found = curves(PAIRS.replace("LAST", "12.0"))
    (cycle,) = cycles(found)
    np.testing.assert_allclose(np.abs(cycle.departure(found, WARM, NONE)), np.log(4), rtol=1e-12)
    text = mechanism_sheet(found, Span(280.0, 360.0), Span(0.0, 0.0))
    assert "R1 R2 R3 R4 R5 R6  INCONSISTENT: the product of k_f/k_r is not 1 but exp(1.39)" in text


def test_what_cannot_run_back_never_stops(curves):
    found = curves(one_way("a(s) => b(s)", "b(s) => c(s)", "c(s) => a(s)"))
    (cycle,) = cycles(found)
    assert cycle.labels == ("R1", "R2", "R3")
    assert "no way back from R1, R2, R3" in cycle_verdict(cycle, found, WARM, NONE)


def test_reactions_of_second_order_close_cycles_too(curves):
    """From 2 a to d directly, and over a + b."""
    second = one_way("2 a(s) <=> d(s)", "a(s) + b(s) => d(s)").replace("A: 1.0", "A: 1e6 m^2/mol/s")
    found = curves(second + one_way("d(s) => a(s) + b(s)", "a(s) <=> b(s)"))
    (cycle,) = cycles(found)
    assert set(cycle.labels) == {"R1", "R2", "R3", "R4"}
    assert "INCONSISTENT" in cycle_verdict(cycle, found, WARM, NONE)
