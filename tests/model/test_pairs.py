"""Reactions that run one way each are held against the equilibrium of the potential, and dissipate together."""

import math

import numpy as np
import pytest

import surfacechem
from surfacechem.expressions import log_sum
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT

DH, DS = -20e3, -50.0
"""Enthalpy and entropy of bonding [J/mol, J/(mol K)]."""

HEAD = f"""\
units: {{length: m, quantity: mol, activation-energy: J/mol}}
phases:
- name: bonds
  thermo: ideal-surface
  kinetics: surface
  species: [free(s), bond(s)]
  reactions: all
  site-density: 1e-9 mol/m^2
species:
- {{name: free(s), composition: {{}}, thermo: {{model: constant-cp, h0: 0 kJ/mol}}}}
- {{name: bond(s), composition: {{}}, thermo: {{model: constant-cp, h0: {DH} J/mol, s0: {DS} J/mol/K}}}}
reactions:
"""
CASE = """\
title: A pair
bodies:
  lower: {{temperature: T, C: 1 mJ/m^2/K}}
  upper: {{temperature: T, C: 1 mJ/m^2/K}}
T_0: 300 K
interface: {{temperature: T, mechanism: pair.yaml}}
initial: {{coverages: {{free(s): {free}, bond(s): {bond}}}, T: {T}}}
run: {{until: 0.2 s, accuracy: 1e-8, outputs: 41}}
"""
FORWARD, BACKWARD = "free(s) => bond(s)", "bond(s) => free(s)"
A, EA = 1e3, 5e3
BACK = (A * math.exp(-DS / GAS_CONSTANT), EA - DH)
"""The parameters of the reverse reaction that keeps detailed balance at every temperature."""


def reaction(equation, A, Ea, duplicate=False):
    mark = "  duplicate: true\n" if duplicate else ""
    return f"- equation: {equation}\n  rate-constant: {{A: {A!r}, b: 0, Ea: {Ea!r}}}\n{mark}"


def loaded(folder, *reactions, free=1.0, T="310 K"):
    (folder / "pair.yaml").write_text(HEAD + "".join(reactions), encoding="utf-8")
    (folder / "case.yaml").write_text(CASE.format(free=free, bond=1 - free, T=T), encoding="utf-8")
    return surfacechem.load(folder / "case.yaml")


@pytest.fixture
def pair(tmp_path):
    """A pair whose reverse is too fast by a factor."""

    def make(factor=1.0, **rest):
        back = reaction(BACKWARD, BACK[0] * factor, BACK[1])
        return loaded(tmp_path, reaction(FORWARD, A, EA), back, **rest)

    return make


def test_a_consistent_pair_is_the_reversible_reaction(pair, tmp_path):
    both = pair().run()
    one = loaded(tmp_path, reaction("free(s) <=> bond(s)", A, EA)).run()
    assert np.max(np.abs(both.dataset.departure_R1_R2)) < 1e-12
    for name in ("theta_bond_s", "T"):
        np.testing.assert_allclose(both.dataset[name], one.dataset[name], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(both.dataset.sigma_R1_R2, one.dataset.sigma_R1, rtol=1e-6, atol=1e-13)
    assert both.warnings == ()
    (verdict,) = both.verdicts
    assert verdict.consistent
    assert verdict.dissipates
    assert both.attributes["detailed_balance"].startswith("free(s) <=> bond(s) (pair): k_f/k_r is K(g, T) to within")


@pytest.mark.parametrize("free", [1.0, 0.0])
def test_the_departure_is_what_the_parameters_lack(pair, free):
    """Also where a coverage has vanished, whose logarithm is infinite."""
    solution = pair(math.exp(2.3), free=free).run()
    np.testing.assert_allclose(solution.dataset.departure_R1_R2, -2.3, rtol=1e-11)
    expected = (
        "free(s) <=> bond(s) (pair): k_f/k_r departs from the equilibrium constant K(g, T) by a factor exp(-2.3) at "
        "most; entropy production stayed positive"
    )
    if free == 1.0:
        assert solution.warnings == (expected,)
    assert expected.split(";")[0] in solution.attributes["warnings"]


def test_between_the_two_equilibria_a_departing_pair_destroys_entropy(pair):
    """From the potential's equilibrium the rates lead away, uphill."""
    K = math.exp(-(DH - 310 * DS) / (GAS_CONSTANT * 310))
    solution = pair(0.1, free=1 / (1 + K)).run()
    (verdict,) = solution.verdicts
    assert not verdict.dissipates
    assert str(verdict).endswith("it DESTROYED ENTROPY")
    assert solution.audit.violations == ("R1_R2",)
    assert "the law R1 R2 destroys entropy" in solution.warnings


def test_parallel_pathways_count_together(tmp_path):
    ways = [reaction(FORWARD, A, EA, duplicate=True), reaction(FORWARD, 2 * A, EA, duplicate=True)]
    solution = loaded(tmp_path, *ways, reaction(BACKWARD, *BACK)).run()
    np.testing.assert_allclose(solution.dataset.departure_R1_R2_R3, math.log(3), rtol=1e-11)


def test_a_coverage_of_another_order_keeps_no_constant(tmp_path):
    """ln(k_f theta^2 / k_r theta) grows with the logarithm of the coverage."""
    order = "  orders: {free(s): 2}\n"
    solution = loaded(tmp_path, reaction(FORWARD, A, EA) + order, reaction(BACKWARD, *BACK)).run()
    dataset = solution.dataset
    drift = dataset.departure_R1_R2 - np.log(dataset.theta_free_s)
    np.testing.assert_allclose(drift, float(drift[0]), rtol=1e-11)


def test_without_a_pair_nothing_is_added(tmp_path):
    for reactions in ([reaction("free(s) <=> bond(s)", A, EA)], [reaction(FORWARD, A, EA)]):
        solution = loaded(tmp_path, *reactions).run()
        assert not [name for name in solution.dataset if name.startswith("departure")]
        assert "detailed_balance" not in solution.attributes
        assert solution.verdicts == ()


def test_one_way_alone_is_audited_by_itself(tmp_path):
    """Unbinding from the side where bonds are stable runs uphill."""
    solution = loaded(tmp_path, reaction(BACKWARD, *BACK), free=0.01, T="250 K").run()
    assert solution.audit.violations == ("R1",)


def test_a_direction_that_is_switched_off_is_said(pair):
    solution = pair(0.0).run()
    assert "one of the two never runs" in str(solution.verdicts[0])


@pytest.mark.parametrize("logs", [(0.0, 0.0), (-1000.0, 5.0), (1e5, -1e5), (800.0, 800.0, 801.0)])
def test_logarithm_of_a_sum(logs):
    assert log_sum(list(logs)) == pytest.approx(np.logaddexp.reduce(logs), rel=1e-14)


SPRINGS = """\
title: A law that states both rates
bodies:
  lower: {{temperature: 300 K}}
  upper: {{temperature: 300 K}}
interface:
  temperature: 300 K
  sites: 1e14 1/m^2
  potential:
    - lattice-gas: {{epsilon: {epsilon!r} J}}
    - bond-springs: {{k_b: 5 pN/nm}}
  bonding:
    - {law}
initial: {{phi: {phi}}}
loading: {{g_n: {{ramp: {{rate: 2 nm/s}}}}}}
run: {{until: 2 s, accuracy: 1e-8}}
"""
KT = BOLTZMANN * 300
BELL = "bell: {k_off: 1 1/s, x_off: 0.4 nm, k_on: 10 1/s, x_on: -0.4 nm}"
DEMBO = "dembo-spring: {k_off: 1 1/s, stiffness: 5 pN/nm, transition_stiffness: 2 pN/nm, k_on: 10 1/s}"


def with_springs(folder, law, phi=0.5):
    text = SPRINGS.format(epsilon=KT * math.log(10), law=law, phi=phi)
    (folder / "springs.yaml").write_text(text, encoding="utf-8")
    return surfacechem.load(folder / "springs.yaml").run()


@pytest.mark.parametrize("phi", [0.0, 1.0])
def test_a_law_with_both_rates_is_held_against_the_potential(phi, tmp_path):
    solution = with_springs(tmp_path, BELL, phi)
    f = solution.dataset.f
    expected = f**2 / (2 * 5e-3 * KT) - f * 0.8e-9 / KT
    np.testing.assert_allclose(solution.dataset.departure_bell, expected, rtol=1e-10, atol=1e-10)
    assert (
        "bell: k_f/k_r departs from the equilibrium constant K(g, T) by a factor exp(5.79) at most"
        in solution.attributes["detailed_balance"]
    )


def test_springs_in_the_rates_and_in_the_potential_agree(tmp_path):
    solution = with_springs(tmp_path, DEMBO)
    assert np.max(np.abs(solution.dataset.departure_dembo_spring)) < 1e-12
    assert solution.warnings == ()


def test_a_potential_that_knows_nothing_of_bonds_is_no_equilibrium(tmp_path):
    """Force spectroscopy: rates and a load, no energy."""
    text = SPRINGS.format(epsilon=0.0, law=BELL, phi=0.5)
    start, end = text.index("  potential:"), text.index("  bonding:")
    text = (text[:start] + text[end:]).replace("g_n: {ramp: {rate: 2 nm/s}}", "f: 10 pN")
    (tmp_path / "rates.yaml").write_text(text, encoding="utf-8")
    assert surfacechem.load(tmp_path / "rates.yaml").run().verdicts == ()
