"""What a mechanism file may not hold is refused with file, line and a way out; Cantera would ignore most of it."""

import re

import pytest

from surfacechem.documents import mechanisms
from surfacechem.errors import InputError, Place
from surfacechem.mechanism import load_mechanism
from surfacechem.mechanism.load import find

TEXT = (mechanisms() / "dna-film.yaml").read_text(encoding="utf-8")

REACTION = TEXT[TEXT.index("- equation") :]
RATE = "  rate-constant: {A: 5.13e8 m^2/mol/s, b: 0, Ea: 0}"
BACK = REACTION.replace("A(s) + B(s) <=> AB(s)", "AB(s) => A(s) + B(s)").replace("m^2/mol", "1")
NEGATIVE_ORDER = """- equation: A(s) + B(s) => AB(s)
  orders: {A(s): -1, B(s): 1}
  negative-orders: true
  rate-constant: {A: 1.0 mol/m^2/s, b: 0, Ea: 0}
"""
BARE = TEXT.replace("units: {length: m, quantity: mol, activation-energy: kJ/mol}", "units: {length: m}")

# What to replace in the file by what, and words of the error.
REFUSED = [
    ("  rate-constant:", "  rate-constants:", "Did you mean 'rate-constant'?"),
    ("units: {length: m", "unit: {length: m", "Did you mean 'units'?"),
    ("model: constant-cp, T0: 298.15 K, h0: -", "model: constant_cp, T0: 298.15 K, h0: -", "Did you"),
    ("{model: constant-cp, T0: 298.15 K, h0: -", "{model: Mu0, h0: -", "'Mu0' is not lowered"),
    ("thermo: ideal-surface", "thermo: edge", "'edge' is not lowered: a contact line"),
    ("thermo: ideal-surface", "thermo: coverage-dependent-surface\n  reference-state-coverag: 0", "Did you mean 'ref"),
    ("  reactions: all", "  reactions: all\n  reference-state-coverage: 0.1", "it belongs to `thermo: coverage-depend"),
    ("  reactions: all", "  reactions: all\n  adjacent-phases: [gas]", "'adjacent-phases' cannot be used"),
    ("  sites: 2", "  sites: 2\n  coverage-dependencies: {}", "only a phase with `thermo: coverage-dependent-surface`"),
    ("  rate-constant:", "  sticking-coefficient:", "needs a gas"),
    (RATE, "  type: sticking-Blowers-Masel", "needs a gas beside the"),
    ("{A: 5.13e8 m^2/mol/s, b: 0, Ea: 0}", "{A: 5.13e8 m^2/mol/s, b: 0, Ea: 0}\n  beta: 0.5", "charge"),
    (RATE, "  type: Blowers-Masel\n  rate-constant: {A: 1e8 m^2/mol/s, b: 0, Ea0: 0, w: 1e9}", "rate type 'Blowers-Ma"),
    ("  rate-constant:", "  coverage-dependencies: {C(s): {a: 0, m: 0, E: 1}}\n  rate-constant:", "no species 'C(s)'"),
    (REACTION, NEGATIVE_ORDER, "negative order"),
    ("  site-density: 1.0e-4 mol/m^2\n", "", "no `site-density`"),
    ("  species: [A(s), B(s), AB(s)]", "  species: [{gri30.yaml/species: [H2]}]", "one file"),
    ("units: {length: m,", "units: {length: m", "expected"),
    ("A: 5.13e8 m^2/mol/s", "A: -5.13e8 m^2/mol/s", "'A' is negative"),
    ("  rate-constant:", "  negative-A: true\n  rate-constant:", "'negative-A' cannot be used here"),
    ("1.0e-4 mol/m^2", "0 mol/m^2", "no number above zero"),
    ("sites: 2", "sites: 0", "no number above zero"),
    ("T0: 298.15 K, h0: -", "T0: 25 C, h0: -", "write `T0: 298.15 K`"),
    ("state: {T: 298.15 K", "state: {T: 25 C", "write `T: 298.15 K`"),
    ("{length: m,", "{temperature: C, length: m,", "temperatures are in K"),
    ("{length: m,", "{lenght: m,", "Did you mean 'length'?"),
    ("{length: m,", "{length: furlong,", "'furlong' is no unit"),
    ("A(s) + B(s) <=> AB(s)", "A(s) + B(s) + M <=> AB(s) + M", "third bodies belong to gases"),
    ("A(s) + B(s) <=> AB(s)", "A(s) + B(s) (+M) <=> AB(s) (+M)", "third bodies"),
    (
        "  rate-constant:",
        "  type: falloff\n  low-P-rate-constant: {A: 1, b: 0, Ea: 0}\n  high-P-rate-constant:",
        "rate type 'falloff' d",
    ),
    (RATE, "  type: pressure-dependent-Arrhenius\n  rate-constants: []", "depends on pressure, which"),
    ("thermo: ideal-surface", "thermo: ideal-gas", "this is a gas and no surface"),
    ("  rate-constant:", "  efficiencies: {A(s): 2}\n  rate-constant:", "third bodies"),
    ("A(s) + B(s) <=> AB(s)", "A(s) + B(s) -> AB(s)", "two sides"),
    ("A(s) + B(s) <=> AB(s)", "A(s) + B(s) <=> B(s) + A(s)", "nothing changes"),
    ("coverages: {A(s): 0.5", "coverages: {a(s): 0.5", "Did you mean 'A(s)'?"),
    ("species: [A(s), B(s),", "species: [A(s), C(s),", "no species 'C(s)'"),
    ("  reactions: all", "  reactions: all\n  skip-undeclared-elements: true", "would vanish"),
    ("{A: 5.13e8 m^2/mol/s, b: 0, Ea: 0}", "[5.13e8, 0, 0]", "write `rate-constant: {A, b, Ea}`"),
    ("reactions:\n- eq", f"reactions:\n{REACTION}- eq", "duplicate reactions"),
    ("reactions:\n- eq", f"reactions:\n{BACK}- eq", "duplicate reactions"),
    ("b: 0, Ea: 0}", "b: 0, b: 1, Ea: 0}", "the key 'b' is given twice"),
    ("1.0e-4 mol/m^2", "1.0e-4 mol/m^3", "Cantera: "),
    ("A(s) + B(s) <=> AB(s)", "A(s) + D(s) <=> AB(s)", "no species 'D(s)'"),
    ("  sites: 2\n", "", "Cantera: "),
    ("h0: -172.3808 kJ", "h0: -1.8e305 kJ", "species AB(s): thermo: h0 must be finite"),
    ("T0: 298.15 K", "T0: ''", "'' is no temperature above zero in kelvin"),
    ("T0: 298.15 K", "T0: .inf K", "no temperature above zero in kelvin"),
    ("b: 0, Ea: 0}", "b: 0, Ea: 5 kJ}", "Ea: 5 kJ is an energy of 3.01107e+27 J/mol, which no"),
    ("b: 0, Ea: 0}", "b: 0, Ea: 0}\n  coverage-dependencies: {A(s): {a: 0, m: 0, E: [1, 5 kJ]}}", "E: 5 kJ is an ener"),
    ("b: 0, Ea: 0}", "b: 0, Ea: 0}\n  coverage-dependencies: {A(s): [0, 0, 5 kJ]}", "E: 5 kJ is an energy of 3.01107e"),
    ("site-density: 1.0e-4", "site-density: 1e-323", "Site density must be positive"),
]


LOADED = """\
- equation: AB(s) => A(s) + B(s)
  type: Bell
  rate-constant: {A: 1 1/s, b: 0, Ea: 0}
  x-beta: 0.4 nm
"""
BY_DEFAULT = BARE.replace("units: {length: m}\n", "")
UNDER_LOAD = BY_DEFAULT.replace("reactions:\n", f"reactions:\n{LOADED}").replace(" <=> AB(s)", " => AB(s)")

UNITLESS = [
    ("5.13e8 m^2/mol/s", "5.13e8", "A(s) + B(s) <=> AB(s): A: 5.13e+08 without a unit counts in powers of"),
    ("Ea: 0}", "Ea: 0}\n  coverage-dependencies: {A(s): [0, 0, 50]}", "E: 50 without a unit counts in J/kmol. Write i"),
    ("Ea: 0", "Ea: 50", "Ea: 50 without a unit counts in J/kmol. Write it with its unit, such as `Ea: 50 kJ/mol`"),
    ("1.0e-4 mol/m^2", "1.0e-4", "phase film: site-density: 0.0001 without a unit counts in kmol/m^2"),
    ("h0: -172.3808 kJ/mol", "h0: -172.3808", "species AB(s): h0: -172.381 without a unit counts in J/kmol"),
]
"""Cantera counts in kmol, which nobody means."""

OF_A_CLASS = [
    ("  x-beta: 0.4 nm\n", "", "a rate of type Bell needs `x-beta`: distance to the transition state [m]"),
    ("x-beta", "x_beta", "unknown key 'x_beta'. Did you mean 'x-beta'?"),
    ("type: Bell", "type: Bel", "rate type 'Bel' is not lowered. Did you mean 'Bell'?"),
    ("x-beta: 0.4 nm", "x-slip: 0.4 nm", "'x-slip' is no key of interface-Bell; it belongs to interface-tw"),
    ("  type: Bell\n", "", "'x-beta' is no key of interface-Arrhenius; it belongs to interface-Bell, "),
    ("0.4 nm", "0.4", "x-beta: 0.4 has no unit, and `units` says nothing about it; write it in m, such as"),
    ("0.4 nm", "0.4 pN", "x-beta = 0.4 pN is not a quantity in m"),
    ("type: Bell", "type: Dudko-Hummer-Szabo\n  barrier: 5 kJ", "barrier: 5 kJ is an energy of 5000 J, which no"),
    ("type: Bell", "type: Dudko-Hummer-Szabo", "a rate of type Dudko-Hummer-Szabo needs `barrier`"),
]

ELASTIC = [
    ("{stifness: 1 pN/nm}", "species AB(s): bond: unknown key 'stifness'. Did you mean 'stiffness'?"),
    ("{stiffness: 1}", "species AB(s): bond: stiffness: 1 has no unit"),
    ("{stiffness: 1 pN/nm, rest-length: 20}", "species AB(s): bond: rest-length: 20 has no unit"),
    ("{rest-length: 20 nm}", "species AB(s): bond needs `stiffness`: stiffness of the bond [N/m]."),
    ("{stiffness: 1 pN}", "species AB(s): bond: stiffness = 1 pN is not a quantity in N/m."),
    ("{stiffness: -1 N/m}", "species AB(s): bond: stiffness = -1 is outside its range: >= 0."),
    ("5 pN/nm", "bond: this must be a mapping, not '5 pN/nm'"),
]

CHANGED = [
    *((TEXT, *row, 6) for row in REFUSED),
    *((BARE, *row, 1) for row in UNITLESS),
    *((UNDER_LOAD, *row, 3) for row in OF_A_CLASS),
    *((BY_DEFAULT, "  sites: 2\n", f"  sites: 2\n  bond: {bond}\n", words, 3) for bond, words in ELASTIC),
]


@pytest.mark.parametrize(("good", "old", "new", "words", "near"), CHANGED, ids=range(len(CHANGED)))
def test_a_change_is_refused_where_it_stands(good, old, new, words, near, tmp_path):
    """In these words, not more than so many lines from the change."""
    file = tmp_path / "changed.yaml"
    assert old in good
    file.write_text(good.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        load_mechanism(file)
    changed = good[: good.index(old)].count("\n") + 1
    assert caught.value.place.file == str(file)
    assert abs(caught.value.place.line - changed) <= near, f"{caught.value} is not near line {changed}"
    assert "*" not in caught.value.message


def test_what_is_changed_is_read_as_it_is_and_units_of_the_file_are_units(tmp_path):
    file = tmp_path / "good.yaml"
    for text in (BARE, BY_DEFAULT, UNDER_LOAD, *(TEXT.replace(old, new) for old, new, _ in UNITLESS)):
        file.write_text(text, encoding="utf-8")
        assert load_mechanism(file).reactions


def test_a_rate_of_first_order_needs_no_amount(tmp_path):
    file = tmp_path / "tethers.yaml"
    text = (mechanisms() / "dna-tethers.yaml").read_text(encoding="utf-8")
    text = re.sub(r"^units: .*$", "", text, flags=re.MULTILINE)
    file.write_text(re.sub(r"A: ([0-9.e+]+)[^,]*,", r"A: \1,", text), encoding="utf-8")
    assert load_mechanism(file).reactions[0].A == 2.565e4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"phase": "flim"}, "Did you mean 'film'? Known: film."),
        ({"bonds": ["AB(g)"]}, "bonds: no species 'AB(g)' in the mechanism. Did you mean 'AB(s)'?"),
    ],
)
def test_errors_of_the_case_stand_in_the_case(arguments, message):
    place = Place("cases/x.yaml", 7, "interface.mechanism")
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        load_mechanism(mechanisms() / "dna-film.yaml", place=place, **arguments)
    assert str(caught.value).startswith("cases/x.yaml:7: interface.mechanism: ")


def test_a_missing_file_names_what_there_is(tmp_path):
    with pytest.raises(InputError, match=r"no mechanism file .*\. Did you mean 'selectin.yaml'\?"):
        load_mechanism(tmp_path / "selectins.yaml")
    (tmp_path / "glue.yaml").touch()
    with pytest.raises(InputError, match=r"no mechanism file glu.yaml\. Did you mean 'glue.yaml'\?"):
        find("glu.yaml", tmp_path, Place())


@pytest.mark.parametrize(
    ("coverages", "message"),
    [
        ({"A(s)": 0.5, "AB(g)": 0.5}, "coverages: no species 'AB(g)'. Did you mean 'AB(s)'?"),
        ({"A(s)": 0.5, "B(s)": 0.4}, "coverages sum to 0.9, not to 1."),
    ],
)
def test_coverages_are_checked(coverages, message):
    mechanism = load_mechanism(mechanisms() / "dna-film.yaml")
    with pytest.raises(InputError, match=re.escape(message)):
        mechanism.coverages(coverages)


def test_several_phases_must_be_named(tmp_path):
    phase = TEXT[TEXT.index("- name: film") : TEXT.index("\nspecies:\n")]
    file = tmp_path / "two.yaml"
    file.write_text(TEXT.replace(phase, phase + phase.replace("name: film", "name: brush")), encoding="utf-8")
    with pytest.raises(InputError, match=r"several phases, name one: .* Known: brush, film\."):
        load_mechanism(file)
    assert load_mechanism(file, "brush").phase == "brush"


def test_reactions_of_other_species_are_left_out(tmp_path):
    extra = "- equation: A(s) + E(s) <=> AE(s)\n  rate-constant: {A: 1 m^2/mol/s, b: 0, Ea: 0}\n"
    text = TEXT.replace("reactions: all", "reactions: declared-species")
    file = tmp_path / "declared.yaml"
    file.write_text(text.replace("reactions:\n- eq", f"reactions:\n{extra}- eq"), encoding="utf-8")
    (law,) = load_mechanism(file).reactions
    assert file.read_text(encoding="utf-8").splitlines()[law.place.line - 1].endswith(law.equation)


def test_sections_of_the_file_may_have_names(tmp_path):
    text = TEXT.replace("species: [A(s), B(s), AB(s)]", "species: [{strands: all}]").replace("\nspecies:", "\nstrands:")
    text = text.replace("  reactions: all", "  reactions: [zipping]").replace("\nreactions:", "\nzipping:")
    file = tmp_path / "named.yaml"
    file.write_text(text, encoding="utf-8")
    assert [law.equation for law in load_mechanism(file).reactions] == ["A(s) + B(s) <=> AB(s)"]
    file.write_text(text.replace("  rate-constant", "  rate-constent"), encoding="utf-8")
    with pytest.raises(InputError, match="Did you mean 'rate-constant'"):
        load_mechanism(file)
