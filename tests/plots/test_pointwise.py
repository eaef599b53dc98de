"""Figures of quantities at given states."""

import numpy as np
import pytest

import surfacechem
from surfacechem import plots
from surfacechem.errors import InputError

pytestmark = pytest.mark.around

CONTACT = {
    "bodies": {"lower": {"temperature": "300 K"}, "upper": {"temperature": "300 K"}},
    "interface": {"potential": [{"penalty": {"E_n": "50 MPa/um"}}], "friction": [{"coulomb": {"mu": 0.3}}]},
    "loading": {"g_n": "-1 nm", "v": "1 mm/s"},
}


def test_tractions_are_drawn_over_what_the_states_differ_in():
    case = surfacechem.load(CONTACT)
    data = case.evaluate({"g_n": [2e-9, -4e-9, -2e-9]})
    figure = plots.figure(data)
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert labels[0] == "$t_{n}$ [kPa]"
    (line,) = figure.axes[0].get_lines()
    assert line.get_xdata() == pytest.approx([-4e-9, -2e-9, 2e-9])
    assert line.get_ydata() == pytest.approx([-200e3, -100e3, 0])
    assert "[nm]" in figure.axes[-1].get_xlabel()
    (slope,) = plots.figure(data, ["t_n_by_g_n"], "t_n").axes
    assert np.all(np.diff(slope.get_lines()[0].get_xdata()) >= 0)
    with pytest.raises(InputError, match="no variable 't' at the states"):
        plots.figure(data, ["t"])
    with pytest.raises(InputError, match="needs states that differ"):
        plots.figure(case.evaluate())
