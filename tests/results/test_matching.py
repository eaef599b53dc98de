"""An exact solution is held against the equations of the scene that it is named for."""

import numpy as np
import pytest

from surfacechem.errors import InputError
from surfacechem.format import load_text
from surfacechem.results.matching import check_equations
from surfacechem.runs.simulation import Simulation

SHEARED_FILM = """
T_0: 300 K
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface:
  temperature: T_c
  medium: {thickness: 5 um, conductivity: 0.13 W/m/K, viscosity: 0.01 Pa s}
  friction: [film-shear]
heat: [film: {between: [lower, upper], closure: medium}]
loading: {v: {ramp: {rate: 30 km/s^2}}}
initial: {T_c: 300 K}
run: {until: 1 ms, outputs: 21}
"""


def test_balances_without_rates_have_a_scale():
    """Across a film between walls of one temperature the mean temperature is eta v^2 / 12 k above theirs."""
    run = Simulation(load_text(SHEARED_FILM)).run(error="balances").trajectory

    def solution(times, factor=1.0):
        return {"T_c": 300.0 + factor * 0.01 * (3e4 * np.asarray(times)) ** 2 / (12 * 0.13)}

    check_equations(solution, run)
    with pytest.raises(InputError, match=r"it misses the equation of T_c by 0\.0018"):
        check_equations(lambda times: solution(times, 1.001), run)
