"""Mechanisms give Cantera's own rates and thermodynamics, at any temperature and coverages."""

import math

import cantera as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanisms import KMOL, call, cantera_of, load, mechanism_texts, partial_molar, pulled, states, values
from surfacechem.mechanism import load_mechanism
from surfacechem.quantities import AVOGADRO

TOLERANCE = 1e-12


@pytest.fixture(autouse=True, scope="module")
def _quiet():
    """Random polynomials jump where two ranges meet."""
    ct.suppress_thermo_warnings(True)
    yield
    ct.suppress_thermo_warnings(False)


def compare(mechanism, T, coverages, gap=0.0, force=0.0):
    surface = pulled(mechanism, T, gap, force)
    surface.coverages = coverages
    coverages = surface.coverages.tolist()
    point = values(mechanism, T, coverages, gap=gap, force=force)
    compare_rates(mechanism, surface, point)
    compare_thermo(mechanism, surface, point)


def compare_rates(mechanism, surface, point):
    forward = np.array([call(law.forward, point) for law in mechanism.reactions])
    reverse = np.array([call(law.reverse, point) for law in mechanism.reactions])
    net = np.array([call(law.rate, point) for law in mechanism.reactions])
    gross = abs(forward) + abs(reverse)
    np.testing.assert_allclose(forward, surface.forward_rates_of_progress * KMOL, rtol=TOLERANCE)
    np.testing.assert_allclose(reverse, surface.reverse_rates_of_progress * KMOL, rtol=TOLERANCE)
    assert np.all(abs(net - surface.net_rates_of_progress * KMOL) <= TOLERANCE * gross)
    production = {variable.name: 0.0 for variable in mechanism.variables}
    scale = dict.fromkeys(production, 0.0)
    for law, rate, size in zip(mechanism.reactions, net, gross, strict=True):
        for name in production:
            nu = law.change.get(name, 0)
            production[name] += nu * rate
            scale[name] += abs(2 * law.products.get(name, 0) - nu) * size  # a catalyst is made and used
    expected = surface.net_production_rates * KMOL
    assert np.all(abs(np.array(list(production.values())) - expected) <= TOLERANCE * np.array(list(scale.values())))
    for law, constant in zip(mechanism.reactions, surface.equilibrium_constants, strict=True):
        if law.reversible:
            assert equilibrium_constant(law, point) == pytest.approx(constant, rel=TOLERANCE)


def equilibrium_constant(law, point):
    """Of concentrations in kmol/m^2: forward over reverse coefficient."""
    ones = point | {item.variable: 1.0 for item in law.species}
    ratio = call(law.forward, ones) / call(law.reverse, ones)
    if any(item.interactions for item in law.species):  # it varies with the coverages
        ratio = math.exp(-law.standard_affinity(point["T_c"], point["g_n"], point))
    for item in law.species:
        ratio *= (point[item.concentration] / KMOL) ** law.change.get(item.variable, 0)
    return ratio


def compare_thermo(mechanism, surface, point):
    T = point["T_c"]
    mu, h, s, cp = (np.array(column) for column in zip(*partial_molar(mechanism, point), strict=True))
    size = abs(surface.partial_molar_enthalpies) + T * abs(surface.partial_molar_entropies) + ct.gas_constant * T
    size /= 1000
    assert np.all(abs(mu - surface.chemical_potentials / 1000) <= TOLERANCE * size)
    assert np.all(abs(h - surface.partial_molar_enthalpies / 1000) <= TOLERANCE * size)
    assert np.all(abs(s - surface.partial_molar_entropies / 1000) <= TOLERANCE * size / T)
    assert np.all(abs(cp - surface.partial_molar_cp / 1000) <= 1e-10 * size / T)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("mechanisms") / "random.yaml"


@given(data=st.data())
@settings(max_examples=20)
def test_random_mechanisms_agree_with_cantera(file, data):
    file.write_text(data.draw(mechanism_texts()), encoding="utf-8")
    mechanism = load_mechanism(file)
    compare(mechanism, *data.draw(states(len(mechanism.variables))))


def test_densities_count_molecules():
    film = load("dna-film.yaml", ["AB(s)"])
    by_name = {variable.name: variable.density for variable in film.variables}
    assert by_name == pytest.approx(
        {"theta_A_s": 1e-4 * AVOGADRO, "theta_B_s": 1e-4 * AVOGADRO, "theta_AB_s": 5e-5 * AVOGADRO}
    )
    assert film.sites.density == pytest.approx(by_name["theta_AB_s"])
    assert film.sites.phi_max == 1
    assert film.bonds == ("theta_AB_s",)
    assert film.species["AB(s)"] == "theta_AB_s"


def test_literature_numbers_come_back():
    """The mechanisms' comments derive their numbers; here from the other end."""
    tethers, film, selectin = (
        cantera_of(load(name)) for name in ("dna-tethers.yaml", "dna-film.yaml", "selectin.yaml")
    )
    K = np.exp(-(-172380.8 + 298.15 * 482.8336) / (8.31446261815324 * 298.15))  # of 1 mol/L
    for surface in (tethers, film, selectin):
        surface.TP = 298.15, ct.one_atm
    assert tethers.equilibrium_constants[0] == pytest.approx(K * 5e-3, rel=1e-6)
    assert film.equilibrium_constants[0] == pytest.approx(K / (10e-6 * 1.0), rel=1e-6)  # m^2/kmol
    assert selectin.reverse_rate_constants[0] == pytest.approx(4.4e6 * 320e-9, rel=1e-6)
