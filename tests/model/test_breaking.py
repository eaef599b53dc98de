"""Bonds of a mechanism that break at once, by a strength or as sliding starts."""

from pathlib import Path

import numpy as np
import pytest
from scenes import SITES, bodies, varying
from solved import closed

from surfacechem.errors import InputError
from surfacechem.laws.cohesive import TensileStrength
from surfacechem.laws.factors import Proportional
from surfacechem.laws.free_energy import Quadratic
from surfacechem.laws.friction import BondedCoulomb
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.mechanism import load_mechanism
from surfacechem.model.assemble import assemble
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.results.audit import audit, findings
from surfacechem.scene import Interface, Mounting, Scene

K = 1e12
"""Stiffness of the bodies [Pa/m]."""

TWO_BONDS = """
units: {length: m, quantity: mol, activation-energy: kJ/mol}
phases:
- name: pair
  thermo: ideal-surface
  kinetics: surface
  species: [free(s), weak(s), strong(s)]
  reactions: all
  site-density: 1.0e-5 mol/m^2
  state: {T: 300 K, coverages: {free(s): 1.0}}
species:
- name: free(s)
  composition: {}
  thermo: {model: constant-cp, T0: 300 K, h0: 0 kJ/mol, s0: 0 J/mol/K, cp0: 0 J/mol/K}
- name: weak(s)
  composition: {}
  thermo: {model: constant-cp, T0: 300 K, h0: -20 kJ/mol, s0: 0 J/mol/K, cp0: 0 J/mol/K}
- name: strong(s)
  composition: {}
  thermo: {model: constant-cp, T0: 300 K, h0: -50 kJ/mol, s0: 0 J/mol/K, cp0: 0 J/mol/K}
reactions:
- equation: weak(s) <=> strong(s)
  rate-constant: {A: 0.0 1/s, b: 0, Ea: 0}
- equation: free(s) <=> weak(s)
  rate-constant: {A: 0.0 1/s, b: 0, Ea: 0}
- equation: strong(s) <=> free(s)
  rate-constant: {A: 0.0 1/s, b: 0, Ea: 0}
"""
"""Two bonds in 1e-5 mol/m^2 of sites that neither form nor break by themselves."""


@pytest.fixture
def two_bonds(tmp_path) -> Path:
    path = tmp_path / "two.yaml"
    path.write_text(TWO_BONDS)
    return path


def scene(path, bonds, coverages, loading, frictions=(), limits=(), potentials=(), **mounts) -> Scene:
    mechanism = load_mechanism(path, bonds=bonds)
    reading = ([*mechanism.potentials, *potentials], frictions, mechanism.reactions, mechanism.sites)
    given = {"variables": mechanism.variables, "bonds": mechanism.bonds, "limits": limits}
    interface = Interface("T", *reading, **given)
    initial = {"T": 300.0} | mechanism.coverages(coverages)
    return Scene(bodies("T", "T", C_1=0.5, C_2=0.5), interface, loading=loading, T_0=300.0, initial=initial, **mounts)


def solve(scene):
    trajectory = closed(scene, 2.0, outputs=21)
    assert audit(trajectory).site_error < 1e-10
    return trajectory


def pulled(path, coverages, **options):
    limits = [TensileStrength(t_max=1e6, **options)]
    bonds = ["weak(s)", "strong(s)"]
    return solve(scene(path, bonds, coverages, {"w_n": Ramp(rate=1e-6)}, limits=limits, normal=Mounting(k=K)))


def coverages(trajectory, point):
    return {name: trajectory.state(trajectory.jumps[0], name, point) for name in trajectory.states}


def test_a_strength_breaks_every_bond_into_free_sites(two_bonds):
    trajectory = pulled(two_bonds, {"weak(s)": 0.3, "strong(s)": 0.25, "free(s)": 0.45})
    (jump,) = trajectory.jumps
    after = coverages(trajectory, "after")
    assert (after["theta_weak_s"], after["theta_strong_s"]) == (0.0, 0.0)
    assert after["theta_free_s"] == pytest.approx(1.0, rel=1e-14)
    assert jump.t == pytest.approx(1.0, rel=1e-12)
    heat = 0.5 * 1e6**2 / K - 1e-5 * (0.3 * 20e3 + 0.25 * 50e3)
    assert jump.released == pytest.approx(heat, rel=1e-9)
    T = np.sqrt(300.0**2 + 2 * 300.0 * heat)
    assert after["T"] == pytest.approx(T, rel=1e-12)
    mixing = sum(x * np.log(x) for x in (0.3, 0.25, 0.45)) * 1e-5 * GAS_CONSTANT
    assert jump.entropy == pytest.approx(T / 300.0 - 1 + mixing, rel=1e-6)


def test_a_strength_breaks_the_bond_that_it_names(two_bonds):
    trajectory = pulled(two_bonds, {"weak(s)": 0.3, "strong(s)": 0.25, "free(s)": 0.45}, breaks="weak(s)")
    after = coverages(trajectory, "after")
    assert after["theta_weak_s"] == 0.0
    assert after["theta_strong_s"] == 0.25
    assert after["theta_free_s"] == pytest.approx(0.75, rel=1e-14)


@pytest.mark.parametrize(("law", "name"), [(TensileStrength, "T_c"), (Quadratic, "T")])
def test_a_run_tells_where_it_leaves_the_range_of_a_law(two_bonds, monkeypatch, law, name):
    monkeypatch.setattr(law, "ranges", {name: (250.0, 290.0)})
    told = findings(pulled(two_bonds, {"weak(s)": 0.5, "strong(s)": 0.5}), None)
    assert f"{law.name().replace('-', ' ')} is an extrapolation: T ran from 300 to" in next(told)


def test_bonds_on_two_sites_give_back_both():
    limits = [TensileStrength(t_max=varying(1e6, Proportional(of="phi")))]
    start = {"PL(s)": 0.4, "P(s)": 0.3, "L(s)": 0.3}
    loading = {"w_n": Ramp(rate=1e-6)}
    trajectory = solve(scene(Path("selectin.yaml"), ["PL(s)"], start, loading, limits=limits, normal=Mounting(k=K)))
    before, after = (coverages(trajectory, point) for point in ("before", "after"))
    assert after["theta_PL_s"] == 0.0
    gained = before["theta_PL_s"] / 2
    assert after["theta_P_s"] == pytest.approx(before["theta_P_s"] + gained, rel=1e-13)
    assert after["theta_L_s"] == pytest.approx(before["theta_L_s"] + gained, rel=1e-13)


def test_sliding_breaks_the_bonds_of_a_mechanism(two_bonds):
    loading = {"p": Hold(level=1e6), "w_t": Ramp(rate=1e-6)}
    friction = BondedCoulomb(mu=0.3, mu_b=0.8, mu_ub=0.4)
    start = {"weak(s)": 0.5, "strong(s)": 0.5}
    bonds, mount = ["weak(s)", "strong(s)"], Mounting(k=K)
    trajectory = solve(scene(two_bonds, bonds, start, loading, [friction], tangential=mount))
    slip = trajectory.jumps[0]
    assert slip.edge.name == "slip forward"
    assert slip.t == pytest.approx(0.8, rel=1e-12)
    assert coverages(trajectory, "after")["theta_free_s"] == pytest.approx(1.0, rel=1e-14)


def test_a_bond_that_several_reactions_break_goes_the_first_way(two_bonds):
    loads, limits = {"w_n": Hold(level=1e-6)}, [TensileStrength(t_max=1e6)]
    given = scene(two_bonds, ["weak(s)"], {"free(s)": 1.0}, loads, limits=limits, normal=Mounting(k=K))
    assert any("by the first of the reactions that break it" in text for text in assemble(given).warnings)


def test_a_limit_names_its_bonds_or_is_refused(two_bonds):
    with pytest.raises(InputError, match=r"no bond is called 'weka\(s\)'.*weak\(s\)"):
        pulled(two_bonds, {"free(s)": 1.0}, breaks="weka(s)")
    interface = Interface("T", sites=SITES, limits=[TensileStrength(t_max=1e6, breaks="bond")])
    loading = {"w_n": Ramp(rate=1e-6)}
    initial = {"T": 300.0, "phi": 1.0}
    bare = Scene(bodies("T", "T"), interface, loading=loading, T_0=300.0, initial=initial, normal=Mounting(k=K))
    with pytest.raises(InputError, match="the bonds are not species of a mechanism"):
        assemble(bare)
