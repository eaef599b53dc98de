"""Loads that begin, turn round or end at nothing: what is touched is not passed, what is not exchanged not lost."""

import math

import numpy as np
import pytest
from scenes import together
from solved import solve

import surfacechem
from surfacechem.errors import InputError
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.laws.longrange import VanDerWaalsFlatFlat
from surfacechem.results.event_table import event_columns

CASE = """
T_0: 300 K
bodies:
  a: {temperature: T, C: 1 kJ/m^2/K}
  b: {temperature: T, C: 1 kJ/m^2/K}
interface:
  temperature: T
"""
PENALTY = CASE + "  potential: [penalty: {E_n: 1e12}]\n"
COULOMB = CASE + "  friction: [coulomb: {mu: 0.5}]\n"
END = "initial: {T: 300 K}\nrun: {until: 2 s, outputs: 41}\n"


@pytest.fixture
def solved(tmp_path):
    def run(text):
        path = tmp_path / "edge.yaml"
        path.write_text(text)
        return surfacechem.load(path).run(error="balances")

    return run


def events(solution):
    return [(jump.edge.name, jump.t) for jump in solution.trajectory.jumps]


@pytest.mark.parametrize(
    "history",
    [
        "{ramp: {rate: -1 MPa/s}}",
        "{table: {times: [0, 1, 2], values: [-1 MPa, 0, -1 MPa]}}",
        "{harmonic: {mean: -1 MPa, amplitude: 1 MPa, frequency: 1 Hz}}",
    ],
)
def test_a_weight_that_comes_to_nothing_rests_in_contact(solved, history):
    solution = solved(PENALTY + f"loading: {{F_n: {history}}}\n" + END)
    data = solution.dataset
    assert solution.status == "finished", solution.reason
    assert events(solution) == []
    np.testing.assert_allclose(data.g_n, data.F_n / 1e12, rtol=1e-11, atol=1e-16)


@pytest.mark.parametrize(("size", "phase"), [(1.0, 0.0), (1e9, 1.0)])
def test_a_pressure_that_touches_nothing_goes_on(solved, size, phase):
    wave = f"{{mean: {size}, amplitude: {size}, frequency: 1 Hz, phase: {phase} rad}}"
    data = solved(COULOMB + f"loading: {{v: 1 mm/s, p: {{harmonic: {wave}}}}}\n" + END)
    assert data.status == "finished", data.reason
    # Two whole waves: the mean pressure alone heats, by quadratic energies.
    heat = 0.5 * size * 1e-3 * 2.0
    assert float(data.dataset["T"][-1]) == pytest.approx(np.sqrt(300.0**2 + heat * 600.0 / 2000.0), rel=1e-12)


def test_a_stage_waits_for_the_traction_along_the_interface(solved):
    stages = """
mechanics: {tangential: {k: 1e9}}
loading: {p: 1 MPa}
programme:
  - load: {w_t: 1 mm/s, until: {t_t: 0.3 MPa}}
  - back: {w_t: -1 mm/s, until: {t_t: {falls-to: -0.2 MPa}}}
  - rest: {for: 0.1 s}
"""
    solution = solved(COULOMB + stages + END)
    times = dict(events(solution))
    assert times["end of load"] == pytest.approx(0.3, rel=1e-12)
    assert times["end of back"] == pytest.approx(0.8, rel=1e-12)
    assert times["end of rest"] == pytest.approx(0.9, rel=1e-12)


def test_a_traction_needs_a_pressure(solved):
    stage = "programme:\n  - load: {w_t: 1 mm/s, until: {t_t: 1 mm}}\n"
    stage += "mechanics: {tangential: {k: 1e9}}\nloading: {p: 1 MPa}\n"
    with pytest.raises(InputError, match="t_t needs a pressure"):
        solved(COULOMB + stage + END)


@pytest.mark.parametrize(("axis", "way", "text"), [("n", "normal", PENALTY), ("t", "tangential", COULOMB)])
def test_a_spring_on_nothing_is_told_what_to_hold(solved, axis, way, text):
    mount = f"mechanics: {{{way}: {{k: 1e9}}}}\nprogramme:\n  - load: {{F_{axis}: -1 MPa/s, for: 1 s}}\n"
    mount += "loading: {p: 1 MPa}\n" if axis == "t" else ""
    with pytest.raises(InputError, match=f"Prescribe `w_{axis}` under `loading`"):
        solved(text + mount + END)


def test_a_gap_that_a_law_excludes_at_the_start_is_to_be_given(solved):
    law = "  potential: [van-der-waals-flat-flat: {A_H: 1e-19}, lennard-jones-flat-flat: {n_1: 2e19, n_2: 3e19, "
    law += "psi_0: 4e-21, g_0: 0.3 nm}]\n"
    mount = "mechanics: {normal: {k: 1e18}}\nloading: {w_n: {ramp: {start: 3 nm, rate: -0.1 nm/s}}}\n"
    with pytest.raises(InputError, match="Give `g_n` under `initial`"):
        solved(CASE + law + mount + END)
    given = END.replace("{T: 300 K}", "{T: 300 K, g_n: 3 nm}")
    assert solved(CASE + law + mount + given).status == "finished"


# -- kinks that fall on breakpoints of the loading are events like any other, once each -------------------------------


RUBBING, SWINGS = [Coulomb(mu=0.3)], {"v": Harmonic(amplitude=1e-3, frequency=0.5)}


def reversals(trajectory, name="v"):
    columns = {column.name: column.values for column in event_columns([trajectory])}
    return columns["event_time"][columns["event_name"] == name]


def test_a_step_ends_where_a_given_gap_closes():
    """The traction bends at touch; the work on the gap is the change of the energy, whatever felt the gap."""
    law = VanDerWaalsFlatFlat(A_H=1e-12, D_0=4e-8)
    trajectory = solve(together([law], loading={"g_n": Ramp(start=7e-8, rate=-3e-8)}), 4.0, rtol=1e-9)
    work = law.energy(g_n=-5e-8) - law.energy(g_n=7e-8)
    assert trajectory.booked("W_g_n") == pytest.approx(work, rel=1e-10)
    (closes,) = trajectory.result.events.t
    assert closes == pytest.approx(7 / 3, rel=1e-14)


def test_kinks_at_one_moment_are_events_once_each():
    """Both components of a velocity reverse together."""
    swing = Harmonic(amplitude=1e-3, frequency=0.37, phase=0.3)
    trajectory = solve(together((), RUBBING, {"p": Hold(level=1e5), "v": swing, "v_2": swing}), 6.0)
    turns = [(k * math.pi - 0.3) / (2 * math.pi * 0.37) for k in range(1, 5)]
    for name in ("v", "v_2"):
        np.testing.assert_allclose(reversals(trajectory, name), turns, rtol=1e-13)
