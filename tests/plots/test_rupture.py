"""Figures of ruptures: distributions and lifetimes are those of the law."""

import numpy as np
import pytest

import surfacechem
from surfacechem import plots
from surfacechem.quantities import BOLTZMANN

pytestmark = pytest.mark.around


@pytest.fixture(scope="module")
def spectrum():
    rates = {"loading.f.ramp.rate": [1e-12, 1e-10, 1e-9]}
    return surfacechem.load("force-spectroscopy").sweep(rates, {"f": "150 pN"}).dataset


def words(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_lifetimes_are_those_under_a_constant_force_at_every_rate(spectrum):
    exact = np.exp(-spectrum["f"].values * 0.4e-9 / (BOLTZMANN * 300)) / 0.1
    found = spectrum["lifetime"].values
    known = np.isfinite(found)
    assert np.all(known.sum(axis=1) > 30)
    assert np.allclose(found[known], np.broadcast_to(exact, found.shape)[known], rtol=1e-9)


def test_the_figure_has_spectrum_distributions_and_lifetimes(spectrum):
    forces, density, lifetime = plots.figure(spectrum).axes
    assert (forces.get_xlabel(), forces.get_xscale()) == ("Loading rate of $f$ [pN s⁻¹]", "log")
    assert words(forces) == ["most probable", "median", "mean", "exact"]
    assert forces.get_ylabel() == "$f$ at rupture [pN]"
    # At 1 pN/s most bonds break before there is a force.
    assert words(density) == ["rate = 100 pN s⁻¹", "rate = 1000 pN s⁻¹"]
    assert (density.get_title("right"), lifetime.get_yscale()) == ("2 of 3 runs", "log")
    (common,) = lifetime.get_lines()  # as the curves of both rates coincide
    assert np.isfinite(common.get_ydata()).sum() == np.isfinite(spectrum["lifetime"].values).any(axis=0).sum()
    assert lifetime.get_title("right") == "2 of 3 runs, their curves coincide"
    for line in density.get_lines():
        x, y = (values[np.isfinite(line.get_ydata())] for values in line.get_data())
        assert np.trapezoid(y, x / 1e-12) == pytest.approx(1, abs=2e-3)  # [1/pN] over [pN]
        assert y.min() >= 0


def test_a_second_parameter_has_colours_and_statistics_have_markers():
    over = {"loading.f.ramp.rate": [1e-11, 1e-10, 1e-9], "interface.bonding.bell.k_off": [0.1, 1.0]}
    forces, *_ = plots.figure(surfacechem.sweep("force-spectroscopy", over, {"f": "150 pN"}).dataset).axes
    rates = [rf"$k_{{\mathrm{{off}}}}$ = {rate} s⁻¹" for rate in (0.1, 1)]
    assert words(forces) == [*rates, "most probable", "median", "mean", "exact"]
    drawn = [line for line in forces.get_lines() if len(line.get_xdata())]
    assert len({line.get_color() for line in drawn}) == 2
    assert {line.get_marker() for line in drawn} == {"o", "s", "D", "None"}


def test_lifetimes_under_constant_forces_have_a_figure():
    data = surfacechem.sweep("bond-lifetimes", {"loading.f": [0, 1e-11, 4e-11]}).dataset
    above, below = plots.figure(data).axes
    points, exact = above.get_lines()[:2]
    assert points.get_xdata().tolist() == [0, 1e-11, 4e-11]
    assert points.get_ydata() == pytest.approx(exact.get_ydata(), rel=1e-11)
    assert (above.get_xlabel(), above.get_yscale()) == ("Force per bond $f$ [pN]", "log")
    assert (len(below.get_lines()), below.get_xscale()) == (3, "log")
    assert words(below) == ["$f$ = 0 pN", "$f$ = 10 pN", "$f$ = 40 pN"]


def test_survival_is_followed_and_drawn_over_decades():
    """That of each run to a thousandth, whose lifetimes are decades apart, though no times are asked for."""
    forces = [0.0, 4e-11, 8e-11]
    data = surfacechem.load("bond-lifetimes", ["run={until: 1 h}"]).sweep({"loading.f": forces}).dataset
    _, below = plots.figure(data).axes
    assert below.get_xscale() == "log"
    for line, lifetime in zip(below.get_lines(), data["lifetime"].values, strict=True):
        x, y = line.get_data()
        t = np.geomspace(lifetime / 100, 5 * lifetime, 50)
        assert np.interp(t, x, y) == pytest.approx(np.exp(-t / lifetime), abs=1e-3)


def test_variables_are_drawn_over_the_load_or_over_the_rate(spectrum):
    over_load = plots.figure(spectrum, ["density_f", "survival"]).axes
    assert {ax.get_xlabel() for ax in over_load} == {"Force per bond, tension positive $f$ [pN]"}
    (each,) = plots.figure(spectrum, ["phi"], "f").axes
    assert [len(line.get_xdata()) for line in each.get_lines()] == 3 * [spectrum.sizes["f"]]
    (over_rate,) = plots.figure(spectrum, ["f_mean"]).axes
    assert over_rate.get_lines()[0].get_xdata().tolist() == [1e-12, 1e-10, 1e-9]
