"""Published constants against what they were fitted to or defined by."""

import numpy as np
import pytest
from scipy.special import erfc, erfcinv

from surfacechem.laws.films import RarefiedFilm, Roelands
from surfacechem.laws.friction import RateAndStateAging, RateAndStateSlip
from surfacechem.laws.heat_transfer import CooperMikicYovanovich, MikicElastic, SongYovanovich

SURFACE = {"between": ("lower", "upper"), "k": 20.0, "m": 0.1, "sigma": 1e-6}
UNIT = SURFACE["k"] * SURFACE["m"] / SURFACE["sigma"]


def separation(area: np.ndarray) -> np.ndarray:
    """Distance of the mean planes of Gaussian surfaces over sigma, where their profiles share a part of the area."""
    return np.sqrt(2) * erfcinv(2 * area)


def plastic(x: np.ndarray) -> np.ndarray:
    """Conductance over k m / sigma at x = p / H: Cooper, Mikic & Yovanovich (1969), in full."""
    d = separation(x)
    return np.exp(-(d**2) / 2) / (2 * np.sqrt(2 * np.pi)) / (1 - np.sqrt(erfc(d / np.sqrt(2)) / 2)) ** 1.5


def elastic(x: np.ndarray) -> np.ndarray:
    """The same for elastic asperities at x = sqrt(2) p / (E' m), of which half the area touches: Mikic (1974)."""
    d = separation(2 * x)
    return np.exp(-(d**2) / 2) / (4 * np.sqrt(np.pi)) / (1 - np.sqrt(erfc(d / np.sqrt(2)) / 4)) ** 1.5


def pressures(law) -> np.ndarray:
    low, high = law.ranges["p"]
    return np.geomspace(low, high, 400)


def test_the_plastic_correlation_is_within_its_error_in_its_range():
    law = CooperMikicYovanovich(**SURFACE, H=2e9)
    p = pressures(law)
    ours = np.array([law.conductance(p=float(value)) for value in p]) / UNIT
    assert np.abs(ours / plastic(p / 2e9) - 1).max() < 0.0155


def test_the_elastic_correlation_is_within_its_error_in_its_range():
    law = MikicElastic(**SURFACE, E=1.1e11)
    p = pressures(law)
    ours = np.array([law.conductance(p=float(value)) for value in p]) / UNIT
    assert np.abs(ours / elastic(np.sqrt(2) * p / 1.1e10) - 1).max() < 0.025


def test_the_size_of_indents_is_that_of_contact_spots():
    """d = sqrt(2 pi) a = 1.62 (sigma / m) (p / H)^0.071 with the mean spot radius a of the plastic model."""
    x = np.geomspace(1e-5, 2e-2, 100)
    d = separation(x)
    radius = np.sqrt(8 / np.pi) * np.exp(d**2 / 2) * erfc(d / np.sqrt(2))
    assert np.abs(1.62 * x**0.071 / (np.sqrt(2 * np.pi) * radius) - 1).max() < 0.08


@pytest.mark.parametrize("c_2", [-0.26, 371.0])
def test_the_hardness_is_that_of_indents_of_this_size(c_2):
    """The second index is that of a factor that runs away with temperature; of its hardness only the logarithm is a
    number.
    """
    law = SongYovanovich(**{**SURFACE, "sigma": 5e-9}, c_1=6e9, c_2=c_2)
    x = law.relative_pressure(2e6)
    assert np.log(x) == pytest.approx(np.log(2e6 / 6e9) - c_2 * np.log(1.62 * 5e-9 / 0.1 / 1e-6 * x**0.071), rel=1e-12)


def test_indices_of_roelands_are_those_of_the_slopes():
    """d ln eta / dp = 5.1e-9 Z (ln eta_0 + 9.67) and d ln eta / dT = -S_0 (ln eta_0 + 9.67) / (T_0 - 138) at p = 0."""
    law, scale = Roelands(eta_0=0.04, Z=0.6, S_0=1.1), np.log(0.04) + 9.67
    at = lambda p, T: np.log(law.value(T_c=T, p=p, T_0=313.15))  # noqa: E731
    by_pressure = (at(1e4, 313.15) - at(0.0, 313.15)) / 1e4
    by_temperature = (at(0.0, 313.15 + 1e-3) - at(0.0, 313.15 - 1e-3)) / 2e-3
    assert by_pressure == pytest.approx(5.1e-9 * 0.6 * scale, rel=1e-3)
    assert by_temperature == pytest.approx(-1.1 * scale / (313.15 - 138), rel=1e-6)


def test_temperature_jump_of_air():
    """2 (2 gamma / (gamma + 1)) Lambda / Pr with the textbook mean free path of 68 nm at 300 K and 1 atm."""
    law = RarefiedFilm(between=("lower", "upper"))
    air = {"k_m": 0.0263, "eta_m": 1.85e-5, "rho_m": 1.177, "cp_m": 1007.0, "gamma_m": 1.4, "p_m": 101325.0}
    jump = 0.0263 / law.conductance(d_m=0.0, **air)
    assert jump == pytest.approx(2 * (2.8 / 2.4) * 68e-9 / 0.707, rel=0.02)
    assert jump == pytest.approx(0.22e-6, rel=0.03)


@pytest.mark.parametrize("law", [RateAndStateAging, RateAndStateSlip])
def test_regularised_friction_is_the_logarithmic_one_while_sliding(law):
    rock = law(mu_0=0.6, a=0.01, b=0.015, L=1e-5, v_0=1e-6)
    for v, theta in ((1e-9, 1e3), (1e-6, 10.0), (1e-2, 1e-3)):
        ours = rock.traction(p=1.0, v=v, ln_theta=np.log(theta))
        assert ours == pytest.approx(0.6 + 0.01 * np.log(v / 1e-6) + 0.015 * np.log(1e-6 * theta / 1e-5), rel=1e-12)
