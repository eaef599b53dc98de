"""Rates under load in Cantera itself: the same numbers as in a scene, honest about a load that is missing."""

import contextlib
import math

import cantera as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanisms import KMOL, call, values
from surfacechem.errors import InputError
from surfacechem.extension import LoadedInterface
from surfacechem.mechanism import load_mechanism
from surfacechem.mechanism.rates import AffinityReaction, kinds
from surfacechem.quantities import BOLTZMANN

pytestmark = pytest.mark.around

HEAD = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
extensions: [{type: python, name: surfacechem.extension}]
phases:
- name: contact
  thermo: ideal-surface
  kinetics: surface
  species: [A(s), B(s), AB(s)]
  reactions: all
  site-density: 1e-6 mol/m^2
  state: {T: 300 K, coverages: {A(s): 0.3, B(s): 0.3, AB(s): 0.4}}
species:
- {name: A(s), composition: {H: 1}, thermo: {model: constant-cp, h0: 0 kJ/mol, s0: 0 J/mol/K}}
- {name: B(s), composition: {H: 1}, thermo: {model: constant-cp, h0: 2 kJ/mol, s0: 10 J/mol/K}}
- {name: AB(s), composition: {H: 2}, sites: 2, thermo: {model: constant-cp, h0: -30 kJ/mol, s0: -60 J/mol/K}}
reactions:
"""
OWN = {
    "Bell": "x-beta: 0.31 nm",
    "Dembo": "stiffness: 2e-3 N/m, transition-stiffness: 0.5 uN/mm",
    "Dembo-formation": "stiffness: 2e-3 N/m, transition-stiffness: 0.5e-3 N/m",
    "two-pathway": "x-slip: 0.2 nm, x-catch: 1.7 nm, catch-ratio: 80",
    "Dudko-Hummer-Szabo": "x-beta: 0.31 nm, barrier: 50 kJ/mol, nu: 0.5",
    "gap-attachment": "stiffness: 1e-3 N/m, rest-length: 5 nm",
    "Kamal-Sourour": "A-2: 3e4 1/s, E-2: 12 kJ/mol, m: 0.5, n: 1.5",
    "linear-affinity": "",
    "exponential-affinity": "",
}
ONE_TO_ONE = ("Kamal-Sourour",)
"""For one species that turns into another."""
BOTH_WAYS = ("linear-affinity", "exponential-affinity")
LOADED = sorted(kind.removeprefix("interface-") for kind, law in kinds().items() if not law.native)


def entry(kind, equation="AB(s) => A(s) + B(s)", constant="A: 2.5e3, b: 0.4, Ea: 20.0", more=""):
    own = "".join(f"  {item.strip()}\n" for item in OWN[kind].split(",") if item)
    return f"- equation: {equation}\n  type: {kind}\n  rate-constant: {{{constant}}}\n{own}{more}"


def all_types():
    """Every rate type in one direction, both and with the coverages."""
    coverage = "  coverage-dependencies:\n    AB(s): {a: 0.1, m: 0.5, E: [3, 2 kcal/mol]}\n"
    coverage += "    A(s): {a: 0, m: 0, E: 1 kJ/mol}\n"
    lines = []
    for kind in ONE_TO_ONE:
        lines.append(entry(kind, "A(s) => B(s)", more="  duplicate: true\n"))
        lines.append(entry(kind, "A(s) <=> B(s)", more="  duplicate: true\n"))
    for kind in BOTH_WAYS:
        lines.append(entry(kind, "A(s) <=> B(s)", more="  duplicate: true\n"))
        lines.append(entry(kind, "A(s) + B(s) <=> AB(s)", "A: 3e9 m^2/mol/s, b: 1, Ea: 1", "  duplicate: true\n"))
    for kind in (kind for kind in LOADED if kind not in ONE_TO_ONE + BOTH_WAYS):
        lines.append(entry(kind, more="  duplicate: true\n"))
        lines.append(entry(kind, "A(s) + B(s) <=> AB(s)", "A: 3e9 m^2/mol/s, b: 0, Ea: 1", "  duplicate: true\n"))
        lines.append(entry(kind, more=coverage + "  duplicate: true\n"))
    return HEAD + "".join(lines)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The mechanism as lowered, and in Cantera."""
    path = tmp_path_factory.mktemp("mechanisms") / "loaded.yaml"
    path.write_text(all_types(), encoding="utf-8")
    return load_mechanism(path), LoadedInterface(str(path), "contact")


def test_every_type_has_an_example_here():
    assert sorted(OWN) == LOADED


@given(
    T=st.floats(280.0, 400.0),
    f=st.floats(-60e-12, 60e-12),
    g_n=st.floats(0.0, 20e-9),
    weights=st.lists(st.floats(0.01, 1.0), min_size=3, max_size=3),
)
@settings(max_examples=10)
def test_same_rates_as_in_a_scene(both, T, f, g_n, weights):
    mechanism, surface = both
    surface.f, surface.g_n = f, g_n
    surface.TP = T, ct.one_atm
    surface.coverages = weights
    point = values(mechanism, T, surface.coverages.tolist()) | {"f": f, "g_n": g_n}
    net, found = surface.net_rates_of_progress * KMOL, surface.forward_rates_of_progress * KMOL
    back = surface.reverse_rates_of_progress * KMOL
    mu = dict(zip(surface.species_names, surface.chemical_potentials / KMOL, strict=True))
    for i, law in enumerate(mechanism.reactions):
        if isinstance(law, AffinityReaction):
            change = {name: law.change.get(mechanism.species[name], 0) for name in mu}
            point["mu"] = sum(nu * mu[name] for name, nu in change.items())
            assert net[i] == pytest.approx(call(law.rate, point), rel=1e-12, abs=1e-12 * found[i])
        else:
            assert found[i] == pytest.approx(call(law.forward, point), rel=1e-12)
            assert back[i] == pytest.approx(call(law.reverse, point), rel=1e-12)


@pytest.mark.parametrize(
    "chosen", [None, {"length": "nm", "quantity": "molec", "activation-energy": "K", "time": "min"}]
)
def test_round_trip(both, tmp_path, chosen):
    mechanism, surface = both
    surface.f, surface.g_n = 20e-12, 6e-9
    path = tmp_path / "written.yaml"
    surface.write_yaml(path, units=chosen)
    again = LoadedInterface(str(path), "contact")
    again.f, again.g_n = surface.f, surface.g_n
    again.TP = surface.TP
    again.coverages = surface.coverages
    np.testing.assert_allclose(again.forward_rates_of_progress, surface.forward_rates_of_progress, rtol=1e-12)
    assert [r.rate.type for r in again.reactions()] == [r.rate.type for r in surface.reactions()]
    lowered = load_mechanism(path)
    assert lowered.sites.density == pytest.approx(mechanism.sites.density, rel=1e-12)
    for ours, theirs in zip(lowered.reactions, mechanism.reactions, strict=True):
        assert type(ours) is type(theirs)
        for name, _ in theirs.specs():
            assert getattr(ours, name) == pytest.approx(getattr(theirs, name), rel=1e-12)


def test_a_spring_that_cantera_has_written_without_its_unit_is_refused(tmp_path):
    text = HEAD.replace("{length: m,", "{length: nm,").replace("1e-6 mol/m^2", "1e-24") + entry("Bell")
    elastic = "-60 J/mol/K}, bond: {stiffness: 1 pN/nm, rest-length: 5}}"
    surface = LoadedInterface(yaml=text.replace("-60 J/mol/K}}", elastic), name="contact")
    surface.write_yaml(tmp_path / "written.yaml")
    with pytest.raises(InputError, match=r"written\.yaml:\d+: species AB\(s\): bond: .*rest-length"):
        load_mechanism(tmp_path / "written.yaml")


def test_a_load_that_is_missing_is_no_zero():
    surface = LoadedInterface(yaml=HEAD + entry("Bell"), name="contact")
    with pytest.raises(AttributeError, match=r"type Bell reads f, the force per bond \[N\], which the surface does"):
        surface.forward_rate_constants  # noqa: B018
    surface.f = 0.0
    assert surface.forward_rate_constants[0] > 0
    plain = ct.Interface(yaml=HEAD + entry("Bell"), name="contact")
    with pytest.raises(AttributeError, match=r"Load the mechanism with surfacechem\.extension\.LoadedInterface"):
        plain.forward_rate_constants  # noqa: B018


def test_a_clone_has_lost_its_load():
    gas_phase = "- {name: gas, thermo: ideal-gas, species: [H2], state: {T: 300 K, P: 1 atm}}\n- name: contact\n"
    hydrogen = "- {name: H2, composition: {H: 2}, thermo: {model: constant-cp}}\n"
    text = (HEAD + entry("Bell")).replace("- name: contact\n", gas_phase + "  adjacent-phases: [gas]\n")
    text = text.replace("- {name: A(s)", hydrogen + "- {name: A(s)")
    gas = ct.Solution(yaml=text, name="gas")
    surface = LoadedInterface(yaml=text, name="contact", adjacent=[gas])
    surface.f = 10e-12
    reactor = ct.IdealGasReactor(gas, clone=True)
    with pytest.raises(AttributeError, match="do not let Cantera clone it"):
        ct.ReactorSurface(surface, reactor, clone=True).phase.forward_rate_constants  # noqa: B018
    kept = ct.ReactorSurface(surface, reactor, clone=False).phase
    assert kept.forward_rate_constants[0] == surface.forward_rate_constants[0]


def test_reactions_of_one_surface_in_another():
    surface = LoadedInterface(yaml=HEAD + entry("Bell"), name="contact")
    other = LoadedInterface(
        thermo="ideal-surface", kinetics="surface", species=surface.species(), reactions=surface.reactions()
    )
    other.site_density = surface.site_density
    surface.f = other.f = 10e-12
    other.TP = surface.TP
    assert other.forward_rate_constants[0] == pytest.approx(surface.forward_rate_constants[0], rel=1e-14)


def test_forces_by_species():
    surface = LoadedInterface(yaml=HEAD + entry("Bell"), name="contact")
    surface.f = 12e-12
    one = surface.forward_rate_constants[0]
    surface.f = {"AB(s)": 12e-12}
    assert surface.forward_rate_constants[0] == one
    surface.f = {"AC(s)": 12e-12}
    with pytest.raises(AttributeError, match="f has no value for any of AB"):
        surface.forward_rate_constants  # noqa: B018


@pytest.mark.parametrize("f", [math.nan, math.inf, {"AB(s)": math.nan}])
def test_a_force_that_is_no_number_is_refused(f):
    surface = LoadedInterface(yaml=HEAD + entry("Bell"), name="contact")
    surface.f = f
    with pytest.raises(ValueError, match=r"a rate of type Bell has no value at T = 300, f = (nan|inf)"):
        surface.net_production_rates  # noqa: B018


def test_exponents_of_a_thousand_are_no_infinity():
    surface = LoadedInterface(yaml=HEAD + entry("Bell"), name="contact")
    surface.TP = 300.0, ct.one_atm
    for f in (1e-8, -1e-8):
        surface.f = f
        assert f * 0.31e-9 / (BOLTZMANN * 300) > 700 or f < 0
        with pytest.warns(RuntimeWarning, match="above 300") if f > 0 else contextlib.nullcontext():
            assert math.isfinite(surface.forward_rate_constants[0])


BELL = entry("Bell")
BAD = {
    "x-beta": ("x-bta", r"unknown key 'x-bta'\. Did you mean 'x-beta'"),
    "0.31 nm": ("0.31 N", r"x-beta = 0\.31 N is not a quantity in m"),
    "Ea: 20.0": ("E: 20.0", r"rate-constant: unknown key 'E'\. Did you mean 'Ea'"),
    "A: 2.5e3, ": ("", r"rate-constant: A is missing"),
    "  x-beta": ("  coverage-dependencies: {C(s): {a: 1, m: 0, E: 0}}\n  x-beta", r"no species 'C\(s\)'"),
}


@pytest.mark.parametrize("old", BAD)
def test_errors_name_file_and_line(old, tmp_path):
    new, message = BAD[old]
    path = tmp_path / "bad.yaml"
    path.write_text(HEAD + BELL.replace(old, new))
    with pytest.raises(ct.CanteraError, match=rf"(?s)Error on line 17 of .*bad\.yaml:.*{message}"):
        LoadedInterface(str(path), "contact")


def test_a_parameter_that_has_no_default_is_asked_for():
    for old, new, message in (
        ("  stiffness: 2e-3 N/m\n", "", r"a rate of type Dembo needs `stiffness`: stiffness of the bond"),
        ("2e-3", "-2e-3", r"stiffness = -0\.002 is outside its range: > 0"),
    ):
        with pytest.raises(ct.CanteraError, match=message):
            LoadedInterface(yaml=HEAD + entry("Dembo").replace(old, new), name="contact")


def test_the_reverse_of_an_elastic_bond_is_refused():
    text = HEAD.replace("sites: 2", "sites: 2, bond: {stiffness: 1e-3}") + entry("Bell", "AB(s) <=> A(s) + B(s)")
    with pytest.raises(ct.CanteraError, match=r"AB\(s\) is elastic.*Write two one-way reactions"):
        LoadedInterface(yaml=text, name="contact")
