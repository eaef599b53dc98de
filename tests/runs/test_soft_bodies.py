"""Bonds that hold a soft body: they share what it pulls with, and go at once at a time that a quadrature gives."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

import surfacechem
from surfacechem.quantities import BOLTZMANN

T, RATE, LENGTH, STIFFNESS, DENSITY = 300.0, 0.02, 0.25e-9, 5.3e-3, 1e14
MECHANISM = f"""
units: {{length: m, quantity: molec}}
phases:
- {{name: contact, thermo: ideal-surface, kinetics: surface, species: all, site-density: {DENSITY} molec/m^2}}
species:
- {{name: free(s), composition: {{}}, thermo: {{model: constant-cp}}}}
- {{name: bond(s), composition: {{}}, thermo: {{model: constant-cp}}, bond: {{stiffness: {STIFFNESS} N/m}}}}
reactions:
- {{equation: bond(s) => free(s), type: Bell, rate-constant: {{A: {RATE} 1/s, b: 0, Ea: 0}}, x-beta: {LENGTH} m}}
"""
CASE = f"""
bodies:
  plate: {{temperature: {T} K}}
  gel: {{temperature: {T} K}}
interface:
  temperature: {T} K
  mechanism: {{file: bonds.yaml, bonds: [bond(s)]}}
mechanics: {{normal: {{k: MOUNT}}}}
loading: {{w_n: HELD}}
initial: {{coverages: {{bond(s): 1}}}}
run: {{until: 200 s}}
"""


@pytest.fixture
def pulled(tmp_path):
    """A run of bonds that hold a body of stiffness k [Pa/m] whose far side is moved by w [m]."""
    (tmp_path / "bonds.yaml").write_text(MECHANISM)

    def run(k, w):
        path = tmp_path / "case.yaml"
        path.write_text(CASE.replace("MOUNT", f"{k} Pa/m").replace("HELD", f"{w} m"))
        return surfacechem.run(path)

    return run


def time_of_rupture(k, w):
    """Integral of -1 / (d phi/dt) from all bonds to none."""

    def inverse(phi):
        gap = k * w / (k + DENSITY * STIFFNESS * phi)
        return np.exp(-STIFFNESS * gap * LENGTH / (BOLTZMANN * T)) / (RATE * phi)

    parts = [1e-10, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0]
    return sum(quad(inverse, a, b, epsabs=0, epsrel=1e-13, limit=400)[0] for a, b in itertools.pairwise(parts))


@pytest.mark.parametrize(("k", "w"), [(1e10, 1e-6), (1e9, 2e-6), (1e11, 2e-7)])
def test_rupture_is_found_where_a_quadrature_finds_it(pulled, k, w):
    solution = pulled(k, w)
    assert solution.status == "stopped"
    assert "the bonds ruptured" in solution.reason
    assert solution.trajectory.result.t == pytest.approx(time_of_rupture(k, w), rel=1e-9)
    assert solution.audit.energy_error < 1e-10


@pytest.mark.parametrize(("force", "capped"), [("20 pN", False), ("6 nN", True)])
def test_a_rate_that_is_capped_is_never_used_silently(tmp_path, force, capped):
    (tmp_path / "bonds.yaml").write_text(MECHANISM.replace(f", bond: {{stiffness: {STIFFNESS} N/m}}", ""))
    path = tmp_path / "case.yaml"
    text = CASE.replace("mechanics: {normal: {k: MOUNT}}\n", "").replace("w_n: HELD", f"f: {force}")
    path.write_text(text)
    solution = surfacechem.run(path)
    said = [warning for warning in solution.warnings if "above 300 the rate goes on along its tangent" in warning]
    assert bool(said) == capped
    assert all(np.all(np.isfinite(column.values)) for column in solution.columns if column.values.dtype.kind == "f")
